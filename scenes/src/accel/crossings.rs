//! Everything that a ray meets, not only what it meets first.

use super::query::{Query, dominant_axis};
use super::tree::LEAF;
use super::{ANALYTIC, Accel, Hit};
use crate::ray::Ray;

/// A triangle or an analytic surface, as numbered when built.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Primitive {
    Triangle(u32),
    Analytic(u32),
}

impl Accel {
    /// Visits every meeting of the ray's interval with the primitives that are wanted, in no particular order.
    pub fn all(&self, ray: &Ray, wanted: impl Fn(Primitive) -> bool, visit: impl FnMut(Hit)) {
        match dominant_axis(ray) {
            0 => self.all_along::<0>(ray, wanted, visit),
            1 => self.all_along::<1>(ray, wanted, visit),
            _ => self.all_along::<2>(ray, wanted, visit),
        }
    }

    fn all_along<const Z: usize>(&self, ray: &Ray, wanted: impl Fn(Primitive) -> bool, mut visit: impl FnMut(Hit)) {
        let query = Query::new::<Z>(ray);
        if !self.nodes.is_empty() {
            return self.leaves_met(ray, |leaf| {
                if leaf & ANALYTIC != 0 {
                    self.all_of_analytic(leaf & !(LEAF | ANALYTIC), ray, &query, &wanted, &mut visit);
                } else {
                    self.all_of_block::<Z>(leaf & !LEAF, ray, &query, &wanted, &mut visit);
                }
            });
        }
        (0..self.blocks.len() as u32).for_each(|i| self.all_of_block::<Z>(i, ray, &query, &wanted, &mut visit));
        (0..self.analytic.len() as u32).for_each(|i| self.all_of_analytic(i, ray, &query, &wanted, &mut visit));
    }

    fn all_of_block<const Z: usize>(
        &self,
        index: u32,
        ray: &Ray,
        query: &Query,
        wanted: &impl Fn(Primitive) -> bool,
        visit: &mut impl FnMut(Hit),
    ) {
        let block = &self.blocks[index as usize];
        block.for_each_meeting::<Z>(query, ray.t_max, |lane, t| {
            let id = block.id(lane as usize);
            if t > 0.0 && t < f64::from(ray.t_max) && wanted(Primitive::Triangle(id)) {
                let (p, b) = block.point(lane as usize, query);
                visit(Hit::Triangle { t: t as f32, id, p, b });
            }
            false
        });
    }

    fn all_of_analytic(
        &self,
        id: u32,
        ray: &Ray,
        query: &Query,
        wanted: &impl Fn(Primitive) -> bool,
        visit: &mut impl FnMut(Hit),
    ) {
        let surface = &self.analytic[id as usize];
        let inverse_length2 = query.direction.length_squared().recip();
        for t in surface.meetings(query.origin, query.direction, inverse_length2) {
            if t > 0.0 && t < f64::from(ray.t_max) && wanted(Primitive::Analytic(id)) {
                let at = surface.point(query.origin, query.direction, t);
                visit(Hit::Analytic { t: t as f32, id, at });
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::tests::random_triangles;
    use super::*;
    use crate::needs::Skip;
    use crate::shape::{Analytic, Sphere};
    use crate::test_support::Random;
    use sampling::Vec3;

    /// Parameter and number of each meeting, in order.
    fn all(accel: &Accel, ray: &Ray, wanted: impl Fn(Primitive) -> bool) -> Vec<(f32, u32)> {
        let mut found = Vec::new();
        accel.all(ray, wanted, |hit| {
            found.push(match hit {
                Hit::Triangle { t, id, .. } => (t, id),
                Hit::Analytic { t, id, .. } => (t, ANALYTIC | id),
            })
        });
        found.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        found
    }

    #[test]
    fn every_primitive_is_met_that_is_met_alone() {
        let mut random = Random::new(11);
        let triangles = random_triangles(&mut random, 90, 0.5);
        let spheres: Vec<Sphere> = (0..9)
            .map(|_| Sphere { center: random.direction(), radius: 0.1 + 0.3 * random.next_1d(), flipped: false })
            .collect();
        let analytic = spheres.iter().copied().map(Analytic::Sphere).collect();
        let tree = Accel::build(&triangles, analytic, Vec3::ZERO, Skip::Nothing);
        let list = Accel { nodes: Vec::new(), ..tree.clone() };
        let alone: Vec<Accel> =
            triangles.iter().map(|t| Accel::build([*t], Vec::new(), Vec3::ZERO, Skip::Unneeded)).collect();
        let mut met = 0;
        for _ in 0..5000 {
            let (o, target) = (random.direction() * 2.0, random.direction() * random.next_1d());
            let mut ray = Ray::new(o, (target - o).normalize());
            ray.t_max = 4.0 * random.next_1d();
            let found = all(&tree, &ray, |_| true);
            assert_eq!(found, all(&list, &ray, |_| true), "{ray:?}");
            assert_eq!(
                found.first().map(|(t, _)| *t),
                tree.closest(&ray).map(|hit| match hit {
                    Hit::Triangle { t, .. } | Hit::Analytic { t, .. } => t,
                })
            );
            let (balls, flat): (Vec<_>, Vec<_>) = found.into_iter().partition(|(_, id)| id & ANALYTIC != 0);
            let expected: Vec<u32> = (0..alone.len() as u32).filter(|&id| alone[id as usize].any(&ray)).collect();
            let mut ids: Vec<u32> = flat.iter().map(|(_, id)| *id).collect();
            ids.sort_unstable();
            assert_eq!(ids, expected, "{ray:?}");
            for (t, id) in &balls {
                let sphere = &spheres[(id & !ANALYTIC) as usize];
                assert!((ray.at(*t).distance(sphere.center) - sphere.radius).abs() < 1e-5);
            }
            met += flat.len() + balls.len();
            let even = |primitive| matches!(primitive, Primitive::Triangle(id) if id % 2 == 0);
            let kept: Vec<_> = flat.into_iter().filter(|(_, id)| id % 2 == 0).collect();
            assert_eq!(all(&tree, &ray, even), kept);
        }
        assert!(met > 10_000, "{met}");
    }
}
