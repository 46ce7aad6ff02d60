//! Everything that a ray meets, not only what it meets first.

use super::lanes::Portable;
use super::query::Query;
use super::traverse::FAR;
use super::tree::{INSTANCE, LEAF, NUMBER, SINGLE};
use super::{ANALYTIC, Accel, Best, Hit, LANES};
use crate::ray::Ray;

/// A triangle or an analytic surface, as numbered when built.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Primitive {
    Triangle(u32),
    Analytic(u32),
}

impl Primitive {
    /// The primitive of an id.
    #[inline]
    pub(super) fn of(id: u32) -> Self {
        if id & ANALYTIC != 0 { Self::Analytic(id & !ANALYTIC) } else { Self::Triangle(id) }
    }
}

impl Accel {
    /// Visits every meeting of the ray's interval with the primitives that are wanted, in no particular order.
    pub fn all(&self, ray: &Ray, wanted: impl Fn(Primitive) -> bool, mut visit: impl FnMut(Hit)) {
        let (query, t_max) = (Query::new(ray), f64::from(ray.t_max));
        self.all_plain(&query, t_max, &mut |best| {
            let primitive = Primitive::of(best.id);
            if wanted(primitive) {
                visit(match primitive {
                    Primitive::Triangle(_) => self.triangle_hit(&best),
                    Primitive::Analytic(_) => self.analytic_hit(query.line, &best),
                });
            }
        });
        if !self.instances().is_empty() {
            self.leaves_met(&query, |leaf| {
                if leaf & INSTANCE != 0 {
                    self.all_of_instance(leaf & NUMBER, ray, t_max, &wanted, &mut visit);
                }
            });
        }
    }

    /// Visits every meeting but those in instances.
    pub(super) fn all_plain(&self, query: &Query, t_max: f64, visit: &mut impl FnMut(Best)) {
        if !self.is_list() {
            return self.leaves_met(query, |leaf| {
                if leaf & SINGLE == 0 {
                    self.all_of_block(leaf & !LEAF, query, t_max, visit);
                } else if leaf & INSTANCE == 0 {
                    self.all_of_analytic(leaf & NUMBER, query, t_max, visit);
                }
            });
        }
        (0..self.blocks.len() as u32).for_each(|index| self.all_of_block(index, query, t_max, visit));
        (0..self.analytic.len() as u32).for_each(|index| self.all_of_analytic(index, query, t_max, visit));
    }

    fn all_of_block(&self, index: u32, query: &Query, t_max: f64, visit: &mut impl FnMut(Best)) {
        let block = &self.blocks[index as usize];
        let mut candidates = block.candidates::<Portable>((), query, self.sizes[index as usize], t_max as f32 * FAR);
        while let Some(candidate) = candidates.take() {
            let (crossing, lane) = (block.crossing(candidate, query), candidate.0);
            let (t, slot) = (crossing.t, index * LANES as u32 + lane as u32);
            if t > 0.0 && t < t_max {
                visit(Best { slot, id: block.id(lane), at: crossing.point(), ..Best::before(t) });
            }
        }
    }

    fn all_of_analytic(&self, index: u32, query: &Query, t_max: f64, visit: &mut impl FnMut(Best)) {
        for t in self.analytic_meetings(index, query.line) {
            if t > 0.0 && t < t_max {
                visit(Best { slot: ANALYTIC | index, id: ANALYTIC | index, ..Best::before(t) });
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

    /// Parameter and number of each meeting, in order.
    fn all(accel: &Accel, ray: &Ray, wanted: impl Fn(Primitive) -> bool) -> Vec<(f32, u32)> {
        let mut found = Vec::new();
        accel.all(ray, wanted, |hit| {
            found.push(match hit {
                Hit::Triangle { t, id, .. } => (t, id),
                Hit::Analytic { t, id, .. } => (t, ANALYTIC | id),
                _ => unreachable!("there are no instances"),
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
        let tree = Accel::build(&triangles, analytic, Skip::Nothing);
        let list = Accel { nodes: Vec::new(), ..tree.clone() };
        let alone: Vec<Accel> = triangles.iter().map(|t| Accel::build(&[*t], Vec::new(), Skip::Unneeded)).collect();
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
                    _ => unreachable!("there are no instances"),
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
