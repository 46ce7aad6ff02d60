//! What is known of surfaces beyond where they are: looked up once a ray has met one.

use crate::emitter::EmitterId;
use crate::material::MaterialId;
use crate::ray::UNIT_ROUNDOFF;
use crate::relief::Derivatives;
use crate::shape::{Cylinder, Disk};
use crate::texture::SurfaceCoordinates;
use sampling::math::Spectrum;
use sampling::{Vec2, Vec3, warp};
use std::f32::consts::{FRAC_1_PI, PI};

/// What a triangle has of its own.
#[derive(Clone, Copy, Debug)]
pub(crate) struct TriangleInfo {
    /// Unit normal of its front.
    pub ng: Vec3,
    /// What rounding in `f64` may leave of the error of a point on it \[m\].
    pub residual: f32,
    /// The surface it belongs to.
    pub surface: u32,
}

/// Names a surface of a scene: a shape, all of which has one material. One that is in a group is the same in every instance.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct SurfaceId(pub u32);

/// What all of a shape has in common.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Surface {
    pub id: SurfaceId,
    pub material: MaterialId,
    pub emitter: Option<EmitterId>,
    /// Its place among the meshes with vertex normals, texture coordinates or colours.
    pub attributes: Option<u32>,
    /// Its area \[m²\], one side; `None` in a group, whose instances have areas of their own.
    pub area: Option<f64>,
}

/// What an analytic surface has of its own.
#[derive(Clone, Debug)]
pub(crate) struct AnalyticInfo {
    /// The surface it belongs to.
    pub surface: u32,
    /// Its texture coordinates.
    pub chart: Chart,
}

/// The texture coordinates of an analytic surface.
#[derive(Clone, Debug)]
pub(crate) enum Chart {
    Sphere(SphereChart),
    Disk(Box<Disk>),
    Cylinder(Box<Cylinder>),
}

impl Chart {
    /// Where textures are read at the point `p` with this front normal.
    pub fn coordinates(&self, p: Vec3, ng: Vec3) -> SurfaceCoordinates {
        let uv = match self {
            Self::Sphere(sphere) => sphere.uv(ng),
            Self::Disk(disk) => disk.uv(p),
            Self::Cylinder(cylinder) => cylinder.uv(p),
        };
        SurfaceCoordinates { uv, ..SurfaceCoordinates::of(p) }
    }

    /// What rounding may leave of the error of a point before it is rounded \[m\].
    pub fn residual(&self) -> f32 {
        match self {
            // The evaluation is in f64; what it leaves is far below this.
            Self::Sphere(sphere) => sphere.radius * UNIT_ROUNDOFF,
            Self::Disk(disk) => disk.residual(),
            Self::Cylinder(cylinder) => cylinder.residual(),
        }
    }

    /// How that point moves with its texture coordinates.
    pub fn derivatives(&self, p: Vec3, ng: Vec3) -> Derivatives {
        match self {
            Self::Sphere(sphere) => sphere.derivatives(ng),
            Self::Disk(disk) => disk.derivatives(p),
            Self::Cylinder(cylinder) => cylinder.derivatives(p),
        }
    }
}

/// The texture coordinates of a sphere.
#[derive(Clone, Copy, Debug)]
pub(crate) struct SphereChart {
    /// True if its front is the inside.
    pub flipped: bool,
    /// Radius \[m\].
    pub radius: f32,
    /// Its own axes in the scene; unit. The last is the pole that v grows towards; u grows from the first to the second.
    pub axes: [Vec3; 3],
}

impl SphereChart {
    /// The texture coordinates of the point with this front normal: the longitude over 2π in [0, 1), and the latitude, 0 at the
    /// south pole and 1 at the north.
    fn uv(&self, ng: Vec3) -> Vec2 {
        let [x, y, z] = self.axes.map(|axis| axis.dot(self.outwards(ng)));
        Vec2::new(warp::turns(y, x), 1.0 - z.clamp(-1.0, 1.0).acos() * FRAC_1_PI)
    }

    /// How that point moves with its texture coordinates; zero along u at the poles.
    fn derivatives(&self, ng: Vec3) -> Derivatives {
        let outwards = self.outwards(ng);
        let pole = self.axes[2];
        let mirrored = self.axes[0].cross(self.axes[1]).dot(pole) < 0.0;
        // As long as the sine of the angle to the pole, and so is what remains of the pole across the normal.
        let east = if mirrored { outwards.cross(pole) } else { pole.cross(outwards) };
        let north = (pole - outwards * pole.dot(outwards)).normalize_or_zero();
        Derivatives { dpdu: east * (2.0 * PI * self.radius), dpdv: north * (PI * self.radius) }
    }

    fn outwards(&self, ng: Vec3) -> Vec3 {
        if self.flipped { -ng } else { ng }
    }
}

/// Vertex normals, texture coordinates and colours of a mesh, and how its triangles move with texture coordinates; each may be
/// empty.
#[derive(Clone, Debug, Default)]
pub(crate) struct Attributes {
    /// The id of the mesh's first triangle.
    pub first: u32,
    /// Vertices of the triangles.
    pub triangles: Vec<[u32; 3]>,
    pub normals: Vec<Vec3>,
    pub uvs: Vec<Vec2>,
    /// Of the vertices.
    pub colours: Vec<Spectrum>,
    /// Of each triangle; only for materials that are anisotropic or have relief.
    pub derivatives: Vec<Derivatives>,
}

impl Attributes {
    /// The interpolated normal of a triangle at barycentric coordinates `b`, on the side of `ng`; `ng` where it vanishes.
    #[inline]
    pub fn normal(&self, id: u32, b: Vec2, ng: Vec3) -> Vec3 {
        if self.normals.is_empty() {
            return ng;
        }
        let vertices = self.triangles[(id - self.first) as usize];
        let [n0, n1, n2] = vertices.map(|vertex| self.normals[vertex as usize]);
        let normal = n0 * (1.0 - b.x - b.y) + n1 * b.x + n2 * b.y;
        match normal.try_normalize() {
            Some(ns) if ns.dot(ng) >= 0.0 => ns,
            Some(ns) => -ns,
            None => ng,
        }
    }

    /// How a triangle moves with its texture coordinates; zero where nothing is known of it.
    #[inline]
    pub fn derivatives(&self, id: u32) -> Derivatives {
        self.derivatives.get((id - self.first) as usize).copied().unwrap_or_default()
    }

    /// Where textures are read at the point `p` of a triangle, at barycentric coordinates `b`.
    pub fn coordinates(&self, p: Vec3, id: u32, b: Vec2) -> SurfaceCoordinates {
        SurfaceCoordinates { p, uv: self.uv(id, b), colour: self.colour(id, b) }
    }

    /// The colour of a triangle at barycentric coordinates `b`; white if the mesh has none.
    fn colour(&self, id: u32, b: Vec2) -> Spectrum {
        if self.colours.is_empty() {
            return Spectrum::ONE;
        }
        let [c0, c1, c2] = self.triangles[(id - self.first) as usize].map(|vertex| self.colours[vertex as usize]);
        c0 * (1.0 - b.x - b.y) + c1 * b.x + c2 * b.y
    }

    /// The texture coordinates of a triangle at barycentric coordinates `b`; these themselves if the mesh has none.
    #[inline]
    fn uv(&self, id: u32, b: Vec2) -> Vec2 {
        if self.uvs.is_empty() {
            return b;
        }
        let [uv0, uv1, uv2] = self.triangles[(id - self.first) as usize].map(|vertex| self.uvs[vertex as usize]);
        uv0 * (1.0 - b.x - b.y) + uv1 * b.x + uv2 * b.y
    }
}

/// How a triangle of these corners moves with these texture coordinates; zero where they span nothing.
pub(crate) fn derivatives([p0, p1, p2]: [Vec3; 3], [uv0, uv1, uv2]: [Vec2; 3]) -> Derivatives {
    let (d1, d2) = (uv1 - uv0, uv2 - uv0);
    let scale = d1.perp_dot(d2);
    let (along_u, along_v) = ((p1 - p0) * d2.y - (p2 - p0) * d1.y, (p2 - p0) * d1.x - (p1 - p0) * d2.x);
    let (dpdu, dpdv) = (along_u / scale, along_v / scale);
    if dpdu.is_finite() && dpdv.is_finite() { Derivatives { dpdu, dpdv } } else { Derivatives::default() }
}
