//! Meshes of any number of triangles, to measure on.

use glam::{DVec3, dvec3};
use sampling::bsdf::{Bsdf, Lambert};
use sampling::math::Spectrum;
use scenes::texture::Texture;
use scenes::{CameraSettings, Emission, MaterialId, MeshData, Scene, SceneBuilder, SceneError, Skip};
use std::f64::consts::PI;

/// A closed bumpy ball around the origin with shared vertices: 2·n² triangles, of radius 0.85 to 1.15 m.
pub(super) fn bumpy_ball(n: usize) -> MeshData {
    let place = |row: f64, column: f64| {
        let (theta, phi) = (row / n as f64 * PI, column / n as f64 * 2.0 * PI);
        let radius = 1.0 + 0.15 * (7.0 * phi).sin() * (5.0 * theta).sin() * theta.sin();
        dvec3(theta.sin() * phi.cos(), theta.cos(), theta.sin() * phi.sin()) * radius
    };
    let inner = (1..n).flat_map(|row| (0..n).map(move |column| place(row as f64, column as f64)));
    let positions: Vec<DVec3> = [DVec3::Y].into_iter().chain(inner).chain([-DVec3::Y]).collect();
    let last = positions.len() - 1;
    let at = |row: usize, column: usize| match row {
        0 => 0,
        row if row == n => last,
        row => 1 + (row - 1) * n + column % n,
    };
    let cell = |row: usize, column: usize| {
        let [a, b] = [at(row, column), at(row, column + 1)];
        let [c, d] = [at(row + 1, column + 1), at(row + 1, column)];
        [[a, b, c], [a, c, d]]
    };
    let all = (0..n).flat_map(|row| (0..n).flat_map(move |column| cell(row, column)));
    // At the poles two corners of a triangle are one.
    let whole = all.filter(|[a, b, c]| a != b && b != c && c != a);
    let triangles = whole.map(|triangle| triangle.map(|v| v as u32)).collect();
    MeshData { positions, triangles, ..MeshData::default() }
}

/// The ball in a room with a lamp.
pub(super) fn ball_in_a_room(n: usize, size: (u32, u32)) -> Result<Scene, SceneError> {
    let mut builder = SceneBuilder::new(&format!("ball of {} triangles", 2 * n * (n - 1)));
    let grey = builder.material(Lambert { albedo: Spectrum::splat(0.5) });
    builder.mesh(bumpy_ball(n), grey);
    walls(&mut builder, grey);
    lamp(&mut builder, grey);
    builder.camera(camera(size));
    builder.build(Skip::Unneeded)
}

/// What lights a room.
#[derive(Clone, Copy, Debug)]
pub(super) enum Light {
    /// A surface.
    Lamp,
    /// A point, which no ray meets.
    Point,
}

/// A room of this material with a ball of it.
pub(super) fn room(name: &str, material: Bsdf, light: Light, size: (u32, u32)) -> SceneBuilder {
    let mut builder = SceneBuilder::new(name);
    let material = builder.material(material);
    builder.sphere(DVec3::ZERO, 0.8, material);
    walls(&mut builder, material);
    match light {
        Light::Lamp => lamp(&mut builder, material),
        Light::Point => builder.point_emitter(dvec3(0.0, 1.4, 0.0), Spectrum::ONE),
    }
    builder.camera(camera(size));
    builder
}

fn walls(builder: &mut SceneBuilder, material: MaterialId) {
    let (low, size) = (dvec3(-2.0, -1.5, -2.0), dvec3(4.0, 3.2, 4.5));
    let [x, y, z] = [DVec3::X * size, DVec3::Y * size, DVec3::Z * size];
    for (edge_u, edge_v, across) in [(x, y, z), (y, z, x), (z, x, y)] {
        builder.quad(low, edge_u, edge_v, material);
        builder.quad(low + across, edge_v, edge_u, material);
    }
}

fn lamp(builder: &mut SceneBuilder, material: MaterialId) {
    let lamp = builder.quad(dvec3(-0.5, 1.69, -0.5), DVec3::X, DVec3::Z, material);
    builder.emit(lamp, Emission { radiance: Texture::Constant(Spectrum::ONE), two_sided: true });
}

fn camera(size: (u32, u32)) -> CameraSettings {
    CameraSettings::pinhole(dvec3(1.2, 0.5, 2.3), DVec3::ZERO, 60.0, size)
}
