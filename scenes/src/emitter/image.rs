//! An environment that bears an image.

use super::mapping::longitude;
use super::{Endpoint, EndpointKind, LeSample, LiSample, Mapping};
use crate::scene::BoundingSphere;
use crate::texture::Image;
use glam::{DMat3, DQuat, DVec3, Mat3};
use rayon::prelude::*;
use sampling::distribution::{CellSample, Piecewise2D};
use sampling::fault;
use sampling::math::Spectrum;
use sampling::{Vec2, Vec3, vec2};
use std::f64::consts::{PI, TAU};
use std::fmt;
use std::sync::Arc;

/// The largest radiance \[W/(m²·sr)\]: products along a path stay within `f32`.
const MAX_RADIANCE: f32 = 1e30;

/// An environment's image as it is given.
#[derive(Clone, Debug)]
pub struct EnvironmentImage {
    /// The image: radiance \[W/(m²·sr)\] over `scale`.
    pub image: Arc<Image>,
    /// How it covers the directions of the environment's own frame.
    pub mapping: Mapping,
    /// What its values are multiplied by.
    pub scale: Spectrum,
    /// From the environment's own frame to the scene's: a rotation, which may be mirrored.
    pub rotation: DMat3,
}

impl EnvironmentImage {
    /// What cannot be, if anything, and how to mend it.
    pub fn fault(&self) -> Option<(String, &'static str)> {
        let (width, height) = self.image.size();
        let scale = self.scale.to_array();
        if scale.iter().any(|factor| !(factor.is_finite() && *factor >= 0.0)) {
            return Some((format!("the scale is {scale:?}"), "give finite numbers that are not negative"));
        }
        let (low, high) = self.image.range();
        if low[..3].iter().any(|value| *value < 0.0) {
            let is_negative = |index: &usize| self.image.texel(*index)[..3].iter().any(|value| *value < 0.0);
            let index = (0..width as usize * height as usize).find(is_negative).unwrap_or_default();
            let (column, row) = (index % width as usize, index / width as usize);
            let message = format!("the texel in column {column}, row {row} is {:?}", &self.image.texel(index)[..3]);
            return Some((message, "mend the image: light cannot be negative"));
        }
        let reaches: [f32; 3] = std::array::from_fn(|channel| high[channel] * scale[channel]);
        if reaches.iter().all(|value| *value == 0.0) {
            return Some(("the image is black".into(), "an emitter must emit; leave it out, or give a scale above 0"));
        }
        if reaches.iter().any(|value| value.is_nan() || *value > MAX_RADIANCE) {
            return Some((format!("its radiance reaches {reaches:?}"), "keep it below 1e30"));
        }
        if self.mapping == Mapping::EqualArea && width != height {
            let message = format!("the image has {width}x{height} texels, but `equal_area` covers a square");
            return Some((message, "give an image as wide as high, or the mapping `equirectangular`"));
        }
        (!Self::is_rotation(&self.rotation)).then(|| {
            ("the transform of an environment scales or shears".into(), "give it rotations and reflections alone")
        })
    }

    /// Whether a map is a rotation, mirrored or not, to the digits that files have.
    pub(crate) fn is_rotation(map: &DMat3) -> bool {
        const ROUNDING: f64 = 1e-4;
        let off = (map.transpose() * *map - DMat3::IDENTITY).to_cols_array();
        off.into_iter().all(|entry| entry.abs() <= ROUNDING)
    }

    /// The rotation without what rounding has left in it.
    fn orthonormal(&self) -> DMat3 {
        let mirror = DVec3::new(1.0, 1.0, self.rotation.determinant().signum());
        let mirror = DMat3::from_diagonal(mirror);
        DMat3::from_quat(DQuat::from_mat3(&(self.rotation * mirror)).normalize()) * mirror
    }
}

/// Light arriving from an infinitely distant sphere that bears an image, bilinear between the centres of its texels.
///
/// Directions are sampled with a density that is constant over the solid angle of each texel, in proportion to the mean of what is
/// interpolated there. So it is positive wherever light comes from.
pub struct ImageEnvironment {
    image: Arc<Image>,
    mapping: Mapping,
    scale: Spectrum,
    /// From the environment's own frame to the scene's, orthonormal.
    to_scene: Mat3,
    bounds: BoundingSphere,
    distribution: Piecewise2D,
    rows: Vec<Row>,
    /// Radiance integrated over all directions \[W/m²\], the mean of the channels.
    integral: f64,
}

/// A row of texels.
#[derive(Clone, Copy)]
struct Row {
    /// Cosines of the angles from the axis of longitude at its upper and its lower edge; of no use for an equal-area square.
    cosines: [f64; 2],
    /// Solid angle of each of its texels \[sr\].
    solid_angle: f64,
    /// What turns a density on the unit square into one of directions \[1/sr\].
    per_solid_angle: f32,
}

impl fmt::Debug for ImageEnvironment {
    /// What tells environments apart.
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        let Self { image, mapping, scale, to_scene, bounds, .. } = self;
        write!(f, "ImageEnvironment {image:?} {mapping:?} {scale:?} {to_scene:?} {bounds:?}")
    }
}

impl ImageEnvironment {
    /// The environment around a scene; what is given has no [fault](EnvironmentImage::fault).
    pub(crate) fn new(given: &EnvironmentImage, bounds: BoundingSphere) -> Result<Self, String> {
        let (width, height) = given.image.size();
        let rows: Vec<Row> = (0..height).map(|row| Row::new(given.mapping, row, (width, height))).collect();
        let (weights, integral) = weights(given, &rows);
        let distribution =
            Piecewise2D::new(&weights, width as usize, height as usize).map_err(|error| error.to_string())?;
        Ok(Self {
            image: given.image.clone(),
            mapping: given.mapping,
            scale: given.scale,
            to_scene: given.orthonormal().as_mat3(),
            bounds,
            distribution,
            rows,
            integral,
        })
    }

    /// Power that passes the bounding sphere's discs \[W\], the mean of the channels.
    pub fn power(&self) -> f64 {
        self.bounds.disc_area() * self.integral
    }

    /// The mean of all directions \[W/(m²·sr)\], the mean of the channels.
    pub fn mean_radiance(&self) -> f64 {
        self.integral / (4.0 * std::f64::consts::PI)
    }

    /// The largest radiance, channel by channel.
    pub fn brightest(&self) -> Spectrum {
        let (_, [r, g, b, _]) = self.image.range();
        Spectrum::new(r, g, b) * self.scale
    }

    /// The place on the image that a direction (unit, pointing out of the scene) sees.
    #[inline]
    fn place(&self, d: Vec3) -> Vec2 {
        self.mapping.on_image(self.mapping.place(self.to_scene.transpose() * d), self.image.size().1)
    }

    /// Radiance arriving out of direction `d` (unit, pointing out of the scene).
    #[inline]
    pub fn le(&self, d: Vec3) -> Spectrum {
        let (width, height) = self.image.size();
        let size = (i64::from(width), i64::from(height));
        let at = self.place(d) * vec2(width as f32, height as f32) - 0.5;
        let corner = at.floor();
        let (column, row) = (corner.x as i64, corner.y as i64);
        let f = at - corner;
        let texel = |right: i64, down: i64| {
            let [r, g, b, _] = self.image.texel(self.mapping.texel(column + right, row + down, size));
            Spectrum::new(r, g, b)
        };
        let above = texel(0, 0) * (1.0 - f.x) + texel(1, 0) * f.x;
        let below = texel(0, 1) * (1.0 - f.x) + texel(1, 1) * f.x;
        (above * (1.0 - f.y) + below * f.y) * self.scale
    }

    /// The density \[1/sr\] with which a direction (unit, pointing out of the scene) is sampled.
    #[inline]
    pub fn pdf(&self, d: Vec3) -> f32 {
        let (column, row) = self.distribution.cell_at(self.place(d));
        self.distribution.pdf(column, row) * self.rows[row].per_solid_angle
    }

    /// A direction pointing out of the scene, and its density \[1/sr\].
    #[inline]
    fn sample(&self, u: Vec2) -> (Vec3, f32) {
        let (width, height) = self.image.size();
        let CellSample { column, row, within, pdf } = self.distribution.sample(u);
        let x = (column as f64 + f64::from(within.x)) / f64::from(width);
        let d = match self.mapping {
            Mapping::Equirectangular | Mapping::EquirectangularToPoles => {
                let [upper, lower] = self.rows[row].cosines;
                let cosine = upper + (lower - upper) * f64::from(within.y);
                longitude(x as f32, ((1.0 - cosine) * (1.0 + cosine)).max(0.0).sqrt() as f32, cosine as f32)
            }
            Mapping::EqualArea => {
                let y = (row as f64 + f64::from(within.y)) / f64::from(height);
                self.mapping.direction(vec2(x as f32, y as f32))
            }
        };
        (self.to_scene * d, pdf * self.rows[row].per_solid_angle)
    }

    /// The light end of paths that arrive from direction `d` (unit, pointing out of the scene).
    #[inline]
    fn endpoint(&self, d: Vec3) -> Endpoint {
        Endpoint { at: self.bounds.far_point(d), kind: EndpointKind::Infinite }
    }

    /// A direction nearly in proportion to its radiance.
    #[inline]
    pub fn sample_li(&self, u: Vec2) -> LiSample {
        let (wi, pdf) = self.sample(u);
        let (endpoint, li) = (self.endpoint(wi), self.le(wi));
        LiSample { endpoint, wi, distance: f32::INFINITY, li, pdf, delta: false }
    }

    /// A direction nearly in proportion to its radiance, and a position uniform over the disc across the scene.
    #[inline]
    pub fn sample_le(&self, u_p: Vec2, u_d: Vec2) -> LeSample {
        let (outwards, pdf_p) = self.sample(u_p);
        LeSample {
            endpoint: self.endpoint(outwards),
            ray: self.bounds.ray_in(outwards, u_d),
            le: self.le(outwards),
            pdf_p,
            pdf_d: self.bounds.disc_pdf_area(),
            cos: 1.0,
        }
    }

    /// The densities of a light walk in direction `d`: of its direction \[1/sr\] and of its position on the disc \[1/m²\].
    #[inline]
    pub fn pdf_le(&self, d: Vec3) -> (f32, f32) {
        (self.pdf(-d), self.bounds.disc_pdf_area())
    }
}

impl Row {
    fn new(mapping: Mapping, row: u32, (width, height): (u32, u32)) -> Self {
        let edges = [row, row + 1].map(|row| PI * mapping.upper_edge(row, height));
        let cosines = edges.map(f64::cos);
        let cells = f64::from(width) * f64::from(height);
        let solid_angle = match mapping {
            Mapping::Equirectangular | Mapping::EquirectangularToPoles => {
                // cos a − cos b = 2 sin((a + b)/2) sin((b − a)/2), which does not cancel near the poles.
                let [middle, half] = [0.5 * (edges[0] + edges[1]), 0.5 * (edges[1] - edges[0])];
                TAU / f64::from(width) * 2.0 * middle.sin() * half.sin()
            }
            Mapping::EqualArea => 2.0 * TAU / cells,
        };
        let per_solid_angle = (1.0 / (cells * solid_angle)) as f32;
        let per_solid_angle = fault!("environment_density_without_sine", per_solid_angle, 0.25 / PI as f32);
        Row { cosines, solid_angle, per_solid_angle }
    }
}

/// What each texel's solid angle is chosen by, the mean radiance there times the solid angle, and the radiance integrated over all
/// directions, both as means of the channels.
fn weights(given: &EnvironmentImage, rows: &[Row]) -> (Vec<f64>, f64) {
    let (width, height) = given.image.size();
    let size = (i64::from(width), i64::from(height));
    let scale = given.scale.to_array().map(f64::from);
    let grey = |column: i64, row: i64| -> f64 {
        let texel = given.image.texel(given.mapping.texel(column, row, size));
        (0..3).map(|channel| f64::from(texel[channel]) * scale[channel]).sum::<f64>() / 3.0
    };
    // The mean over a texel of what is interpolated between its centre and those of its neighbours.
    const SHARES: [f64; 3] = [0.125, 0.75, 0.125];
    let mean = |column: i64, row: i64| -> f64 {
        let across = |row: i64| (0..3).map(|i| SHARES[i] * grey(column + i as i64 - 1, row)).sum::<f64>();
        (0..3).map(|j| SHARES[j] * across(row + j as i64 - 1)).sum()
    };
    let mut weights = vec![0.0; width as usize * height as usize];
    weights.par_chunks_mut(width as usize).zip(rows).enumerate().for_each(
        |(row, (weights, Row { solid_angle, .. }))| {
            for (column, weight) in weights.iter_mut().enumerate() {
                *weight = mean(column as i64, row as i64) * solid_angle;
            }
        },
    );
    let sums = (0..size.1).map(|row| {
        (0..size.0).map(|column| grey(column, row)).sum::<f64>() * interpolated_solid_angle(given.mapping, row, size)
    });
    let integral = sums.sum();
    (weights, integral)
}

/// ∫ dω of the hat with which a texel of this row is interpolated.
fn interpolated_solid_angle(mapping: Mapping, row: i64, (width, height): (i64, i64)) -> f64 {
    if mapping == Mapping::EqualArea {
        return 2.0 * TAU / (width * height) as f64;
    }
    let whole = TAU / width as f64;
    if height == 1 {
        return 2.0 * whole;
    }
    // With the row's angle a and the rows' distance h, ∫ (1 − |t|/h) sin(a + t) dt over ±h is 2 sin a (1 − cos h)/h. Beyond the
    // centre of the first and of the last row their texels go on to the pole.
    let (h, angle) = match mapping {
        Mapping::EquirectangularToPoles => (PI / (height - 1) as f64, PI * row as f64 / (height - 1) as f64),
        _ => (PI / height as f64, PI * (row as f64 + 0.5) / height as f64),
    };
    let versine = 2.0 * (0.5 * h).sin().powi(2);
    if row > 0 && row < height - 1 {
        return whole * 2.0 * angle.sin() * versine / h;
    }
    if mapping == Mapping::EquirectangularToPoles {
        return whole * (1.0 - h.sin() / h);
    }
    let (sine, cosine) = (0.5 * h).sin_cos();
    whole * (1.0 - cosine + sine * versine / h + cosine * (1.0 - h.sin() / h))
}
