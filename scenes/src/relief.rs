//! Normal maps and bump maps: normals that textures tilt.

use crate::texture::{SurfaceCoordinates, Texture};
use crate::tilt::Remedies;
use sampling::math::Frame;
use sampling::{Vec2, Vec3, vec3};

/// What tilts a surface's normals.
#[derive(Clone, Debug)]
pub struct Relief {
    /// By how much.
    pub map: ReliefMap,
    /// What is done where tilted normals fail the surface.
    pub remedies: Remedies,
}

/// By how much normals are tilted.
#[derive(Clone, Debug)]
pub enum ReliefMap {
    /// The normal in the frame of dp/du, dp/dv and the surface's normal, as `2c − 1` of a colour c.
    Normals(Texture),
    /// The height above the surface \[m\].
    Heights(Texture),
}

/// How a surface point moves with its texture coordinates \[m\].
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Derivatives {
    pub dpdu: Vec3,
    pub dpdv: Vec3,
}

impl From<ReliefMap> for Relief {
    fn from(map: ReliefMap) -> Self {
        Self { map, remedies: Remedies::default() }
    }
}

impl ReliefMap {
    /// The texture.
    pub fn texture(&self) -> &Texture {
        match self {
            Self::Normals(texture) | Self::Heights(texture) => texture,
        }
    }

    /// The texture, to be changed.
    pub(crate) fn texture_mut(&mut self) -> &mut Texture {
        match self {
            Self::Normals(texture) | Self::Heights(texture) => texture,
        }
    }

    /// The tilted normal at a point, in the surface's frame, whose x axis runs along dp/du; its z is positive.
    pub(crate) fn normal(&self, frame: &Frame, at: &SurfaceCoordinates, derivatives: &Derivatives) -> Vec3 {
        match self {
            Self::Normals(texture) => {
                let [x, y, z] = texture.at(at).to_array().map(|channel| 2.0 * channel - 1.0);
                // Where the texture is mirrored on the surface, v runs against the frame's y axis.
                let y = if derivatives.dpdv.dot(frame.y) < 0.0 { -y } else { y };
                upwards(vec3(x, y, z))
            }
            Self::Heights(texture) => {
                let slope = surface_gradient(texture, frame, at, derivatives);
                upwards(vec3(-slope.x, -slope.y, 1.0))
            }
        }
    }
}

/// A unit normal above the surface: a normal map's direction below it stands for the steepest above, one degree from level.
fn upwards(normal: Vec3) -> Vec3 {
    const LEAST: f32 = 0.0175;
    let unit = normal.normalize_or(Vec3::Z);
    if unit.z >= LEAST {
        return unit;
    }
    vec3(unit.x, unit.y, 0.0).normalize_or(Vec3::X) * (1.0 - LEAST * LEAST).sqrt() + Vec3::Z * LEAST
}

/// The gradient of a height over the surface, in the frame's x and y \[1\], from its slopes along u and v `[Mikkelsen10]`.
fn surface_gradient(texture: &Texture, frame: &Frame, at: &SurfaceCoordinates, derivatives: &Derivatives) -> Vec2 {
    let Derivatives { dpdu, dpdv } = *derivatives;
    // What is read by position has no u and v: there they are lengths along the frame's axes. What is read by texture coordinates
    // that don't vary has no slope.
    let has_uv = dpdu != Vec3::ZERO && dpdv != Vec3::ZERO && texture.needs_uv();
    if texture.needs_uv() && !has_uv {
        return Vec2::ZERO;
    }
    let (along_u, along_v) = if has_uv { (dpdu, dpdv) } else { (frame.x, frame.y) };
    let slope = match texture {
        Texture::Image(image) => image.slope(at.uv),
        _ => slope_by_differences(texture, at, [along_u, along_v], has_uv),
    };
    let (u, v) = (frame.to_local(along_u).truncate(), frame.to_local(along_v).truncate());
    let area = u.perp_dot(v);
    if area == 0.0 {
        return Vec2::ZERO;
    }
    // The gradient g has g·u and g·v for its slopes.
    Vec2::new(slope.x * v.y - slope.y * u.y, slope.y * u.x - slope.x * v.x) / area
}

/// How a height grows along u and v, which move a point along two vectors.
fn slope_by_differences(texture: &Texture, at: &SurfaceCoordinates, [u, v]: [Vec3; 2], has_uv: bool) -> Vec2 {
    let (step, length) = texture.step();
    let step = if has_uv { step } else { Vec2::splat(length) };
    let height = |du: f32, dv: f32| {
        let p = at.p + u * du + v * dv;
        texture.at(&SurfaceCoordinates { p, uv: at.uv + Vec2::new(du, dv), ..*at }).mean()
    };
    let across = |du: f32, dv: f32| height(du, dv) - height(-du, -dv);
    Vec2::new(across(step.x, 0.0), across(0.0, step.y)) / (2.0 * step)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::texture::{Channel, Image, ImageTexture, UvMap, Wrap};
    use sampling::math::Spectrum;
    use std::sync::Arc;

    #[test]
    fn a_plane_of_heights_tilts_by_its_slope_whatever_the_coordinates() {
        let ramp = Texture::Ramp {
            base: Spectrum::ZERO,
            slope: Spectrum::splat(0.5),
            axis: Vec3::X,
            origin: glam::DVec3::ZERO,
            scale: 1.0,
        };
        let relief = ReliefMap::Heights(ramp);
        let frame = Frame::from_z_x(Vec3::Z, Vec3::X);
        let at = SurfaceCoordinates::of(vec3(0.3, 0.4, 0.0));
        let expected = vec3(-0.5, 0.0, 1.0).normalize();
        for (dpdu, dpdv) in [(Vec3::X, Vec3::Y), (vec3(2.0, 1.0, 0.0), vec3(0.3, -0.4, 0.0)), (Vec3::ZERO, Vec3::ZERO)]
        {
            let normal = relief.normal(&frame, &at, &Derivatives { dpdu, dpdv });
            assert!((normal - expected).length() < 1e-3, "{normal}");
        }
    }

    #[test]
    fn heights_of_an_image_have_the_slope_of_what_is_read() {
        let texels = (0..12).map(|i| [((7 * i) % 5) as f32 * 0.1; 4]).collect();
        let image = Arc::new(Image::from_linear(4, 3, texels).unwrap());
        for wrap in Wrap::ALL {
            let map = UvMap { scale: Vec2::new(1.3, -2.0), offset: Vec2::new(0.2, 0.7) };
            let (channel, scale) = (Channel::Colour, Spectrum::splat(0.8));
            let heights = ImageTexture { image: image.clone(), wrap, map, channel, scale };
            for i in 0..200 {
                let uv = Vec2::new(i as f32 * 0.754_877_7, i as f32 * 0.569_840_3).fract() * 2.0;
                let step = 1.0 / 1024.0;
                let across = |d: Vec2| (heights.at(uv + d * step) - heights.at(uv - d * step)).mean() / (2.0 * step);
                let (slope, expected) = (heights.slope(uv), Vec2::new(across(Vec2::X), across(Vec2::Y)));
                // Where a texel's centre is between the two points, the difference is that of two slopes.
                let place = map.at(uv) * Vec2::new(4.0, 3.0) + 0.5;
                let near = |x: f32, scale: f32| (x - x.round()).abs() < 1.5 * step * scale;
                let at_a_centre = near(place.x, 1.3 * 4.0) || near(place.y, 2.0 * 3.0);
                assert!(at_a_centre || (slope - expected).length() < 2e-3, "{wrap:?} {uv}: {slope} {expected}");
            }
        }
    }

    #[test]
    fn a_normal_map_follows_u_and_v_even_where_it_is_mirrored() {
        let relief = ReliefMap::Normals(Texture::Constant(Spectrum::new(0.5, 0.9, 0.8)));
        let frame = Frame::from_z_x(Vec3::Z, Vec3::X);
        let at = SurfaceCoordinates::of(Vec3::ZERO);
        for (dpdv, y) in [(Vec3::Y, 0.8), (-Vec3::Y, -0.8)] {
            let normal = relief.normal(&frame, &at, &Derivatives { dpdu: Vec3::X, dpdv });
            assert!((normal - vec3(0.0, y, 0.6)).length() < 1e-6, "{normal}");
        }
    }

    #[test]
    fn normals_stay_above_the_surface() {
        for map in [[0.9, 0.5, 0.2], [0.5, 0.5, 0.0], [0.5, 0.5, 0.5]] {
            let relief = ReliefMap::Normals(Texture::Constant(Spectrum::from(map)));
            let frame = Frame::from_z(Vec3::Z);
            let normal = relief.normal(&frame, &SurfaceCoordinates::of(Vec3::ZERO), &Derivatives::default());
            assert!(normal.z > 0.0 && (normal.length() - 1.0).abs() < 1e-6, "{normal}");
        }
    }
}
