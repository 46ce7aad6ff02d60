//! The roughness of microfacet models, as scene files give it.

use super::{Argument, Beckmann, Ggx, Microfacets, Misfit, Parameter, Preset, ShiftedGamma};

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
    /// The kind of distribution of normals.
    pub const DISTRIBUTION: Self = Self::choice("distribution", "distribution of normals", &["ggx", "beckmann", "sgd"]);
    /// The tail of the shifted-gamma distribution.
    pub const GAMMA: Self = Self::number(
        "gamma",
        "fall-off γ of the distribution `sgd`, 1 when nothing is said of it",
        0.0,
        4.0,
        Preset::Absent,
    );
    /// What becomes of light that facets scatter to one another.
    pub const MULTIPLE_SCATTERING: Self = Self::choice(
        "multiple_scattering",
        "what becomes of light that facets scatter to one another",
        &["lost", "compensated"],
    );
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

/// The distribution from [`Parameter::DISTRIBUTION`], [`Parameter::GAMMA`] and the arguments of [`alphas`]; `None` where the
/// surface is smooth.
///
/// # Errors
///
/// Those of [`alphas`], a width that is too small for the distribution, and a γ for one that has none.
pub fn microfacets([distribution, gamma, a, b, c, d]: [Argument; 6]) -> Result<Option<Microfacets>, Misfit> {
    let (distribution, gamma) = (distribution.choice(), gamma.given_number());
    if gamma.is_some() && distribution != 2 {
        return Err(Misfit::new("gamma", "leave it out, or give `distribution = \"sgd\"`, which alone has it"));
    }
    let Some((x, y)) = alphas([a, b, c, d])? else { return Ok(None) };
    let least = [Ggx::MIN_ALPHA, Beckmann::MIN_ALPHA, ShiftedGamma::MIN_ALPHA][distribution];
    if x.min(y) < least {
        let mend = format!("give an α of at least {least} with this distribution, or 0 for a surface that is smooth");
        return Err(Misfit::new("distribution", mend));
    }
    Ok(Some(match distribution {
        0 => Ggx::new(x, y).into(),
        1 => Beckmann::new(x, y).into(),
        _ => ShiftedGamma::new(x, y, gamma.unwrap_or(1.0)).into(),
    }))
}

/// Whether [`Parameter::MULTIPLE_SCATTERING`] is to be compensated.
///
/// # Errors
///
/// It is, of anisotropic facets.
pub fn is_compensated(multiple_scattering: Argument, facets: &Microfacets) -> Result<bool, Misfit> {
    let compensated = multiple_scattering.choice() == 1;
    if compensated && facets.is_anisotropic() {
        let mend = "it is compensated for one roughness all round: give `alpha` alone, or let it be \"lost\"";
        return Err(Misfit::new("multiple_scattering", mend));
    }
    Ok(compensated)
}
