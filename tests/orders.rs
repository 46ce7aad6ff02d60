//! Every method against every closed form, order by order.
//!
//! False-alarm rate: 0.1 % for each test (Šidák over its methods, orders and blocks).

use crate::support::{Budget, Estimate, Family, exact, grey, measure, method};
use integrators::{Integrator, Measurement};
use sampling::bsdf::{Bsdf, BsdfModel, Dielectric, Lambert, Lobes, Mirror, TransportMode};
use sampling::math::Spectrum;
use sampling::{Vec2, Vec3, vec2, vec3};
use glam::{DVec3, dvec3};
use scenes::{CameraSettings, Emission, Interaction, MeshData, Ray, Scene, SceneBuilder, Skip, Texture};

const ALL: [&str; 4] = ["direct", "path", "light", "bdpt"];

/// Nodes and weights of five-point Gauss–Legendre quadrature on [0, 1].
const GAUSS: [(f64, f64); 5] = [
    (0.046910077030668, 0.118463442528095),
    (0.230765344947158, 0.239314335249683),
    (0.5, 0.284444444444444),
    (0.769234655052842, 0.239314335249683),
    (0.953089922969332, 0.118463442528095),
];

/// The mean over a block of the image of a smooth function of the first hit, by quadrature over every pixel.
fn block_means(scene: &Scene, m: &Measurement, value: impl Fn(&Interaction, &Ray) -> f64) -> Vec<f64> {
    let (mut sums, mut pixels) = (vec![0.0; m.grid.count()], vec![0.0; m.grid.count()]);
    for pixel in 0..m.pixels() {
        let (x, y) = (pixel as u32 % m.width, pixel as u32 / m.width);
        for ((u, wu), (v, wv)) in GAUSS.iter().flat_map(|a| GAUSS.iter().map(move |b| (a, b))) {
            let raster = vec2(x as f32 + *u as f32, y as f32 + *v as f32);
            let ray = scene.camera.sample_we(raster, Vec2::ZERO).ray;
            let hit = scene.intersect(&ray).expect("every pixel sees a surface");
            sums[m.grid.block_of(pixel)] += wu * wv * value(&hit, &ray);
        }
        pixels[m.grid.block_of(pixel)] += 1.0;
    }
    sums.iter().zip(&pixels).map(|(s, n)| s / n).collect()
}

/// Compares a method's orders, block by block and over the whole image, with what they should be.
fn compare(family: &mut Family, scene: &Scene, name: &str, budget: Budget, truth: impl Fn(usize, &Interaction, &Ray) -> f64) {
    compare_made(family, scene, name, method(name).as_ref(), budget, truth);
}

fn compare_made(
    family: &mut Family,
    scene: &Scene,
    label: &str,
    method: &dyn Integrator,
    budget: Budget,
    truth: impl Fn(usize, &Interaction, &Ray) -> f64,
) {
    let m = measure(scene, method, label, budget);
    for order in method.orders(budget.max_order) {
        let layer = m.layer_of_order(order).unwrap();
        let expected = block_means(scene, &m, |hit, ray| truth(order, hit, ray));
        for (block, &expected) in expected.iter().enumerate() {
            let label = format!("{} {label} order {order} block {block}", scene.name);
            family.against_truth(label, Estimate::of_block(&m, layer, block), expected);
        }
        let mean = expected.iter().sum::<f64>() / expected.len() as f64;
        family.against_truth(format!("{} {label} order {order} image", scene.name), Estimate::of_image(&m, layer), mean);
    }
}

fn camera(position: DVec3, target: DVec3, fov: f64, size: u32) -> CameraSettings {
    let up = if (target - position).normalize().y.abs() > 0.99 { DVec3::X } else { DVec3::Y };
    CameraSettings { position, target, up, fov, width: size, height: size }
}

fn lambert(albedo: f32) -> Bsdf {
    Lambert { albedo: Spectrum::splat(albedo) }.into()
}

fn shining(radiance: f32) -> Emission {
    Emission { radiance: Texture::Constant(Spectrum::splat(radiance)), two_sided: false }
}

#[test]
fn furnace() {
    let scene = crate::support::builtin("furnace", 8);
    let mut family = Family::new("furnace");
    for name in ALL {
        compare(&mut family, &scene, name, Budget::samples(64), |order, hit, ray| {
            grey(exact(&scene, order, hit.point.p, ray.d))
        });
    }
    family.finish();
}

#[test]
fn integrating_sphere() {
    let scene = crate::support::builtin("integrating_sphere", 8);
    let mut family = Family::new("integrating sphere");
    for name in ALL {
        compare(&mut family, &scene, name, Budget::samples(64), |order, hit, ray| {
            grey(exact(&scene, order, hit.point.p, ray.d))
        });
    }
    family.finish();
}


/// A closed tetrahedron whose faces, and a ball of a mirror's material within, all reflect and emit alike.
#[test]
fn uniform_tetrahedron_with_a_mirror_ball() {
    let (albedo, emitted) = (0.6, 0.8);
    let mut builder = SceneBuilder::new("tetrahedron");
    let (wall, mirror) = (builder.material(lambert(albedo)), builder.material(Bsdf::from(Mirror { reflectance: Spectrum::splat(albedo) })));
    let corners = [dvec3(1., 1., 1.), dvec3(1., -1., -1.), dvec3(-1., 1., -1.), dvec3(-1., -1., 1.)].map(|p| p * 2.0);
    // Wound so that the fronts look inwards.
    let triangles = vec![[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]];
    let mesh = MeshData { positions: corners.to_vec(), triangles, normals: vec![], uvs: vec![] };
    let walls = builder.mesh(mesh, wall);
    builder.flip(walls);
    let walls_front_inwards = {
        let normal = (corners[2] - corners[0]).cross(corners[1] - corners[0]);
        normal.dot(-corners[0]) > 0.0
    };
    if walls_front_inwards {
        builder.flip(walls);
    }
    let ball = builder.sphere(dvec3(0.1, 0.0, 0.2), 0.3, mirror);
    builder.emit(walls, shining(emitted));
    builder.emit(ball, shining(emitted));
    builder.camera(camera(dvec3(0.5, 0.5, 0.8), dvec3(0.0, 0.0, 0.0), 50.0, 8));
    let scene = builder.build(Skip::Unneeded).unwrap();
    let mut family = Family::new("tetrahedron");
    for name in ["direct", "path", "bdpt"] {
        compare(&mut family, &scene, name, Budget::samples(64), |order, _, _| (emitted * albedo.powi(order as i32)) as f64);
    }
    family.finish();
}

/// A sphere with a point emitter at its centre: L_k = ρ(x) ρ̄^(k−1) I / (πR²) for k ≥ 1.
#[test]
fn sphere_with_a_point_emitter_at_its_centre() {
    let (radius, intensity, base, slope) = (1.5, 3.0, 0.5, 0.3);
    let mut builder = SceneBuilder::new("point in sphere");
    let albedo = Texture::Ramp {
        base: Spectrum::splat(base),
        slope: Spectrum::splat(slope),
        axis: vec3(0.0, 0.0, 1.0),
        origin: Vec3::ZERO,
        scale: radius as f32,
    };
    let wall = builder.material(scenes::Material::Lambert { albedo });
    let sphere = builder.sphere(DVec3::ZERO, radius, wall);
    builder.flip(sphere);
    builder.point_emitter(DVec3::ZERO, Spectrum::splat(intensity));
    builder.camera(camera(dvec3(0.4, 0.3, 0.9), dvec3(0.1, 0.0, -1.0), 60.0, 8));
    let scene = builder.build(Skip::Unneeded).unwrap();
    let mut family = Family::new("point emitter in a sphere");
    for name in ALL {
        compare(&mut family, &scene, name, Budget::samples(64), |order, hit, ray| {
            let albedo = base as f64 + slope as f64 * (world(&scene, hit, ray).z / radius);
            let first = intensity as f64 / (std::f64::consts::PI * radius * radius);
            if order == 0 { 0.0 } else { albedo * (base as f64).powi(order as i32 - 1) * first }
        });
    }
    family.finish();
}

/// The hit point in the coordinates of the scene's description.
fn world(scene: &Scene, hit: &Interaction, _: &Ray) -> DVec3 {
    hit.point.p.as_dvec3() + scene.origin
}

/// A floor seen from above, big enough to fill the view, with nothing else in it.
fn floor(name: &str, albedo: f32, size: u32) -> SceneBuilder {
    let mut builder = SceneBuilder::new(name);
    let grey = builder.material(lambert(albedo));
    builder.quad(dvec3(-2.0, 0.0, 2.0), dvec3(4.0, 0.0, 0.0), dvec3(0.0, 0.0, -4.0), grey);
    builder.camera(camera(dvec3(1.0, 1.0, 1.0), dvec3(0.2, 0.0, 0.1), 30.0, size));
    builder
}

/// Irradiance at `p` with normal `n` from a polygon of radiance 1, by Lambert's formula (fronts and horizon not looked at).
fn lambert_irradiance(p: DVec3, n: DVec3, polygon: &[DVec3]) -> f64 {
    let mut sum = 0.0;
    for (i, &a) in polygon.iter().enumerate() {
        let b = polygon[(i + 1) % polygon.len()];
        let (a, b) = ((a - p).normalize(), (b - p).normalize());
        let cross = a.cross(b);
        sum += a.dot(b).clamp(-1.0, 1.0).acos() * n.dot(cross.normalize());
    }
    (sum / 2.0).abs()
}

#[test]
fn polygon_emitter_over_a_plane() {
    let (albedo, radiance) = (0.7, 5.0);
    let mut builder = floor("polygon light", albedo, 8);
    let black = builder.material(lambert(0.0));
    let corners = [dvec3(-0.3, 0.6, -0.2), dvec3(0.5, 0.6, -0.2), dvec3(0.5, 0.9, 0.4), dvec3(-0.3, 0.9, 0.4)];
    // Its front looks down.
    let light = builder.quad(corners[0], corners[1] - corners[0], corners[3] - corners[0], black);
    let down = (corners[1] - corners[0]).cross(corners[3] - corners[0]).y < 0.0;
    if !down {
        builder.flip(light);
    }
    builder.emit(light, shining(radiance));
    // From the side, so that only floor is seen.
    builder.camera(camera(dvec3(1.2, 0.35, 1.2), dvec3(0.1, 0.0, 0.1), 22.0, 8));
    let scene = builder.build(Skip::Unneeded).unwrap();
    let mut family = Family::new("polygon light");
    for name in ALL {
        compare(&mut family, &scene, name, Budget { max_order: 1, ..Budget::samples(256) }, |order, hit, ray| {
            let p = world(&scene, hit, ray);
            let irradiance = radiance as f64 * lambert_irradiance(p, DVec3::Y, &corners);
            if order == 0 { 0.0 } else { albedo as f64 / std::f64::consts::PI * irradiance }
        });
    }
    family.finish();
}

#[test]
fn sphere_emitter_over_a_plane() {
    let (albedo, radiance, centre, radius) = (0.7, 5.0, dvec3(0.1, 0.8, -0.3), 0.25);
    let mut builder = floor("sphere light", albedo, 8);
    let black = builder.material(lambert(0.0));
    let light = builder.sphere(centre, radius, black);
    builder.emit(light, shining(radiance));
    builder.camera(camera(dvec3(1.2, 0.35, 1.2), dvec3(0.1, 0.0, 0.1), 22.0, 8));
    let scene = builder.build(Skip::Unneeded).unwrap();
    let mut family = Family::new("sphere light");
    for name in ALL {
        compare(&mut family, &scene, name, Budget { max_order: 1, ..Budget::samples(256) }, |order, hit, ray| {
            let d = centre - world(&scene, hit, ray);
            let irradiance = std::f64::consts::PI * radiance as f64 * radius * radius * d.y / d.length().powi(3);
            if order == 0 { 0.0 } else { albedo as f64 / std::f64::consts::PI * irradiance }
        });
    }
    family.finish();
}

#[test]
fn point_emitter_over_a_plane() {
    let (albedo, intensity, position) = (0.7, 2.0, dvec3(0.2, 0.7, -0.1));
    let mut builder = floor("point light", albedo, 8);
    builder.point_emitter(position, Spectrum::splat(intensity));
    let scene = builder.build(Skip::Unneeded).unwrap();
    let mut family = Family::new("point light");
    for name in ALL {
        compare(&mut family, &scene, name, Budget { max_order: 1, ..Budget::samples(256) }, |order, hit, ray| {
            let d = position - world(&scene, hit, ray);
            let irradiance = intensity as f64 * d.y / d.length().powi(3);
            if order == 0 { 0.0 } else { albedo as f64 / std::f64::consts::PI * irradiance }
        });
    }
    family.finish();
}

/// A ball that fills the view, in a uniform environment.
fn ball_in_environment(name: &str, bsdf: Bsdf, radiance: f32) -> Scene {
    let mut builder = SceneBuilder::new(name);
    let material = builder.material(bsdf);
    builder.sphere(DVec3::ZERO, 1.0, material);
    builder.environment(Spectrum::splat(radiance));
    builder.camera(camera(dvec3(0.3, 0.2, 2.5), DVec3::ZERO, 20.0, 4));
    builder.build(Skip::Unneeded).unwrap()
}

/// Lit by the environment alone, a convex body scatters once: order 1 is the directional albedo times the radiance.
#[test]
fn lambertian_ball_in_a_uniform_environment() {
    let (albedo, radiance) = (0.7, 1.3);
    let scene = ball_in_environment("lambertian ball", lambert(albedo), radiance);
    let mut family = Family::new("lambertian ball");
    for name in ALL {
        compare(&mut family, &scene, name, Budget { max_order: 3, ..Budget::samples(256) }, |order, _, _| {
            if order == 1 { (albedo * radiance) as f64 } else { 0.0 }
        });
    }
    family.finish();
}

/// In a glass ball every internal angle is the same, so order k ≥ 2 is (1 − F)² F^(k−2) times the radiance, and order 1 is F.
#[test]
fn glass_ball_in_a_uniform_environment() {
    let (eta, radiance) = (1.5, 1.3);
    let scene = ball_in_environment("glass ball", Dielectric { eta }.into(), radiance);
    let mut family = Family::new("glass ball");
    for name in ["direct", "path", "bdpt"] {
        compare(&mut family, &scene, name, Budget::samples(256), |order, hit, ray| {
            let reflected = fresnel(-(ray.d.dot(hit.point.ng) as f64), eta as f64);
            let share = match order {
                0 => 0.0,
                1 => reflected,
                k => (1.0 - reflected).powi(2) * reflected.powi(k as i32 - 2),
            };
            share * radiance as f64
        });
    }
    family.finish();
}

/// Fresnel's reflectance in f64, for light that arrives from outside.
fn fresnel(cos: f64, eta: f64) -> f64 {
    let cos_t = (1.0 - (1.0 - cos * cos) / (eta * eta)).sqrt();
    let parallel = (eta * cos - cos_t) / (eta * cos + cos_t);
    let perpendicular = (cos - eta * cos_t) / (cos + eta * cos_t);
    (parallel * parallel + perpendicular * perpendicular) / 2.0
}

/// Reflecting models at order 1: the directional albedo, by quadrature over the hemisphere, times the radiance.
#[test]
fn rough_conductor_ball_in_a_uniform_environment() {
    let radiance = 1.3;
    for (index, bsdf) in Bsdf::all_examples().into_iter().filter(|(name, _)| *name == "rough_conductor").enumerate() {
        let bsdf = bsdf.1;
        let lobes = bsdf.lobes();
        if lobes.is_delta() || index >= 3 {
            continue;
        }
        let scene = ball_in_environment(&format!("rough conductor {index}"), bsdf, radiance);
        let mut family = Family::new(format!("rough conductor ball {index}"));
        for name in ALL {
            compare(&mut family, &scene, name, Budget { max_order: 2, ..Budget::samples(512) }, |order, hit, ray| {
                if order == 1 { radiance as f64 * directional_albedo(&bsdf, hit.frame.to_local(-ray.d)) } else { 0.0 }
            });
        }
        family.finish();
    }
}

/// ∫ f cos dω over the upper hemisphere, by the midpoint rule in half-vector-free coordinates around the mirror direction.
fn directional_albedo(bsdf: &Bsdf, wo: Vec3) -> f64 {
    let (rings, sectors) = (400, 800);
    let mut sum = 0.0;
    for i in 0..rings {
        // In z = cos θ the measure is uniform.
        let z = (i as f64 + 0.5) / rings as f64;
        let r = (1.0 - z * z).sqrt();
        for j in 0..sectors {
            let phi = (j as f64 + 0.5) / sectors as f64 * std::f64::consts::TAU;
            let wi = vec3((r * phi.cos()) as f32, (r * phi.sin()) as f32, z as f32);
            sum += grey(bsdf.eval(wo, wi, Lobes::ALL, TransportMode::Radiance).to_array().map(f64::from)) * z;
        }
    }
    sum * std::f64::consts::TAU / (rings * sectors) as f64
}
