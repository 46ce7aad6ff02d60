//! A density over directions that is refined where light comes from: a quadtree over the sphere [Müller et al. 2017, §3.2].

use sampling::warp::{self, uniform_sphere_pdf};
use sampling::{Vec2, Vec3, vec2};

/// The part of all light from which a square is divided.
const DIVIDED_FROM: f32 = 0.01;
/// Squares are divided at most so often: into cells of 4π / 2²⁴ sr.
const MAX_DEPTH: u32 = 12;
/// The last number below 1.
const BELOW_ONE: f32 = 1.0_f32.next_down();

/// Where a unit direction lies in the unit square, by which areas are solid angles over 4π (Lambert's cylindrical projection).
#[inline]
pub fn to_square(d: Vec3) -> Vec2 {
    vec2(warp::turns(d.y, d.x), ((d.z + 1.0) / 2.0).clamp(0.0, BELOW_ONE))
}

/// The direction that lies there.
#[inline]
pub fn from_square(p: Vec2) -> Vec3 {
    let z = 2.0 * p.y - 1.0;
    let (sin, cos) = warp::sin_cos_turns(p.x);
    let r = ((1.0 - z) * (1.0 + z)).max(0.0).sqrt();
    Vec3::new(r * cos, r * sin, z)
}

/// A square. Quarter `i` lies at the higher half of x if bit 0 of `i` is set, of y if bit 1 is.
#[derive(Clone, Copy, Debug, Default)]
struct Square {
    /// What was added to each quarter.
    light: [f32; 4],
    /// The number of the square that each quarter is; 0 where it is not divided.
    parts: [u32; 4],
}

impl Square {
    fn total(&self) -> f32 {
        self.light.iter().sum()
    }
}

/// The tree; square 0 is the whole.
#[derive(Clone, Debug)]
pub struct Quadtree {
    squares: Vec<Square>,
}

impl Default for Quadtree {
    /// One square without light.
    fn default() -> Self {
        Self { squares: vec![Square::default()] }
    }
}

impl Quadtree {
    /// Whether nothing was added.
    pub fn is_dark(&self) -> bool {
        self.squares[0].total() <= 0.0
    }

    /// Adds light from a place in the square, spread over as wide a box as the finest square there, so that neighbours learn of one
    /// another [Müller 2019, §10.3].
    pub fn add(&mut self, place: Vec2, light: f32) {
        let width = self.finest(place);
        let from = vec2(place.x - 0.5 * width, (place.y - 0.5 * width).clamp(0.0, 1.0 - width));
        let density = light / (width * width);
        // Round the sphere in x.
        for turn in [-1.0, 0.0, 1.0] {
            let from = from + vec2(turn, 0.0);
            self.add_box(0, from, from + width, density);
        }
    }

    /// The width of the finest square that a place lies in.
    fn finest(&self, mut place: Vec2) -> f32 {
        let (mut at, mut width) = (0, 1.0);
        loop {
            width /= 2.0;
            match self.squares[at].parts[descend(&mut place)] {
                0 => return width,
                part => at = part as usize,
            }
        }
    }

    /// Adds light of this density over a box of a square, in the square's own unit.
    fn add_box(&mut self, at: usize, from: Vec2, to: Vec2, density: f32) {
        for quarter in 0..4 {
            let corner = 0.5 * vec2((quarter & 1) as f32, (quarter >> 1) as f32);
            let (from, to) = (from.max(corner), to.min(corner + 0.5));
            if from.cmplt(to).all() {
                let edges = to - from;
                self.squares[at].light[quarter] += density * edges.x * edges.y;
                match self.squares[at].parts[quarter] {
                    0 => {}
                    part => self.add_box(part as usize, 2.0 * (from - corner), 2.0 * (to - corner), 0.25 * density),
                }
            }
        }
    }

    /// The density of a direction [1/sr]; 0 where no light came from.
    #[inline]
    pub fn pdf(&self, d: Vec3) -> f32 {
        let (mut at, mut p, mut pdf) = (0, to_square(d), uniform_sphere_pdf());
        loop {
            let (quarter, square) = (descend(&mut p), &self.squares[at]);
            let total = square.total();
            if total <= 0.0 {
                // Squares that the light of the one above was lost in, by underflow.
                return pdf;
            }
            pdf *= 4.0 * square.light[quarter] / total;
            match square.parts[quarter] {
                0 => return pdf,
                part => at = part as usize,
            }
        }
    }

    /// A direction of that density.
    #[inline]
    pub fn sample(&self, mut u: Vec2) -> Vec3 {
        let (mut at, mut corner, mut width) = (0, Vec2::ZERO, 1.0);
        loop {
            let Square { light, parts } = &self.squares[at];
            let (left, right) = (light[0] + light[2], light[1] + light[3]);
            if left + right <= 0.0 {
                break;
            }
            let x = choose(&mut u.x, left, right);
            let y = choose(&mut u.y, light[x], light[x + 2]);
            width /= 2.0;
            corner += width * vec2(x as f32, y as f32);
            match parts[x + 2 * y] {
                0 => break,
                part => at = part as usize,
            }
        }
        from_square(corner + width * u)
    }

    /// A tree without light, as fine as the light of this one asks for.
    pub fn refined(&self) -> Self {
        let whole = self.squares[0].total();
        let mut fine = Self::default();
        if whole > 0.0 {
            fine.divide(0, Some((self, 0)), self.squares[0].light, DIVIDED_FROM * whole, 1);
        }
        fine
    }

    /// Divides the quarters of a square that hold more than `most`; `like` is the square of a tree whose light it is.
    fn divide(&mut self, at: usize, like: Option<(&Self, usize)>, light: [f32; 4], most: f32, depth: u32) {
        for (quarter, &light) in light.iter().enumerate() {
            if light <= most || depth >= MAX_DEPTH {
                continue;
            }
            let part = self.squares.len();
            self.squares.push(Square::default());
            self.squares[at].parts[quarter] = part as u32;
            let like = like.and_then(|(tree, at)| match tree.squares[at].parts[quarter] {
                0 => None,
                part => Some((tree, part as usize)),
            });
            let quarters = like.map_or([light / 4.0; 4], |(tree, at)| tree.squares[at].light);
            self.divide(part, like, quarters, most, depth + 1);
        }
    }
}

/// The quarter that a place of a square lies in, and its place there.
#[inline]
fn descend(p: &mut Vec2) -> usize {
    let doubled = 2.0 * *p;
    let (x, y) = (doubled.x >= 1.0, doubled.y >= 1.0);
    *p = doubled - vec2(f32::from(u8::from(x)), f32::from(u8::from(y)));
    usize::from(x) + 2 * usize::from(y)
}

/// The first or the second by their light, and what is left of the uniform number.
#[inline]
fn choose(u: &mut f32, first: f32, second: f32) -> usize {
    let chance = first / (first + second);
    let is_second = *u >= chance;
    let rest = if is_second { (*u - chance) / (1.0 - chance) } else { *u / chance };
    *u = rest.min(BELOW_ONE);
    usize::from(is_second)
}

#[cfg(test)]
mod tests {
    use super::*;
    use sampling::rng::Stream;
    use std::f32::consts::PI;

    /// With a bright spot, refined so often.
    fn spotted(times: u32) -> Quadtree {
        let mut tree = Quadtree::default();
        let mut dice = Stream::new(1, 2);
        for _ in 0..times {
            tree = tree.refined();
            for _ in 0..1000 {
                let [x, y] = [(); 2].map(|()| dice.next_f32());
                tree.add(vec2(x, y), 0.1);
                tree.add(vec2(0.3 + 0.05 * x, 0.7 + 0.05 * y), 1.0);
            }
        }
        tree
    }

    #[test]
    fn directions_go_to_the_square_and_back() {
        let mut dice = Stream::new(3, 4);
        for _ in 0..1000 {
            let p = vec2(dice.next_f32(), dice.next_f32());
            let d = from_square(p);
            assert!((d.length() - 1.0).abs() < 1e-6);
            assert!((from_square(to_square(d)) - d).length() < 1e-5, "{p} {d}");
        }
        for axis in [Vec3::X, Vec3::Y, Vec3::Z] {
            for d in [axis, -axis] {
                let p = to_square(d);
                assert!(p.cmplt(Vec2::ONE).all() && p.cmpge(Vec2::ZERO).all());
                assert!((from_square(p) - d).length() < 1e-3);
            }
        }
    }

    /// The mean over the sphere of density times 4π, and the part of samples within the spot against the density's there: the
    /// former by a grid finer than the tree is anywhere, the latter within five standard deviations (one alarm in 10⁶).
    #[test]
    fn the_density_integrates_to_one_and_is_that_of_samples() {
        for times in [1, 2, 5] {
            let tree = spotted(times);
            let n = 1 << 9;
            let place = |i: usize| (i as f32 + 0.5) / n as f32;
            let (mut whole, mut spot) = (0.0, 0.0);
            let within = |p: Vec2| (0.25..0.375).contains(&p.x) && (0.625..0.75).contains(&p.y);
            for i in 0..n * n {
                let p = vec2(place(i % n), place(i / n));
                let part = f64::from(4.0 * PI * tree.pdf(from_square(p))) / (n * n) as f64;
                whole += part;
                spot += if within(p) { part } else { 0.0 };
            }
            assert!((whole - 1.0).abs() < 0.01, "{times}: {whole}");
            let mut dice = Stream::new(5, 6);
            let samples = 100_000;
            let hits = (0..samples).filter(|_| within(to_square(tree.sample(vec2(dice.next_f32(), dice.next_f32())))));
            let (found, error) =
                (hits.count() as f64 / f64::from(samples), (spot * (1.0 - spot) / f64::from(samples)).sqrt());
            assert!((found - spot).abs() < 5.0 * error + 0.002, "{times}: {found} {spot}");
            // Where a direction is sampled, its density is not zero.
            assert!(tree.pdf(tree.sample(vec2(0.1, 0.9))) > 0.0);
        }
        assert!(spotted(5).pdf(from_square(vec2(0.305, 0.705))) > 100.0 / (4.0 * PI));
    }

    #[test]
    fn without_light_all_directions_are_alike() {
        let tree = Quadtree::default();
        assert!(tree.is_dark() && tree.refined().squares.len() == 1);
        assert_eq!(tree.pdf(Vec3::X), 1.0 / (4.0 * PI));
        assert!((tree.sample(vec2(0.5, 0.75)) - from_square(vec2(0.5, 0.75))).length() < 1e-6);
    }
}
