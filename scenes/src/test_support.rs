//! What several tests build on.

use crate::builder::{CameraSettings, MeshData, SceneBuilder};
use crate::material::MaterialId;
use crate::needs::Skip;
use crate::scene::Scene;
use crate::texture::Texture;
use glam::{DVec3, dvec3};
use sampling::bsdf::Lambert;
use sampling::math::Spectrum;
use sampling::rng::Stream;
use sampling::{Vec2, Vec3, vec2, warp};

/// A stream of random numbers.
pub(crate) struct Random(Stream);

impl Random {
    pub fn new(seed: u64) -> Self {
        Random(Stream::new(seed, 1))
    }

    pub fn next_1d(&mut self) -> f32 {
        self.0.next_f32()
    }

    pub fn next_2d(&mut self) -> Vec2 {
        let x = self.next_1d();
        vec2(x, self.next_1d())
    }

    /// A uniform direction.
    pub fn direction(&mut self) -> Vec3 {
        warp::uniform_sphere(self.next_2d())
    }
}

/// An empty scene with a camera and a grey material.
pub(crate) fn grey_builder(name: &str) -> (SceneBuilder, MaterialId) {
    let mut builder = SceneBuilder::new(name);
    let grey = builder.material(Lambert { albedo: Spectrum::splat(0.5) });
    builder.camera(CameraSettings::pinhole(dvec3(0.0, 0.0, 5.0), DVec3::ZERO, 40.0, (64, 48)));
    (builder, grey)
}

/// The six faces of a box from `low` to `high` as quads whose fronts look inside.
pub(crate) fn add_room(builder: &mut SceneBuilder, low: DVec3, high: DVec3, material: MaterialId) {
    let (x, y, z) = (DVec3::X * (high - low), DVec3::Y * (high - low), DVec3::Z * (high - low));
    for (edge_u, edge_v, across) in [(x, y, z), (y, z, x), (z, x, y)] {
        builder.quad(low, edge_u, edge_v, material);
        builder.quad(low + across, edge_v, edge_u, material);
    }
}

/// A closed bumpy ball around the origin, about 4·n² triangles with shared vertices; radius about 1.
pub(crate) fn bumpy_ball(n: usize) -> MeshData {
    use std::f64::consts::PI;
    let place = |theta: f64, phi: f64| {
        let radius = 1.0 + 0.15 * (7.0 * phi).sin() * (5.0 * theta).sin() * theta.sin();
        dvec3(theta.sin() * phi.cos(), theta.cos(), theta.sin() * phi.sin()) * radius
    };
    let columns = 2 * n;
    let mut positions = vec![place(0.0, 0.0)];
    for row in 1..n {
        positions.extend((0..columns).map(|c| place(row as f64 / n as f64 * PI, c as f64 / n as f64 * PI)));
    }
    positions.push(place(PI, 0.0));
    let last = positions.len() as u32 - 1;
    let at = |row: usize, column: usize| match row {
        0 => 0,
        row if row == n => last,
        row => (1 + (row - 1) * columns + column % columns) as u32,
    };
    let mut triangles = Vec::new();
    for row in 0..n {
        for column in 0..columns {
            let [a, b, c, d] =
                [(row, column), (row, column + 1), (row + 1, column + 1), (row + 1, column)].map(|(r, c)| at(r, c));
            triangles
                .extend([[a, b, c], [a, c, d]].into_iter().filter(|t| t[0] != t[1] && t[1] != t[2] && t[2] != t[0]));
        }
    }
    MeshData { positions, triangles, ..MeshData::default() }
}

/// A ramp along the z axis through the origin, per metre.
pub(crate) fn ramp_z(base: Spectrum, slope: Spectrum) -> Texture {
    Texture::Ramp { base, slope, axis: Vec3::Z, origin: DVec3::ZERO, scale: 1.0 }
}

/// Builds, and panics with the message if that fails.
pub(crate) fn built(builder: SceneBuilder, skip: Skip) -> Scene {
    builder.build(skip).unwrap_or_else(|error| panic!("{error}"))
}
