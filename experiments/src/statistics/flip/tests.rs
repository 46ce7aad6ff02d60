use super::*;

const WIDTH: usize = 48;
const HEIGHT: usize = 40;

/// An image by formula, of u and v from 0 to 1 and the pixel's place.
fn image(of: impl Fn(f64, f64, usize, usize) -> [f64; 3]) -> Vec<[f32; 3]> {
    let pixels = (0..HEIGHT).flat_map(|y| (0..WIDTH).map(move |x| (x, y)));
    pixels.map(|(x, y)| of(x as f64 / WIDTH as f64, y as f64 / HEIGHT as f64, x, y).map(|v| v as f32)).collect()
}

fn waves(u: f64, v: f64, _: usize, _: usize) -> [f64; 3] {
    [0.5 + 0.5 * (7.0 * u + 3.0 * v).sin(), 0.5 + 0.5 * (5.0 * v - 2.0 * u).cos(), u * v]
}

/// The same with a pattern like noise.
fn noisy(u: f64, v: f64, x: usize, y: usize) -> [f64; 3] {
    let noise = ((x * 7 + y * 13) % 11) as f64 / 11.0 - 0.5;
    let waves = waves(u, v, x, y);
    [0, 1, 2].map(|c| (waves[c] + 0.2 * noise * (1 + c) as f64).clamp(0.0, 1.0))
}

fn step(at: f64) -> Vec<[f32; 3]> {
    image(|u, _, _, _| if u < at { [0.9, 0.2, 0.1] } else { [0.1, 0.3, 0.8] })
}

/// Radiances: squares of the above, eightfold, times a scale.
fn radiance(of: impl Fn(f64, f64, usize, usize) -> [f64; 3], scale: f64, from: f64) -> Vec<[f32; 3]> {
    image(|u, v, x, y| if u > from { of(u, v, x, y).map(|c| scale * 8.0 * c * c) } else { [0.0; 3] })
}

/// Against flip-evaluator 1.7 (PyPI), `evaluate(reference, test, "LDR", inputsRGB=False)`: means at its 67 pixels per degree
/// and at 20, and one pixel.
#[test]
fn differences_are_those_of_the_authors_program() {
    let (grey, waves, noisy) = (image(|_, _, _, _| [0.5; 3]), image(waves), image(noisy));
    let [green, blue] = [1, 2].map(|channel| image(|_, _, _, _| [0, 1, 2].map(|c| f64::from(u8::from(c == channel)))));
    let cases = [
        ("waves, noisy", &waves, &noisy, 0.226_746, 0.400_425, 0.089_279),
        ("grey, noisy", &grey, &noisy, 0.919_033, 0.908_458, 0.887_057),
        ("grey, waves", &grey, &waves, 0.925_739, 0.911_130, 0.895_390),
        ("a step moved", &step(0.5), &step(0.54), 0.090_148, 0.061_777, 0.546_160),
        ("green, blue", &green, &blue, 1.0, 1.0, 1.0),
    ];
    for (name, reference, test, fine, coarse, pixel) in cases {
        let map = ldr(WIDTH, reference, test, PIXELS_PER_DEGREE);
        let found = [mean(&map), mean(&ldr(WIDTH, reference, test, 20.0)), map[20 * WIDTH + 24]];
        let close = found.iter().zip([fine, coarse, pixel]).all(|(a, b)| (a - b).abs() < 1e-4);
        assert!(close, "{name}: {found:?} for {:?}", [fine, coarse, pixel]);
    }
}

/// Against the same program's `evaluate(reference, test, "HDR")`, which also tells its exposures.
#[test]
fn differences_of_radiances_are_those_of_the_authors_program() {
    let cases = [
        (0.05, -1.0, 0.378_070, 0.312_187, (2.499_938, 4.121_243, 2)),
        (1.0, -1.0, 0.378_070, 0.312_187, (-1.821_990, -0.200_685, 2)),
        (30.0, -1.0, 0.378_070, 0.312_187, (-6.728_881, -5.107_576, 2)),
        (1.0, 0.6, 0.239_738, 0.065_621, (-1.821_990, 24.083_298, 26)),
    ];
    for (scale, from, expected, pixel, (start, stop, count)) in cases {
        let [reference, test] = [radiance(waves, scale, from), radiance(noisy, scale, from)];
        let exposures = Exposures::of(WIDTH, &reference);
        let close = (exposures.start - start).abs() < 1e-4 && (exposures.stop - stop).abs() < 1e-4;
        assert!(close && exposures.count == count, "{scale}: {exposures:?}");
        let map = hdr(WIDTH, &reference, &test, PIXELS_PER_DEGREE);
        let found = [mean(&map), map[20 * WIDTH + 24]];
        assert!((found[0] - expected).abs() < 1e-4 && (found[1] - pixel).abs() < 1e-4, "{scale}, {from}: {found:?}");
    }
}

#[test]
fn an_image_does_not_differ_from_itself_and_all_values_are_fit() {
    let strange = image(|u, _, x, _| match x % 5 {
        0 => [f64::NAN; 3],
        1 => [f64::INFINITY; 3],
        2 => [-1.0; 3],
        _ => [u; 3],
    });
    assert!(hdr(WIDTH, &strange, &strange, PIXELS_PER_DEGREE).iter().all(|&v| v == 0.0));
    let black = image(|_, _, _, _| [0.0; 3]);
    for map in [hdr(WIDTH, &black, &strange, 20.0), ldr(WIDTH, &strange, &black, 20.0)] {
        assert!(map.iter().all(|v| (0.0..=1.0).contains(v)));
    }
}
