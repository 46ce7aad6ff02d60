//! Scattering models in the local frame, one file a model.
//!
//! To add one: write its file with an `impl BsdfModel`, declare the file as a module here, and put its name into the
//! `models!` list below. Scene files, the program, the help and the laws (`laws.rs`, `tests/bsdf_laws.rs`) read that list, and the
//! model's own list of parameters.
//!
//! Models that reflect are two-sided: they scatter from `wo` to `wi` where both are on one side, whichever it is.

#[cfg(test)]
mod albedo;
mod ashikhmin_shirley;
mod beckmann;
mod blinn_normals;
mod blinn_phong;
mod blinn_torrance;
mod coated_base;
mod conductor;
mod cook_torrance;
mod delta;
mod dielectric;
mod diffuse_transmission;
mod distribution_based;
mod fresnel;
mod ggx;
mod grooves;
mod half;
mod lafortune;
mod lambert;
#[cfg(test)]
mod laws;
mod lobes;
mod masking;
mod merl;
mod merl_table;
mod metals;
mod microfacets;
mod mirror;
mod missing_energy;
mod mix;
mod model;
mod null;
mod oren_nayar;
mod parameter;
mod parts;
mod phong;
mod plastic;
mod principled;
mod quadrature;
mod rough_conductor;
mod rough_dielectric;
mod rough_plastic;
mod roughness;
mod shifted_gamma;
mod table;
mod thin_glass;
mod tinted;
mod v_cavities;
mod ward;

pub use ashikhmin_shirley::AshikhminShirley;
pub use beckmann::Beckmann;
pub use blinn_phong::BlinnPhong;
pub use blinn_torrance::BlinnTorrance;
pub use coated_base::{Interreflection, Within};
pub use conductor::Conductor;
pub use cook_torrance::CookTorrance;
pub use dielectric::Dielectric;
pub use diffuse_transmission::DiffuseTransmission;
pub use distribution_based::{DistributionBased, HalfVectors};
pub use fresnel::{DielectricFresnel, diffuse_transmittance, fresnel_conductor, fresnel_dielectric};
pub use ggx::Ggx;
pub use lafortune::Lafortune;
pub use lambert::Lambert;
pub use lobes::Lobes;
pub use masking::Masking;
pub use merl::Merl;
pub use merl_table::MerlTable;
pub use microfacets::Microfacets;
pub use mirror::Mirror;
pub use mix::Mix;
use model::survival_of;
pub use model::{BsdfModel, BsdfSample, TransportMode};
pub use null::Null;
pub use oren_nayar::{OrenNayar, OrenNayarForm};
pub use parameter::{Argument, Arguments, Domain, MAX_PARAMETERS, Misfit, Parameter, Preset};
pub use phong::Phong;
pub use plastic::Plastic;
pub use principled::{Principled, PrincipledSettings, Tints};
pub use rough_conductor::RoughConductor;
pub use rough_dielectric::RoughDielectric;
pub use rough_plastic::RoughPlastic;
pub use rough_plastic::coat::{Coat, Strays};
pub use shifted_gamma::ShiftedGamma;
use table::{Recalled, Tables};
pub use table::{Shared, Table};
pub use thin_glass::ThinGlass;
pub use tinted::Tinted;
pub use ward::Ward;

use crate::math::Spectrum;
use glam::{Vec2, Vec3};

/// A model of the list: what is known of it without an instance.
#[derive(Clone, Copy)]
pub struct ModelEntry {
    /// What scene files call it.
    pub name: &'static str,
    /// What it is, in one line.
    pub about: &'static str,
    /// What scene files may say of it.
    pub parameters: &'static [Parameter],
    /// [`BsdfModel::MAX_ALBEDO`].
    pub max_albedo: f32,
    /// [`BsdfModel::from_arguments`].
    pub from_arguments: fn(&Arguments) -> Result<Bsdf, Misfit>,
    /// [`BsdfModel::examples`].
    pub examples: fn() -> Vec<Bsdf>,
}

impl std::fmt::Debug for ModelEntry {
    fn fmt(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
        f.write_str(self.name)
    }
}

macro_rules! models {
    ($($(#[$doc:meta])* $model:ident),* $(,)?) => {
        /// Any of the models: a small value, copied into every hit.
        #[derive(Clone, Copy, Debug, PartialEq)]
        pub enum Bsdf {
            $($(#[$doc])* $model($model),)*
        }

        $(impl From<$model> for Bsdf {
            #[inline]
            fn from(model: $model) -> Self {
                Self::$model(model)
            }
        })*

        impl Bsdf {
            /// All models.
            pub const MODELS: &[ModelEntry] = &[$(ModelEntry {
                name: $model::NAME,
                about: $model::ABOUT,
                parameters: $model::PARAMETERS,
                max_albedo: $model::MAX_ALBEDO,
                from_arguments: $model::from_arguments,
                examples: || $model::examples().into_iter().map(Self::from).collect(),
            }),*];

            /// The examples of all models, each with its model's name.
            pub fn all_examples() -> Vec<(&'static str, Self)> {
                let named = |entry: &'static ModelEntry| (entry.examples)().into_iter().map(move |model| (entry.name, model));
                Self::MODELS.iter().flat_map(named).collect()
            }

            /// The model of this name.
            pub fn model(name: &str) -> Option<&'static ModelEntry> {
                Self::MODELS.iter().find(|entry| entry.name == name)
            }

            /// The name of this model.
            pub fn name(&self) -> &'static str {
                match self { $(Self::$model(_) => $model::NAME,)* }
            }
        }

        /// What [`BsdfModel`] says of a model, of any of them.
        ///
        /// The commonest is told apart at once, where it is asked, so that nothing of it goes through memory.
        impl Bsdf {
            /// [`BsdfModel::eval`].
            #[inline(always)]
            pub fn eval(&self, wo: Vec3, wi: Vec3, lobes: Lobes, mode: TransportMode) -> Spectrum {
                match self { Self::Lambert(model) => model.eval(wo, wi, lobes, mode), _ => self.eval_any(wo, wi, lobes, mode) }
            }

            /// [`BsdfModel::pdf`].
            #[inline(always)]
            pub fn pdf(&self, wo: Vec3, wi: Vec3, mode: TransportMode) -> f32 {
                match self { Self::Lambert(model) => model.pdf(wo, wi, mode), _ => self.pdf_any(wo, wi, mode) }
            }

            /// [`BsdfModel::eval_pdf`].
            #[inline(always)]
            pub fn eval_pdf(&self, wo: Vec3, wi: Vec3, mode: TransportMode) -> (Spectrum, f32) {
                match self { Self::Lambert(model) => model.eval_pdf(wo, wi, mode), _ => self.eval_pdf_any(wo, wi, mode) }
            }

            /// [`BsdfModel::sample`].
            #[inline(always)]
            pub fn sample(&self, wo: Vec3, uc: f32, u: Vec2, mode: TransportMode) -> Option<BsdfSample> {
                match self { Self::Lambert(model) => model.sample(wo, uc, u, mode), _ => self.sample_any(wo, uc, u, mode) }
            }

            /// [`BsdfModel::lobes`].
            #[inline(always)]
            pub fn lobes(&self) -> Lobes {
                match self { Self::Lambert(model) => model.lobes(), _ => self.lobes_any() }
            }

            /// [`BsdfModel::survival`].
            #[inline(always)]
            pub fn survival(&self) -> f32 {
                match self { Self::Lambert(model) => model.survival(), _ => self.survival_any() }
            }

            /// [`BsdfModel::is_anisotropic`].
            #[inline(always)]
            pub fn is_anisotropic(&self) -> bool {
                match self { Self::Lambert(_) => false, _ => self.is_anisotropic_any() }
            }

            #[inline(never)]
            fn eval_any(&self, wo: Vec3, wi: Vec3, lobes: Lobes, mode: TransportMode) -> Spectrum {
                match self { $(Self::$model(model) => model.eval(wo, wi, lobes, mode),)* }
            }

            #[inline(never)]
            fn pdf_any(&self, wo: Vec3, wi: Vec3, mode: TransportMode) -> f32 {
                match self { $(Self::$model(model) => model.pdf(wo, wi, mode),)* }
            }

            #[inline(never)]
            fn eval_pdf_any(&self, wo: Vec3, wi: Vec3, mode: TransportMode) -> (Spectrum, f32) {
                match self { $(Self::$model(model) => model.eval_pdf(wo, wi, mode),)* }
            }

            #[inline(never)]
            fn sample_any(&self, wo: Vec3, uc: f32, u: Vec2, mode: TransportMode) -> Option<BsdfSample> {
                match self { $(Self::$model(model) => model.sample(wo, uc, u, mode),)* }
            }

            #[inline(never)]
            fn lobes_any(&self) -> Lobes {
                match self { $(Self::$model(model) => model.lobes(),)* }
            }

            #[inline(never)]
            fn survival_any(&self) -> f32 {
                match self { $(Self::$model(model) => model.survival(),)* }
            }

            #[inline(never)]
            fn is_anisotropic_any(&self) -> bool {
                match self { $(Self::$model(model) => model.is_anisotropic(),)* }
            }

            /// [`BsdfModel::fixed`].
            pub fn fixed(&self) -> &'static [&'static str] {
                match self { $(Self::$model(model) => model.fixed(),)* }
            }
        }

        #[cfg(test)]
        #[expect(non_snake_case, reason = "the names of the models")]
        mod laws_hold_for {
            $(#[test]
            fn $model() {
                super::laws::hold_for::<super::$model>();
            })*
        }
    };
}

// THE LIST.
models! {
    /// Ideal diffuse reflection.
    Lambert,
    /// Ideal diffuse reflection and transmission.
    DiffuseTransmission,
    /// Ideal specular reflection.
    Mirror,
    /// A surface that does nothing but let light through.
    Null,
    /// A smooth metal.
    Conductor,
    /// A smooth interface between two transparent media.
    Dielectric,
    /// A thin pane of glass.
    ThinGlass,
    /// A rough metal.
    RoughConductor,
    /// A rough interface between two transparent media.
    RoughDielectric,
    /// A smooth clear coat over a diffuse base.
    Plastic,
    /// A rough clear coat over a diffuse base.
    RoughPlastic,
    /// Disney's principled model.
    Principled,
    /// A blend of two models.
    Mix,
    /// A model whose mirror images and highlights are coloured.
    Tinted,
    /// A measured isotropic reflectance.
    Merl,
    /// Rough diffuse reflection.
    OrenNayar,
    /// A cosine lobe about the mirror direction.
    Phong,
    /// A cosine lobe about the half vector.
    BlinnPhong,
    /// The same with Torrance and Sparrow's geometry and Fresnel's equations.
    BlinnTorrance,
    /// Beckmann's facets in V-shaped grooves.
    CookTorrance,
    /// Elliptical highlights.
    Ward,
    /// An anisotropic cosine lobe over a diffuse base.
    AshikhminShirley,
    /// A highlight that the user draws.
    DistributionBased,
    /// Generalised cosine lobes.
    Lafortune,
}
