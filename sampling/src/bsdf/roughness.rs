//! The roughness of microfacet models, as scene files give it.

use super::{Argument, Ggx, Misfit, Parameter, Preset};

impl Parameter {
    /// Perceptual roughness.
    pub const ROUGHNESS: Self =
        Self::number("roughness", "perceptual roughness, √α; 0 is smooth", 0.0, 1.0, Preset::Absent);
    /// The width of the distribution of normals.
    pub const ALPHA: Self =
        Self::number("alpha", "width α of the distribution of normals; 0 is smooth", 0.0, 1.0, Preset::Absent);
    /// The same along x.
    pub const ALPHA_X: Self = Self::number("alpha_x", "α along the tangent", 0.0, 1.0, Preset::Absent);
    /// The same along y.
    pub const ALPHA_Y: Self = Self::number("alpha_y", "α across the tangent", 0.0, 1.0, Preset::Absent);
}

/// α when nothing is said of it.
const USUAL_ALPHA: f32 = 0.1;

/// α_x and α_y from [`Parameter::ROUGHNESS`], [`Parameter::ALPHA`], [`Parameter::ALPHA_X`] and [`Parameter::ALPHA_Y`], of
/// which one way is given; `None` where the surface is smooth.
///
/// # Errors
///
/// More than one way is given, or half of one, or a width below [`Ggx::MIN_ALPHA`] that isn't 0.
pub fn alphas([roughness, alpha, alpha_x, alpha_y]: [Argument; 4]) -> Result<Option<(f32, f32)>, Misfit> {
    let both = (alpha_x.given_number(), alpha_y.given_number());
    let (name, x, y) = match (roughness.given_number(), alpha.given_number(), both) {
        (None, None, (None, None)) => ("alpha", USUAL_ALPHA, USUAL_ALPHA),
        (Some(roughness), None, (None, None)) => ("roughness", roughness * roughness, roughness * roughness),
        (None, Some(alpha), (None, None)) => ("alpha", alpha, alpha),
        (None, None, (Some(x), Some(y))) => ("alpha_x", x, y),
        (None, None, _) => return Err(Misfit::new("alpha_x", "give both `alpha_x` and `alpha_y`, or `alpha` alone")),
        (Some(_), ..) => {
            return Err(Misfit::new("roughness", "give either `roughness`, or `alpha`, which is its square"));
        }
        (None, Some(_), _) => {
            return Err(Misfit::new("alpha", "give either `alpha`, or `alpha_x` and `alpha_y`"));
        }
    };
    if x == 0.0 && y == 0.0 {
        return Ok(None);
    }
    if x.min(y) < Ggx::MIN_ALPHA {
        let least = if name == "roughness" { Ggx::MIN_ALPHA.sqrt() } else { Ggx::MIN_ALPHA };
        return Err(Misfit::new(name, format!("give at least {least}, or 0 for a surface that is smooth all round")));
    }
    Ok(Some((x, y)))
}
