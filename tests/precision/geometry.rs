//! Surfaces, rays, directions and measures.

use std::f64::consts::PI;

use glam::{DVec3, dvec3, vec2};
use sampling::measure::{area_to_solid_angle, geometry_term};
use sampling::warp;
use scenes::builder::MeshData;
use scenes::shape::{Sphere, Triangle};
use scenes::{Ray, SceneBuilder, Skip, SurfacePoint};

use super::{Dice, TRIES, Worst, double, single};
use crate::support::{camera, lambert};

/// Where a ray meets the plane of a triangle, and the barycentric coordinates there.
fn meeting(triangle: Triangle, ray: &Ray) -> (f64, [f64; 2]) {
    let [a, b, c] = triangle.0.map(|p| p.as_dvec3());
    let (o, d) = (ray.o.as_dvec3(), ray.d.as_dvec3());
    let (u, v) = (b - a, c - a);
    let across = d.cross(v);
    let determinant = u.dot(across);
    let from = o - a;
    let along = from.cross(u);
    (v.dot(along) / determinant, [from.dot(across) / determinant, d.dot(along) / determinant])
}

/// Triangles of every shape and size are met where the plane is: as near as the point's own bound of its error says, which is a
/// few units in the last place of its coordinates.
#[test]
fn triangles_and_the_starts_of_rays() {
    let mut dice = Dice::new(5);
    let [mut place, mut bound] = ["point on a triangle", "bound of its error"].map(Worst::of);
    let mut start = Worst::of("start of a ray, of what it needs");
    let [mut distance, mut shares, mut at_edges] =
        ["distance to a triangle", "barycentric coordinates", "barycentric coordinates of points at edges"]
            .map(Worst::of);
    for _ in 0..TRIES / 100 {
        let mut builder = SceneBuilder::new("triangle");
        let grey = builder.material(lambert(0.5));
        let size = dice.magnitude(1e-6, 1e6);
        let (u, v) = (dice.anywhere() * size, dice.anywhere() * size * dice.magnitude(1e-3, 1.0));
        let middle = dice.anywhere() * size * dice.magnitude(1e-2, 1e2);
        let positions = vec![middle, middle + u, middle + v];
        builder.mesh(MeshData { positions, triangles: vec![[0, 1, 2]], ..Default::default() }, grey);
        builder.camera(camera(middle + dice.anywhere() * size, middle, 40.0, 4));
        let Ok(scene) = builder.build(Skip::Unneeded) else { continue };
        let Some(&facet) = scene.facets().as_ref().and_then(|facets| facets.first()) else { continue };
        let [a, b, c] = facet.triangle.0.map(|p| p.as_dvec3());
        for _ in 0..100 {
            let (x, y) = (dice.unit(), dice.unit());
            let (x, y) = if x + y < 1.0 { (x, y) } else { (1.0 - x, 1.0 - y) };
            let target = a + (b - a) * x + (c - a) * y;
            let from = target + dice.anywhere() * size * dice.magnitude(1e-3, 10.0);
            let ray = Ray::new(from.as_vec3(), (target - from).normalize().as_vec3());
            let cos = f64::from(facet.ng.dot(ray.d).abs());
            let Some(hit) = scene.intersect_facet(&ray) else {
                let margin = x.min(y).min(1.0 - x - y).min((1.0 - (x - y).abs()) / 2.0);
                assert!(margin.abs() < 0.1 || cos < 0.3, "missed at {x}, {y} of {facet:?}, by {ray:?}");
                continue;
            };
            let (t, exact) = meeting(facet.triangle, &ray);
            // What is seen all but edge on is met anywhere.
            if exact.iter().any(|b| !b.is_finite()) || cos < 1e-3 {
                continue;
            }
            let point = hit.interaction.point;
            let largest = point
                .p
                .abs()
                .max_element()
                .max(facet.triangle.0.iter().map(|p| p.abs().max_element()).fold(0.0, f32::max));
            let unit = single(f64::from(largest));
            let twice_area = (b - a).cross(c - a).length();
            let longest = (b - a).length().max((c - a).length()).max((c - b).length());
            // Coordinates are rounded in steps of `unit`, and what lies across the plane counts 1/cos times along the ray.
            let step = (unit + single(t)) / cos;
            distance.add_in(f64::from(hit.interaction.t), t, step, || format!("{cos}"));
            // Close to an edge points are moved off it, by 8 roundings of the coordinates, and more at sharp corners.
            let least = exact[0].min(exact[1]).min(1.0 - exact[0] - exact[1]);
            let sums = facet.triangle.0.map(|p| f64::from(p.abs().element_sum()));
            let off = 8.0 * single(0.5) * sums.into_iter().fold(0.0, f64::max) * longest / twice_area;
            let shares = if least > off + step * longest / twice_area { &mut shares } else { &mut at_edges };
            for (found, exact) in hit.b.to_array().into_iter().zip(exact) {
                let step = single(1.0) + step * longest / twice_area;
                shares.add_in(f64::from(found), exact, step, || format!("{cos}, {exact}"));
            }
            let n = (b - a).cross(c - a).normalize();
            let off = |p: glam::Vec3| (p.as_dvec3() - a).dot(n);
            let at = || format!("t {t:e}, size {size:e}");
            place.add_in(off(point.p), 0.0, unit, at);
            bound.add_in(f64::from(point.p_error), 0.0, unit, at);
            assert!(off(point.p).abs() <= f64::from(point.p_error), "{} beyond {}", off(point.p), point.p_error);
            for side in [1.0_f32, -1.0] {
                let moved =
                    off(point.offset_toward(facet.ng * side)) * n.dot(facet.ng.as_dvec3()).signum() * f64::from(side);
                assert!(moved > 0.0, "the start is on the wrong side by {moved:e}, {}", at());
                start.add_in(moved, 0.0, f64::from(point.p_error), at);
            }
        }
    }
    place.finish(1.5);
    bound.finish(12.0);
    start.finish(2.0);
    distance.finish(1.0);
    shares.finish(0.5);
    // Of each of three coordinates.
    at_edges.finish(3.0 * 8.0);
}

/// Lines through a point of a sphere, from anywhere, meet it there, but for what rounds the origin, over how steeply they do.
#[test]
fn lines_and_spheres() {
    const BOUND: f64 = 6.0;
    let mut dice = Dice::new(15);
    let mut worst = Worst::of("where a line meets a sphere");
    for _ in 0..TRIES {
        let radius = dice.magnitude(1e-6, 1e6) as f32;
        let center = (dice.anywhere() * f64::from(radius) * dice.magnitude(1e-3, 1e3)).as_vec3();
        let sphere = Sphere { center, radius, flipped: false };
        let (r, c) = (f64::from(radius), center.as_dvec3());
        let n = dice.anywhere();
        let origin = c + dice.anywhere() * r * dice.magnitude(1e-3, 1e6);
        let direction = c + n * r - origin;
        let length2 = direction.length_squared();
        let cos = n.dot(direction).abs() / length2.sqrt();
        // What rounds the origin about the centre; where it is more than the height of the cap that the line cuts off, the line may pass it by.
        let rounded = double(1.0) * ((origin - c).length() + c.length() + r);
        if 0.5 * r * cos * cos < BOUND * rounded {
            continue;
        }
        let roots = sphere.meetings(origin, direction, 1.0 / length2);
        let nearest = roots.into_iter().min_by(|a, b| (a - 1.0).abs().total_cmp(&(b - 1.0).abs())).unwrap();
        let unit = rounded / (length2.sqrt() * cos);
        worst.add_in(nearest, 1.0, unit, || format!("cos {cos:e}, {:e} radii away", length2.sqrt() / r));
    }
    worst.finish(BOUND);
}

#[test]
fn spheres_and_their_cones() {
    let mut dice = Dice::new(6);
    let [mut surface, mut cone] = ["point on a sphere", "density of a sphere's cone"].map(Worst::of);
    for _ in 0..TRIES {
        let radius = dice.magnitude(1e-6, 1e6) as f32;
        let center = (dice.anywhere() * f64::from(radius) * dice.magnitude(1e-3, 1e3)).as_vec3();
        let sphere = Sphere { center, radius, flipped: false };
        let r = f64::from(radius);
        let u = vec2(dice.unit() as f32, dice.unit() as f32);
        let SurfacePoint { p, p_error, .. } = sphere.sample_area(u).at;
        let off = p.as_dvec3().distance(center.as_dvec3()) - r;
        let unit = single(f64::from(p.abs().max_element().max(center.abs().max_element())).max(r));
        let at = || format!("radius {radius:e} at {center}");
        surface.add_in(off, 0.0, unit, at);
        assert!(off.abs() <= f64::from(p_error), "{off:e} beyond {p_error:e}, {}", at());
        // From just above the surface to where the sphere is all but a point.
        let from = (center.as_dvec3() + dice.anywhere() * r * (1.0 + dice.magnitude(1e-5, 1e6))).as_vec3();
        let Some(pdf) = sphere.pdf_cone(from) else { continue };
        let sin2 = r * r / from.as_dvec3().distance_squared(center.as_dvec3());
        cone.add(pdf, (1.0 + (1.0 - sin2).sqrt()) / (2.0 * PI * sin2), || format!("{}, seen from {from}", at()));
    }
    surface.finish(1.5);
    cone.finish(3.0);
}

#[test]
fn cones_discs_and_hemispheres() {
    let mut dice = Dice::new(7);
    let mut worst =
        ["radius of a disc", "versine in a cone", "sine in a cone", "sine over a hemisphere", "1 - cos"].map(Worst::of);
    let [radius, versine, sine, hemisphere, one_minus_cos] = &mut worst;
    for _ in 0..TRIES {
        let u = vec2(dice.share(), dice.share());
        let at = || format!("{u}");
        // The concentric map's radius is the larger of the two coordinates of the square, in the middle of the numbers' intervals of 2⁻²⁴.
        let offset = (2.0 * u.as_dvec2() - (1.0 - 2.0_f64.powi(-24))).abs();
        let r = offset.max_element();
        let disc = warp::uniform_disk(u).as_dvec2();
        radius.add_in(disc.length(), r, single(r.max(1e-3)), at);
        let most = dice.magnitude(1e-12, 2.0) as f32;
        let w = warp::uniform_cone(u, most).as_dvec3();
        let exact = r * r * f64::from(most);
        let sin = (exact * (2.0 - exact)).sqrt();
        // Near the axis it is known to a part of the cone's own, and near its opposite to a rounding of 2.
        versine.add_in(1.0 - w.z, exact, f64::from(f32::EPSILON), at);
        sine.add_in(
            w.truncate().length(),
            sin,
            single(sin).max(single(f64::from(most).sqrt() * 1e-3)) * (1.0 + 1.0 / (2.0 - exact)),
            at,
        );
        hemisphere.add_in(warp::cosine_hemisphere(u).as_dvec3().truncate().length(), r, single(r.max(1e-3)), at);
        let sin2 = dice.share();
        let s = f64::from(sin2);
        one_minus_cos.add_in(f64::from(warp::one_minus_cos(sin2)), s / (1.0 + (1.0 - s).sqrt()), single(s), || {
            format!("{sin2:e}")
        });
    }
    for (worst, most) in worst.into_iter().zip([4.0, 2.0, 4.0, 4.0, 2.0]) {
        worst.finish(most);
    }
}

#[test]
fn geometry_terms() {
    let mut dice = Dice::new(8);
    let [mut term, mut solid] = ["geometry term", "area to solid angle"].map(Worst::of);
    for _ in 0..TRIES {
        let size = dice.magnitude(1e-6, 1e6);
        let a = (dice.anywhere() * size * dice.magnitude(1e-3, 1e3)).as_vec3();
        let b = (a.as_dvec3() + dice.anywhere() * size * dice.magnitude(1e-3, 1e3)).as_vec3();
        let [na, nb] = [dice.anywhere(), dice.anywhere()].map(|n| n.as_vec3());
        let d = b.as_dvec3() - a.as_dvec3();
        let squared = d.length_squared();
        let [x, y] = [na, nb].map(|n| n.as_dvec3().dot(d).abs() / squared.sqrt());
        // A cosine is known to a rounding of 1.
        if x.min(y) < 1e-3 {
            continue;
        }
        let at = || format!("{a} to {b}");
        let exact = x * y / squared;
        term.add_in(f64::from(geometry_term(a, na, b, nb)), exact, single(exact) * (1.0 + 1.0 / x + 1.0 / y), at);
        let exact = squared / y;
        solid.add_in(f64::from(area_to_solid_angle(1.0, a, b, nb)), exact, single(exact) * (1.0 + 1.0 / y), at);
    }
    term.finish(4.0);
    solid.finish(4.0);
    // A hair above a plane, where its cosine is all that counts.
    let (a, b) = (dvec3(0.0, 0.0, 0.0).as_vec3(), dvec3(1.0, 0.0, 1e-7).as_vec3());
    let exact = 1e-7_f32 as f64;
    let found = f64::from(geometry_term(a, DVec3::Z.as_vec3(), b, -DVec3::X.as_vec3()));
    assert!((found / exact - 1.0).abs() < 1e-6, "{found:e}");
}
