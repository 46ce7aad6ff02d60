//! Delicate routines against their formulas in double precision, over extremes and at random, with the error in units in the last place.
//!
//! What a routine is given is exact: the formula gets the same numbers in `f64`. So its error is its own, and that of what it is given,
//! however large, is not counted. `-- --nocapture precision` prints the worst of each with where it is.

mod facets;
mod geometry;
mod refraction;
mod scattering;
mod solid_angles;
mod statistics;

use glam::DVec3;
use sampling::rng::{Stream, mix};

/// How many numbers a routine is tried with.
const TRIES: usize = 100_000;

/// The worst error of a routine so far.
struct Worst {
    name: &'static str,
    ulps: f64,
    at: String,
    tried: usize,
}

impl Worst {
    fn of(name: &'static str) -> Self {
        Self { name, ulps: 0.0, at: "nothing".into(), tried: 0 }
    }

    /// Compares with the exact value, in units of the last place of `unit`.
    #[track_caller]
    fn add_in(&mut self, found: f64, exact: f64, unit: f64, at: impl Fn() -> String) {
        assert!(found.is_finite() && exact.is_finite(), "{}: {found:e}, exactly {exact:e} at {}", self.name, at());
        self.tried += 1;
        let ulps = (found - exact).abs() / unit;
        if ulps > self.ulps {
            (self.ulps, self.at) = (ulps, at());
        }
    }

    /// Compares numbers of single precision.
    #[track_caller]
    fn add(&mut self, found: f32, exact: f64, at: impl Fn() -> String) {
        self.add_in(f64::from(found), exact, single(exact), at);
    }

    /// Prints the worst, which must not exceed `most` \[ulp\].
    #[track_caller]
    fn finish(self, most: f64) {
        let Self { name, ulps, at, tried } = self;
        println!("{name:<34} {ulps:>9.2} ulp of {tried} tries, at {at}");
        assert!(tried > 0 && ulps <= most, "{name} is off by {ulps} ulp, not {most}, at {at}");
    }
}

/// One unit in the last place of a number in single precision.
fn single(x: f64) -> f64 {
    let x = (x.abs() as f32).max(f32::MIN_POSITIVE);
    f64::from(x.next_up()) - f64::from(x)
}

/// One in double precision.
fn double(x: f64) -> f64 {
    let x = x.abs().max(f64::MIN_POSITIVE);
    x.next_up() - x
}

/// How far a value moves where a direction does by half a unit in the last place of 1, or a whole one, along each of the axes.
fn moved(w: DVec3, value: impl Fn(DVec3) -> f64) -> f64 {
    let exact = value(w);
    let steps = [-1.0, -0.5, 0.5, 1.0].map(|units| units * f64::from(f32::EPSILON));
    let along = |axis: DVec3| steps.iter().map(|step| (value(w + step * axis) - exact).abs()).fold(0.0, f64::max);
    DVec3::AXES.into_iter().map(along).sum()
}

/// Random numbers, others under another seed of all tests.
struct Dice(Stream);

impl Dice {
    fn new(seed: u64) -> Self {
        Self(Stream::new(mix(seed), crate::support::seed().wrapping_sub(1)))
    }

    fn unit(&mut self) -> f64 {
        (f64::from(self.0.next_u32()) + 0.5) / 4_294_967_296.0
    }

    /// Any magnitude in a range alike.
    fn magnitude(&mut self, low: f64, high: f64) -> f64 {
        (low.ln() + (high.ln() - low.ln()) * self.unit()).exp()
    }

    /// In (0, 1), of which half is near 0 and a quarter near 1.
    fn share(&mut self) -> f32 {
        let x = match self.unit() {
            kind if kind < 0.5 => self.magnitude(1e-7, 1.0),
            kind if kind < 0.75 => 1.0 - self.magnitude(1e-7, 1.0),
            _ => self.unit(),
        };
        (x as f32).clamp(1e-7, 1.0)
    }

    /// The width of a lobe, often the least or the greatest.
    fn width(&mut self, least: f64) -> f32 {
        match self.unit() {
            kind if kind < 0.1 => least as f32,
            kind if kind < 0.2 => 1.0,
            _ => self.magnitude(least, 1.0) as f32,
        }
    }

    /// A random number as samplers draw them, of which some are the least or the greatest.
    fn number(&mut self) -> f32 {
        match self.unit() {
            kind if kind < 0.05 => 0.0,
            kind if kind < 0.1 => 1.0_f32.next_down(),
            _ => self.share().min(1.0_f32.next_down()),
        }
    }

    /// A direction above the surface with such a cosine.
    fn direction(&mut self) -> glam::Vec3 {
        let (cos, phi) = (f64::from(self.share()), std::f64::consts::TAU * self.unit());
        let sin = ((1.0 - cos) * (1.0 + cos)).sqrt();
        glam::dvec3(sin * phi.cos(), sin * phi.sin(), cos).as_vec3()
    }

    /// A direction.
    fn anywhere(&mut self) -> glam::DVec3 {
        let (z, phi) = (2.0 * self.unit() - 1.0, std::f64::consts::TAU * self.unit());
        let sin = (1.0 - z * z).sqrt();
        glam::dvec3(sin * phi.cos(), sin * phi.sin(), z)
    }
}
