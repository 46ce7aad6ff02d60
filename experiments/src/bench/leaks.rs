//! `neumann bench leaks`: rays at edges and vertices of closed meshes from within, and on from what they meet there; none may get out.

use super::meshes::bumpy_ball;
use crate::cli::print;
use crate::error::{Error, Status};
use glam::{DQuat, DVec2, DVec3, dvec2, dvec3};
use rayon::prelude::*;
use sampling::bsdf::Lambert;
use sampling::math::Spectrum;
use sampling::rng::{Stream, mix2};
use sampling::{Vec3, vec2, warp};
use scenes::{CameraSettings, Kernel, MeshData, Ray, Scene, SceneBuilder, SceneError, Skip};

/// Where the meshes are: around the origin, which the beam's edges pass and the cube's corner is at when it is moved there, so that
/// coordinates are rounded least where those of other corners are rounded as ever; and far from it.
const OFFSETS: [DVec3; 3] = [DVec3::ZERO, DVec3::ONE, dvec3(100.0, 200.0, -50.0)];
/// Rays with random numbers of their own.
const CHUNK: u64 = 1 << 16;

/// A closed mesh, how far from the origin all is within it \[m\], and what is left out where it is searched.
type Case = (MeshData, f32, Skip);

/// Closed meshes around the origin: balls of 40, 1104 and 28 560 triangles; and, each as a list and in a tree, a cube, a roof with an edge
/// of 42 degrees, and a beam that is forty times as long as it is wide, askew.
fn cases() -> Vec<Case> {
    let cube = [dvec2(-1.0, -1.0), dvec2(1.0, -1.0), dvec2(1.0, 1.0), dvec2(-1.0, 1.0)];
    let roof = [dvec2(-1.6, 0.0), dvec2(1.0, -1.0), dvec2(1.0, 1.0)];
    let mut beam = prism(&cube.map(|p| p * 0.025));
    let turn = DQuat::from_axis_angle(dvec3(0.3, 0.8, 0.52).normalize(), 1.1);
    beam.positions.iter_mut().for_each(|p| *p = turn * *p);
    let balls = [5, 24, 120].map(|n| (bumpy_ball(n), 0.5, Skip::Unneeded));
    let prisms = [(prism(&cube), 0.5), (prism(&roof), 0.5), (beam, 0.0125)].into_iter();
    let both = prisms.flat_map(|(mesh, inner)| [Skip::Unneeded, Skip::Nothing].map(|skip| (mesh.clone(), inner, skip)));
    balls.into_iter().chain(both).collect()
}

/// A prism of height 2 over a convex outline that runs counter-clockwise.
fn prism(outline: &[DVec2]) -> MeshData {
    let n = outline.len() as u32;
    let positions = [-1.0, 1.0].iter().flat_map(|&z| outline.iter().map(move |p| p.extend(z))).collect();
    let side = |i: u32| {
        let [a, b] = [i, (i + 1) % n];
        [[a, b, b + n], [a, b + n, a + n]]
    };
    let end = |i: u32| [[0, i + 1, i], [n, n + i, n + i + 1]];
    let triangles = (0..n).flat_map(side).chain((1..n - 1).flat_map(end)).collect();
    MeshData { positions, triangles, ..MeshData::default() }
}

/// A closed mesh around its middle.
struct Closed {
    scene: Scene,
    middle: Vec3,
    /// What is so close to the middle is within \[m\].
    inner: f32,
    corners: Vec<Vec3>,
    triangles: Vec<[u32; 3]>,
}

/// Shoots at least so many rays with every kernel, and says how many got out.
pub(super) fn leaks(rays: u64, seed: u64) -> Result<Status, Error> {
    let cases = cases();
    let chunks = rays.div_ceil(CHUNK * (cases.len() * OFFSETS.len()) as u64).max(1);
    let mut text = String::new();
    let mut leaked = 0;
    for kernel in Kernel::available() {
        let (mut shot, mut out) = (0, 0);
        for (index, (case, offset)) in cases.iter().flat_map(|case| OFFSETS.map(|offset| (case, offset))).enumerate() {
            let mut closed = Closed::new(case.clone(), offset)?;
            closed.scene.set_kernel(kernel);
            let seed = mix2(seed, index as u64);
            let counts = (0..chunks).into_par_iter().map(|chunk| closed.escapes(Stream::new(seed, chunk)));
            let [these, escaped] = counts.reduce(|| [0; 2], |one, other| [one[0] + other[0], one[1] + other[1]]);
            (shot, out) = (shot + these, out + escaped);
        }
        text += &format!("{kernel}: {out} of {shot} rays got out\n");
        leaked += out;
    }
    print(&text)?;
    Ok(if leaked == 0 { Status::Done } else { Status::Failed })
}

impl Closed {
    fn new((mut mesh, inner, skip): Case, offset: DVec3) -> Result<Self, SceneError> {
        mesh.positions.iter_mut().for_each(|p| *p += offset);
        let corners = mesh.positions.iter().map(|p| p.as_vec3()).collect();
        let triangles = mesh.triangles.clone();
        let mut builder = SceneBuilder::new("closed");
        let grey = builder.material(Lambert { albedo: Spectrum::splat(0.5) });
        // A speck keeps the scene from being recentred.
        builder.sphere(offset * -0.5, 1e-3, grey);
        builder.mesh(mesh, grey);
        builder.camera(CameraSettings::pinhole(offset, offset + DVec3::X, 40.0, (16, 16)));
        Ok(Closed { scene: builder.build(skip)?, middle: offset.as_vec3(), inner, corners, triangles })
    }

    /// How many rays a chunk has, and how many of them meet nothing, by either question: after each another goes on from where it ends.
    fn escapes(&self, mut stream: Stream) -> [u64; 2] {
        let (mut shot, mut out) = (0, 0);
        let mut shoot = |ray: &Ray| {
            let hit = self.scene.intersect(ray);
            shot += 1;
            out += u64::from(hit.is_none() || !self.scene.occluded(ray));
            hit
        };
        for _ in 0..CHUNK / 2 {
            let ray = self.ray(&mut stream);
            let Some(hit) = shoot(&ray) else { continue };
            let d = warp::uniform_sphere(vec2(stream.next_f32(), stream.next_f32()));
            let cos = hit.point.ng.dot(d);
            // What is exactly along the surface leaves to neither side.
            if cos != 0.0 {
                shoot(&hit.point.spawn(if cos * hit.point.ng.dot(ray.d) > 0.0 { -d } else { d }));
            }
        }
        [shot, out]
    }

    /// A ray from within at a vertex or a point of an edge; of some the origin is exactly above it.
    fn ray(&self, stream: &mut Stream) -> Ray {
        let mut next = || stream.next_f32();
        let triangle = self.triangles[(next() * self.triangles.len() as f32) as usize];
        let side = (next() * 3.0) as usize;
        let [a, b] = [triangle[side], triangle[(side + 1) % 3]].map(|v| self.corners[v as usize]);
        let share = [0.0, 0.5, next()][(next() * 3.0) as usize];
        let target = a + (b - a) * share;
        let mut corner = || self.corners[(next() * self.corners.len() as f32) as usize] - self.middle;
        let [one, other] = [corner(), corner()];
        let mut o = self.middle + one.lerp(other, next()) * 0.45 * next();
        let axis = (next() * 3.0) as usize;
        let mut above = o;
        above[axis] = target[axis];
        if next() < 0.3 && (above - self.middle).length() < self.inner {
            o = above;
        }
        Ray::new(o, (target - o).normalize_or_zero())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_ray_gets_out_and_from_outside_some_do() {
        for (case, offset) in cases().into_iter().zip(OFFSETS.into_iter().cycle()) {
            let mut closed = Closed::new(case, offset).unwrap();
            let [shot, out] = closed.escapes(Stream::new(1, 1));
            assert!(shot > CHUNK * 9 / 10 && out == 0, "{out} of {shot}");
            closed.middle += Vec3::splat(3.0);
            assert!(closed.escapes(Stream::new(1, 1))[1] > 0);
        }
    }
}
