//! The triangles of a scene, for methods that work on surfaces rather than along rays.

use super::Scene;
use crate::accel::Hit;
use crate::interaction::Interaction;
use crate::material::Material;
use crate::ray::Ray;
use crate::shape::Triangle;
use sampling::{Vec2, Vec3};

/// A flat triangle of a scene, as it is traced.
#[derive(Clone, Copy, Debug)]
pub struct Facet {
    /// Its vertices \[m\].
    pub triangle: Triangle,
    /// Unit normal of its front.
    pub ng: Vec3,
}

/// A hit on a facet.
#[derive(Clone, Copy, Debug)]
pub struct FacetHit {
    /// Its place in [`Scene::facets`].
    pub facet: usize,
    /// Barycentric coordinates of the vertices 1 and 2.
    pub b: Vec2,
    /// What was met.
    pub interaction: Interaction,
}

impl Scene {
    /// All surfaces as flat triangles, in the order in which they were given; `None` if there are others: spheres, disks and cylinders,
    /// what is placed in instances, and meshes with vertex normals.
    pub fn facets(&self) -> Option<Vec<Facet>> {
        let bent = self.attributes.iter().any(|attributes| !attributes.normals.is_empty());
        if bent || !self.analytic.is_empty() || !self.accel.instances().is_empty() {
            return None;
        }
        let corners = self.accel.triangles();
        let facet = |(id, info): (usize, &crate::surface::TriangleInfo)| {
            let triangle = corners.get(&(id as u32))?;
            Some(Facet { triangle: *triangle, ng: info.ng })
        };
        self.triangles.iter().enumerate().map(facet).collect()
    }

    /// The first facet on the ray's interval (0, `t_max`), in a scene that has no other surfaces.
    #[inline]
    pub fn intersect_facet(&self, ray: &Ray) -> Option<FacetHit> {
        let hit = self.accel.closest(ray)?;
        let Hit::Triangle { id, b, .. } = hit else { return None };
        Some(FacetHit { facet: id as usize, b, interaction: self.interaction(hit, ray.d) })
    }

    /// The point of a facet at barycentric coordinates `b`, as a ray of direction `d` meets it.
    pub fn on_facet(&self, facet: usize, at: &Facet, b: Vec2, d: Vec3) -> Interaction {
        let p = at.triangle.point([f64::from(b.x), f64::from(b.y)], at.ng).p;
        self.interaction(Hit::Triangle { t: 0.0, id: facet as u32, p, b }, d)
    }

    /// The name of the first surface's material that is such.
    pub fn material_where(&self, is_such: impl Fn(&Material) -> bool) -> Option<String> {
        let found = self.surfaces.iter().position(|surface| is_such(&self.materials[surface.material.0 as usize]))?;
        self.labels.surfaces().get(found)?.first().cloned()
    }
}

#[cfg(test)]
mod tests {
    use crate::needs::Skip;
    use crate::ray::Ray;
    use crate::test_support::{Random, add_room, built, grey_builder};
    use glam::DVec3;
    use sampling::Vec3;

    /// Few facets, which are searched as a list, and many, in a tree.
    #[test]
    fn facets_are_where_rays_meet_them() {
        for rooms in 1..4 {
            let (mut builder, grey) = grey_builder("rooms");
            for i in 0..rooms {
                let size = DVec3::splat(1.0 + f64::from(i));
                add_room(&mut builder, -size, size, grey);
            }
            let scene = built(builder, Skip::Unneeded);
            let facets = scene.facets().expect("all are flat");
            assert_eq!(facets.len(), 12 * rooms as usize);
            let mut random = Random::new(7);
            for _ in 0..1000 {
                let ray = Ray::new(Vec3::ZERO, random.direction());
                let hit = scene.intersect_facet(&ray).expect("it is closed");
                let facet = &facets[hit.facet];
                let again = scene.on_facet(hit.facet, facet, hit.b, ray.d);
                assert!(again.point.p.distance(hit.interaction.point.p) < 1e-6);
                assert_eq!((again.point.ng, again.surface), (facet.ng, hit.interaction.surface));
            }
        }
    }

    #[test]
    fn other_surfaces_are_no_facets() {
        let (mut builder, grey) = grey_builder("sphere");
        builder.sphere(DVec3::ZERO, 1.0, grey);
        assert!(built(builder, Skip::Unneeded).facets().is_none());
    }
}
