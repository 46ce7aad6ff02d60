//! Every model of the list, scattered from once by a ball in a uniform environment and many times inside a glowing sphere,
//! against quadrature of the model itself: this joins sampling, evaluation, densities and integrators.
//!
//! False-alarm rate: 0.1 % for each model and test (Šidák over methods, orders and blocks). Models whose lobes are too narrow
//! for the quadrature, by its own estimate of its error, are left out and named, and so are those that scatter next to nothing.

use crate::bsdf_laws::{delta_lobes, listed};
use crate::support::{ALL, Budget, COLUMNS, Family, GAUSS, Truth, camera, grey, is_night, plain, shining};
use glam::{DVec3, dvec3};
use sampling::bsdf::{Bsdf, Dielectric, Lobes, TransportMode};
use sampling::math::Spectrum;
use sampling::{Vec3, vec2, vec3};
use scenes::{Scene, SceneBuilder, Skip};
use std::f64::consts::{FRAC_PI_2, TAU};

/// The quadrature's relative error, at most.
const PRECISION: f64 = 2e-4;

/// Quadratures by panels and azimuths, each twice as fine as the one before.
const LEVELS: [(usize, usize); 4] = [(6, 36), (12, 72), (24, 144), (48, 288)];

/// Quadrature over the upper hemisphere: cosines with weights, and azimuths.
struct Hemisphere {
    cosines: Vec<(f64, f64)>,
    /// Cosines and sines, evenly spaced, those below half a turn first.
    azimuths: Vec<(f64, f64)>,
}

impl Hemisphere {
    /// Five Gauss nodes in each of so many panels of the polar angle.
    fn new((panels, azimuths): (usize, usize)) -> Self {
        let width = FRAC_PI_2 / panels as f64;
        let nodes = |i: usize| {
            GAUSS.map(|(u, weight)| {
                let (sin, cos) = ((i as f64 + u) * width).sin_cos();
                (cos, weight * width * sin)
            })
        };
        let azimuth = |i: usize| {
            let (sin, cos) = ((i as f64 + 0.5) / azimuths as f64 * TAU).sin_cos();
            (cos, sin)
        };
        Self { cosines: (0..panels).flat_map(nodes).collect(), azimuths: (0..azimuths).map(azimuth).collect() }
    }

    /// ∫ f cos dφ at each node, times its weight: what light from there adds in the direction of `wo`.
    ///
    /// Where azimuths matter by their difference alone, whatever its sign, half of them are the mirror image of the others.
    fn kernel(&self, bsdf: &Bsdf, wo: Vec3) -> Vec<[f64; 3]> {
        let (wo, azimuths) = match bsdf.is_anisotropic() {
            true => (wo, &self.azimuths[..]),
            false => (vec3(wo.x.hypot(wo.y), 0.0, wo.z), &self.azimuths[..self.azimuths.len() / 2]),
        };
        let step = TAU / azimuths.len() as f64;
        let at = |&(z, weight): &(f64, f64)| {
            let r = (1.0 - z * z).sqrt();
            let mut sum = [0.0; 3];
            for (cos, sin) in azimuths {
                let wi = vec3((r * cos) as f32, (r * sin) as f32, z as f32);
                let f = bsdf.eval(wo, wi, Lobes::ALL, TransportMode::Radiance).to_array();
                (0..3).for_each(|c| sum[c] += f[c] as f64);
            }
            sum.map(|s| s * z * weight * step)
        };
        self.cosines.iter().map(at).collect()
    }
}

/// What delta lobes reflect of the light from the mirror direction.
fn mirrored(bsdf: &Bsdf, wo: Vec3) -> [f64; 3] {
    let lobes = delta_lobes(bsdf, wo, TransportMode::Radiance).into_iter();
    let reflected = lobes.filter(|lobe| Lobes::REFLECTION.contains(lobe.lobe));
    reflected.map(|lobe| lobe.weight * lobe.pdf).sum::<Spectrum>().to_array().map(f64::from)
}

/// The sum over nodes of a kernel times a radiance.
fn apply(kernel: &[[f64; 3]], radiance: &[[f64; 3]]) -> [f64; 3] {
    std::array::from_fn(|c| kernel.iter().zip(radiance).map(|(k, l)| k[c] * l[c]).sum())
}

/// A scattered radiance with what delta lobes add.
fn with_mirrored(scattered: [f64; 3], mirrored: [f64; 3], radiance: [f64; 3]) -> [f64; 3] {
    std::array::from_fn(|c| scattered[c] + mirrored[c] * radiance[c])
}

/// The orders inside a sphere of radiance 1: every chord meets it at equal angles, so that L_{k+1}(θ) = ∫ f cos θ' L_k(θ') dω',
/// and r(θ) L_k(θ) more where delta lobes reflect the share r: the angle of what a mirror shows is the same.
/// Order 1 alone is the directional albedo, of any model.
struct Glowing<'b> {
    bsdf: &'b Bsdf,
    hemisphere: Hemisphere,
    /// `[order][node]`, up to the last order but one.
    orders: Vec<Vec<[f64; 3]>>,
}

impl<'b> Glowing<'b> {
    fn new(bsdf: &'b Bsdf, hemisphere: Hemisphere, max_order: usize) -> Self {
        let towards = |&(z, _): &(f64, f64)| vec3((1.0 - z * z).sqrt() as f32, 0.0, z as f32);
        let mut orders = vec![vec![[1.0; 3]; hemisphere.cosines.len()]];
        if max_order > 1 {
            let kernels: Vec<_> =
                hemisphere.cosines.iter().map(|node| hemisphere.kernel(bsdf, towards(node))).collect();
            let mirrored: Vec<_> = hemisphere.cosines.iter().map(|node| mirrored(bsdf, towards(node))).collect();
            for order in 0..max_order - 1 {
                let last: &Vec<[f64; 3]> = &orders[order];
                let next = |node: usize| with_mirrored(apply(&kernels[node], last), mirrored[node], last[node]);
                orders.push((0..last.len()).map(next).collect());
            }
        }
        Self { bsdf, hemisphere, orders }
    }

    /// All orders in the direction `wo`, mean over channels.
    fn towards(&self, wo: Vec3) -> Vec<f64> {
        let kernel = self.hemisphere.kernel(self.bsdf, wo);
        let mirrored = mirrored(self.bsdf, wo);
        // The radiance of each order in this direction itself, which the mirror direction has too.
        let mut here = [1.0; 3];
        let mut orders = vec![1.0];
        for radiance in &self.orders {
            here = with_mirrored(apply(&kernel, radiance), mirrored, here);
            orders.push(grey(here));
        }
        orders
    }
}

impl Glowing<'_> {
    /// Whether so little is scattered, as where an index is all but 1, that lobes are chosen too seldom for a test.
    fn is_faint(&self) -> bool {
        let order_1 = self.towards(vec3(0.6, 0.0, 0.8))[1];
        order_1 > 0.0 && order_1 < 1e-3
    }
}

/// Whether the nodes are dense against the lobes: one so narrow that it falls between the nodes of two levels seems converged.
fn sees(bsdf: &Bsdf, wo: Vec3, (panels, _): (usize, usize)) -> bool {
    let spacing = FRAC_PI_2 / (GAUSS.len() * panels) as f64;
    (0..256).all(|i| {
        let [uc, x, y] = [0.618_034, 0.754_877_7, 0.569_840_3].map(|step: f32| (0.5 + step * i as f32).fract());
        let sample = bsdf.sample(wo, uc, vec2(x, y), TransportMode::Radiance);
        // The share of the density that one node stands for.
        sample.is_none_or(|s| s.lobe.is_delta() || f64::from(s.pdf) * spacing * spacing < 0.05)
    })
}

/// The orders by the coarsest quadrature that is fine enough, if any is: doubling it changes little. Directions have polar
/// angles of at most 53°, as all those in which the two cameras here meet a sphere.
fn resolved(bsdf: &Bsdf, max_order: usize) -> Option<Glowing<'_>> {
    let directions = [0.6, 0.75, 0.9, 0.999].map(|z: f32| vec3((1.0 - z * z).sqrt(), 0.0, z));
    let mut coarse = Glowing::new(bsdf, Hemisphere::new(LEVELS[0]), max_order);
    for level in &LEVELS[1..] {
        let fine = Glowing::new(bsdf, Hemisphere::new(*level), max_order);
        let close = |wo: &Vec3| {
            let (coarse, fine) = (coarse.towards(*wo), fine.towards(*wo));
            coarse.iter().zip(&fine).all(|(a, b)| (a - b).abs() <= PRECISION * b)
        };
        if directions.iter().all(|wo| close(wo) && sees(bsdf, *wo, *level)) {
            return Some(fine);
        }
        coarse = fine;
    }
    None
}

/// The examples that the quadrature can do, of those that `suits`, with their orders up to `max_order`: every day the first of each
/// model and every fourth after it, of a single order every third, and of a model that these leave out the others until one is
/// done; by night all of them.
fn examples(max_order: usize, suits: impl Fn(&Bsdf) -> bool, check: impl Fn(&str, &Bsdf, &Glowing)) {
    let (mut done, mut left_out) = (Vec::new(), Vec::new());
    let (mut last, mut count) = ("", 0);
    let step = match max_order {
        _ if is_night() => 1,
        1 => 3,
        _ => 4,
    };
    for (model, bsdf) in listed() {
        // Examples are numbered in their model, so that another model changes no random number of this one.
        count = if model == last { count + 1 } else { 0 };
        last = model;
        let wanted = count % step == 0 || !done.contains(&model);
        if !suits(&bsdf) || !wanted {
            continue;
        }
        let name = format!("{model} (example {count})");
        match resolved(&bsdf, max_order) {
            Some(orders) if !orders.is_faint() => {
                check(&name, &bsdf, &orders);
                done.push(model);
            }
            _ => left_out.push((model, name)),
        }
    }
    println!("too narrow for the quadrature, or too faint for the samples: {left_out:?}");
    let forgotten: Vec<_> = left_out.iter().filter(|(model, _)| !done.contains(model)).collect();
    assert!(forgotten.is_empty(), "of these models nothing is tested: {forgotten:?}");
}

/// Compares all methods that carry all the light; light tracing's samples seldom come into view, and it gets more.
fn compare(truth: &Truth, lobes: Lobes, samples: u32, conclusive: f64) {
    let mut family = Family::new(truth.name());
    // A pinhole does not see by light tracing what a delta lobe sends to it.
    for name in ALL.into_iter().filter(|name| *name != "light" || !lobes.intersects(Lobes::DELTA)) {
        let budget = Budget::samples(if name == "light" { 8 * samples } else { samples });
        truth.compare(&mut family, name, plain(name).as_ref(), budget, COLUMNS);
    }
    family.finish(conclusive);
}

#[test]
fn many_times_inside_a_glowing_sphere() {
    let reflects = |bsdf: &Bsdf| !bsdf.is_anisotropic() && !bsdf.lobes().intersects(Lobes::TRANSMISSION);
    examples(4, reflects, |name, bsdf, orders| {
        let mut builder = SceneBuilder::new(&format!("inside {name}"));
        let wall = builder.material(*bsdf);
        let sphere = builder.sphere(DVec3::ZERO, 1.0, wall);
        builder.flip(sphere);
        builder.emit(sphere, shining(1.0));
        builder.camera(camera(dvec3(0.3, 0.2, 0.7), dvec3(0.1, -0.6, 0.0), 50.0, 4));
        let scene = builder.build(Skip::Unneeded).unwrap();
        let truth = Truth::new(&scene, |hit, ray| orders.towards(hit.frame.to_local(-ray.d)));
        compare(&truth, bsdf.lobes(), 32, 0.7);
    });
}

/// A ball that fills the view, in a uniform environment.
fn ball_in_environment(name: &str, bsdf: Bsdf, radiance: f32) -> Scene {
    let mut builder = SceneBuilder::new(&format!("ball of {name}"));
    let material = builder.material(bsdf);
    builder.sphere(DVec3::ZERO, 1.0, material);
    builder.environment(Spectrum::splat(radiance));
    builder.camera(camera(dvec3(0.3, 0.2, 2.5), DVec3::ZERO, 20.0, 4));
    builder.build(Skip::Unneeded).unwrap()
}

/// Lit by the environment alone, a convex body reflects once: order 1 is its directional albedo times the radiance, whatever
/// it transmits.
#[test]
fn once_by_a_ball_in_a_uniform_environment() {
    let radiance = 1.3;
    examples(
        1,
        |_| true,
        |name, bsdf, orders| {
            let scene = ball_in_environment(name, *bsdf, radiance);
            let truth = Truth::new(&scene, |hit, ray| {
                vec![0.0, radiance as f64 * orders.towards(hit.frame.to_local(-ray.d))[1]]
            });
            compare(&truth, bsdf.lobes(), 64, 0.8);
        },
    );
}

/// In a glass ball every internal angle is the same, so order k ≥ 2 is (1 − F)² F^(k−2) times the radiance, and order 1 is F.
/// F is some 4 %: beyond order 4 there is less than a path in 10⁵, more than an everyday test can see.
#[test]
fn glass_ball_in_a_uniform_environment() {
    let (eta, radiance) = (1.5, 1.3);
    let scene = ball_in_environment("glass", Dielectric { eta }.into(), radiance);
    let truth = Truth::new(&scene, |hit, ray| {
        let reflected = fresnel(-(ray.d.dot(hit.point.ng) as f64), eta as f64);
        let through = (1.0 - reflected).powi(2);
        let shares = [0.0, reflected, through, through * reflected, through * reflected * reflected];
        shares.map(|share| share * radiance as f64).to_vec()
    });
    let mut family = Family::new("glass ball");
    for name in ["path", "bdpt"] {
        truth.compare(&mut family, name, plain(name).as_ref(), Budget::samples(2048), COLUMNS);
    }
    truth.compare(&mut family, "direct", plain("direct").as_ref(), Budget::samples(256), COLUMNS);
    family.finish(0.7);
}

/// Fresnel's reflectance in f64, for light that arrives from outside.
fn fresnel(cos: f64, eta: f64) -> f64 {
    let cos_t = (1.0 - (1.0 - cos * cos) / (eta * eta)).sqrt();
    let parallel = (eta * cos - cos_t) / (eta * cos + cos_t);
    let perpendicular = (cos - eta * cos_t) / (cos + eta * cos_t);
    (parallel * parallel + perpendicular * perpendicular) / 2.0
}
