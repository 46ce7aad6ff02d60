//! Where a camera stands and how it is turned.

use super::CameraSettings;
use crate::error::SceneError;
use glam::DVec3;
use sampling::{Vec2, Vec3, vec2};

/// A place and an orthonormal frame.
#[derive(Clone, Copy, Debug)]
pub(super) struct View {
    /// Where it stands \[m\].
    pub position: Vec3,
    /// Unit direction of view.
    pub forward: Vec3,
    /// Unit direction to the right in the image; that of a mirrored image is to the left of the view.
    pub right: Vec3,
    /// Unit direction up in the image.
    pub up: Vec3,
}

impl View {
    /// The view that the settings describe, in coordinates shifted by `−shift`.
    pub fn new(settings: &CameraSettings, shift: DVec3) -> Result<Self, SceneError> {
        let CameraSettings { position, target, up, mirrored, .. } = *settings;
        if !(position.is_finite() && target.is_finite() && up.is_finite()) {
            return Err(SceneError::invalid("the camera has a coordinate that is not finite", "give finite numbers"));
        }
        let forward = (target - position).try_normalize().ok_or_else(|| {
            SceneError::invalid("the camera's target is its position", "move `target` to a point the camera looks at")
        })?;
        let right = up
            .try_normalize()
            .map(|up| forward.cross(up))
            .filter(|right| right.length() > 1e-9)
            .ok_or_else(|| {
                SceneError::invalid(
                    "the camera's `up` is zero or parallel to its direction of view",
                    "choose an `up` at an angle to `target - position`",
                )
            })?
            .normalize();
        Ok(View {
            position: (position - shift).as_vec3(),
            forward: forward.as_vec3(),
            right: (if mirrored { -right } else { right }).as_vec3(),
            up: right.cross(forward).as_vec3(),
        })
    }

    /// The components of a vector to the right and up in the image.
    #[inline]
    pub fn across(&self, v: Vec3) -> Vec2 {
        vec2(v.dot(self.right), v.dot(self.up))
    }

    /// The point of the plane through the position, across the view, that these components lead to.
    #[inline]
    pub fn point(&self, across: Vec2) -> Vec3 {
        self.position + self.right * across.x + self.up * across.y
    }
}
