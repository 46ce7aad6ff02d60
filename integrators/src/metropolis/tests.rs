use super::point::Point;
use super::*;
use crate::contribution::Contribution;
use crate::path::Path;
use crate::render::{Render, RenderSettings};
use sampling::Spectrum;
use sampling::moments::Moments;
use sampling::sampler::{Purpose, Role, SamplerKind, StreamKey, Subpath};
use scenes::LoadOptions;
use serde::Deserialize;

/// A function with a jump, a zero and a peak: of two numbers at an address that only some points ask for, in two orders.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
struct Peak {
    #[serde(skip)]
    broken: bool,
}

/// Its integrals, order by order.
const INTEGRALS: [f64; 2] = [0.3 * 0.05 * 60.0, 0.3 * 0.5];

impl Explored for Peak {
    type Base = Path;
    const INSTEAD: &'static str = "nothing";

    fn base(&self) -> Path {
        Path::default()
    }

    fn steps(&self) -> (LargeSteps, SmallStep, Bootstrap) {
        (LargeSteps::default(), SmallStep::default(), Bootstrap::try_from(1.0 / 3.0).unwrap())
    }

    fn explore<S: Sink>(
        &self,
        _: &Scene,
        _: &Request,
        pixel: Pixel,
        sampler: &mut Sampler,
        _: &mut Scratch,
        out: &mut S,
    ) -> f32 {
        sampler.start_vertex(Subpath::Light, 7);
        if sampler.get_1d(Purpose::Lobe) >= 0.3 {
            return 1.0;
        }
        let u = sampler.get_2d(Purpose::Direction);
        let mut add = |order: usize, value: f32| {
            let technique = Technique::connect(0, order + 2);
            out.add(Contribution::new(pixel.raster, technique, Spectrum::new(value, 0.0, 0.0), 0.5));
        };
        if u.x < 0.05 {
            add(0, 60.0);
        }
        add(1, u.y);
        if self.broken && u.y > 0.75 {
            add(1, f32::NAN);
        }
        // What is counted twice makes up for the weight.
        2.0
    }
}

fn rendered(peak: Peak, replicates: u32) -> Vec<[f64; 2]> {
    let scene = scenes::load("furnace", &LoadOptions { size: Some((2, 2)), ..LoadOptions::default() }).unwrap();
    let method = Metropolis::new("peak", peak);
    let mut render = Render::new(&scene, &method, settings()).unwrap();
    (0..replicates).for_each(|_| render.run_replicate(&|_| {}));
    render.replicate_means().map(|layers| [layers[0][0], layers[1][0]]).collect()
}

fn settings() -> RenderSettings {
    RenderSettings {
        orders: Orders::up_to(1),
        tail: false,
        samples_per_replicate: 3,
        seed: 1,
        sampler: SamplerKind::Independent,
        instance: "peak".to_owned(),
        role: Role::Estimate,
    }
}

/// Replicates of twelve mutations that begin at one of four points, with a pilot of one: most of them are black, and their mean is the
/// truth. 40 000 of them; |z| > 5 has probability 10⁻⁶ by chance.
#[test]
fn the_mean_of_the_shortest_replicates_is_the_truth() {
    let means = rendered(Peak::default(), 40_000);
    for (order, truth) in INTEGRALS.into_iter().enumerate() {
        let mut moments = Moments::default();
        means.iter().for_each(|layers| moments.push(layers[order]));
        let (mean, error) = (moments.mean, moments.variance_of_mean().sqrt());
        println!("order {order}: {mean} ± {error}, truth {truth}");
        assert!(
            (mean - truth).abs() < 5.0 * error && error < 0.05 * truth,
            "order {order}: {mean} ± {error}, not {truth}"
        );
    }
    let black = means.iter().filter(|layers| layers[1] == 0.0).count();
    assert!(black > 1000, "{black} replicates found nothing");
}

/// What is not finite is counted and moves nothing: not the chain, nor what else the same points contribute.
#[test]
fn what_is_not_finite_is_counted_and_keeps_no_chain() {
    let scene = scenes::load("furnace", &LoadOptions { size: Some((2, 2)), ..LoadOptions::default() }).unwrap();
    let method = Metropolis::new("peak", Peak { broken: true });
    let mut render = Render::new(&scene, &method, settings()).unwrap();
    (0..500).for_each(|_| render.run_replicate(&|_| {}));
    let m = render.finish();
    assert_eq!(m.invalid[0], 0);
    // Of 500 · (4 + 1) independent points 7.5 % are broken, of those that chains look at more.
    assert!(m.invalid[1] > 500, "{:?}", m.invalid);
    let whole = rendered(Peak::default(), 500);
    assert_eq!(m.replicate_means.iter().map(|layers| [layers[0][0], layers[1][0]]).collect::<Vec<_>>(), whole);
}

#[test]
fn seeds_are_as_frequent_as_they_are_large() {
    let scene = scenes::load("furnace", &LoadOptions { size: Some((2, 2)), ..LoadOptions::default() }).unwrap();
    let request = Request::new(Orders::up_to(1), false);
    let space = Space { explored: Peak::default(), scene: &scene, request: &request };
    let seeds = Seeds::find(&space, StreamKey::new(1, "seeds", Role::Estimate, 0), 1000);
    let mut sampler = Sampler::of_chain(StreamKey::new(1, "seeds", Role::Estimate, 0), 0.01);
    let (mut scratch, mut point) = (Scratch::default(), Point::<false>::new(&request));
    let mut look = |number: u64| {
        seeds::turn_to_seed(&mut sampler, number);
        space.look(&mut sampler, &mut scratch, &mut point);
        point.size
    };
    let mut sum = 0.0;
    for number in 0..1000 {
        let size = look(number);
        if size > 0.0 {
            // Just after its beginning and just before its end it is found.
            for within in [0.001, 0.999] {
                let (group, rest) = seeds.at((sum + within * size) / (1000.0 * seeds.mean())).unwrap();
                assert!(group.contains(&number) && group.start.is_multiple_of(seeds::GROUP), "{number} {group:?}");
                let before: f64 = (group.start..number).map(&mut look).sum();
                assert!(rest > before && rest < before + size, "{number}: {rest} after {before} of {size}");
            }
        }
        sum += size;
    }
    assert!((seeds.sizes.iter().sum::<f64>() / seeds.mean() - 1.0).abs() < 1e-12);
    assert!(seeds.at(1.0_f64.next_down()).is_some());
}

#[test]
fn where_all_is_black_there_are_no_seeds() {
    let scene = scenes::load("furnace", &LoadOptions { size: Some((2, 2)), ..LoadOptions::default() }).unwrap();
    let request = Request::new(Orders::up_to(1), false);
    let space = Space { explored: Peak::default(), scene: &scene, request: &request };
    assert!(Seeds::find(&space, StreamKey::new(1, "none", Role::Estimate, 0), 0).at(0.5).is_none());
    let orders = Mmlt::default().informed(&[0.0, 0.0]);
    assert_eq!(orders.odds, [0.5, 1.0]);
    let orders = Mmlt::default().informed(&[1.0, 3.0]);
    assert_eq!(orders.odds, [0.375, 1.0]);
    assert_eq!(
        [0.0, 0.374, 0.375, 0.999].map(|u| orders.choose(2, u)),
        [(0, 0.375), (0, 0.375), (1, 0.625), (1, 0.625)]
    );
    assert_eq!(Mmlt::default().choose(4, 0.5), (2, 0.25));
}
