//! Integrals of known value, on which samplers are tried without a scene.
//!
//! Three are what a pixel integrates: a smooth spot, a disc and an edge, over the numbers of the film. The others are the six
//! families of [Genz 1984], each hard for a reason of its own, over the numbers of a vertex: two for a direction, three with the
//! choice of a lobe, six with next-event estimation. All are asked for at the addresses where walks ask for them.

mod estimate;
mod genz;
pub mod screen;

pub use estimate::{content, measure, seconds_per_sample, work, write_checkpoint};
use genz::Genz;
use sampling::sampler::{Purpose, Sampler, Subpath};
use statrs::function::erf::erf;
use std::f64::consts::PI;
use std::fmt;

/// A function on the unit cube whose integral is known.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Integral {
    /// exp(−|x − c|² / 2σ²) in the pixel.
    Spot,
    /// 1 within a circle in the pixel.
    Disc,
    /// 1 on one side of a line that no axis is parallel to.
    Edge,
    /// One of Genz's functions in so many dimensions.
    Genz(Genz, usize),
}

const SPOT: ([f64; 2], f64) = ([0.4, 0.6], 0.25);
const RADIUS: f64 = 0.4;
/// The edge: x + 0.6 y = 0.75.
const EDGE: (f64, f64) = (0.6, 0.75);
/// Dimensions in which Genz's functions are taken.
const DIMENSIONS: [usize; 3] = [2, 3, 6];

/// The numbers of a sample: those of the film, then those of a walk's first vertex.
#[derive(Clone, Copy, Debug)]
pub struct Numbers {
    film: [f64; 2],
    vertex: [f64; 6],
}

impl Numbers {
    /// Asks a sampler, which stands at a sample, as a walk would.
    #[inline]
    pub fn draw(sampler: &mut Sampler) -> Self {
        let film = sampler.get_2d(Purpose::Film);
        sampler.start_vertex(Subpath::Camera, 1);
        let direction = sampler.get_2d(Purpose::Direction);
        let lobe = sampler.get_1d(Purpose::Lobe);
        let emitter = sampler.get_1d(Purpose::NextEmitter);
        let position = sampler.get_2d(Purpose::NextPosition);
        let vertex = [direction.x, direction.y, lobe, emitter, position.x, position.y];
        Self { film: [film.x, film.y].map(f64::from), vertex: vertex.map(f64::from) }
    }
}

impl Integral {
    /// All of them.
    pub fn all() -> Vec<Self> {
        let genz = Genz::ALL.iter().flat_map(|&family| DIMENSIONS.map(|d| Self::Genz(family, d)));
        [Self::Spot, Self::Disc, Self::Edge].into_iter().chain(genz).collect()
    }

    /// How many numbers it depends on.
    pub fn dimension(self) -> usize {
        match self {
            Self::Spot | Self::Disc | Self::Edge => 2,
            Self::Genz(_, dimension) => dimension,
        }
    }

    /// Its value at a sample.
    #[inline]
    pub fn eval(self, numbers: &Numbers) -> f64 {
        let [x, y] = numbers.film;
        let is = |inside: bool| f64::from(u8::from(inside));
        match self {
            Self::Spot => {
                let ([cx, cy], sigma) = SPOT;
                (-((x - cx).powi(2) + (y - cy).powi(2)) / (2.0 * sigma * sigma)).exp()
            }
            Self::Disc => is((x - 0.5).powi(2) + (y - 0.5).powi(2) < RADIUS * RADIUS),
            Self::Edge => is(x + EDGE.0 * y < EDGE.1),
            Self::Genz(family, dimension) => family.eval(&numbers.vertex[..dimension]),
        }
    }

    /// Its integral.
    pub fn exact(self) -> f64 {
        match self {
            Self::Spot => {
                let (centre, sigma) = SPOT;
                let scale = sigma * 2.0_f64.sqrt();
                let side = |c: f64| sigma * (PI / 2.0).sqrt() * (erf((1.0 - c) / scale) + erf(c / scale));
                centre.map(side).iter().product()
            }
            Self::Disc => PI * RADIUS * RADIUS,
            // Every row's part left of the edge, which leaves the square neither to the left nor to the right.
            Self::Edge => EDGE.1 - EDGE.0 / 2.0,
            Self::Genz(family, dimension) => family.exact(dimension),
        }
    }
}

impl fmt::Display for Integral {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Spot => f.pad("spot"),
            Self::Disc => f.pad("disc"),
            Self::Edge => f.pad("edge"),
            Self::Genz(family, dimension) => f.pad(&format!("{}_{dimension}", family.name())),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use sampling::moments::Moments;
    use sampling::sampler::{Role, SamplerKind, StreamKey};

    /// 21 integrals, each within 4.5 standard errors of the mean of 64 replicates: a false alarm in 1600 runs, and the seed is fixed.
    #[test]
    fn closed_forms_are_the_means() {
        let integrals = Integral::all();
        let mut moments = vec![Moments::default(); integrals.len()];
        for replicate in 0..64 {
            let key = StreamKey::new(7, "closed forms", Role::Estimate, replicate);
            let mut sampler = Sampler::new(SamplerKind::Sobol, key, 4096, (1, 1));
            let mut sums = vec![0.0; integrals.len()];
            for sample in 0..4096 {
                sampler.start_sample(0, sample);
                let numbers = Numbers::draw(&mut sampler);
                sums.iter_mut().zip(&integrals).for_each(|(sum, integral)| *sum += integral.eval(&numbers));
            }
            moments.iter_mut().zip(sums).for_each(|(m, sum)| m.push(sum / 4096.0));
        }
        for (integral, m) in integrals.iter().zip(moments) {
            let (exact, error) = (integral.exact(), m.variance_of_mean().sqrt());
            // Numbers are multiples of 2⁻²⁴, each rounded down.
            let off = (m.mean - exact).abs() - 1e-6 * exact.abs();
            assert!(off < 4.5 * error && error < 1e-2 * exact.abs(), "{integral}: {} ± {error}, not {exact}", m.mean);
        }
    }

    #[test]
    fn names_are_all_different() {
        let mut names: Vec<String> = Integral::all().iter().map(ToString::to_string).collect();
        names.sort();
        names.dedup();
        assert_eq!(names.len(), 3 + 6 * DIMENSIONS.len());
    }
}
