use super::*;
use crate::ray::Ray;
use crate::test_support::{add_room, built, bumpy_ball, grey_builder, ramp_z};
use crate::texture::Texture;
use glam::dvec3;
use sampling::bsdf::{Lambert, Mirror};
use sampling::{Vec3, vec2, vec3};

#[track_caller]
fn refused(builder: SceneBuilder, word: &str) {
    match builder.build(Skip::Unneeded) {
        Ok(_) => panic!("a scene was built in spite of: {word}"),
        Err(error) => assert!(error.to_string().contains(word), "{error}"),
    }
}

#[test]
fn what_is_wrong_is_told() {
    let with = |change: &dyn Fn(&mut SceneBuilder, MaterialId)| {
        let (mut builder, grey) = grey_builder("bad");
        change(&mut builder, grey);
        builder
    };
    refused(SceneBuilder::new("no camera"), "camera");
    refused(
        with(&|b, m| {
            b.sphere(DVec3::ZERO, -1.0, m);
        }),
        "radius",
    );
    refused(
        with(&|b, m| {
            b.sphere(DVec3::NAN, 1.0, m);
        }),
        "finite",
    );
    refused(
        with(&|b, m| {
            b.quad(DVec3::ZERO, DVec3::X, DVec3::X, m);
        }),
        "no area",
    );
    refused(
        with(&|b, _| {
            b.sphere(DVec3::ZERO, 1.0, MaterialId(7));
        }),
        "material 7",
    );
    refused(with(&|b, _| b.environment(Spectrum::splat(-1.0))), "environment");
    refused(with(&|b, _| b.point_emitter(DVec3::ZERO, Spectrum::splat(f32::NAN))), "point emitter");
    refused(
        with(&|b, _| {
            b.material(Lambert { albedo: Spectrum::splat(1.5) });
        }),
        "albedo",
    );
    refused(
        with(&|b, m| {
            b.sphere(DVec3::ZERO, 1e18, m);
        }),
        "unit",
    );
    refused(
        with(&|b, m| {
            let shape = b.sphere(DVec3::ZERO, 1.0, m);
            b.transform(shape, DAffine3::from_scale(dvec3(1.0, 2.0, 1.0)));
        }),
        "sphere",
    );
    refused(
        with(&|b, m| {
            let mut mesh = bumpy_ball(4);
            mesh.triangles[3] = [0, 1, 9999];
            b.mesh(mesh, m);
        }),
        "9999",
    );
    refused(
        with(&|b, m| {
            let shape = b.sphere(DVec3::ZERO, 1.0, m);
            let radiance = ramp_z(Spectrum::ONE, Spectrum::splat(2.0));
            b.emit(shape, Emission { radiance, two_sided: false });
        }),
        "radiance",
    );
    refused(
        with(&|b, _| {
            let albedo = ramp_z(Spectrum::splat(0.5), Spectrum::splat(0.6));
            let ramp = b.material(Material::lambert(albedo));
            b.sphere(DVec3::ZERO, 1.0, ramp);
        }),
        "albedo",
    );
}

#[test]
fn the_hash_knows_what_an_image_depends_on() {
    let scene = |change: &dyn Fn(&mut SceneBuilder, MaterialId)| {
        let (mut builder, grey) = grey_builder("hashed");
        add_room(&mut builder, DVec3::NEG_ONE, DVec3::ONE, grey);
        change(&mut builder, grey);
        built(builder, Skip::Unneeded).hash
    };
    let plain = scene(&|_, _| {});
    assert_eq!(plain, scene(&|_, _| {}));
    assert_eq!(plain, scene(&|b, _| b.note("only a note".into())));
    let others = [
        scene(&|b, m| {
            b.sphere(DVec3::ZERO, 0.5, m);
        }),
        scene(&|b, m| {
            b.sphere(DVec3::ZERO, 0.500_001, m);
        }),
        scene(&|b, _| {
            b.material(Mirror { reflectance: Spectrum::ONE });
        }),
        scene(&|b, _| b.environment(Spectrum::ONE)),
        scene(&|b, _| b.flip(ShapeId(0))),
        scene(&|b, _| b.emit(ShapeId(0), Emission { radiance: 1.0.into(), two_sided: false })),
        scene(&|b, _| b.emit(ShapeId(0), Emission { radiance: 1.0.into(), two_sided: true })),
        scene(&|b, _| b.transform(ShapeId(0), DAffine3::from_scale(dvec3(1.0, 1.0, 0.999)))),
        scene(&|b, _| {
            let settings = b.camera.expect("there is one");
            b.camera(CameraSettings { projection: Projection::Pinhole { fov: 41.0 }, ..settings });
        }),
    ];
    for (i, hash) in others.iter().enumerate() {
        assert_ne!(*hash, plain, "{i}");
        assert!(!others[..i].contains(hash), "{i}");
    }
}

#[test]
fn the_hash_does_not_depend_on_skips() {
    let hashes = [Skip::Unneeded, Skip::Nothing].map(|skip| {
        let (mut builder, grey) = grey_builder("hashed");
        builder.sphere(DVec3::ZERO, 1.0, grey);
        built(builder, skip).hash
    });
    assert_eq!(hashes[0], hashes[1]);
}

#[test]
fn a_distant_scene_is_recentred_and_loses_nothing() {
    let place = dvec3(1e5, -3e5, 2e5);
    let (mut builder, grey) = grey_builder("far");
    add_room(&mut builder, place - 1.0, place + 1.0, grey);
    let albedo = Texture::Ramp {
        base: Spectrum::splat(0.5),
        slope: Spectrum::splat(0.25),
        axis: sampling::Vec3::X,
        origin: place,
        scale: 1.0,
    };
    let ramp = builder.material(Material::lambert(albedo));
    builder.sphere(place, 0.5, ramp);
    let scene = built(builder, Skip::Unneeded);
    assert!((scene.origin - place).length() < 1e-9);
    let it = scene.intersect(&crate::ray::Ray::new(sampling::Vec3::X * 0.9, -sampling::Vec3::X)).expect("the ball");
    assert!((it.t - 0.4).abs() < 1e-6);
    let sampling::bsdf::Bsdf::Lambert(lambert) = it.bsdf else { panic!("{:?}", it.bsdf) };
    assert!((lambert.albedo.to_array()[0] - 0.625).abs() < 1e-6);
    let (mut near, grey) = grey_builder("near");
    add_room(&mut near, DVec3::ZERO, DVec3::ONE, grey);
    assert_eq!(built(near, Skip::Unneeded).origin, DVec3::ZERO);
}

#[test]
fn needs_say_what_a_scene_asks_and_nothing_is_skipped_when_told_so() {
    let build = |skip| {
        let (mut builder, grey) = grey_builder("needs");
        let (x, y, z) = (DVec3::X, DVec3::Y, DVec3::Z);
        for (u, v) in [(x, y), (y, z), (z, x)] {
            builder.quad(DVec3::NEG_ONE, u, v, grey);
        }
        builder.emit(ShapeId(0), Emission { radiance: 1.0.into(), two_sided: false });
        built(builder, skip)
    };
    let needs = build(Skip::Unneeded).needs;
    assert!(needs.only_lambertian && needs.few_primitives && needs.hittable_emitters && !needs.emitter_choice);
    assert_eq!((needs.primitives, needs.emitters), (6, 1));
    let skipped = "environment textures masks subsurface emitter_choice lobe_choice camera_points bvh";
    assert_eq!(needs.skipped().join(" "), skipped);
    let all = build(Skip::Nothing).needs;
    assert!(all.skipped().is_empty());
    assert!(all.environment && all.textures && all.delta_lobes && !all.only_lambertian && !all.few_primitives);
    assert!(needs.pinhole && !all.pinhole);
}

#[test]
fn triangles_without_area_are_left_out_and_counted() {
    let (mut builder, grey) = grey_builder("slivers");
    let mut mesh = bumpy_ball(6);
    let count = mesh.triangles.len();
    mesh.triangles.extend([[0, 0, 1], [2, 3, 2]]);
    builder.mesh(mesh, grey);
    let scene = built(builder, Skip::Unneeded);
    assert_eq!(scene.counts().triangles, count);
    assert!(scene.notes[0].starts_with("2 triangles"), "{:?}", scene.notes);
}

#[test]
fn an_empty_scene_is_a_scene() {
    for skip in [Skip::Unneeded, Skip::Nothing] {
        let (builder, _) = grey_builder("empty");
        let scene = built(builder, skip);
        let ray = scene.camera.sample_we(sampling::vec2(3.0, 4.0), sampling::Vec2::ZERO).ray;
        assert!(scene.intersect(&ray).is_none() && !scene.occluded(&ray));
        assert_eq!(scene.bounds.radius, 1.0);
    }
}

#[test]
fn tangents_run_along_u() {
    let metal = || sampling::bsdf::RoughConductor::from_reflectance(Spectrum::ONE, 0.1, 0.4);
    let look = |add: &dyn Fn(&mut SceneBuilder, MaterialId)| {
        let mut builder = SceneBuilder::new("tangents");
        let material = builder.material(sampling::bsdf::Bsdf::from(metal()));
        add(&mut builder, material);
        builder.camera(CameraSettings::pinhole(dvec3(0.3, 0.2, 5.0), DVec3::ZERO, 40.0, (4, 4)));
        let scene = builder.build(Skip::Unneeded).unwrap();
        assert!(scene.needs.tangents);
        let ray = Ray::new(vec3(0.3, 0.2, 5.0), -Vec3::Z);
        scene.intersect(&ray).unwrap().frame.x
    };
    let along = |a: Vec3, b: Vec3| assert!((a.dot(b).abs() - 1.0).abs() < 1e-5, "{a} is not along {b}");
    let turned = DAffine3::from_rotation_z(0.3);
    let east = vec3(0.3f32.cos(), 0.3f32.sin(), 0.0);
    for flip in [false, true] {
        along(
            east,
            look(&|builder, material| {
                let quad = builder.quad(dvec3(-1.0, -1.0, 0.0), dvec3(2.0, 0.0, 0.0), dvec3(0.0, 2.0, 0.0), material);
                builder.transform(quad, turned);
                if flip {
                    builder.flip(quad);
                }
            }),
        );
        along(
            east,
            look(&|builder, material| {
                let mesh = MeshData {
                    positions: vec![dvec3(-2.0, -2.0, 0.0), dvec3(2.0, -2.0, 0.0), dvec3(0.0, 4.0, 0.0)],
                    triangles: vec![[0, 1, 2]],
                    uvs: vec![vec2(0.0, 0.0), vec2(1.0, 0.0), vec2(0.5, 1.5)],
                    ..MeshData::default()
                };
                let mesh = builder.mesh(mesh, material);
                builder.transform(mesh, turned);
                if flip {
                    builder.flip(mesh);
                }
            }),
        );
    }
    // On a sphere they run around its pole, here the y axis.
    let upright = DAffine3::from_rotation_x(-std::f64::consts::FRAC_PI_2);
    let tangent = look(&|builder, material| {
        let sphere = builder.sphere(DVec3::ZERO, 1.0, material);
        builder.transform(sphere, upright);
    });
    assert!(tangent.y.abs() < 1e-6, "{tangent}");
}

#[test]
fn the_hash_does_not_depend_on_what_is_skipped() {
    let (mut builder, grey) = grey_builder("skips");
    builder.quad(DVec3::ZERO, DVec3::X, DVec3::Y, grey);
    builder.sphere(DVec3::Z, 0.2, grey);
    let checked = builder.material(Material::lambert(ramp_z(Spectrum::splat(0.1), Spectrum::splat(0.2))));
    builder.quad(DVec3::Z, DVec3::X, DVec3::Y, checked);
    let hashes = [Skip::Unneeded, Skip::Nothing].map(|skip| builder.clone().build(skip).unwrap().hash);
    assert_eq!(hashes[0], hashes[1]);
}

#[test]
fn too_many_triangles_are_refused() {
    assert!(super::check::check_count(1 << 27).is_ok());
    let error = super::check::check_count(1 << 28).unwrap_err().to_string();
    assert!(error.contains("268435456 triangles") && error.contains("instances"), "{error}");
}
