use super::form_factor::{Coupling, Panel, coupling, irradiance, kernel};
use super::operator::Operator;
use super::{Basis, Elements, Radiosity, Rays, Refinement};
use crate::integrator::Estimator;
use crate::method::Methods;
use crate::request::{Orders, Request};
use glam::{DVec3, dvec3};
use sampling::bsdf::{Bsdf, Dielectric, Lambert};
use sampling::math::Spectrum;
use scenes::{CameraSettings, Emission, MaterialId, Scene, SceneBuilder, Skip, Texture};
use serde_json::json;
use std::f64::consts::PI;

/// Both halves of a parallelogram, facing where `u × v` points.
fn plate(origin: DVec3, u: DVec3, v: DVec3) -> Vec<Panel> {
    let normal = u.cross(v).normalize();
    vec![
        Panel::new([origin, origin + u, origin + u + v], normal),
        Panel::new([origin, origin + u + v, origin + v], normal),
    ]
}

/// A regular polygon in many triangles, of the area of a disc.
fn disc(centre: DVec3, radius: f64, normal: DVec3) -> Vec<Panel> {
    const SIDES: usize = 48;
    let angle = 2.0 * PI / SIDES as f64;
    let radius = radius * (angle / angle.sin()).sqrt();
    let rim = |i: usize| centre + dvec3((i as f64 * angle).cos(), (i as f64 * angle).sin(), 0.0) * radius;
    (0..SIDES).map(|i| Panel::new([centre, rim(i), rim(i + 1)], normal)).collect()
}

fn form_factor<const B: usize>(from: &[Panel], to: &[Panel]) -> f64 {
    let couplings = from.iter().flat_map(|x| to.iter().filter_map(move |y| coupling::<B>(x, y)));
    couplings.map(|c| c[0][0]).sum::<f64>() / from.iter().map(|panel| panel.area).sum::<f64>()
}

/// [Howell, C-11]: aligned parallel rectangles of edges x and y, in units of their distance.
fn parallel(x: f64, y: f64) -> f64 {
    let (x1, y1) = (x.hypot(1.0), y.hypot(1.0));
    let log = ((x1 * y1).powi(2) / (1.0 + x * x + y * y)).sqrt().ln();
    let arcs = x * y1 * (x / y1).atan() + y * x1 * (y / x1).atan() - x * x.atan() - y * y.atan();
    2.0 / (PI * x * y) * (log + arcs)
}

/// [Howell, C-14]: from a rectangle of depth w to one of height h that stands on its edge, in units of that edge.
fn perpendicular(h: f64, w: f64) -> f64 {
    let (h2, w2) = (h * h, w * w);
    let r = (h2 + w2).sqrt();
    let arcs = w * (1.0 / w).atan() + h * (1.0 / h).atan() - r * (1.0 / r).atan();
    let a = (1.0 + w2) * (1.0 + h2) / (1.0 + w2 + h2);
    let b = w2 * (1.0 + w2 + h2) / ((1.0 + w2) * (w2 + h2));
    let c = h2 * (1.0 + h2 + w2) / ((1.0 + h2) * (h2 + w2));
    (arcs + 0.25 * (a.ln() + w2 * b.ln() + h2 * c.ln())) / (PI * w)
}

/// [Howell, C-41]: coaxial parallel discs of these radii, in units of their distance, from the first to the second.
fn coaxial(r1: f64, r2: f64) -> f64 {
    let s = 1.0 + (1.0 + r2 * r2) / (r1 * r1);
    0.5 * (s - (s * s - 4.0 * (r2 / r1).powi(2)).sqrt())
}

/// Of constant elements and of linear ones, which are integrated in different ways.
fn check_both(what: &str, from: &[Panel], to: &[Panel], exact: f64) {
    check(&format!("{what}, constant"), form_factor::<1>(from, to), exact);
    check(&format!("{what}, linear"), form_factor::<3>(from, to), exact);
}

fn check(what: &str, found: f64, exact: f64) {
    let relative = (found / exact - 1.0).abs();
    println!("{what}: {found:.8}, closed form {exact:.8}, off by {relative:.1e}");
    assert!(relative < 1e-3, "{what}: {found} {exact}");
}

#[test]
fn plates_see_one_another_as_the_closed_forms_say() {
    for (x, y) in [(1.0, 1.0), (2.0, 0.5), (0.1, 0.1), (10.0, 10.0), (10.0, 0.3)] {
        let below = plate(DVec3::ZERO, DVec3::X * x, DVec3::Y * y);
        let above = plate(dvec3(0.0, 0.0, 1.0), DVec3::Y * y, DVec3::X * x);
        check_both(&format!("parallel {x} {y}"), &below, &above, parallel(x, y));
    }
    for (h, w) in [(1.0, 1.0), (0.5, 2.0), (3.0, 0.2), (0.1, 0.1)] {
        let floor = plate(DVec3::ZERO, DVec3::X * w, DVec3::Y);
        let wall = plate(DVec3::ZERO, DVec3::Y, DVec3::Z * h);
        check_both(&format!("perpendicular {h} {w}"), &floor, &wall, perpendicular(h, w));
        check_both(&format!("perpendicular {w} {h}, back"), &wall, &floor, perpendicular(w, h));
    }
}

#[test]
fn discs_see_one_another_as_the_closed_form_says() {
    for (r1, r2) in [(1.0, 1.0), (0.5, 2.0), (3.0, 1.0)] {
        let (below, above) = (disc(DVec3::ZERO, r1, DVec3::Z), disc(DVec3::Z, r2, -DVec3::Z));
        check_both(&format!("discs {r1} {r2}"), &below, &above, coaxial(r1, r2));
    }
}

/// All moments of couplings, of triangles apart and of such as the other's plane cuts, against plain sums over many points of both.
#[test]
fn moments_are_those_of_a_sum_over_many_points() {
    let below = Panel::new([DVec3::ZERO, DVec3::X, DVec3::Y], DVec3::Z);
    let others = [
        [dvec3(0.2, 0.1, 0.9), dvec3(0.3, 1.2, 0.7), dvec3(1.4, 0.2, 1.1)],
        [dvec3(1.5, -0.5, -0.4), dvec3(1.6, 0.9, -0.3), dvec3(1.3, 0.2, 0.8)],
    ];
    for corners in others {
        let normal = (corners[1] - corners[0]).cross(corners[2] - corners[0]).normalize();
        let normal = if normal.dot(below.centre - corners[0]) > 0.0 { normal } else { -normal };
        let above = Panel::new(corners, normal);
        let quick: Coupling<3> = coupling(&below, &above).unwrap();
        const N: usize = 48;
        let cells = |i: usize| (0..N - i).map(move |j| (i as f64 + 1.0 / 3.0, j as f64 + 1.0 / 3.0));
        let upright = (0..N).flat_map(cells);
        let turned = (0..N - 1).flat_map(|i| (0..N - 1 - i).map(move |j| (i as f64 + 2.0 / 3.0, j as f64 + 2.0 / 3.0)));
        let points: Vec<glam::DVec2> = upright.chain(turned).map(|(s, t)| glam::DVec2::new(s, t) / N as f64).collect();
        let weight = below.area * above.area / (points.len() * points.len()) as f64;
        let mut slow: Coupling<3> = [[0.0; 3]; 3];
        for &s in &points {
            let (p, f) = (below.point(s), super::basis::functions::<3>(s));
            for &t in &points {
                let k = weight * kernel(p, below.normal, above.point(t), above.normal);
                let g = super::basis::functions::<3>(t);
                (0..9).for_each(|i| slow[i / 3][i % 3] += k * f[i / 3] * g[i % 3]);
            }
        }
        println!("{quick:?}\n{slow:?}");
        for i in 0..9 {
            let error = (quick[i / 3][i % 3] - slow[i / 3][i % 3]).abs();
            assert!(error < 1e-3 * slow[0][0], "{quick:?}\n{slow:?}");
        }
        let swapped: Coupling<3> = coupling(&above, &below).unwrap();
        (0..9).for_each(|i| assert!((swapped[i % 3][i / 3] - quick[i / 3][i % 3]).abs() < 1e-3 * slow[0][0]));
    }
}

/// Of a hemisphere's view: a wall at the foot of which the point stands, endless but for a little, fills half.
#[test]
fn irradiance_of_an_endless_wall_is_a_half() {
    let corners = [dvec3(1e-3, -1e4, 0.0), dvec3(1e-3, 1e4, 0.0), dvec3(1e-3, 0.0, 1e8)];
    let wall = Panel::new(corners, -DVec3::X);
    assert!((irradiance(DVec3::ZERO, DVec3::Z, &wall) - 0.5).abs() < 1e-3);
    assert_eq!(irradiance(DVec3::X, DVec3::Z, &wall), 0.0, "behind it");
}

/// A closed room of these edges, all walls of which emit and reflect as given.
fn room(size: DVec3, albedo: f32, emitted: f32) -> SceneBuilder {
    let mut builder = SceneBuilder::new("room");
    let wall = builder.material(Lambert { albedo: Spectrum::splat(albedo) });
    let (x, y, z) = (DVec3::X * size.x, DVec3::Y * size.y, DVec3::Z * size.z);
    for (u, v, across) in [(x, y, z), (y, z, x), (z, x, y)] {
        for (origin, u, v) in [(DVec3::ZERO, u, v), (across, v, u)] {
            let quad = builder.quad(origin, u, v, wall);
            let radiance = Texture::Constant(Spectrum::splat(emitted));
            if emitted > 0.0 {
                builder.emit(quad, Emission { radiance, two_sided: false });
            }
        }
    }
    builder.camera(CameraSettings::pinhole(0.5 * size, DVec3::ZERO, 60.0, (4, 4)));
    builder
}

fn settings(elements: u32, basis: Basis, refinement: Refinement) -> Radiosity {
    Radiosity { elements: Elements(elements), basis, refinement, ..Radiosity::default() }
}

fn solved(scene: &Scene, max_order: usize, settings: &Radiosity) -> std::sync::Arc<super::Solution> {
    settings.solve(scene, &Request::new(Orders::up_to(max_order), true)).unwrap()
}

/// All of a closed room's light arrives in it, however fine the mesh: form factors sum to one. Those of a cube's faces are the closed
/// forms, summed over elements.
#[test]
fn form_factors_of_a_closed_room_sum_to_one() {
    let scene = room(DVec3::ONE, 0.5, 1.0).build(Skip::Unneeded).unwrap();
    for (elements, basis) in [(12, Basis::Constant), (192, Basis::Linear), (768, Basis::Constant)] {
        let settings = settings(elements, basis, Refinement::Even);
        let solution = solved(&scene, 2, &settings);
        let mesh = solution.mesh();
        assert_eq!((mesh.elements().len(), mesh.is_convex()), (elements as usize, true));
        let [closure, before] = [solution.report.closure, solution.report.unbalanced];
        println!("{elements} {basis:?}: sums from {before:?} before they are balanced, and {closure:?}");
        assert!(
            before.iter().all(|sum| (sum - 1.0).abs() < 2e-4) && closure.iter().all(|sum| (sum - 1.0).abs() < 1e-6)
        );
        let mut operator = Operator::new(&scene, mesh, basis, 1);
        operator.balance(&scene, mesh, 1);
        let facing = |normal: DVec3| {
            let of = mesh.elements().iter().enumerate().filter(move |(_, e)| e.panel.normal.dot(normal) > 0.9);
            of.map(|(i, e)| (i, e.panel.area)).collect::<Vec<_>>()
        };
        let between = |from: DVec3, to: DVec3| {
            let to = facing(to);
            let row =
                |&(i, area): &(usize, f64)| area * to.iter().map(|&(j, _)| operator.form_factor(i, j)).sum::<f64>();
            facing(from).iter().map(row).sum::<f64>()
        };
        check("opposite faces", between(DVec3::X, -DVec3::X), parallel(1.0, 1.0));
        check("neighbours", between(DVec3::X, DVec3::Y), perpendicular(1.0, 1.0));
    }
}

/// A closed room of one albedo and one emission: order k is ρᵏ of what is emitted, everywhere.
#[test]
fn orders_of_a_furnace_are_powers_of_its_albedo() {
    let (albedo, emitted) = (0.7f32, 2.0);
    let scene = room(dvec3(1.0, 2.0, 0.5), albedo, emitted).build(Skip::Unneeded).unwrap();
    let solution = solved(&scene, 6, &settings(200, Basis::Linear, Refinement::Error));
    let radiosity = PI * f64::from(emitted);
    for order in 1..=7 {
        let arrives = radiosity * f64::from(albedo).powi(order as i32 - 1);
        let exact = if order == 7 { arrives / (1.0 - f64::from(albedo)) } else { arrives };
        for irradiance in solution.irradiance(order).unwrap() {
            let [mean, s, t] = irradiance.map(|channels| channels[1] / exact);
            assert!((mean - 1.0).abs() < 1e-6 && s.abs() < 1e-6 && t.abs() < 1e-6, "order {order}: {mean} {s} {t}");
        }
    }
    for (order, flux) in solution.report.flux.iter().enumerate() {
        let exact = radiosity * 7.0 * f64::from(albedo).powi(order as i32);
        assert!((flux.leaving / exact - 1.0).abs() < 1e-6 && flux.escaped == 0.0, "{order} {flux:?}");
    }
}

/// A closed room with a block in the way, lit by a lamp on its ceiling.
fn occluded_room() -> Scene {
    let mut builder = room(dvec3(1.0, 1.2, 0.9), 0.6, 0.0);
    let white = builder.material(Lambert { albedo: Spectrum::new(0.8, 0.6, 0.4) });
    let (origin, x, y, z) = (dvec3(0.35, 0.4, 0.0), DVec3::X * 0.3, DVec3::Y * 0.25, DVec3::Z * 0.5);
    for (corner, u, v) in [(origin, z, y), (origin + x, y, z), (origin, x, z), (origin + y, z, x), (origin + z, x, y)] {
        builder.quad(corner, u, v, white);
    }
    let lamp = builder.quad(dvec3(0.3, 0.2, 0.89), DVec3::Y * 0.4, DVec3::X * 0.2, white);
    builder.emit(lamp, Emission { radiance: Texture::Constant(Spectrum::splat(2.0)), two_sided: false });
    builder.build(Skip::Unneeded).unwrap()
}

/// What leaves is absorbed, goes on or escapes, to a millionth in every order, where things stand in the way: as couplings have it and,
/// from elsewhere, as rays find what escapes. In a closed room nothing does.
#[test]
fn flux_is_neither_made_nor_lost() {
    let box_ = scenes::load("cornell_box", &scenes::LoadOptions::default()).unwrap();
    for (scene, closed) in [(box_, false), (occluded_room(), true)] {
        for (elements, basis) in [(200, Basis::Constant), (200, Basis::Linear), (120, Basis::Linear)] {
            let solution = solved(&scene, 5, &settings(elements, basis, Refinement::Error));
            let report = &solution.report;
            println!(
                "{} {elements} {basis:?}: sums from {:?}, weighted {:?}, off by {:.1e}",
                scene.name, report.unbalanced, report.closure, report.imbalance
            );
            for (order, (now, next)) in report.flux.iter().zip(&report.flux[1..]).enumerate() {
                let accounted = now.escaped + now.absorbed + next.leaving;
                println!("  order {order}: {now:?}, off by {:.1e}", accounted / now.leaving - 1.0);
                assert!((accounted / now.leaving - 1.0).abs() < 1e-6 && now.absorbed > 0.0);
                assert!(if closed { now.escaped == 0.0 } else { now.escaped > 0.0 });
            }
            let [low, high] = report.closure;
            assert!(high < 1.0 + 1e-6 && (!closed || low > 1.0 - 1e-6));
        }
    }
}

/// Before they are balanced, sums of form factors and what escapes are off by what rays leave open; that falls with their number.
#[test]
fn rays_leave_less_for_the_balance_the_more_they_are() {
    let scene = scenes::load("cornell_box", &scenes::LoadOptions::default()).unwrap();
    let off = [2, 64].map(|rays| {
        let settings = Radiosity { rays: Rays(rays), ..settings(216, Basis::Constant, Refinement::Even) };
        let solution = solved(&scene, 1, &settings);
        println!("{rays} rays: sums from {:?}, {} rays in all", solution.report.unbalanced, solution.report.rays);
        solution.report.unbalanced.map(|sum| (sum - 1.0).abs())
    });
    assert!((0..2).all(|end| off[1][end] < 0.01 && off[1][end] < 0.5 * off[0][end]), "{off:?}");
}

/// Error estimates put elements where light varies: in a room lit by a small lamp near a corner, not on its dark sides.
#[test]
fn meshes_are_refined_where_light_varies() {
    let mut builder = room(DVec3::ONE, 0.5, 0.0);
    let lamp = builder.material(Lambert { albedo: Spectrum::ZERO });
    let quad = builder.quad(dvec3(0.05, 0.05, 0.999), DVec3::Y * 0.1, DVec3::X * 0.1, lamp);
    builder.emit(quad, Emission { radiance: Texture::Constant(Spectrum::ONE), two_sided: false });
    let scene = builder.build(Skip::Unneeded).unwrap();
    let solution = solved(&scene, 3, &settings(1000, Basis::Constant, Refinement::Error));
    let mesh = solution.mesh();
    assert!(mesh.elements().len() > 950 && mesh.elements().len() <= 1000 && !mesh.is_convex());
    let near = |e: &&super::mesh::Element| e.panel.centre.distance(dvec3(0.1, 0.1, 1.0)) < 0.5;
    let (count, all) = (mesh.elements().iter().filter(near).count(), mesh.elements().len());
    println!("{count} of {all}, meshes {:?}", solution.report.meshes);
    assert!(count * 4 > all, "an eleventh of the room has {count} of {all} elements");
    let above = |e: &super::mesh::Element| e.panel.centre.z > 0.9995;
    let lamp_back: Vec<f64> =
        mesh.elements().iter().filter(|e| !above(e) && e.panel.normal.z > 0.0).map(|e| e.panel.area).collect();
    assert!(!lamp_back.is_empty());
}

/// The same matrix, whatever the threads.
#[test]
fn bits_do_not_depend_on_threads() {
    let scene = scenes::load("cornell_box", &scenes::LoadOptions::default()).unwrap();
    let solve = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        let solution = pool.install(|| solved(&scene, 3, &settings(150, Basis::Linear, Refinement::Error)));
        (1..=4).map(|order| solution.irradiance(order).unwrap().to_vec()).collect::<Vec<_>>()
    };
    assert_eq!(solve(1), solve(3));
}

#[test]
fn settings_and_scenes_that_cannot_be_are_refused_with_a_mend() {
    let methods = Methods::standard();
    let message = |settings: serde_json::Value| methods.build("radiosity", &settings).err().unwrap().to_string();
    assert!(message(json!({"elements": 0})).contains("setting `elements`: 0 elements; give 1 to"));
    assert!(message(json!({"rays": 0})).contains("setting `rays`"));
    assert!(message(json!({"basis": "cubic"})).contains("linear"));
    assert!(message(json!({"element": 10})).contains("did you mean `elements`"));
    let refusal = |change: &dyn Fn(&mut SceneBuilder, MaterialId)| {
        let mut builder = room(DVec3::ONE, 0.5, 1.0);
        let grey = builder.material(Lambert { albedo: Spectrum::splat(0.5) });
        change(&mut builder, grey);
        Radiosity::default().unsupported(&builder.build(Skip::Nothing).unwrap())
    };
    assert_eq!(refusal(&|_, _| ()), None);
    let glass = |builder: &mut SceneBuilder, _| {
        let glass = builder.material(Bsdf::from(Dielectric { eta: 1.5 }));
        builder.quad(DVec3::splat(0.5), DVec3::X * 0.1, DVec3::Y * 0.1, glass);
    };
    assert!(refusal(&glass).unwrap().contains("more than scatter by Lambert's law"));
    assert!(refusal(&|b, grey| _ = b.sphere(DVec3::splat(0.5), 0.1, grey)).unwrap().contains("no flat triangles"));
    assert!(
        refusal(&|b, _| b.point_emitter(DVec3::splat(0.5), Spectrum::ONE)).unwrap().contains("let a surface shine")
    );
    let many = |builder: &mut SceneBuilder, grey| {
        (0..600)
            .for_each(|i| _ = builder.quad(DVec3::splat(1e-3 * f64::from(i)), DVec3::X * 0.01, DVec3::Y * 0.01, grey));
    };
    let reason = refusal(&many).unwrap();
    assert!(reason.contains("1212 triangles") && reason.contains("set elements to 2424"), "{reason}");
    let few = Radiosity { rays: Rays(1), ..settings(24, Basis::Constant, Refinement::Even) };
    assert_eq!(few.unsupported(&room(DVec3::ONE, 0.5, 1.0).build(Skip::Unneeded).unwrap()), None);
}
