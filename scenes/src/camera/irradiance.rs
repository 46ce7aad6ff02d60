//! The irradiance meter.

use super::film::Raster;
use super::view::View;
use super::{CameraSettings, WeSample, WiSample};
use crate::error::SceneError;
use crate::ray::{Ray, SurfacePoint};
use glam::DVec3;
use sampling::filter::Filter;
use sampling::math::Frame;
use sampling::{Vec2, Vec3, vec2, warp};
use std::f32::consts::{FRAC_1_PI, PI};

/// Where an irradiance meter receives light.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Receiver {
    /// At its position.
    Point,
    /// On a rectangle about its position, with these sides to the right and up in its view \[m\].
    Rectangle([f64; 2]),
    /// On a disk about its position, of this radius \[m\].
    Disk(f64),
    /// On a sphere about its position, from outside, of this radius \[m\].
    Sphere(f64),
}

/// A surface that measures the irradiance that falls on its front, E = 1/A ∫∫ L cosθ dω dA \[W/m²\], the mean over its area A.
///
/// The image is the unit disc on which directions are projected along the normal, so that equal areas are equal projected solid
/// angles `[Shirley97, for the map of the square to the disc]`, and a pixel's value is the mean of radiance there, times π: with
/// one pixel the irradiance. Points uniform over the receiver and a raster position uniform over the image give directions of the
/// density cosθ/π, so that with the importance We = 1/A every sample has the weight π.
#[derive(Clone, Copy, Debug)]
pub struct Irradiance {
    pub(super) view: View,
    pub(super) raster: Raster,
    surface: Surface,
    /// Area of the receiver \[m²\]; 1 for a point.
    area: f32,
}

/// A receiver in `f32`.
#[derive(Clone, Copy, Debug)]
enum Surface {
    Point,
    /// Half of the sides.
    Rectangle(Vec2),
    Disk(f32),
    Sphere(f32),
}

impl Irradiance {
    /// What every sample weighs.
    pub(super) const WEIGHT: f32 = PI;

    pub(super) fn new(settings: &CameraSettings, receiver: Receiver, shift: DVec3) -> Result<Self, SceneError> {
        if settings.filter != Filter::Box {
            return Err(SceneError::invalid(
                format!("an irradiance meter has the filter `{}`", settings.filter),
                "leave its `filter` out: beyond its image there are no directions",
            ));
        }
        let lengths = match receiver {
            Receiver::Point => vec![],
            Receiver::Rectangle(sides) => sides.to_vec(),
            Receiver::Disk(radius) | Receiver::Sphere(radius) => vec![radius],
        };
        if let Some(length) = lengths.iter().find(|length| !(length.is_finite() && **length > 0.0)) {
            return Err(SceneError::invalid(
                format!("a length of the irradiance meter is {length}"),
                "give lengths above 0, in metres",
            ));
        }
        let (surface, area) = match receiver {
            Receiver::Point => (Surface::Point, 1.0),
            Receiver::Rectangle([a, b]) => (Surface::Rectangle(vec2(a as f32, b as f32) * 0.5), (a * b) as f32),
            Receiver::Disk(radius) => (Surface::Disk(radius as f32), PI * (radius * radius) as f32),
            Receiver::Sphere(radius) => (Surface::Sphere(radius as f32), 4.0 * PI * (radius * radius) as f32),
        };
        Ok(Irradiance { view: View::new(settings, shift)?, raster: Raster::of(settings)?, surface, area })
    }

    /// Whether it receives light at one point alone.
    pub(super) fn is_point(&self) -> bool {
        matches!(self.surface, Surface::Point)
    }

    /// The farthest that it reaches from its position \[m\].
    pub(super) fn reach(&self) -> f32 {
        match self.surface {
            Surface::Point => 0.0,
            Surface::Rectangle(half) => half.length(),
            Surface::Disk(radius) | Surface::Sphere(radius) => radius,
        }
    }

    /// A point uniform over the receiver.
    #[inline]
    fn sample_point(&self, u: Vec2) -> SurfacePoint {
        let View { position, forward, .. } = self.view;
        let (p, ng) = match self.surface {
            Surface::Point => (position, forward),
            Surface::Rectangle(half) => (self.view.point((2.0 * u - 1.0) * half), forward),
            Surface::Disk(radius) => (self.view.point(warp::uniform_disk(u) * radius), forward),
            Surface::Sphere(radius) => {
                let ng = warp::uniform_sphere(u);
                (position + ng * radius, ng)
            }
        };
        // It may lie on a surface of the scene, so that what it sees is asked for from a little before it.
        SurfacePoint::on_surface(p, ng, 4.0 * f32::EPSILON * self.reach())
    }

    /// The frame that directions at a point are measured in: of the view, but on a sphere.
    #[inline]
    fn frame(&self, ng: Vec3) -> Frame {
        match self.surface {
            Surface::Sphere(_) => Frame::from_z(ng),
            _ => Frame { x: self.view.right, y: self.view.up, z: ng },
        }
    }

    #[inline]
    pub(super) fn sample_we(&self, raster: Vec2, u: Vec2) -> WeSample {
        let at = self.sample_point(u);
        let Vec2 { x, y } = raster / self.raster.size();
        let local = warp::cosine_hemisphere(vec2(x, (1.0 - y).min(1.0_f32.next_down())));
        let d = self.frame(at.ng).to_world(local);
        let ray = Ray::new(at.offset_toward(d), d);
        WeSample { ray, at, weight: Self::WEIGHT, pdf_p: 1.0 / self.area, pdf_d: local.z * FRAC_1_PI }
    }

    /// The cosine at a point of the receiver, and the raster position, of a direction; None behind it.
    #[inline]
    fn project(&self, ng: Vec3, d: Vec3) -> Option<(f32, Vec2)> {
        let cos = d.dot(ng);
        if cos <= 0.0 {
            return None;
        }
        let local = self.frame(ng).to_local(d);
        let square = square_of(local.truncate());
        let size = self.raster.size();
        let inside = size.map(f32::next_down);
        Some((cos, (vec2(square.x, 1.0 - square.y) * size).clamp(Vec2::ZERO, inside)))
    }

    #[inline]
    pub(super) fn we(&self, at: &SurfacePoint, d: Vec3) -> Option<(f32, Vec2)> {
        let (_, raster) = self.project(at.ng, d)?;
        Some((1.0 / self.area, raster))
    }

    #[inline]
    pub(super) fn pdf_we(&self, at: &SurfacePoint, d: Vec3) -> (f32, f32) {
        (1.0 / self.area, d.dot(at.ng).max(0.0) * FRAC_1_PI)
    }

    #[inline]
    pub(super) fn sample_wi(&self, p_ref: Vec3, u: Vec2) -> Option<WiSample> {
        let at = self.sample_point(u);
        let to_camera = at.p - p_ref;
        let squared = to_camera.length_squared();
        if squared == 0.0 {
            return None;
        }
        let wi = to_camera * squared.sqrt().recip();
        let (cos, raster) = self.project(at.ng, -wi)?;
        Some(WiSample { at, wi, raster, we: 1.0 / self.area, pdf: squared / (cos * self.area) })
    }
}

/// The place on the unit square that the concentric map carries to a point of the unit disc.
#[inline]
fn square_of(p: Vec2) -> Vec2 {
    let r = p.length();
    let across = |p: f32, q: f32| 4.0 * FRAC_1_PI * (p / q).atan();
    let signed = if r == 0.0 {
        Vec2::ZERO
    } else if p.x.abs() > p.y.abs() {
        let along = r.copysign(p.x);
        vec2(along, along * across(p.y, p.x))
    } else {
        let along = r.copysign(p.y);
        vec2(along * across(p.x, p.y), along)
    };
    0.5 + 0.5 * signed
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::camera::{Camera, Projection, Rays};
    use crate::test_support::Random;
    use glam::dvec3;
    use std::f32::consts::TAU;

    const RECEIVERS: [Receiver; 4] =
        [Receiver::Point, Receiver::Rectangle([2.0, 0.5]), Receiver::Disk(0.7), Receiver::Sphere(1.3)];

    fn meters() -> Vec<Camera> {
        let (position, target) = (dvec3(1.0, 2.0, 3.0), dvec3(0.5, 1.0, -2.0));
        let settings = CameraSettings::pinhole(position, target, 40.0, (3, 2));
        let meter = |receiver| CameraSettings { projection: Projection::Irradiance(receiver), ..settings };
        RECEIVERS.map(|receiver| Camera::new(&meter(receiver), DVec3::ZERO).unwrap()).to_vec()
    }

    #[test]
    fn the_square_is_what_the_disc_is_made_of() {
        let mut random = Random::new(90);
        for _ in 0..20_000 {
            let u = random.next_2d();
            assert!(square_of(warp::uniform_disk(u)).distance(u) < 1e-5, "{u}");
        }
        assert_eq!(square_of(Vec2::ZERO), vec2(0.5, 0.5));
    }

    #[test]
    fn what_a_meter_samples_is_what_it_evaluates() {
        let mut random = Random::new(91);
        for meter in meters() {
            assert_eq!(meter.rays() == Rays::FromPoint, matches!(&meter, Camera::Irradiance(own) if own.is_point()));
            for _ in 0..5000 {
                let (u, raster) = (random.next_2d(), random.next_2d() * vec2(3.0, 2.0));
                let sample = meter.sample_we(raster, u);
                let (pdf_p, pdf_d) = meter.pdf_we(&sample.at, sample.ray.d);
                let cos = sample.ray.d.dot(sample.at.ng);
                assert!(pdf_p == sample.pdf_p && (pdf_d - sample.pdf_d).abs() < 1e-6 && cos >= -1e-6);
                let Some((we, back)) = meter.we(&sample.at, sample.ray.d).filter(|_| cos > 1e-3) else { continue };
                assert!(back.distance(raster) < 1e-4 / cos, "{meter}: {back} {raster}");
                assert!((we * cos / (pdf_p * pdf_d) / PI - 1.0).abs() < 1e-3 && sample.weight == meter.weight());
                let p = sample.ray.at(2.0);
                let seen = meter.sample_wi(p, u).expect("it is before the receiver");
                let pdf = p.distance_squared(seen.at.p) / cos * pdf_p;
                assert!(seen.at.p == sample.at.p && seen.we == we && (seen.pdf / pdf - 1.0).abs() < 2e-3);
            }
        }
    }

    /// By the midpoint rule over directions: the importance of a point that lies for certain, times the cosine, is π in all.
    #[test]
    fn the_importance_of_all_directions_is_pi() {
        const ROWS: usize = 800;
        for meter in meters() {
            let at = meter.sample_we(Vec2::ONE, vec2(0.3, 0.6)).at;
            let (mut importance, mut density) = (0.0, 0.0);
            for (row, column) in (0..ROWS).flat_map(|row| (0..ROWS).map(move |column| (row, column))) {
                let z = 1.0 - (2 * row + 1) as f32 / ROWS as f32;
                let (sin, cos) = (TAU * (column as f32 + 0.5) / ROWS as f32).sin_cos();
                let d = (vec2(cos, sin) * (1.0 - z * z).sqrt()).extend(z);
                let (pdf_p, pdf_d) = meter.pdf_we(&at, d);
                density += f64::from(pdf_d);
                importance += meter.we(&at, d).map_or(0.0, |(we, _)| f64::from(we * d.dot(at.ng) / pdf_p));
            }
            let cell = f64::from(4.0 * PI) / (ROWS * ROWS) as f64;
            assert!((density * cell - 1.0).abs() < 3e-3 && (importance * cell / f64::from(PI) - 1.0).abs() < 3e-3);
        }
    }

    #[test]
    fn lengths_and_filters_are_checked() {
        let settings = CameraSettings::pinhole(DVec3::ZERO, DVec3::Z, 40.0, (1, 1));
        let fault = |receiver, filter| {
            let settings = CameraSettings { projection: Projection::Irradiance(receiver), filter, ..settings };
            Camera::new(&settings, DVec3::ZERO).err().map(|error| error.to_string()).unwrap_or_default()
        };
        assert!(fault(Receiver::Disk(0.0), Filter::Box).contains("length"));
        assert!(fault(Receiver::Rectangle([1.0, f64::NAN]), Filter::Box).contains("length"));
        assert!(fault(Receiver::Point, Filter::Gaussian).contains("filter"));
    }
}
