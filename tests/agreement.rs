//! Every pair of methods on every built-in scene, order by order: Welch's t on the image and on blocks of it.
//!
//! False-alarm rate: 0.1 % for each scene (Šidák over pairs, orders and blocks). Beside each comparison of image means stands
//! the detectable bias, the relative difference that would have been found with a probability of 80 %. It falls with the
//! square root of `NEUMANN_TEST_SCALE`: at the scale of `.ci/nightly` it is at most 0.3 % for orders 0 to 4 and 1 % above,
//! but for the methods named below, whose own noise does not allow it.

use crate::support::{Entry, agree, builtin};

/// Width and height of the images.
const SIZE: u32 = 16;

fn agree_on(name: &str, entries: &[Entry], conclusive: f64) {
    agree(&format!("agreement on {name}"), &builtin(name, SIZE), 8, entries, conclusive);
}

#[test]
fn cornell_box() {
    let entries = [
        Entry::new("direct", 768),
        Entry::new("path", 1024).without_roulette(),
        Entry::new("light", 640).without_roulette(),
        Entry::new("bdpt", 256).without_roulette(),
    ];
    agree_on("cornell_box", &entries, 0.99);
}

#[test]
fn furnace() {
    let entries = [
        Entry::new("direct", 32),
        Entry::new("path", 32).without_roulette(),
        Entry::new("light", 256).without_roulette(),
        Entry::new("bdpt", 16).without_roulette(),
    ];
    agree_on("furnace", &entries, 0.99);
}

#[test]
fn integrating_sphere() {
    let entries = [
        Entry::new("direct", 32),
        Entry::new("path", 32).without_roulette(),
        Entry::new("light", 256).without_roulette(),
        Entry::new("bdpt", 16).without_roulette(),
    ];
    agree_on("integrating_sphere", &entries, 0.9);
}

#[test]
fn veach_mis() {
    let entries = [
        Entry::new("direct", 512),
        Entry::new("path", 384).without_roulette(),
        Entry::new("light", 64).without_roulette().up_to(0),
        Entry::new("bdpt", 128).without_roulette(),
    ];
    agree_on("veach_mis", &entries, 0.8);
}

#[test]
fn glass_caustic() {
    let entries = [
        Entry::new("direct", 256),
        Entry::new("path", 640).without_roulette(),
        Entry::new("light", 384).without_roulette(),
        Entry::new("bdpt", 192).without_roulette(),
    ];
    agree_on("glass_caustic", &entries, 0.8);
}

#[test]
fn indirect_lamp() {
    let entries = [
        Entry::new("direct", 192),
        Entry::new("path", 640).without_roulette(),
        Entry::new("light", 256).without_roulette(),
        Entry::new("bdpt", 128).without_roulette(),
    ];
    agree_on("indirect_lamp", &entries, 0.8);
}
