//! Normals that a map has tilted, and about which of them light scatters.
//!
//! Seen from `v` and lit from `l`, a surface whose normal n is tilted to n′ scatters radiance with the kernel
//! `f(v, l) |cos θ′_l| S(l)`, whose directions and cosine are taken to n′: nothing else is known of the relief. It is zero where
//! n and n′ disagree about the side of a direction. Importance has the same kernel with its arguments exchanged \[Veach97, 5.3\].
//!
//! Such a kernel is not reciprocal, and loses light: there are directions from which the surface is seen, but n′ is not. The
//! [`Remedies`] say what is done about that.

use sampling::bsdf::TransportMode;
use sampling::math::Frame;
use sampling::{Vec3, vec3};

/// What is done where a tilted normal fails a surface; by default all that can be.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Remedies {
    /// A face that is turned away from whom the surface is turned to is tilted the other way, rather than black.
    pub turning: bool,
    /// Light is dimmed the more it grazes the surface, by S(l) \[Conty19\], so that it doesn't end abruptly where the surface itself
    /// is turned away from it.
    pub shadowing: bool,
}

impl Remedies {
    /// Normals that are tilted, and nothing else.
    pub const NONE: Self = Self { turning: false, shadowing: false };
    /// The names by which they are declared.
    pub const NAMES: [&str; 4] = ["turned_and_shadowed", "turned", "shadowed", "plain"];
    /// All of them, in the order of their names.
    pub const ALL: [Self; 4] = [
        Self { turning: true, shadowing: true },
        Self { turning: true, shadowing: false },
        Self { turning: false, shadowing: true },
        Self::NONE,
    ];

    /// The name by which these are declared.
    pub fn name(self) -> &'static str {
        let is_this = |(_, remedies): &(_, _)| *remedies == self;
        Self::NAMES.into_iter().zip(Self::ALL).find(is_this).expect("all of them have names").0
    }
}

impl Default for Remedies {
    fn default() -> Self {
        Self { turning: true, shadowing: true }
    }
}

/// A tilted normal. Directions are in the frame of the surface's own normal, z.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Tilt {
    /// Unit; its z is positive.
    pub normal: Vec3,
    /// What is done where it fails.
    pub remedies: Remedies,
}

/// Which way a normal is tilted.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Face {
    /// As the map has it.
    Mapped,
    /// The other way.
    Turned,
}

impl Tilt {
    /// What the surface turns to who sees it from here.
    #[inline]
    pub fn seen_from(&self, viewer: Vec3) -> Face {
        if self.remedies.turning && !self.has_on_one_side(Face::Mapped, viewer) { Face::Turned } else { Face::Mapped }
    }

    /// The unit normal of a face.
    #[inline]
    pub fn normal_of(&self, face: Face) -> Vec3 {
        match face {
            Face::Mapped => self.normal,
            Face::Turned => vec3(-self.normal.x, -self.normal.y, self.normal.z),
        }
    }

    /// The frame about the normal of a face; its x axis is nearest to the surface's.
    #[inline]
    pub fn frame(&self, face: Face) -> Frame {
        Frame::from_z_x(self.normal_of(face), Vec3::X)
    }

    /// S(l), the share of light from here that reaches the relief \[Conty19\]: Smith's masking by facets of GGX that are about as
    /// rough as a relief with such tilts.
    #[inline]
    pub fn shadowing(&self, light: Vec3) -> f32 {
        if !self.remedies.shadowing {
            return 1.0;
        }
        let alpha_squared = (0.125 * tan_squared(self.normal)).min(1.0);
        2.0 / (1.0 + (1.0 + alpha_squared * tan_squared(light)).sqrt())
    }

    /// The probability with which a walk that comes from `wo` is scattered about this face's normal.
    ///
    /// Which face it is depends on the viewer. A walk from a light doesn't know who that will be: it chooses a face, about as often as
    /// matte surfaces are seen to have it, and one that is then left in a direction which sees the other ends.
    #[inline]
    pub fn probability(&self, face: Face, wo: Vec3, mode: TransportMode) -> f32 {
        let of_mapped = match mode {
            TransportMode::Radiance => f32::from(u8::from(self.seen_from(wo) == Face::Mapped)),
            TransportMode::Importance if !self.remedies.turning => 1.0,
            TransportMode::Importance => {
                match [Face::Mapped, Face::Turned].map(|face| self.has_on_one_side(face, wo)) {
                    [true, true] => self.share_of_mapped(),
                    [mapped, _] => f32::from(u8::from(mapped)),
                }
            }
        };
        match face {
            Face::Mapped => of_mapped,
            Face::Turned => 1.0 - of_mapped,
        }
    }

    /// The face that `uc` chooses with its [`probability`](Self::probability), and what is left of it.
    #[inline]
    pub fn choose(&self, uc: f32, wo: Vec3, mode: TransportMode) -> (Face, f32) {
        let of_mapped = self.probability(Face::Mapped, wo, mode);
        let (face, rest) = match uc < of_mapped {
            true => (Face::Mapped, uc / of_mapped),
            false => (Face::Turned, (uc - of_mapped) / (1.0 - of_mapped)),
        };
        (face, rest.clamp(0.0, 1.0f32.next_down()))
    }

    /// Whether a direction is on the same side of the surface and of a face.
    #[inline]
    fn has_on_one_side(&self, face: Face, w: Vec3) -> bool {
        same_side(w.z, w.dot(self.normal_of(face)))
    }

    /// Of what Lambertian faces scatter to the directions that see them, the share of the mapped one.
    ///
    /// Of the projected hemisphere about n′, (1 + cos θ)/2 is above the surface; of that about the turned normal,
    /// (cos θ − cos 2θ)/2 is between the surface and the plane across n′, where the turned face is seen.
    #[inline]
    fn share_of_mapped(&self) -> f32 {
        let cos = self.normal.z;
        let (mapped, turned) = (1.0 + cos, (1.0 - cos) * (1.0 + 2.0 * cos));
        mapped / (mapped + turned)
    }
}

/// The square of the tangent of the angle to z.
#[inline]
fn tan_squared(w: Vec3) -> f32 {
    (w.x * w.x + w.y * w.y) / (w.z * w.z)
}

/// True if both cosines are positive or both negative; their product might underflow.
#[inline]
pub(crate) fn same_side(a: f32, b: f32) -> bool {
    (a > 0.0 && b > 0.0) || (a < 0.0 && b < 0.0)
}

#[cfg(test)]
mod tests;
