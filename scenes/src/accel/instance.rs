//! Instances: trees that are kept once, in coordinates of their own, and placed many times.
//!
//! A ray that meets the box of an instance is taken into the coordinates of its group in `f64`, and moved forward until it is near
//! the surfaces there. Its direction is not normalised, so that parameters mean the same inside and outside, but for where they
//! start. In which triangle the line is, is decided for the ray rounded once, the same for all that the instance holds, so that nothing
//! leaks between its neighbours; on which side of a triangle's plane the origin is, and where an analytic surface is met, is
//! decided in `f64` without that rounding.

use super::block::LANES;
use super::crossings::Primitive;
use super::query::{Line, Query};
use super::{ANALYTIC, Accel, Best, Hit, Kernel, Meeting, PLACED, Placed};
use crate::ray::{Ray, UNIT_ROUNDOFF, rounding};
use crate::shape::{Analytic, Triangle, margin};
use glam::{DAffine3, DMat3, DVec3};
use sampling::Vec3;
use sampling::fault;

/// A group that is placed somewhere.
#[derive(Clone, Debug)]
pub(crate) struct Instance {
    /// From the group's coordinates to the scene's.
    pub to_world: DAffine3,
    /// And back.
    to_local: DAffine3,
    /// Which group.
    pub prototype: u32,
    /// What rounding in `f64` leaves of a position, relative to the position.
    residual: f32,
}

/// What is placed: surfaces in coordinates of their own.
#[derive(Clone, Debug)]
pub(crate) struct Prototype {
    accel: Accel,
    /// The ids of its first triangle and of its first analytic surface.
    first: [u32; 2],
    triangles: u64,
    /// The box around it.
    low: Vec3,
    high: Vec3,
    /// A ball around it.
    middle: DVec3,
    reach: f64,
}

/// A ray in the coordinates of a group.
struct Within {
    ray: Ray,
    /// Its origin and direction, not rounded.
    exact: [DVec3; 2],
    /// The parameter of the ray outside where this one begins.
    start: f64,
    /// The end of its interval.
    t_max: f64,
}

impl Within {
    #[inline]
    fn line(&self) -> Line<'_> {
        Line { ray: &self.ray, exact: Some(&self.exact) }
    }
}

impl Instance {
    /// An instance of a prototype; None where the transform cannot be undone, or not well enough.
    pub fn new(to_world: DAffine3, prototype: u32) -> Option<Self> {
        /// Entries beyond this, or below its reciprocal, could leave the range of `f32` when multiplied.
        const MOST: f64 = 1e12;
        let to_local = to_world.inverse();
        let norm = |m: &DMat3| m.to_cols_array().iter().map(|entry| entry * entry).sum::<f64>().sqrt();
        let (there, back) = (norm(&to_world.matrix3), norm(&to_local.matrix3));
        // The condition number bounds by how much rounding grows on the way there and back.
        let condition = there * back;
        let good = to_world.is_finite() && to_local.is_finite() && there <= MOST && back <= MOST && condition <= 1e8;
        let residual = (condition * 64.0 * f64::EPSILON) as f32;
        good.then_some(Instance { to_world, to_local, prototype, residual })
    }

    /// A point of the group's surfaces, in its own coordinates.
    #[inline]
    pub fn to_local(&self, p: Vec3) -> Vec3 {
        self.to_local.transform_point3(p.as_dvec3()).as_vec3()
    }

    /// Where a triangle of the group is met, off its edges by what is rounded there and in the scene: barycentric coordinates, and the point
    /// in the scene.
    fn off_edges(&self, corners: [Vec3; 3], at: Meeting) -> ([f64; 2], DVec3) {
        let local = corners.map(Vec3::as_dvec3);
        let placed = local.map(|corner| self.to_world.transform_point3(corner));
        let b = margin::off_placed_edges(&placed, &local, at.b);
        (b, if b == at.b { self.to_world.transform_point3(at.p) } else { margin::point(&placed, b) })
    }

    /// A vector along the group's surfaces, in the scene.
    #[inline]
    pub fn vector_to_world(&self, v: Vec3) -> Vec3 {
        self.to_world.transform_vector3(v.as_dvec3()).as_vec3()
    }

    /// A normal of the group's surfaces, in the scene, unit: normals are covectors and go with the inverse transpose, which keeps
    /// them on the image of their side whether the transform mirrors or not.
    #[inline]
    pub fn normal_to_world(&self, n: Vec3) -> Vec3 {
        self.covector_to_world(n.as_dvec3()).normalize_or_zero().as_vec3()
    }

    /// The normal that in the scene is `n`, unit.
    #[inline]
    pub fn normal_to_local(&self, n: Vec3) -> Vec3 {
        self.covector_to_local(n).normalize_or_zero().as_vec3()
    }

    #[inline]
    fn covector_to_world(&self, n: DVec3) -> DVec3 {
        fault!("normals_by_the_matrix", self.to_local.matrix3.transpose(), self.to_world.matrix3) * n
    }

    #[inline]
    fn covector_to_local(&self, n: Vec3) -> DVec3 {
        self.to_world.matrix3.transpose() * n.as_dvec3()
    }

    /// How far rays that leave the point `p` with the normal `ng` are to be moved along it, in the scene: the `p_error` of
    /// [`SurfacePoint`](crate::SurfacePoint). `residual` is the error of points of the surface in the group's own coordinates.
    ///
    /// With the transform x ↦ Mx + t, a plane of normal n has the normal m = M⁻ᵀn / |M⁻ᵀn| in the scene, and a displacement e in
    /// the group's coordinates moves a point by m·Me = n·e / |M⁻ᵀn| = n·e |Mᵀm| away from the plane. So distances along the normal
    /// grow by |Mᵀm|, however the transform stretches otherwise. What can be wrong:
    ///
    /// 1. `p` has been rounded once, from `f64`, and what is added to it is rounded once more: `rounding(p)`, as for all surfaces.
    /// 2. The point in the group's coordinates is within `residual` of the surface: |Mᵀm| times that.
    /// 3. The ray is taken back in `f64`. Products with M⁻¹ are off by a few 2⁻⁵³ |M⁻¹| |p|, and along the normal by |Mᵀm| times that,
    ///    at most the condition number of M times a few 2⁻⁵³ |p|.
    /// 4. In which triangle a ray's line lies is decided for the line rounded to `f32`, the origin by 2⁻²⁴ of each coordinate, which
    ///    changes the distance to the plane of n by at most Σ|nᵢ| 2⁻²⁴ |oᵢ|, or `rounding` of the place in the group. The side of
    ///    the plane itself does not depend on this; but at an edge the ray may be tested against the neighbour instead, and the
    ///    point is then as far above that one's plane as from where it would have been tested.
    #[inline]
    pub fn p_error(&self, p: Vec3, ng: Vec3, residual: f32) -> f32 {
        let growth = self.covector_to_local(ng).length() as f32;
        let local = self.to_local(p);
        let far = self.to_world.translation.abs().max_element() as f32 + p.abs().max_element();
        rounding(p) + growth * (rounding(local) + residual) + self.residual * far
    }
}

impl Prototype {
    /// Takes the accelerated surfaces of a group, whose first triangle and analytic surface have these ids.
    pub fn new(triangles: &[Triangle], analytic: Vec<Analytic>, first: [u32; 2], skip: crate::needs::Skip) -> Self {
        let corners = |surface: &Analytic| <[Vec3; 2]>::from(surface.extent());
        let points = || triangles.iter().flat_map(|t| t.0).chain(analytic.iter().flat_map(corners));
        let (low, high) =
            points().fold((Vec3::INFINITY, Vec3::NEG_INFINITY), |(low, high), p| (low.min(p), high.max(p)));
        let middle = (low.as_dvec3() + high.as_dvec3()) * 0.5;
        // With room for the rounding of where a ray begins.
        let room = 4.0 * f64::from(UNIT_ROUNDOFF) * middle.abs().max_element();
        let reach = (high.as_dvec3() - low.as_dvec3()).length() * 0.5 * (1.0 + 1e-6) + room;
        let count = triangles.len() as u64;
        let accel = Accel::build(triangles, analytic, skip);
        Prototype { accel, first, triangles: count, low, high, middle, reach }
    }

    /// The corners of its box, in the scene.
    pub fn corners(&self, to_world: &DAffine3) -> [DVec3; 8] {
        let (low, high) = (self.low.as_dvec3(), self.high.as_dvec3());
        std::array::from_fn(|i| {
            let pick = |bit: usize| i >> bit & 1 == 1;
            to_world.transform_point3(DVec3::select(glam::BVec3::new(pick(0), pick(1), pick(2)), high, low))
        })
    }

    /// The lowest and the highest coordinates in the scene, rounded outwards.
    pub fn extent(&self, to_world: &DAffine3) -> (Vec3, Vec3) {
        let corners = self.corners(to_world);
        let low = corners.iter().fold(DVec3::INFINITY, |low, p| low.min(*p)).as_vec3();
        let high = corners.iter().fold(DVec3::NEG_INFINITY, |high, p| high.max(*p)).as_vec3();
        let outwards = |v: Vec3, next: fn(f32) -> f32| Vec3::from_array(v.to_array().map(next));
        (outwards(low, f32::next_down), outwards(high, f32::next_up))
    }

    #[inline]
    fn enter(&self, instance: &Instance, ray: &Ray, t_max: f64) -> Within {
        let o = instance.to_local.transform_point3(ray.o.as_dvec3());
        let d = instance.to_local.transform_vector3(ray.d.as_dvec3());
        let inverse_length2 = d.length_squared().recip();
        let start = (self.middle - o).dot(d) * inverse_length2 - self.reach * inverse_length2.sqrt();
        // Not NaN: what has no direction stays where it is.
        let start = start.max(0.0);
        let origin = o + d * start;
        // With room for the rounding of the difference: what is nearest is decided outside.
        let t_max = (t_max - start) * (1.0 + 4.0 * f64::EPSILON);
        let local = Ray { o: origin.as_vec3(), d: d.as_vec3(), t_max: (t_max as f32).next_up() };
        Within { ray: local, exact: [origin, d], start, t_max }
    }

    #[inline]
    fn id(&self, best: &Best) -> u32 {
        if best.slot & ANALYTIC != 0 {
            ANALYTIC | (self.first[1] + (best.slot & !ANALYTIC))
        } else {
            self.first[0] + best.id
        }
    }
}

impl Accel {
    /// An instance.
    #[inline]
    pub fn instance(&self, index: u32) -> &Instance {
        &self.instances[index as usize]
    }

    /// How many triangles there are with those of instances, if so many are kept.
    pub fn placed_triangles(&self, kept: usize) -> u64 {
        let once: u64 = self.prototypes.iter().map(|prototype| prototype.triangles).sum();
        let of = |instance: &Instance| self.prototypes[instance.prototype as usize].triangles;
        kept as u64 - once + self.instances.iter().map(of).sum::<u64>()
    }

    /// The code that follows rays.
    pub fn kernel(&self) -> Kernel {
        self.kernel
    }

    /// Has rays followed by other code.
    pub fn set_kernel(&mut self, kernel: Kernel) {
        self.kernel = kernel;
        self.prototypes.iter_mut().for_each(|prototype| prototype.accel.set_kernel(kernel));
    }

    #[inline]
    fn prototype(&self, index: u32) -> (&Instance, &Prototype) {
        let instance = self.instance(index);
        (instance, &self.prototypes[instance.prototype as usize])
    }

    /// Searches an instance for a nearer hit.
    #[inline(never)]
    pub(super) fn offer_instance(&self, index: u32, line: Line, mut best: Best) -> Best {
        let (instance, prototype) = self.prototype(index);
        let within = prototype.enter(instance, line.ray, best.t);
        let mut found = Best::before(within.t_max);
        prototype.accel.search(within.line(), &mut found);
        if !found.is_hit() {
            return best;
        }
        let (t, id) = (within.start + found.t, prototype.id(&found));
        // Of two equally near the one numbered first, as everywhere; of two copies of one triangle, that of the first instance.
        let before = match best.is_placed() {
            true => (id, index) < (best.id, best.placed.instance),
            false => id < best.id,
        };
        if t < best.t || (t == best.t && before) {
            best = Best { t, slot: PLACED, id, placed: Placed { instance: index, slot: found.slot }, at: found.at };
        }
        best
    }

    /// Whether anything in an instance is met before `t_max`.
    #[inline(never)]
    pub(super) fn meets_instance(&self, index: u32, ray: &Ray, t_max: f64) -> bool {
        let (instance, prototype) = self.prototype(index);
        let mut within = prototype.enter(instance, ray, t_max);
        within.t_max = t_max - within.start;
        prototype.accel.meets(within.line(), within.t_max)
    }

    /// Works out the point of a hit in an instance.
    #[inline(never)]
    pub(super) fn placed_hit(&self, ray: &Ray, best: &Best) -> Hit {
        let Placed { instance: index, slot } = best.placed;
        let (instance, prototype) = self.prototype(index);
        let within = prototype.enter(instance, ray, f64::INFINITY);
        prototype.hit(instance, index, &within, &Best { t: best.t - within.start, slot, ..*best }, best.t)
    }

    /// Visits what is wanted of an instance.
    pub(super) fn all_of_instance(
        &self,
        index: u32,
        ray: &Ray,
        t_max: f64,
        wanted: &impl Fn(Primitive) -> bool,
        visit: &mut impl FnMut(Hit),
    ) {
        let (instance, prototype) = self.prototype(index);
        let mut within = prototype.enter(instance, ray, t_max);
        within.t_max = t_max - within.start;
        let mut met = |best: Best| {
            let id = prototype.id(&best);
            if wanted(Primitive::of(id)) {
                let t = within.start + best.t;
                visit(prototype.hit(instance, index, &within, &Best { id, ..best }, t));
            }
        };
        prototype.accel.all_plain(&Query::of(within.line()), within.t_max, &mut met);
    }
}

impl Prototype {
    /// The point of a hit: worked out in `f64` here, taken to the scene, and rounded once. `best` has the parameter and the slot
    /// within, but the id without; `t` is the parameter outside.
    fn hit(&self, instance: &Instance, index: u32, within: &Within, best: &Best, t: f64) -> Hit {
        let t = t as f32;
        let place = |p: DVec3| instance.to_world.transform_point3(p).as_vec3();
        if best.slot & ANALYTIC != 0 {
            let surface = &self.accel.analytic[(best.slot & !ANALYTIC) as usize];
            let [origin, direction] = within.exact;
            let (p, normal) = surface.exact_point(origin, direction, best.t);
            let ng = instance.covector_to_world(normal).normalize().as_vec3();
            return Hit::PlacedAnalytic { t, id: best.id & !ANALYTIC, instance: index, p: place(p), ng };
        }
        let (block, lane) = (&self.accel.blocks[best.slot as usize / LANES], best.slot as usize % LANES);
        let (b, p) = instance.off_edges(block.corners(lane), best.at);
        Hit::PlacedTriangle { t, id: best.id, instance: index, p: p.as_vec3(), b: block.vertex_weights(lane, b) }
    }
}

#[cfg(test)]
mod tests;
