//! Emitters on meshes: without vertex normals, under mirrored transforms, wound either way.
//!
//! False-alarm rate: 0.1 % for each test.

use crate::support::{ALL_AND_RUNS, Budget, Family, measure, plain};
use glam::{DAffine3, DMat3, DVec3, dvec3};
use sampling::bsdf::{Bsdf, Lambert};
use sampling::math::Spectrum;
use scenes::{CameraSettings, Emission, MeshData, Scene, SceneBuilder, Skip, Texture};

/// How the emitter over the floor is made.
#[derive(Clone, Copy)]
enum Lamp {
    Quad,
    Mesh,
    /// The mirror image of a lamp, mirrored back by its transform.
    MirroredMesh,
    MirroredQuad,
}

fn room(lamp: Lamp) -> Scene {
    let mut builder = SceneBuilder::new("room");
    let grey = builder.material(Bsdf::from(Lambert { albedo: Spectrum::splat(0.6) }));
    builder.quad(dvec3(-1.0, 0.0, 1.0), dvec3(2.0, 0.0, 0.0), dvec3(0.0, 0.0, -2.0), grey);
    builder.quad(dvec3(-1.0, 0.0, -1.0), dvec3(2.0, 0.0, 0.0), dvec3(0.0, 2.0, 0.0), grey);
    // Fronts down: x × z points down.
    let (origin, u, v) = (dvec3(-0.4, 1.2, -0.3), dvec3(0.7, 0.0, 0.0), dvec3(0.0, 0.1, 0.6));
    let mirror = DAffine3::from_mat3(DMat3::from_diagonal(dvec3(-1.0, 1.0, 1.0)));
    let flat = |origin: DVec3, u: DVec3, v: DVec3| MeshData {
        positions: vec![origin, origin + u, origin + u + v, origin + v],
        triangles: vec![[0, 1, 2], [0, 2, 3]],
        ..MeshData::default()
    };
    let back = |p: DVec3| mirror.transform_point3(p);
    let shape = match lamp {
        Lamp::Quad => builder.quad(origin, u, v, grey),
        Lamp::Mesh => builder.mesh(flat(origin, u, v), grey),
        Lamp::MirroredMesh => builder.mesh(flat(back(origin), back(u), back(v)), grey),
        Lamp::MirroredQuad => builder.quad(back(origin), back(u), back(v), grey),
    };
    if matches!(lamp, Lamp::MirroredMesh | Lamp::MirroredQuad) {
        // The winding of the mirror image makes its front look up: turned over, it looks down, and so does its image.
        builder.flip(shape);
        builder.transform(shape, mirror);
    }
    builder.emit(shape, Emission { radiance: Texture::Constant(Spectrum::splat(4.0)), two_sided: false });
    builder.camera(CameraSettings::pinhole(dvec3(0.3, 0.9, 3.0), dvec3(0.0, 0.6, 0.0), 40.0, (8, 8)));
    builder.build(Skip::Unneeded).unwrap()
}

#[test]
fn emitters_on_meshes_shine_as_quads_do() {
    let mut family = Family::new("lamps");
    let budget = Budget::samples(64).up_to(3);
    let reference = measure(&room(Lamp::Quad), plain("path").as_ref(), "quad", budget);
    assert!(reference.image(1).mean > 0.01, "the lamp's front looks away from the floor");
    for (lamp, name) in
        [(Lamp::Mesh, "mesh"), (Lamp::MirroredMesh, "mirrored mesh"), (Lamp::MirroredQuad, "mirrored quad")]
    {
        for integrator in ALL_AND_RUNS {
            let method = plain(integrator);
            let m = measure(&room(lamp), method.as_ref(), &format!("{name} {integrator}"), budget);
            for layer in method.orders(3) {
                let label = format!("{name} {integrator} order {layer}");
                family.layer(&label, layer, 4, &reference, &m);
            }
        }
    }
    family.finish(0.8);
}
