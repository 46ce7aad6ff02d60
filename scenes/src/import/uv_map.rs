//! Where in a pattern a point lies, as importers write it.

use glam::DVec2;

use super::translation::numbers;

/// Where in a pattern a point lies: `uv · scale + offset`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct UvMap {
    pub scale: DVec2,
    pub offset: DVec2,
}

impl UvMap {
    /// That of an image that is stretched over a surface once.
    pub const IDENTITY: Self = Self { scale: DVec2::ONE, offset: DVec2::ZERO };
    /// The same with v the other way round.
    pub const TURNED: Self = Self { scale: DVec2::new(1.0, -1.0), offset: DVec2::new(0.0, 1.0) };

    /// This and then the next.
    pub fn then(self, next: Self) -> Self {
        Self { scale: self.scale * next.scale, offset: self.offset * next.scale + next.offset }
    }

    /// As keys of an inline table.
    pub fn keys(self) -> String {
        let mut text = String::new();
        if self.scale != DVec2::ONE {
            text += &format!(", uv_scale = {}", numbers(&self.scale.to_array()));
        }
        if self.offset != DVec2::ZERO {
            text += &format!(", uv_offset = {}", numbers(&self.offset.to_array()));
        }
        text
    }
}
