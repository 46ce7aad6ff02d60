//! How the mean of a method's images stands to the truth.

use serde::Serialize;

/// The bias of a method's estimates of the light that it carries.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Bias {
    /// The mean is the truth.
    #[default]
    None,
    /// The mean goes to the truth as samples are added to a replicate; that of a replicate of finitely many differs from it.
    Consistent,
    /// The mean goes to the truth as the elements of a mesh become more; samples do not change it.
    Mesh,
    /// The mean is something else.
    Lasting,
}

impl Bias {
    /// As tables tell it of a method; `None` of one without.
    pub fn label(self) -> Option<&'static str> {
        match self {
            Self::None => None,
            Self::Consistent => Some("biased, consistent"),
            Self::Mesh => Some("biased by its mesh, consistent as elements grow"),
            Self::Lasting => Some("biased"),
        }
    }
}
