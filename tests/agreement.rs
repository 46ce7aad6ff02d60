//! Every pair of methods on every built-in scene, order by order: Welch's t on the image and on blocks of it.
//!
//! False-alarm rate: 0.1 % for each scene (Šidák over pairs, orders and blocks). Beside each comparison of image means stands
//! the detectable bias, the relative difference that would have been found with a probability of 80 %. It falls with the square
//! root of `NEUMANN_TEST_SCALE`; at the scale of `.ci/nightly`, 32, it is at most 0.3 % for orders 0 to 4 and 1 % above. What
//! makes the last three scenes hard is the relative standard deviation of one sample: 1 needs 0.9 million samples for a
//! detectable bias of 0.3 % in a pair, 10 needs 90 million.

use crate::support::{Entry, agree, builtin};

/// Width and height of the images.
const SIZE: u32 = 16;

/// The share `conclusive` of the blocks must decide something.
fn agree_on(name: &str, entries: &[Entry], conclusive: f64) {
    agree(&format!("agreement on {name}"), &builtin(name, SIZE), 8, entries, conclusive);
}

/// Relative standard deviations are 0.3 to 5.
#[test]
fn cornell_box() {
    let entries = [
        Entry::new("direct", 192).by_night(4),
        Entry::new("path", 192).without_roulette().by_night(4),
        Entry::new("light", 128).without_roulette().by_night(4),
        Entry::new("bdpt", 48).without_roulette().by_night(4),
    ];
    agree_on("cornell_box", &entries, 0.99);
}

#[test]
fn furnace() {
    let entries = [
        Entry::new("direct", 16).by_night(2),
        Entry::new("path", 16).without_roulette().by_night(2),
        Entry::new("light", 64).without_roulette().by_night(4),
        Entry::new("bdpt", 8).without_roulette().by_night(2),
    ];
    agree_on("furnace", &entries, 0.99);
}

#[test]
fn integrating_sphere() {
    let entries = [
        Entry::new("direct", 16).by_night(2),
        Entry::new("path", 16).without_roulette().by_night(2),
        Entry::new("light", 64).without_roulette().by_night(4),
        Entry::new("bdpt", 8).without_roulette().by_night(2),
    ];
    agree_on("integrating_sphere", &entries, 0.99);
}

/// Camera rays seldom meet the smallest ball, of radiance 1000, directly or in a plate: relative standard deviations are 40
/// for `direct` and `path` at order 0, and 13 for `bdpt` at order 1, where it decides what is known of them all; detectable biases are 21 % and
/// 7 % every day. Light tracing's connections to the camera meet the lobes of the smooth plates, of width
/// 0.005, as seldom, and are up to 1/(πα²) = 12 700 when they do: its relative standard deviation is 40 at order 1 and more
/// beyond, with a tail that no sample shows, and it is compared at order 0 alone.
#[test]
fn veach_mis() {
    let entries = [
        Entry::new("direct", 128).by_night(24),
        Entry::new("path", 128).without_roulette().by_night(24),
        Entry::new("light", 32).without_roulette().up_to(0).by_night(2),
        Entry::new("bdpt", 112).without_roulette().by_night(12),
    ];
    agree_on("veach_mis", &entries, 0.8);
}

/// Path tracing meets the lamp through glass or in a mirror only by chance: its relative standard deviation is 8 to 15 at
/// orders 2 to 5 and 35 to 40 above, where light tracing's is 1.5 to 5. Detectable biases of pairs with it are 2 % to 9 %
/// every day. What a mirror shows of a caustic makes `bdpt` do the same: 10 to 20 at orders 4 and above,
/// outside the pixels that are compared with light tracing.
#[test]
fn glass_caustic() {
    let entries = [
        Entry::new("direct", 128).by_night(2),
        Entry::new("path", 320).without_roulette().by_night(12),
        Entry::new("light", 192).without_roulette().by_night(2),
        Entry::new("bdpt", 96).without_roulette().by_night(16),
    ];
    agree_on("glass_caustic", &entries, 0.5);
}

/// Nearly all light leaves the shade upwards, where path tracing seldom looks: its relative standard deviation is 14 to 33
/// from order 2 on, where the others' is 1.5 to 3. Detectable biases of pairs with it are 3.5 % to 7.5 % every day.
#[test]
fn indirect_lamp() {
    let entries = [
        Entry::new("direct", 48).by_night(4),
        Entry::new("path", 240).without_roulette().by_night(16),
        Entry::new("light", 64).without_roulette().by_night(4),
        Entry::new("bdpt", 32).without_roulette().by_night(4),
    ];
    agree_on("indirect_lamp", &entries, 0.5);
}

/// All light has come through a ball of glass before it lights anything: what a mirror or another ball shows of it, every method meets by chance.
/// Nothing is asked of `direct` and `path` but that no order differs significantly; light tracing and `bdpt` decide outside those pixels.
#[test]
fn mirror_caustic() {
    let entries = [
        Entry::new("direct", 32).of_infinite_variance(),
        Entry::new("path", 96).without_roulette().of_infinite_variance(),
        Entry::new("light", 64).without_roulette(),
        Entry::new("bdpt", 64).without_roulette().up_to(4),
    ];
    agree_on("mirror_caustic", &entries, 0.8);
}
