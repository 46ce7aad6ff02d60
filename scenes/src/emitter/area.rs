//! Surfaces that emit.

use super::{Endpoint, EndpointKind, LeSample, LiSample};
use crate::ray::SurfacePoint;
use crate::shape::{Cylinder, Disk, FewTriangles, Parallelogram, Rectangle, SeenTriangles, Sphere, Triangle};
use crate::surface::{Attributes, Chart};
use crate::texture::{SurfaceCoordinates, Texture};
use glam::Vec2Swizzles;
use sampling::fault;
use sampling::math::{Frame, Spectrum};
use sampling::warp::SphericalRectangle;
use sampling::{Vec2, Vec3, measure, vec2, warp};
use std::f64::consts::PI;

/// What a shape emits.
#[derive(Clone, Debug, PartialEq)]
pub struct Emission {
    /// Radiance \[W/(m²·sr)\], finite and not negative.
    pub radiance: Texture,
    /// True if the back emits as the front does.
    pub two_sided: bool,
}

/// The area an emitter samples.
#[derive(Clone, Debug)]
pub enum AreaShape {
    /// A parallelogram.
    Quad(Parallelogram),
    /// A parallelogram whose angles are right.
    Rectangle(Box<Rectangle>),
    /// A sphere.
    Sphere(Sphere),
    /// A disk.
    Disk(Box<Disk>),
    /// A cylinder.
    Cylinder(Box<Cylinder>),
    /// A mesh: a triangle is chosen in proportion to its area, or to its solid angle from near few of them.
    Mesh {
        /// The triangles with their front normals.
        triangles: Vec<(Triangle, Vec3)>,
        /// The sum of the areas up to and including each triangle \[m²\].
        cumulative: Vec<f64>,
        /// As they are sampled from near them, if they are few.
        few: Option<Box<FewTriangles>>,
    },
}

/// How next-event estimation places points on surfaces that emit. Neither changes a mean.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum PointRule {
    /// By the solid angle that is seen from the point to be lit: spheres always; rectangles, and meshes of few triangles, from near them.
    #[default]
    SolidAngle,
    /// Uniform over the area.
    Area,
}

impl PointRule {
    /// The names by which it is chosen.
    pub const NAMES: [&str; 2] = ["solid_angle", "area"];
    /// All of them, in the order of their names.
    pub const ALL: [Self; 2] = [Self::SolidAngle, Self::Area];

    /// Its name.
    pub fn name(self) -> &'static str {
        Self::NAMES[self as usize]
    }
}

/// The area as it is seen from a point near it.
enum Near<'a> {
    Rectangle(&'a Rectangle, SphericalRectangle),
    Triangles(&'a [(Triangle, Vec3)], SeenTriangles<'a>),
}

impl Near<'_> {
    /// The density of points on it [1/sr].
    #[inline]
    fn pdf(&self) -> f32 {
        match self {
            Near::Rectangle(_, seen) => seen.pdf(),
            Near::Triangles(_, seen) => seen.pdf(),
        }
    }

    /// A point uniform over the solid angle that is seen; None if that is dark.
    #[inline]
    fn sample(&self, u: Vec2) -> Option<Sampled> {
        match self {
            Near::Rectangle(rectangle, seen) => {
                let b = seen.sample(u);
                Some(Sampled::whole(rectangle.quad.sample(b), b))
            }
            Near::Triangles(triangles, seen) => {
                let (index, b) = (seen.solid_angle() > 0.0).then(|| seen.sample(u))?;
                Some(Sampled::on_mesh(triangles, index, b))
            }
        }
    }
}

/// The coordinates in which the radiance at sampled points is read.
#[derive(Clone, Debug)]
pub(crate) enum AreaChart {
    /// Those of the sample itself, the other way round if the quad is turned.
    Quad { turned: bool },
    /// Those of an analytic surface.
    Analytic(Chart),
    /// Those of the mesh, whose triangles are counted from the emitter's first.
    Mesh(Attributes),
}

/// A point sampled on the area.
struct Sampled {
    at: SurfacePoint,
    /// The triangle of a mesh.
    triangle: u32,
    /// Its place: barycentric coordinates of the vertices 1 and 2 of a triangle, shares of the edges of a quad.
    b: Vec2,
}

impl Sampled {
    #[inline]
    fn whole(at: SurfacePoint, b: Vec2) -> Self {
        Sampled { at, triangle: 0, b }
    }

    #[inline]
    fn on_mesh(triangles: &[(Triangle, Vec3)], index: usize, b: Vec2) -> Self {
        let (triangle, ng) = &triangles[index];
        let ng = fault!("sampled_normals_turned_over", *ng, -*ng);
        Sampled { at: triangle.point([b.x.into(), b.y.into()], ng), triangle: index as u32, b }
    }
}

/// A surface that emits, with the same radiance in all directions of its front (or of both sides).
#[derive(Clone, Debug)]
pub struct AreaEmitter {
    /// What is sampled.
    pub shape: AreaShape,
    /// What it emits.
    pub emission: Emission,
    /// Surface area \[m²\], one side.
    pub area: f32,
    /// Mean radiance over the area; for what is read by coordinates only nearly.
    pub mean_radiance: Spectrum,
    /// How points on it are sampled for a point to be lit.
    pub points: PointRule,
    /// Where the radiance is read by texture coordinates or vertex colours, those of sampled points.
    pub(crate) chart: Option<Box<AreaChart>>,
}

impl AreaEmitter {
    /// Emitted power \[W\], the mean of the channels: π·A·(mean radiance), twice that if two-sided.
    pub fn power(&self) -> f64 {
        let sides = if self.emission.two_sided { 2.0 } else { 1.0 };
        sides * PI * f64::from(self.area) * f64::from(self.mean_radiance.mean())
    }

    /// The radiance emitted in direction `w` (unit, away from the surface) at a point with this front normal which emits `emitted`:
    /// that, or zero on a dark side.
    #[inline]
    pub fn le(&self, emitted: Spectrum, ng: Vec3, w: Vec3) -> Spectrum {
        let front = fault!("emitter_shines_from_its_back", ng.dot(w) > 0.0, true);
        if self.emission.two_sided || front { emitted } else { Spectrum::ZERO }
    }

    /// The radiance at a sampled point.
    #[inline]
    fn emitted(&self, sampled: &Sampled) -> Spectrum {
        match &self.emission.radiance {
            Texture::Constant(radiance) => *radiance,
            varying => varying.at(&self.coordinates(sampled)),
        }
    }

    #[inline(never)]
    fn coordinates(&self, sampled: &Sampled) -> SurfaceCoordinates {
        let Sampled { at, triangle, b } = sampled;
        match self.chart.as_deref() {
            None => SurfaceCoordinates::of(at.p),
            Some(AreaChart::Quad { turned }) => {
                let uv = if fault!("emission_read_at_turned_coordinates", *turned, !*turned) { b.yx() } else { *b };
                SurfaceCoordinates { uv, ..SurfaceCoordinates::of(at.p) }
            }
            Some(AreaChart::Analytic(chart)) => chart.coordinates(at.p, at.ng),
            Some(AreaChart::Mesh(attributes)) => attributes.coordinates(at.p, *triangle, *b),
        }
    }

    /// The mean radiance at these points of the unit square, as they are taken to the area.
    pub(crate) fn mean_over(&self, points: impl Iterator<Item = Vec2>) -> Spectrum {
        let (mut sum, mut count) = ([0.0f64; 3], 0.0);
        for u in points {
            let radiance = self.emitted(&self.sample_area(u)).to_array();
            sum.iter_mut().zip(radiance).for_each(|(sum, value)| *sum += f64::from(value));
            count += 1.0;
        }
        Spectrum::from(sum.map(|sum| (sum / count) as f32))
    }

    /// A point uniform over the area.
    #[inline]
    fn sample_area(&self, u: Vec2) -> Sampled {
        match &self.shape {
            AreaShape::Quad(quad) => Sampled::whole(quad.sample(u), u),
            AreaShape::Rectangle(rectangle) => Sampled::whole(rectangle.quad.sample(u), u),
            AreaShape::Sphere(sphere) => Sampled::whole(sphere.sample_area(u).at, u),
            AreaShape::Disk(disk) => Sampled::whole(disk.sample(u), u),
            AreaShape::Cylinder(cylinder) => Sampled::whole(cylinder.sample(u), u),
            AreaShape::Mesh { triangles, cumulative, .. } => {
                let (index, rest) = warp::choose(cumulative, u.x);
                let b = warp::uniform_triangle(vec2(rest, u.y));
                Sampled::on_mesh(triangles, index, vec2(b.y, b.z))
            }
        }
    }

    /// A sampled point where rays can leave it, inside of what adjoins its triangle at the edges.
    #[inline]
    fn off_edges(&self, &Sampled { at, triangle, b }: &Sampled) -> SurfacePoint {
        match &self.shape {
            AreaShape::Quad(quad) => quad.off_edges(at, b),
            AreaShape::Rectangle(rectangle) => rectangle.quad.off_edges(at, b),
            AreaShape::Mesh { triangles, .. } => triangles[triangle as usize].0.off_edges(at, [b.x.into(), b.y.into()]),
            AreaShape::Sphere(_) | AreaShape::Disk(_) | AreaShape::Cylinder(_) => at,
        }
    }

    /// A sphere whose outside emits is sampled by the cone it fills, where it is seen from outside.
    #[inline]
    fn cone_sphere(&self) -> Option<&Sphere> {
        match &self.shape {
            AreaShape::Sphere(sphere)
                if self.points == PointRule::SolidAngle && (self.emission.two_sided || !sphere.flipped) =>
            {
                Some(sphere)
            }
            _ => None,
        }
    }

    /// A rectangle, or few triangles, near the point to be lit are sampled by the solid angle that they fill there.
    #[inline]
    fn near(&self, p_ref: Vec3) -> Option<Near<'_>> {
        if self.points == PointRule::Area {
            return None;
        }
        match &self.shape {
            AreaShape::Rectangle(rectangle) => Some(Near::Rectangle(rectangle, rectangle.seen_from(p_ref)?)),
            AreaShape::Mesh { triangles, few: Some(few), .. } => {
                Some(Near::Triangles(triangles, few.seen_from(p_ref)?))
            }
            _ => None,
        }
    }

    /// Whether all of it is known to be seen from behind, where nothing is emitted.
    #[inline]
    fn is_dark_from(&self, p_ref: Vec3) -> bool {
        matches!(&self.shape, AreaShape::Rectangle(rectangle) if !self.emission.two_sided && rectangle.is_behind(p_ref))
    }

    /// A point of the surface for a point to be lit; None if that point is on a side that is dark.
    #[inline]
    pub fn sample_li(&self, p_ref: Vec3, u: Vec2) -> Option<LiSample> {
        if let Some(cone) = self.cone_sphere().and_then(|sphere| sphere.sample_cone(p_ref, u)) {
            return Some(LiSample {
                endpoint: Endpoint { at: cone.at, kind: EndpointKind::Surface },
                wi: cone.wi,
                distance: cone.distance,
                li: self.emitted(&Sampled::whole(cone.at, u)),
                pdf: cone.pdf,
                delta: false,
            });
        }
        if self.is_dark_from(p_ref) {
            return None;
        }
        let near = self.near(p_ref);
        let sampled = match &near {
            Some(near) => near.sample(u)?,
            None => self.sample_area(u),
        };
        let at = sampled.at;
        let to_emitter = at.p - p_ref;
        let distance = to_emitter.length();
        let wi = to_emitter / distance;
        let cos = -wi.dot(at.ng);
        let faces = cos > 0.0 || (self.emission.two_sided && cos < 0.0);
        if !faces {
            return None;
        }
        Some(LiSample {
            endpoint: Endpoint { at, kind: EndpointKind::Surface },
            wi,
            distance,
            li: self.emitted(&sampled),
            pdf: self.pdf_towards(p_ref, &at, near.as_ref()),
            delta: false,
        })
    }

    /// The density of `sample_li` at a point of the surface \[1/sr\]; 0 where it faces away.
    #[inline]
    pub fn pdf_li(&self, p_ref: Vec3, at: &SurfacePoint, wi: Vec3) -> f32 {
        let cos = -wi.dot(at.ng);
        let faces = cos > 0.0 || (self.emission.two_sided && cos < 0.0);
        if !faces {
            return 0.0;
        }
        if let Some(pdf) = self.cone_sphere().and_then(|sphere| sphere.pdf_cone(p_ref)) {
            return pdf;
        }
        let pdf = self.pdf_towards(p_ref, at, self.near(p_ref).as_ref());
        fault!("area_density_not_converted", pdf, 1.0 / self.area)
    }

    /// The density [1/sr] of a point of what is sampled by area, or as it is seen from near it.
    #[inline]
    fn pdf_towards(&self, p_ref: Vec3, at: &SurfacePoint, near: Option<&Near>) -> f32 {
        match near {
            Some(near) => near.pdf(),
            None => measure::area_to_solid_angle(1.0 / self.area, p_ref, at.p, at.ng),
        }
    }

    /// A position uniform over the area and a direction in proportion to the cosine; both sides alike if two-sided.
    #[inline]
    pub fn sample_le(&self, u_p: Vec2, u_d: Vec2) -> Option<LeSample> {
        let sampled = self.sample_area(u_p);
        let at = self.off_edges(&sampled);
        let (normal, u_d) = self.choose_side(at.ng, u_d);
        let local = warp::cosine_hemisphere(u_d);
        if local.z <= 0.0 {
            return None;
        }
        let d = Frame::from_z(normal).to_world(local);
        Some(LeSample {
            endpoint: Endpoint { at, kind: EndpointKind::Surface },
            ray: at.spawn(d),
            le: self.emitted(&sampled),
            pdf_p: 1.0 / self.area,
            pdf_d: self.side_pmf() * warp::cosine_hemisphere_pdf(local.z),
            cos: fault!("emitter_cosine_dropped", local.z, 1.0),
        })
    }

    /// The densities of `sample_le`: of the position \[1/m²\] and of the direction \[1/sr\], 0 on a dark side.
    #[inline]
    pub fn pdf_le(&self, at: &SurfacePoint, d: Vec3) -> (f32, f32) {
        let cos = at.ng.dot(d);
        let lit = if self.emission.two_sided { cos.abs() } else { cos.max(0.0) };
        (1.0 / self.area, self.side_pmf() * warp::cosine_hemisphere_pdf(lit))
    }

    #[inline]
    fn side_pmf(&self) -> f32 {
        if self.emission.two_sided { fault!("density_of_both_sides", 0.5, 1.0) } else { 1.0 }
    }

    /// The normal of the side to emit from, and what is left of the random numbers.
    #[inline]
    fn choose_side(&self, ng: Vec3, u: Vec2) -> (Vec3, Vec2) {
        if !self.emission.two_sided {
            return (ng, u);
        }
        if u.x < 0.5 { (ng, vec2(2.0 * u.x, u.y)) } else { (-ng, vec2(2.0 * u.x - 1.0, u.y)) }
    }
}
