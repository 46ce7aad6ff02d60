//! Measured isotropic reflectances.

use super::merl_table::{HalfAngles, MerlTable};
use super::{
    Arguments, Bsdf, BsdfModel, BsdfSample, Domain, Lobes, Misfit, Parameter, Preset, Shared, Table, TransportMode,
};
use crate::math::{Spectrum, reflect, same_hemisphere};
use crate::warp::{cosine_hemisphere, cosine_hemisphere_pdf};
use glam::{Vec2, Vec3};
use std::sync::OnceLock;

/// A measured f_s by half and difference angles `[Rusinkiewicz98]`, from a file of the MERL database `[Matusik03]`.
///
/// The table, of 90 × 90 × 180 entries, is interpolated linearly between the centres of its bins. It has the difference azimuth
/// modulo π, which is reciprocity, and the angles are computed so that exchanging the directions changes no bit. Entries below
/// 0, with which the files mark what is below the horizon, are taken as 0, so that values fall towards them over the last bin
/// at grazing angles. Measurements beyond some 80° are extrapolations and may reflect more than they receive; a file with a
/// directional albedo above [`MAX_ALBEDO`](BsdfModel::MAX_ALBEDO) is refused.
///
/// Sampled is either the cosine, or a half vector by the table's mean over difference angles; the density is that of both.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Merl {
    table: Shared<MerlTable>,
}

/// The probability of the cosine's lobe; of the half vectors the rest.
const COSINE: f32 = 0.5;

impl Merl {
    /// The model of this table.
    pub fn new(table: Shared<MerlTable>) -> Self {
        Self { table }
    }

    #[inline(always)]
    fn value_and_density(&self, wo: Vec3, wi: Vec3) -> Option<(Spectrum, f32)> {
        if !same_hemisphere(wo, wi) {
            return None;
        }
        let above = |w: Vec3| w.with_z(w.z.abs());
        let (wo, wi) = (above(wo), above(wi));
        let angles = HalfAngles::of(wo, wi)?;
        // dh/dwi = 1 / (4 wo·h).
        let by_half = self.table.half_vectors.pdf(&angles) / (4.0 * angles.cos_d);
        let pdf = COSINE * cosine_hemisphere_pdf(wi.z) + (1.0 - COSINE) * by_half;
        Some((self.table.value(&angles), pdf))
    }
}

impl BsdfModel for Merl {
    const NAME: &'static str = "merl";
    const ABOUT: &'static str = "a measured isotropic reflectance, a file of the MERL database";
    const PARAMETERS: &'static [Parameter] = &[Parameter {
        name: "file",
        about: "a table of the MERL database",
        domain: Domain::File { read: |bytes| MerlTable::read(bytes).map(Table::Merl) },
        preset: Preset::Required("\"gold-metallic-paint.binary\""),
    }];
    /// What files may have at grazing angles, and no example has.
    const MAX_ALBEDO: f32 = 2.0;

    fn from_arguments(arguments: &Arguments) -> Result<Bsdf, Misfit> {
        let [file] = arguments.all();
        match file.table() {
            Table::Merl(table) => Ok(Self { table }.into()),
            other => panic!("not a table of MERL: {other:?}"),
        }
    }

    fn eval(&self, wo: Vec3, wi: Vec3, lobes: Lobes, _mode: TransportMode) -> Spectrum {
        if !lobes.contains(Lobes::GLOSSY_REFLECTION) {
            return Spectrum::ZERO;
        }
        self.value_and_density(wo, wi).map_or(Spectrum::ZERO, |(f, _)| f)
    }

    fn pdf(&self, wo: Vec3, wi: Vec3, _mode: TransportMode) -> f32 {
        self.value_and_density(wo, wi).map_or(0.0, |(_, pdf)| pdf)
    }

    fn eval_pdf(&self, wo: Vec3, wi: Vec3, _mode: TransportMode) -> (Spectrum, f32) {
        self.value_and_density(wo, wi).unwrap_or((Spectrum::ZERO, 0.0))
    }

    fn sample(&self, wo: Vec3, uc: f32, u: Vec2, _mode: TransportMode) -> Option<BsdfSample> {
        if wo.z == 0.0 {
            return None;
        }
        let above = wo.with_z(wo.z.abs());
        let wi = if uc < COSINE {
            cosine_hemisphere(u)
        } else {
            reflect(above, self.table.half_vectors.sample(u)).normalize()
        };
        let (f, pdf) = self.value_and_density(above, wi)?;
        let weight = f * (wi.z / pdf);
        let wi = wi.with_z(wi.z.copysign(wo.z));
        Some(BsdfSample { wi, weight, pdf, lobe: Lobes::GLOSSY_REFLECTION, eta: 1.0 })
    }

    fn lobes(&self) -> Lobes {
        Lobes::GLOSSY_REFLECTION
    }

    fn survival(&self) -> f32 {
        self.table.survival
    }

    fn examples() -> Vec<Self> {
        // No measured file comes with the program: these are tabulated from closed forms, through the format of the files.
        static TABLES: OnceLock<[Shared<MerlTable>; 2]> = OnceLock::new();
        let tables = TABLES.get_or_init(|| {
            use super::{Ggx, Lambert, RoughConductor};
            let radiance = TransportMode::Radiance;
            let paint = RoughConductor::from_reflectance(Spectrum::new(0.8, 0.5, 0.2), 0.25, 0.25);
            let velvet = Lambert { albedo: Spectrum::new(0.1, 0.2, 0.5) };
            let wide = Ggx::new(0.6, 0.6);
            [
                MerlTable::write(|wo, wi| paint.eval(wo, wi, Lobes::ALL, radiance)),
                // A lobe of retro-reflection, which no half vector finds.
                MerlTable::write(|wo, wi| {
                    let back = Vec3::new(-wo.x, -wo.y, wo.z) + wi;
                    velvet.eval(wo, wi, Lobes::ALL, radiance) + Spectrum::splat(0.3 * wide.d(back.normalize()))
                }),
            ]
            .map(|bytes| MerlTable::read(&bytes).expect("a table of the right size"))
        });
        tables.iter().map(|&table| Self { table }).collect()
    }
}
