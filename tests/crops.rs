//! Crops change no pixel: a part of an image has the bits that it has in the whole, under several filters, samplers and
//! methods.

use crate::support::{ALL, builtin, plain, with_pilot};
use integrators::{Measurement, Orders, Render, RenderSettings, Window};
use sampling::filter::Filter;
use sampling::sampler::{Role, SamplerKind};
use scenes::Scene;

const SIZE: u32 = 40;

fn rendered(scene: &Scene, name: &str, sampler: SamplerKind, window: Window) -> Measurement {
    let method = plain(name);
    let settings = RenderSettings {
        orders: Orders::up_to(2),
        tail: false,
        samples_per_replicate: with_pilot(name, 6),
        seed: 3,
        sampler,
        instance: name.to_owned(),
        role: Role::Estimate,
    };
    let mut render = Render::cropped(scene, method.as_ref(), settings, window).unwrap();
    (0..3).for_each(|_| render.run_replicate(&|_| {}));
    render.finish()
}

#[test]
fn a_crop_has_the_bits_of_the_whole_image() {
    // Across the borders of tiles of 16 pixels, within one, at the image's border, and a single pixel.
    let windows = [(9..35, 14..33), (17..31, 18..30), (32..40, 0..40), (39..40, 39..40)];
    for (filter, sampler) in [
        (Filter::Box, SamplerKind::Independent),
        (Filter::Mitchell, SamplerKind::Zsobol),
        (Filter::Gaussian, SamplerKind::Stratified),
    ] {
        let [room, plates] = ["cornell_box", "veach_mis"].map(|name| {
            let mut scene = builtin(name, SIZE);
            scene.camera.set_filter(filter);
            scene
        });
        for name in ALL.into_iter().chain([
            "composite",
            "adaptive",
            "adaptive_bdpt",
            "coherent",
            "coherent_bdpt",
            "guided",
            "vcm",
            "ppm",
            "pssmlt",
            "mmlt",
        ]) {
            // Where pixels take different numbers of samples.
            let scene = if name.starts_with("adaptive") { &plates } else { &room };
            let whole = rendered(scene, name, sampler, Window::whole(SIZE, SIZE));
            for (x, y) in windows.clone() {
                let window = Window { x, y };
                let part = rendered(scene, name, sampler, window.clone());
                assert_eq!((part.width, part.height), (window.width(), window.height()));
                for pixel in 0..part.pixels() {
                    let (column, row) = (pixel as u32 % part.width, pixel as u32 / part.width);
                    let place = ((window.y.start + row) * SIZE + window.x.start + column) as usize;
                    for layer in 0..part.layers.len() {
                        let label =
                            format!("{name} {filter} {sampler} {window:?}, pixel {column} {row}, layer {layer}");
                        assert_eq!(part.mean(layer, pixel), whole.mean(layer, place), "{label}");
                        assert_eq!(part.variance(layer, pixel), whole.variance(layer, place), "{label}");
                    }
                }
            }
        }
    }
}

/// Camera walks of other pixels are not traced; light walks, which may land in any, are.
#[test]
fn only_what_may_reach_a_crop_is_traced() {
    let scene = builtin("cornell_box", SIZE);
    let window = Window { x: 9..35, y: 14..33 };
    let all = u64::from(SIZE * SIZE) * 18;
    let path = rendered(&scene, "path", SamplerKind::Independent, window.clone());
    assert_eq!(path.counters.camera_paths, path.pixels() as u64 * 18);
    for name in ["light", "bdpt"] {
        assert_eq!(rendered(&scene, name, SamplerKind::Independent, window.clone()).counters.light_paths, all);
    }
}
