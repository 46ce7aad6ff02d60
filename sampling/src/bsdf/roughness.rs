//! The roughness of microfacet models, as scene files give it.

use super::{Argument, Beckmann, Ggx, Masking, Microfacets, Misfit, Parameter, Preset, ShiftedGamma};

impl Parameter {
    /// Perceptual roughness.
    pub const ROUGHNESS: Self =
        Self::number("roughness", "perceptual roughness, √α; smooth where α is", 0.0, 1.0, Preset::Absent);
    /// The width of the distribution of normals.
    pub const ALPHA: Self = Self::number(
        "alpha",
        "width α of the distribution of normals; below 0.0001 (0.0002 of `beckmann` and `sgd`) smooth",
        0.0,
        1.0,
        Preset::Absent,
    );
    /// Perceptual roughness of a lobe that has no smooth limit among the models.
    pub const LOBE_ROUGHNESS: Self =
        Self::number("roughness", "perceptual roughness, √α, with α at least 0.0001", 0.0, 1.0, Preset::Absent);
    /// The width of such a lobe.
    pub const LOBE_ALPHA: Self = Self::number(
        "alpha",
        "width α of the distribution of normals; below 0.0001 it is taken as that",
        0.0,
        1.0,
        Preset::Absent,
    );
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
    /// How facets hide one another.
    pub const MASKING: Self = Self::choice(
        "masking",
        "how facets hide one another from two directions: by their common height (also through the surface), or from each by itself",
        &["correlated", "separable", "correlated_throughout"],
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
/// A width below `least` is one that directions in `f32` do not resolve. If both are, the surface is smooth; if one is, it is
/// taken as `least`: the lobe is drawn out along the other, and as narrow as it can be.
///
/// # Errors
///
/// More than one way is given, or half of one.
#[inline]
pub fn alphas([roughness, alpha, alpha_x, alpha_y]: [Argument; 4], least: f32) -> Result<Option<(f32, f32)>, Misfit> {
    let both = (alpha_x.given_number(), alpha_y.given_number());
    let (x, y) = match (roughness.given_number(), alpha.given_number(), both) {
        (None, None, (None, None)) => (USUAL_ALPHA, USUAL_ALPHA),
        (Some(roughness), None, (None, None)) => (roughness * roughness, roughness * roughness),
        (None, Some(alpha), (None, None)) => (alpha, alpha),
        (None, None, (Some(x), Some(y))) => (x, y),
        (None, None, _) => return Err(Misfit::new("alpha_x", "give both `alpha_x` and `alpha_y`, or `alpha` alone")),
        (Some(_), ..) => {
            return Err(Misfit::new("roughness", "give either `roughness`, or `alpha`, which is its square"));
        }
        (None, Some(_), _) => {
            return Err(Misfit::new("alpha", "give either `alpha`, or `alpha_x` and `alpha_y`"));
        }
    };
    Ok((x.max(y) >= least).then(|| (x.max(least), y.max(least))))
}

/// The same of a lobe that has no smooth limit among the models: both widths are at least [`Ggx::MIN_ALPHA`].
///
/// # Errors
///
/// Those of [`alphas`].
#[inline]
pub fn lobe_alphas(arguments: [Argument; 4]) -> Result<(f32, f32), Misfit> {
    const LEAST: f32 = Ggx::MIN_ALPHA;
    Ok(alphas(arguments, LEAST)?.unwrap_or((LEAST, LEAST)))
}

/// The distribution from [`Parameter::DISTRIBUTION`], [`Parameter::GAMMA`] and the arguments of [`alphas`]; `None` where the
/// surface is smooth.
///
/// # Errors
///
/// Those of [`alphas`], and a γ for a distribution that has none.
pub fn microfacets([distribution, gamma, a, b, c, d]: [Argument; 6]) -> Result<Option<Microfacets>, Misfit> {
    let (distribution, gamma) = (distribution.choice(), gamma.given_number());
    if gamma.is_some() && distribution != 2 {
        return Err(Misfit::new("gamma", "leave it out, or give `distribution = \"sgd\"`, which alone has it"));
    }
    let least = [Ggx::MIN_ALPHA, Beckmann::MIN_ALPHA, ShiftedGamma::MIN_ALPHA][distribution];
    let Some((x, y)) = alphas([a, b, c, d], least)? else { return Ok(None) };
    Ok(Some(match distribution {
        0 => Ggx::new(x, y).into(),
        1 => Beckmann::new(x, y).into(),
        _ => ShiftedGamma::new(x, y, gamma.unwrap_or(1.0)).into(),
    }))
}

/// How facets hide one another, from [`Parameter::MASKING`].
pub fn masking(argument: Argument) -> Masking {
    [Masking::Correlated, Masking::Separable, Masking::CorrelatedThroughout][argument.choice()]
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
