//! Which pixels see much the same as their neighbours.

use crate::block::Window;
use crate::film::Average;
use crate::integrator::Pixel;
use crate::measurement::Counters;
use rayon::prelude::*;
use sampling::bsdf::{Lobes, TransportMode};
use sampling::math::Spectrum;
use sampling::{Vec2, Vec3, vec2};
use scenes::{Interaction, Scene};
use std::f32::consts::PI;
use std::ops::Range;

/// One minus the cosine between the normals of surfaces that are not alike: 14°.
const TURN: f32 = 0.03;
/// The squared sine of the angle at which one lies off the plane of another that is not like it: 8°.
const OFF_PLANE: f32 = 0.02;
/// The part of the larger albedo by which the other differs of surfaces that are not alike.
const ALBEDO: f32 = 0.2;
/// Neighbours whose weights add up to less are too few to be shared with.
const FEWEST: f32 = 1.0;
/// Rays along either axis that find the parts of a pixel at an edge.
const LOOKS: u8 = 4;

/// A diffuse surface that neither emits nor lets light through.
#[derive(Clone, Copy, Debug, Default)]
struct Surface {
    p: Vec3,
    n: Vec3,
    albedo: Spectrum,
}

impl Surface {
    /// From 1 for the same to 0.
    #[inline]
    fn likeness(&self, other: &Self) -> f32 {
        // None to what has no normal, which is no number here.
        let turned = (1.0 - (1.0 - self.n.dot(other.n)) / TURN).max(0.0);
        if turned == 0.0 {
            return 0.0;
        }
        let d = other.p - self.p;
        let off = d.dot(self.n).abs().max(d.dot(other.n).abs());
        let off_plane = 1.0 - off * off / (d.length_squared() * OFF_PLANE).max(f32::MIN_POSITIVE);
        let albedo = match self.albedo == other.albedo {
            true => 1.0,
            false => {
                let larger = self.albedo.max_component().max(other.albedo.max_component());
                let [a, b] = [self.albedo, other.albedo].map(Spectrum::to_array);
                let difference = (0..3).map(|c| (a[c] - b[c]).abs()).fold(0.0, f32::max);
                1.0 - difference / (larger * ALBEDO).max(f32::MIN_POSITIVE)
            }
        };
        turned.min(1.0) * off_plane.max(0.0) * albedo.max(0.0)
    }

    /// What many of them are in the mean.
    fn mean(of: &[Self]) -> Self {
        let sum = of.iter().fold(Self::default(), |sum, one| Self {
            p: sum.p + one.p,
            n: sum.n + one.n,
            albedo: sum.albedo + one.albedo,
        });
        let count = of.len() as f32;
        Self { p: sum.p / count, n: sum.n.normalize(), albedo: sum.albedo / count }
    }
}

/// What a ray of the camera meets.
#[derive(Clone, Copy, Debug)]
enum Seen {
    /// Nothing, from where no light comes.
    Nothing,
    /// What shares no numbers.
    Alone,
    /// A surface that may.
    Surface(Surface),
}

impl Seen {
    /// By the middle of the lens.
    fn look(scene: &Scene, raster: Vec2) -> Self {
        // By reference: an interaction is large.
        match &scene.intersect(&scene.camera.sample_we(raster, vec2(0.5, 0.5)).ray) {
            Some(hit) => Self::of(scene, hit),
            // A silhouette before the sky is known better by places of the pixel's own.
            None if scene.environment.is_some() => Self::Alone,
            None => Self::Nothing,
        }
    }

    fn of(scene: &Scene, hit: &Interaction) -> Self {
        let diffuse = Lobes::DIFFUSE_REFLECTION.contains(hit.bsdf.lobes()) && !hit.bsdf.lobes().is_empty();
        if !diffuse || hit.emitter.is_some() || scene.body_of(hit).is_some() {
            return Self::Alone;
        }
        let n = hit.ns();
        Self::Surface(Surface { p: hit.point.p, n, albedo: hit.eval(n, n, TransportMode::Radiance) * PI })
    }
}

/// A part of a pixel that sees one surface.
#[derive(Clone, Copy, Debug)]
struct Part {
    surface: Surface,
    /// How much of the pixel it is.
    share: f32,
    /// One over the sum of the unnormalised weights in its average, once they are known.
    scale: f32,
}

/// What a pixel sees.
#[derive(Clone, Debug)]
enum Sight {
    /// What shares no numbers.
    Alone,
    /// One surface.
    Whole(Part),
    /// Surfaces with an edge between them.
    Split(Box<[Part]>),
}

/// What pixels see, and their weights in one another's averages.
pub(super) struct Neighbours {
    width: u32,
    height: u32,
    radius: u32,
    /// By pixel.
    sights: Vec<Sight>,
    /// The weights that the distances of pixels leave, by row and column.
    near: Vec<f32>,
    /// Work done to find them.
    pub work: Counters,
}

impl Neighbours {
    /// Bytes for each pixel, with those for a corner of it or a copy while neighbours are found, and for parts: four of every eighth, which is much.
    pub const BYTES: u64 = (2 * size_of::<Sight>() + size_of::<Seen>() + 1 + size_of::<Part>()) as u64;

    /// No pixel shares numbers.
    pub fn none(scene: &Scene) -> Self {
        let (width, height) = (scene.camera.width(), scene.camera.height());
        let sights = vec![Sight::Alone; width as usize * height as usize];
        Self { width, height, radius: 0, sights, near: Vec::new(), work: Counters::default() }
    }

    /// Looks at every pixel of the image.
    pub fn find(scene: &Scene, radius: u32) -> Self {
        let mut all = Self { radius, near: Self::nearness(radius), ..Self::none(scene) };
        let width = all.width as usize;
        let at = |i: usize| ((i % width) as u32, (i / width) as u32);
        let corners = Corners::look(scene);
        let rays: Vec<u8>;
        (all.sights, rays) = (0..all.sights.len()).into_par_iter().map(|i| corners.pixel(scene, at(i))).unzip();
        all.work.closest = corners.seen.len() as u64 + rays.into_iter().map(u64::from).sum::<u64>();
        drop(corners);
        // Whole pixels that are left alone are nobody's neighbours.
        all.sights = (0..all.sights.len()).into_par_iter().map(|i| all.kept(at(i))).collect();
        all.sights = (0..all.sights.len()).into_par_iter().map(|i| all.weighed(at(i))).collect();
        all
    }

    /// Which part of a pixel these numbers for the filter lie in.
    pub fn part(&self, scene: &Scene, (x, y): (u32, u32), place: Vec2) -> usize {
        let Sight::Split(parts) = self.sight((x, y)) else { return 0 };
        let (pixel, _) = Pixel::sample(x, y, scene.camera.filter(), place);
        let part = match Seen::look(scene, pixel.raster) {
            Seen::Surface(surface) => parts.iter().position(|part| part.surface.likeness(&surface) > 0.0),
            _ => None,
        };
        part.unwrap_or(parts.len())
    }

    fn sight(&self, (x, y): (u32, u32)) -> &Sight {
        &self.sights[y as usize * self.width as usize + x as usize]
    }

    /// What a pixel sees, if it has neighbours enough.
    fn kept(&self, at: (u32, u32)) -> Sight {
        match self.sight(at) {
            Sight::Whole(part) if self.around(at, &part.surface) < FEWEST => Sight::Alone,
            sight => sight.clone(),
        }
    }

    /// What a pixel sees, with its neighbours' weights in its shares.
    fn weighed(&self, at: (u32, u32)) -> Sight {
        // The pixel itself is one of those that are averaged; left to itself it has the mean of both images.
        let weighed = |part: &Part, around: f32| Part { scale: 1.0 / (1.0 + around.max(1.0)), ..*part };
        let around = |part: &Part| self.around(at, &part.surface);
        match self.sight(at) {
            Sight::Alone => Sight::Alone,
            Sight::Whole(part) => Sight::Whole(weighed(part, around(part))),
            Sight::Split(parts) => {
                let arounds: Vec<f32> = parts.iter().map(around).collect();
                let mean: f32 = parts.iter().zip(&arounds).map(|(part, around)| part.share * around).sum();
                if mean < FEWEST {
                    return Sight::Alone;
                }
                Sight::Split(parts.iter().zip(arounds).map(|(part, around)| weighed(part, around)).collect())
            }
        }
    }

    /// The sum of the unnormalised weights of other pixels that see what a pixel sees.
    fn around(&self, at: (u32, u32), seen: &Surface) -> f32 {
        let mut sum = 0.0;
        self.each(at, seen, &Window::whole(self.width, self.height), |of, weight| {
            sum += if of == at { 0.0 } else { weight };
        });
        sum
    }

    /// The whole pixels of a window about one, and the unnormalised weights of what they see in the average of what that one sees.
    #[inline]
    fn each(&self, at: (u32, u32), seen: &Surface, within: &Window, mut take: impl FnMut((u32, u32), f32)) {
        let around = |i: u32, within: &Range<u32>| {
            let start = i.saturating_sub(self.radius).max(within.start);
            start..(i + self.radius + 1).min(within.end).max(start)
        };
        let columns = around(at.0, &within.x);
        for y in around(at.1, &within.y) {
            let near = &self.near[at.1.abs_diff(y) as usize * (self.radius as usize + 1)..];
            let row = y as usize * self.width as usize;
            let sights = &self.sights[row + columns.start as usize..row + columns.end as usize];
            for (x, sight) in columns.clone().zip(sights) {
                let near = near[at.0.abs_diff(x) as usize];
                if let (Sight::Whole(other), true) = (sight, near > 0.0) {
                    take((x, y), near * seen.likeness(&other.surface));
                }
            }
        }
    }

    /// The weights that the distances of pixels leave, row by row.
    fn nearness(radius: u32) -> Vec<f32> {
        let reach = ((radius + 1) * (radius + 1)) as f32;
        let left = |x: u32, y: u32| (1.0 - (x * x + y * y) as f32 / reach).max(0.0).powi(2);
        (0..=radius).flat_map(|y| (0..=radius).map(move |x| left(x, y))).collect()
    }
}

impl Average for Neighbours {
    fn reach(&self) -> u32 {
        self.radius
    }

    #[inline]
    fn parts(&self, pixel: (u32, u32)) -> usize {
        match self.sight(pixel) {
            Sight::Alone => 0,
            Sight::Whole(_) => 1,
            // What lies past them is one, too, which shares with nothing but itself.
            Sight::Split(parts) => parts.len() + 1,
        }
    }

    #[inline]
    fn weights(&self, at: (u32, u32), part: usize, within: &Window, mut take: impl FnMut((u32, u32), f64)) {
        let (side, itself) = match self.sight(at) {
            Sight::Alone => return,
            Sight::Whole(side) => (Some(side), None),
            Sight::Split(sides) => (sides.get(part), Some(sides.get(part).map_or(0.5, |side| side.scale))),
        };
        if let Some(Part { surface, scale, .. }) = side {
            self.each(at, surface, within, |of, weight| {
                if weight > 0.0 {
                    take(of, f64::from(weight * scale));
                }
            });
        }
        if let Some(weight) = itself.filter(|_| within.contains(at)) {
            take(at, f64::from(weight));
        }
    }
}

/// What is seen at the corners of pixels: a straight edge that crosses a pixel has a corner of it on its other side.
struct Corners {
    width: u32,
    height: u32,
    seen: Vec<Seen>,
}

impl Corners {
    fn look(scene: &Scene) -> Self {
        let (width, height) = (scene.camera.width(), scene.camera.height());
        let columns = width as usize + 1;
        let at = |i: usize| vec2((i % columns) as f32, (i / columns) as f32);
        let corners = (0..columns * (height as usize + 1)).into_par_iter();
        Self { width, height, seen: corners.map(|i| Seen::look(scene, at(i))).collect() }
    }

    /// What a pixel sees, by its corners and those as much further out as its filter reaches, and by so many rays more where these see an edge.
    fn pixel(&self, scene: &Scene, (x, y): (u32, u32)) -> (Sight, u8) {
        let further = (scene.camera.filter().radius() - 0.5).ceil() as u32;
        let range = |i: u32, size: u32| i.saturating_sub(further) as usize..=(i + 1 + further).min(size) as usize;
        let rows = range(y, self.height).map(|row| row * (self.width as usize + 1));
        let corners = rows.flat_map(|row| range(x, self.width).map(move |column| &self.seen[row + column]));
        let mut surfaces = Vec::new();
        let mut count = 0;
        for seen in corners {
            count += 1;
            match seen {
                Seen::Alone => return (Sight::Alone, 0),
                Seen::Nothing => (),
                Seen::Surface(surface) => surfaces.push(*surface),
            }
        }
        match surfaces[..] {
            [] => (Sight::Alone, 0),
            [one, ..] if surfaces.len() == count && surfaces.iter().all(|other| other.likeness(&one) > 0.0) => {
                (Sight::Whole(Part { surface: Surface::mean(&surfaces), share: 1.0, scale: 1.0 }), 0)
            }
            _ if scene.camera.filter().has_negative_lobes() => (Sight::Alone, 0),
            _ => Self::split(scene, (x, y)),
        }
    }

    /// What a pixel sees at an edge, and the number of rays that said so.
    fn split(scene: &Scene, (x, y): (u32, u32)) -> (Sight, u8) {
        let within = |i: u8| (f32::from(i) + 0.5) / f32::from(LOOKS);
        let (mut groups, mut rays) = (Vec::<Vec<Surface>>::new(), 0);
        for (i, j) in (0..LOOKS).flat_map(|j| (0..LOOKS).map(move |i| (i, j))) {
            let (pixel, _) = Pixel::sample(x, y, scene.camera.filter(), vec2(within(i), within(j)));
            rays += 1;
            match Seen::look(scene, pixel.raster) {
                Seen::Alone => return (Sight::Alone, rays),
                Seen::Nothing => (),
                Seen::Surface(surface) => match groups.iter_mut().find(|group| group[0].likeness(&surface) > 0.0) {
                    Some(group) => group.push(surface),
                    None => groups.push(vec![surface]),
                },
            }
        }
        let share = |group: &Vec<Surface>| group.len() as f32 / f32::from(LOOKS * LOOKS);
        let part = |group: &Vec<Surface>| Part { surface: Surface::mean(group), share: share(group), scale: 1.0 };
        (Sight::Split(groups.iter().map(part).collect()), rays)
    }
}
