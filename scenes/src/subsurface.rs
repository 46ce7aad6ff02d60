//! Bodies through which light goes: materials with a BSSRDF.

use crate::accel::Primitive;
use crate::interaction::Interaction;
use crate::material::{Material, MaterialId};
use crate::ray::{Ray, SurfacePoint};
use crate::scene::{BoundingSphere, Scene};
use crate::shape::{Analytic, Triangle};
use crate::surface::{AnalyticInfo, Surface, TriangleInfo};
use sampling::Vec3;
use sampling::bsdf::{Bsdf, Plastic};
use sampling::math::Spectrum;
use sampling::subsurface::Subsurface;

/// A margin for the rounding of a bounding sphere and of lines that pass it, relative to the lengths that come into it.
const MARGIN: f32 = 1e-5;

/// A material of which all surfaces together bound one body, of any number of pieces.
///
/// Its BSDF is the boundary's reflection alone, a smooth one; what comes through the body is for methods that know of it.
/// A surface is looked at from either side, and the body lies on the other.
#[derive(Clone, Debug)]
pub struct Body {
    /// What the scene calls the material.
    pub name: String,
    /// What light does in it.
    pub subsurface: Subsurface,
    boundary: Bsdf,
    /// A sphere around its surfaces.
    bounds: BoundingSphere,
}

impl Body {
    /// A body of a material that is called so.
    pub fn new(name: &str, subsurface: Subsurface) -> Self {
        let boundary = Plastic::new(Spectrum::ZERO, subsurface.eta()).into();
        let bounds = BoundingSphere { center: Vec3::ZERO, radius: 0.0 };
        Self { name: name.to_owned(), subsurface, boundary, bounds }
    }

    /// The reflection at its boundary.
    #[inline]
    pub(crate) fn boundary(&self) -> Bsdf {
        self.boundary
    }

    /// The part of the line through `p` along the unit vector `axis` that may meet its surfaces.
    fn line(&self, p: Vec3, axis: Vec3) -> Option<Ray> {
        let BoundingSphere { center, radius } = self.bounds;
        let to_center = center - p;
        let along = to_center.dot(axis);
        let reach = radius + MARGIN * (radius + to_center.length() + center.length());
        if (to_center - axis * along).length_squared() > reach * reach {
            return None;
        }
        Some(Ray { o: p + axis * (along - reach), d: axis, t_max: 2.0 * reach })
    }
}

impl From<Body> for Material {
    fn from(body: Body) -> Self {
        Self::Subsurface(Box::new(body))
    }
}

impl Scene {
    /// The body whose boundary a surface point belongs to, if it belongs to one.
    #[inline]
    pub fn body_of(&self, it: &Interaction) -> Option<&Body> {
        if !self.needs.subsurface {
            return None;
        }
        match &self.materials[self.material_of(it).0 as usize] {
            Material::Subsurface(body) => Some(body),
            _ => None,
        }
    }

    pub(crate) fn material_of(&self, it: &Interaction) -> MaterialId {
        self.surfaces[it.surface.0 as usize].material
    }

    /// The bodies, as materials in the order of the scene.
    pub fn bodies(&self) -> impl Iterator<Item = &Body> {
        let used = |material: usize| self.surfaces.iter().any(|surface| surface.material.0 as usize == material);
        self.materials.iter().enumerate().filter_map(move |(index, material)| match material {
            Material::Subsurface(body) if used(index) => Some(&**body),
            _ => None,
        })
    }

    /// Appends every surface point of `it`'s body on the unbounded line through `p` along the unit vector `axis`, in order
    /// along it. Whatever else the line meets is left out.
    pub fn crossings(&self, it: &Interaction, p: Vec3, axis: Vec3, points: &mut Vec<Interaction>) {
        let Some(line) = self.body_of(it).and_then(|body| body.line(p, axis)) else { return };
        let material = self.material_of(it);
        let of_body = |surface: u32| self.surfaces[surface as usize].material == material;
        let wanted = |primitive| match primitive {
            Primitive::Triangle(id) => of_body(self.triangles[id as usize].surface),
            Primitive::Analytic(id) => of_body(self.analytic[id as usize].surface),
        };
        let first = points.len();
        self.accel.all(&line, wanted, |hit| points.push(self.interaction(hit, axis)));
        // Where two are equally far, as at an edge, any order will do that is the same for all arrangements.
        let rank = |a: &SurfacePoint, b: &SurfacePoint| {
            let differing = a.ng.to_array().into_iter().zip(b.ng.to_array()).map(|(a, b)| a.total_cmp(&b));
            differing.fold(std::cmp::Ordering::Equal, std::cmp::Ordering::then)
        };
        points[first..].sort_unstable_by(|a, b| a.t.total_cmp(&b.t).then_with(|| rank(&a.point, &b.point)));
    }
}

/// Where surfaces are, for [`bound`].
pub(crate) struct Places<'a> {
    pub surfaces: &'a [Surface],
    pub triangles: &'a [Triangle],
    pub infos: &'a [TriangleInfo],
    pub analytic: &'a [Analytic],
    pub analytic_infos: &'a [AnalyticInfo],
    /// The surfaces of each instance, and the corners of its box.
    pub placed: &'a [(&'a [Surface], [Vec3; 8])],
}

/// Notes of every body where its surfaces are.
pub(crate) fn bound(materials: &mut [Material], places: &Places) {
    for (index, material) in materials.iter_mut().enumerate() {
        let Material::Subsurface(body) = material else { continue };
        let material = MaterialId(index as u32);
        let own = |surface: u32| places.surfaces[surface as usize].material == material;
        let holds = |surfaces: &[Surface]| surfaces.iter().any(|surface| surface.material == material);
        let placed = places.placed.iter().filter(|(surfaces, _)| holds(surfaces)).flat_map(|(_, corners)| corners);
        let triangles = places.triangles.iter().zip(places.infos).filter(|(_, info)| own(info.surface));
        let vertices = triangles.flat_map(|(triangle, _)| triangle.0).map(|vertex| (vertex, 0.0));
        let analytic = places.analytic.iter().zip(places.analytic_infos).filter(|(_, info)| own(info.surface));
        let balls = vertices.chain(analytic.flat_map(|(surface, _)| surface.balls()));
        let balls: Vec<(Vec3, f32)> = balls.chain(placed.map(|&corner| (corner, 0.0))).collect();
        let (low, high) = balls
            .iter()
            .fold((Vec3::INFINITY, Vec3::NEG_INFINITY), |(low, high), (p, r)| (low.min(p - *r), high.max(p + *r)));
        if low.is_finite() {
            let center = (low + high) * 0.5;
            let radius = balls.iter().map(|(p, r)| p.distance(center) + r).fold(0.0, f32::max);
            body.bounds = BoundingSphere { center, radius };
        }
    }
}
