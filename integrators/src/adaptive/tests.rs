use super::smoothing::Smoothing;
use super::spread::{levels, spread};
use super::*;
use crate::contribution::{Contribution, Sink, Technique};
use crate::film::{BlockFilm, BlockStore};
use crate::integrator::Pixel;
use crate::path::Path;
use crate::request::Orders;
use crate::sampled::Sampled;
use crate::scratch::Scratch;
use crate::{Integrator, Render, RenderSettings, Window};
use sampling::Spectrum;
use sampling::sampler::{Purpose, Role, Sampler, SamplerKind};
use scenes::{LoadOptions, load};
use serde::{Deserialize, Serialize};
use std::sync::Mutex;

const SIZE: (usize, usize) = (48, 40);
const PIXELS: usize = SIZE.0 * SIZE.1;

fn scene(name: &str, side: u32) -> Scene {
    load(name, &LoadOptions { size: Some((side, side)), ..LoadOptions::default() }).unwrap()
}

fn key() -> StreamKey {
    StreamKey::new(1, "adaptive", Role::Estimate, 0)
}

fn allocation(scene: &Scene, samples: u32) -> Option<Allocation> {
    let request = Request::new(Orders::up_to(3), false);
    let replicate = Replicate { number: 0, key: key(), sampler: SamplerKind::Sobol, samples };
    Allocation::find(&Path::default(), scene, &request, &replicate)
}

/// A number in [0, 1) for a pixel.
fn noise(pixel: usize) -> f64 {
    (pixel as f64 * 0.618_033_988_75).fract()
}

fn mean(levels: &[i32]) -> f64 {
    levels.iter().map(|&level| f64::from(level).exp2()).sum::<f64>() / levels.len() as f64
}

#[test]
fn levels_have_the_mean_asked_for_and_are_to_what_is_wanted() {
    for (spreading, asked) in [(0.5, 0.875), (2.0, 0.875), (4.0, 0.5), (9.0, 1.0)] {
        let wanted: Vec<f64> = (0..PIXELS).map(|i| (spreading * noise(i)).exp2()).collect();
        let levels = spread(wanted.clone(), SIZE.0, asked);
        let found = mean(&levels);
        assert!(found <= asked && found > 0.97 * asked, "{found} for {asked}");
        assert!(levels.iter().all(|level| LEVELS.contains(level)));
        let within = |level: i32| level > *LEVELS.start() && level < *LEVELS.end();
        let ratios = || (0..PIXELS).filter(|&i| within(levels[i])).map(|i| f64::from(levels[i]) - wanted[i].log2());
        let (least, most) = (ratios().fold(f64::MAX, f64::min), ratios().fold(f64::MIN, f64::max));
        assert!(most - least < 2.1, "from {least} to {most}");
    }
}

#[test]
fn all_have_the_same_where_nothing_is_known_or_it_cannot_be_told() {
    let even = vec![0; PIXELS];
    assert_eq!(spread(vec![0.0; PIXELS], SIZE.0, 0.875), even);
    assert_eq!(spread(vec![f64::INFINITY; PIXELS], SIZE.0, 0.875), even);
    let times = vec![1.0; PIXELS];
    // A few pixels err much, and their neighbours know nothing of it.
    let spikes: Vec<[f64; 1]> = (0..PIXELS).map(|i| [if i % 203 == 7 { 1e4 } else { 0.1 + noise(i) }]).collect();
    assert_eq!(levels(&spikes, &times, SIZE, 0.875), even);
    assert_eq!(levels(&[[f64::NAN]; PIXELS], &times, SIZE, 0.875), even);
    assert_eq!(levels(&[[2.0]], &[1.0], (1, 1), 0.875), [0]);
}

#[test]
fn pixels_that_err_more_and_take_less_time_get_more() {
    let left = |i: usize| i % SIZE.0 < SIZE.0 / 2;
    let of = |levels: Vec<i32>| {
        let side = |which: bool| -> Vec<i32> { (0..PIXELS).filter(|&i| left(i) == which).map(|i| levels[i]).collect() };
        mean(&side(true)) / mean(&side(false))
    };
    let errors: Vec<[f64; 1]> = (0..PIXELS).map(|i| [(0.5 + noise(i)) * if left(i) { 16.0 } else { 1.0 }]).collect();
    let even = vec![3.0; PIXELS];
    assert!((3.0..5.0).contains(&of(levels(&errors, &even, SIZE, 1.0))));
    let times: Vec<f64> = (0..PIXELS).map(|i| if left(i) { 16.0 } else { 1.0 }).collect();
    assert!((0.8..1.3).contains(&of(levels(&errors, &times, SIZE, 1.0))));
}

#[test]
fn averages_keep_what_is_the_same_everywhere_and_those_of_others_know_nothing_of_a_pixel() {
    for deviation in [1.0, 6.0] {
        let smoothing = Smoothing::new(deviation);
        let same = smoothing.smoothed(&[[3.0]; PIXELS], SIZE);
        assert!(same.iter().all(|[x]| (x - 3.0).abs() < 1e-12));
        for pixel in [0, SIZE.0 - 1, 5 * SIZE.0 + 7, PIXELS - 1] {
            let mut image = vec![[1.0]; PIXELS];
            image[pixel] = [1e6];
            let smoothed = smoothing.smoothed(&image, SIZE);
            let others = smoothing.of_others(&image, &smoothed, SIZE);
            assert!(
                (others[pixel][0] - 1.0).abs() < 1e-6 && smoothed[pixel][0] > 100.0,
                "{pixel}: {:?}",
                others[pixel]
            );
        }
    }
}

/// Blocks take every sample of every pixel once, however they are cut.
#[test]
fn blocks_have_all_samples_of_a_pixel() {
    let scene = scene("veach_mis", 32);
    for samples in [16, 19, 64, 100] {
        let allocation = allocation(&scene, samples).unwrap();
        let mut levels = [0; 7];
        for pixel in Window::whole(32, 32).pixels() {
            levels[allocation.of(pixel)] += 1;
            for at_once in [1, 4, 7, 64] {
                let mut next = 0;
                for first in (0..samples).step_by(at_once) {
                    let within = allocation.within(pixel, &(first..(first + at_once as u32).min(samples)));
                    assert_eq!(within.start, next);
                    next = within.end;
                }
                assert_eq!(next, allocation.samples(pixel));
            }
        }
        assert!(levels.iter().filter(|&&pixels| pixels > 20).count() >= 4, "{samples}: {levels:?}");
    }
}

/// The pilot is paid for: where a quarter of the samples is a whole number no more are taken than were asked for, and hardly fewer, but where all pixels
/// take the same.
#[test]
fn the_pilot_and_the_image_take_the_samples_asked_for() {
    let scene = scene("veach_mis", 32);
    let method = Sampled { name: "adaptive", estimator: Path::default(), adapts: true };
    for samples in [8, 16, 24, 64, 600] {
        assert_eq!(allocation(&scene, samples).is_some(), samples >= FEWEST);
        let settings = RenderSettings {
            orders: Orders::up_to(1),
            tail: false,
            samples_per_replicate: samples,
            seed: 2,
            sampler: SamplerKind::Sobol,
            instance: "adaptive".to_owned(),
            role: Role::Estimate,
        };
        let mut render = Render::new(&scene, &method, settings).unwrap();
        render.run_replicate(&|_| {});
        let share = render.finish().counters.camera_paths as f64 / f64::from(32 * 32 * samples);
        let of_pilot = (samples / 16).min(MOST_IN_PILOT);
        let evenly = share == 1.0 + f64::from(2 * of_pilot) / f64::from(samples);
        assert!((share <= 1.0 && share > 0.96) || (evenly && samples < 64), "{samples}: {share}");
        let replicate = Replicate { number: 0, key: key(), sampler: SamplerKind::Sobol, samples };
        let most = method.most_samples(&scene, &Request::new(Orders::up_to(1), false), replicate);
        assert_eq!(most, if samples < FEWEST { samples } else { 16 * samples });
    }
}

/// What a pixel's samples count for adds up to what those of a pixel of the replicate do, and so do splats over the image.
#[test]
fn samples_count_as_often_as_there_are_fewer_of_them() {
    // Half of the pixels are noisy, whatever the scene is.
    let (scene, request) = (scene("furnace", 32), Request::new(Orders::up_to(0), false));
    for number in [50, 64, 100] {
        let replicate = Replicate { number: 0, key: key(), sampler: SamplerKind::Independent, samples: number };
        let allocation = Allocation::find(&Recorder::default(), &scene, &request, &replicate).unwrap();
        let (mut splats, mut few) = (0.0, 0);
        for pixel in Window::whole(32, 32).pixels() {
            let samples = allocation.samples(pixel);
            let Counts { own, splats: of_splats } = allocation.counts(pixel);
            assert!((own * samples as f32 / number as f32 - 1.0).abs() < 1e-6);
            assert!(f64::from(own) <= MOST_COUNTS);
            splats += f64::from(of_splats) * f64::from(samples);
            few += u32::from(samples < number);
        }
        assert!((splats / (f64::from(number) * 1024.0) - 1.0).abs() < 1e-6, "{splats}");
        assert!(few > 300, "{number}: {few}");
    }
}

/// Takes a number for what it sees, noisier to the left, and keeps all numbers that it was given.
#[derive(Default, Serialize, Deserialize)]
struct Recorder {
    #[serde(skip)]
    given: Mutex<Vec<[u32; 2]>>,
}

impl Estimator for Recorder {
    fn estimate<S: Sink>(
        &self,
        _: &Scene,
        _: &Request,
        pixel: Pixel,
        sampler: &mut Sampler,
        _: &mut Scratch,
        out: &mut S,
    ) {
        let u = sampler.get_2d(Purpose::Direction);
        self.given.lock().unwrap().push(u.to_array().map(f32::to_bits));
        let value = Spectrum::splat(if pixel.x < 16 { u.x } else { 0.9 + 0.01 * u.x });
        out.add(Contribution::new(pixel.raster, Technique::connect(0, 2), value, 1.0));
    }
}

/// What a pilot has seen has no part in the image, or pixels that began dark would stay dark: it has numbers of its own, and so have all samples.
#[test]
fn no_sample_is_taken_twice_nor_one_of_the_pilots() {
    let scene = scene("furnace", 32);
    let request = Request::new(Orders::up_to(0), false);
    let method = Sampled { name: "recorder", estimator: Recorder::default(), adapts: true };
    let replicate = Replicate { number: 0, key: key(), sampler: SamplerKind::Independent, samples: 64 };
    let pass = method.begin(&scene, &request, replicate);
    let count = || method.estimator.given.lock().unwrap().len();
    assert_eq!(count(), 8 * 32 * 32);
    let mut film = BlockFilm::new(BlockStore::default(), &request, *scene.camera.raster(), Window::whole(32, 32));
    let blocks = method.blocks(Window::whole(32, 32), &request, 64);
    for block in (0..blocks.count()).map(|i| blocks.block(i)) {
        film.start(block.tile.clone());
        pass.run(block, &mut film);
        film.finish();
    }
    let taken = count();
    assert!(taken > 60 * 32 * 32 && taken <= 64 * 32 * 32, "{taken}");
    let mut given = method.estimator.given.lock().unwrap();
    given.sort_unstable();
    given.dedup();
    assert_eq!(given.len(), taken);
}
