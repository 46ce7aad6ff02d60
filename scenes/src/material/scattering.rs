//! What gives a surface's BSDF, point by point.

use crate::texture::{SurfaceCoordinates, Texture};
use sampling::bsdf::{Argument, Arguments, Bsdf, Domain, Lambert, Misfit, ModelEntry};
use sampling::math::Spectrum;
use sampling::rng::{mix2, unit_f32};

/// What gives the BSDF of a point.
#[derive(Clone, Debug)]
pub enum Scattering {
    /// The same everywhere.
    Same(Bsdf),
    /// One model, of which textures give some parameters.
    Model(Box<Parameters>),
    /// Two, one of which varies.
    Blend(Box<Blend>),
}

/// A model of which textures give some parameters.
#[derive(Clone, Debug)]
pub struct Parameters {
    model: &'static ModelEntry,
    /// Those that do not vary.
    arguments: Arguments,
    /// Places in the model's list of parameters, and what gives them.
    textures: Vec<(usize, Texture)>,
}

/// Two kinds of scattering, in patches too small to see: a point has one of them, by a hash of where it is.
///
/// So a vertex of a path has one BSDF, whichever way it is asked for, and has it with the same probability from either end of the
/// path: the choice stands in a path's value and in all of its densities alike, and cancels.
#[derive(Clone, Debug)]
pub struct Blend {
    /// The first and the second.
    pub parts: [Scattering; 2],
    /// The share of the second, in [0, 1].
    pub amount: Texture,
}

impl Scattering {
    /// The model with these arguments, but for the parameters at these places of its list, which textures give.
    ///
    /// # Errors
    ///
    /// Those of the model, where nothing varies: arguments that don't go together.
    pub fn new(
        model: &'static ModelEntry,
        arguments: Arguments,
        textures: Vec<(usize, Texture)>,
    ) -> Result<Self, Misfit> {
        if textures.is_empty() {
            return (model.from_arguments)(&arguments).map(Self::Same);
        }
        Ok(Self::Model(Box::new(Parameters { model, arguments, textures })))
    }

    /// Lambert's law, of an albedo that varies.
    pub fn lambert(albedo: Texture) -> Self {
        let model = Bsdf::model("lambert").expect("it is in the list");
        let arguments = Arguments::presets(model.parameters);
        Self::new(model, arguments, vec![(0, albedo)]).expect("an albedo alone")
    }

    /// The BSDF at a point; textures are read here, once per hit. Arguments are tried when the scene is built, at vertices and
    /// extremes; should they not go together at a point between, it scatters what is not a number, so that it is counted and
    /// reported.
    pub(crate) fn at(&self, point: &SurfaceCoordinates) -> Bsdf {
        match self {
            Self::Same(bsdf) => *bsdf,
            Self::Model(parameters) => {
                let invalid = |_| Lambert { albedo: Spectrum::splat(f32::NAN) }.into();
                parameters.with(|texture| texture.at(point)).unwrap_or_else(invalid)
            }
            Self::Blend(_) => self.chosen(point).at(point),
        }
    }

    /// The part that a point has, of blends of blends the innermost.
    fn chosen(&self, point: &SurfaceCoordinates) -> &Self {
        let words = point.p.to_array().map(f32::to_bits);
        let bits = words.iter().fold(0, |bits, &word| mix2(bits, u64::from(word)));
        let mut scattering = self;
        for depth in 0.. {
            let Self::Blend(blend) = scattering else { break };
            // Every choice has a number of its own.
            let u = unit_f32((mix2(bits, depth) >> 32) as u32);
            scattering = &blend.parts[usize::from(u < blend.amount.at(point).mean())];
        }
        scattering
    }

    /// How many kinds it is mixed of, each counted as often as it occurs.
    pub fn kinds(&self) -> usize {
        match self {
            Self::Same(Bsdf::Mix(mix)) => mix.kinds(),
            Self::Same(_) | Self::Model(_) => 1,
            Self::Blend(blend) => blend.parts.iter().map(Self::kinds).sum(),
        }
    }

    /// Whether every point scatters as Lambert's law says.
    pub(super) fn is_lambertian(&self) -> bool {
        match self {
            Self::Same(bsdf) => matches!(bsdf, Bsdf::Lambert(_)),
            Self::Model(parameters) => parameters.model.name == "lambert",
            Self::Blend(blend) => blend.parts.iter().all(Self::is_lambertian),
        }
    }

    /// The largest albedo, where every point scatters as Lambert's law says and that is known.
    pub(super) fn lambertian_albedo(&self) -> Option<Spectrum> {
        let of = |bsdf: &Bsdf| if let Bsdf::Lambert(lambert) = bsdf { Some(lambert.albedo) } else { None };
        match self {
            Self::Same(bsdf) => of(bsdf),
            Self::Model(parameters) => {
                parameters.textures().all(|(.., texture)| texture.range().is_some()).then_some(())?;
                of(&parameters.with(|texture| texture.range().map_or(Spectrum::ONE, |(_, most)| most)).ok()?)
            }
            Self::Blend(blend) => {
                blend.parts.iter().try_fold(Spectrum::ZERO, |most, part| Some(most.max(part.lambertian_albedo()?)))
            }
        }
    }

    /// Whether one of two widths varies: then they differ somewhere.
    pub(super) fn may_be_anisotropic(&self) -> bool {
        match self {
            Self::Same(_) => false,
            Self::Model(parameters) => {
                parameters.textures().any(|(name, ..)| matches!(name, "alpha_x" | "alpha_y" | "n_u" | "n_v"))
            }
            Self::Blend(blend) => blend.parts.iter().any(Self::may_be_anisotropic),
        }
    }

    /// The models of which textures give parameters.
    pub fn models(&self) -> Vec<&Parameters> {
        match self {
            Self::Same(_) => Vec::new(),
            Self::Model(parameters) => vec![parameters],
            Self::Blend(blend) => blend.parts.iter().flat_map(Self::models).collect(),
        }
    }

    /// All its textures.
    pub(super) fn textures(&self) -> Vec<&Texture> {
        match self {
            Self::Same(_) => Vec::new(),
            Self::Model(parameters) => parameters.textures.iter().map(|(_, texture)| texture).collect(),
            Self::Blend(blend) => {
                let parts = blend.parts.iter().flat_map(Self::textures);
                parts.chain([&blend.amount]).collect()
            }
        }
    }

    /// All its textures, to be changed.
    pub(super) fn textures_mut(&mut self) -> Vec<&mut Texture> {
        match self {
            Self::Same(_) => Vec::new(),
            Self::Model(parameters) => parameters.textures.iter_mut().map(|(_, texture)| texture).collect(),
            Self::Blend(blend) => {
                let parts = blend.parts.iter_mut().flat_map(Self::textures_mut);
                parts.chain([&mut blend.amount]).collect()
            }
        }
    }
}

impl Parameters {
    /// The textures, each with the name and the domain of the parameter that it gives.
    pub fn textures(&self) -> impl Iterator<Item = (&'static str, Domain, &Texture)> {
        self.textures.iter().map(|(place, texture)| {
            let parameter = &self.model.parameters[*place];
            (parameter.name, parameter.domain, texture)
        })
    }

    /// The BSDF where textures have the values that `value` gives.
    ///
    /// # Errors
    ///
    /// Those of the model: arguments that don't go together.
    pub fn with(&self, value: impl Fn(&Texture) -> Spectrum) -> Result<Bsdf, Misfit> {
        let mut arguments = self.arguments;
        for (place, texture) in &self.textures {
            // Rounding may leave a domain whose borders the texture touches.
            let argument = match self.model.parameters[*place].domain {
                Domain::Number(from, to) => Argument::Number(value(texture).mean().clamp(from, to)),
                Domain::Colour(from, to) => {
                    Argument::Colour(Spectrum::from(value(texture).to_array().map(|channel| channel.clamp(from, to))))
                }
                domain => unreachable!("no texture gives {domain}"),
            };
            arguments.set(*place, argument);
        }
        (self.model.from_arguments)(&arguments)
    }
}
