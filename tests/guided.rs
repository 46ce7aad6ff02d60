//! Guided path tracing: whatever its pilots learn, its means are those of methods that learn nothing.
//!
//! False-alarm rate: 0.1 % for each scene (Šidák over orders and blocks), as for every pair of methods.

use crate::support::{Entry, agree, builtin, furnished, left_to_the_night};
use serde_json::json;

const SIZE: u32 = 16;

/// Pilots of four times as many samples as their replicates, so that parts of space and directions are divided many times; and the default.
fn guided(samples: u32) -> [Entry; 2] {
    let taught = json!({"roulette": "none", "training": 4.0});
    [
        Entry::new("guided", samples).with("guided, taught long", taught),
        Entry::new("guided", samples).without_roulette(),
    ]
}

#[test]
fn diffuse_rooms() {
    for (name, samples) in [("cornell_box", 16), ("integrating_sphere", 6)] {
        let [taught, default] = guided(samples);
        let entries = [taught, default, Entry::new("bdpt", 3 * samples / 4).without_roulette()];
        agree(&format!("guided on {name}"), &builtin(name, SIZE), 6, &entries, 0.4);
    }
}

/// Glass, through which a guide has nothing to say, and floors that it leads to glass.
#[test]
fn caustics() {
    if left_to_the_night() {
        return;
    }
    let [taught, default] = guided(64);
    let entries = [taught.up_to(4), default.up_to(4), Entry::new("bdpt", 64).without_roulette()];
    agree("guided on glass_caustic", &builtin("glass_caustic", SIZE), 4, &entries, 0.3);
}

/// Every kind of lobe, and emitters that next-event estimation and guided walks both find.
#[test]
fn every_kind_of_lobe() {
    let [taught, default] = guided(48);
    let entries = [taught, default, Entry::new("bdpt", 32).without_roulette()];
    agree("guided in a furnished room", &furnished([true, true]), 4, &entries, 0.3);
}
