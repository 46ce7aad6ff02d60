//! How facets that hide from one direction hide from another.

use crate::fault;

/// Whether what hides a facet from one of two directions tells of the other.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Masking {
    /// By the height of the facet, which is the same for both: G₂ = 1 / (1 + Λ(wo) + Λ(wi)) [Heitz14, (99)]. From the two sides of a
    /// surface heights count from opposite ends, and directions are taken apart.
    #[default]
    Correlated,
    /// The same, with that formula for the two sides of a surface as well, as pbrt has it.
    CorrelatedThroughout,
    /// Not at all: G₂ = G₁(wo) G₁(wi) [Smith67; Walter07, (23)]. It is never the larger of the two.
    Separable,
}

impl Masking {
    /// |cos θ_o cos θ_i| / G₂(wo, wi), given the magnitudes of the cosines and the projected areas.
    #[inline(always)]
    pub(super) fn joint_area(self, cos_o: f32, area_o: f32, cos_i: f32, area_i: f32) -> f32 {
        match self {
            // σ ≥ cos, so what is subtracted is never more than either of the others.
            Self::Correlated | Self::CorrelatedThroughout => {
                fault!("masking_dropped", area_o * cos_i + (area_i - cos_i) * cos_o, cos_o * cos_i)
            }
            Self::Separable => area_o * area_i,
        }
    }

    /// The same where the directions are on the two sides of the surface.
    #[inline(always)]
    pub(super) fn joint_area_through(self, cos_o: f32, area_o: f32, cos_i: f32, area_i: f32) -> f32 {
        match self {
            Self::CorrelatedThroughout => self.joint_area(cos_o, area_o, cos_i, area_i),
            Self::Correlated | Self::Separable => area_o * area_i,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::Masking::{Correlated, Separable};
    use crate::bsdf::fresnel::fresnel_dielectric;
    use crate::bsdf::metals::index_of_reflectance;
    use crate::bsdf::quadrature::{integrate, integrate_towards_ends};
    use crate::bsdf::{
        Beckmann, BsdfModel, Ggx, Lobes, Microfacets, RoughConductor, RoughDielectric, ShiftedGamma, TransportMode,
    };
    use crate::math::Spectrum;
    use glam::{DVec3, Vec3, dvec3, vec2, vec3};
    use std::f64::consts::{PI, TAU};

    const ALPHAS: [f32; 3] = [0.05, 0.25, 0.6];
    const MODE: TransportMode = TransportMode::Radiance;

    /// Isotropic facets, with D and G₁ as they are published.
    #[derive(Clone, Copy, Debug)]
    enum Published {
        Ggx,
        Beckmann,
    }

    impl Published {
        const ALL: [Self; 2] = [Self::Ggx, Self::Beckmann];

        fn facets(self, alpha: f32) -> Microfacets {
            match self {
                Self::Ggx => Ggx::new(alpha, alpha).into(),
                Self::Beckmann => Beckmann::new(alpha, alpha).into(),
            }
        }

        /// [Walter07, (25) and (33)].
        fn d(self, alpha: f64, m: DVec3) -> f64 {
            let (cos2, alpha2) = (m.z * m.z, alpha * alpha);
            let tan2 = (1.0 - cos2).max(0.0) / cos2;
            match self {
                Self::Ggx => alpha2 / (PI * cos2 * cos2 * (alpha2 + tan2).powi(2)),
                Self::Beckmann => (-tan2 / alpha2).exp() / (PI * alpha2 * cos2 * cos2),
            }
        }

        /// [Walter07, (26) and (34)].
        fn g1(self, alpha: f64, w: DVec3) -> f64 {
            let tan = w.x.hypot(w.y) / w.z;
            if tan == 0.0 {
                return 1.0;
            }
            let a = 1.0 / (alpha * tan);
            match self {
                Self::Ggx => 2.0 / (1.0 + (1.0 + 1.0 / (a * a)).sqrt()),
                Self::Beckmann => {
                    let erf = 2.0 / PI.sqrt() * integrate(0.0, a.min(6.0), 12, |t| (-t * t).exp());
                    2.0 / (1.0 + erf + (-a * a).exp() / (a * PI.sqrt()))
                }
            }
        }

        /// What a white metal reflects: D G₁ G₁ / (4 cos cos).
        fn value(self, alpha: f64, wo: DVec3, wi: DVec3) -> f64 {
            let g = self.g1(alpha, wo) * self.g1(alpha, wi);
            self.d(alpha, (wo + wi).normalize()) * g / (4.0 * wo.z * wi.z)
        }
    }

    fn white(facets: Microfacets) -> RoughConductor {
        let (eta, k) = index_of_reflectance(Spectrum::ONE);
        RoughConductor::with_facets(eta, k, facets)
    }

    fn at(theta: f64, phi: f64) -> DVec3 {
        dvec3(theta.sin() * phi.cos(), theta.sin() * phi.sin(), theta.cos())
    }

    /// Pairs of directions above the surface, about half of them near one another's mirror images.
    fn pairs() -> Vec<(Vec3, Vec3)> {
        let thetas = [0.1, 0.6, 1.1, 1.4, 1.53];
        let wos = thetas.map(|theta| at(theta, 0.7).as_vec3());
        let wis = |wo: Vec3| {
            let any = thetas.into_iter().flat_map(|theta| [0.0, 2.0, 3.9].map(|phi| at(theta, phi).as_vec3()));
            let near = [-0.1, -0.02, 0.0, 0.04].map(|by| vec3(by - wo.x, -wo.y, wo.z).normalize());
            any.chain(near)
        };
        wos.into_iter().flat_map(|wo| wis(wo).map(move |wi| (wo, wi))).collect()
    }

    #[test]
    fn values_are_the_published_ones() {
        for (kind, alpha) in Published::ALL.into_iter().flat_map(|kind| ALPHAS.map(|alpha| (kind, alpha))) {
            let metal = white(kind.facets(alpha)).masked(Separable);
            let glass = RoughDielectric::with_facets(1.5, kind.facets(alpha)).masked(Separable);
            for (wo, wi) in pairs() {
                let exact = kind.value(f64::from(alpha), wo.as_dvec3(), wi.as_dvec3());
                let what = format!("{kind:?} {alpha}, wo {wo:?}, wi {wi:?}: {exact}");
                let value = f64::from(metal.eval(wo, wi, Lobes::ALL, MODE).max_component());
                // Where the density is steep, the rounding of directions shows.
                let slack = 2e-5 * exact + 1e-20;
                assert!((value - exact).abs() < slack, "{what} {value}");
                let reflected = fresnel_dielectric(wo.dot((wo + wi).normalize()).min(1.0), 1.5).reflected;
                let exact = exact * f64::from(reflected);
                let value = f64::from(glass.eval(wo, wi, Lobes::ALL, MODE).max_component());
                assert!((value - exact).abs() < slack, "glass {what} {value}");
            }
        }
    }

    #[test]
    fn samples_reflect_what_the_values_do() {
        const COUNT: usize = 1 << 17;
        for (kind, alpha) in Published::ALL.into_iter().flat_map(|kind| ALPHAS.map(|alpha| (kind, alpha))) {
            let metal = white(kind.facets(alpha)).masked(Separable);
            for theta_o in [0.05, 0.8, 1.5] {
                let wo = at(theta_o, 0.0);
                let value =
                    |theta: f64, phi: f64| kind.value(f64::from(alpha), wo, at(theta, phi)) * theta.cos() * theta.sin();
                let ring =
                    |theta: f64| 2.0 * integrate_towards_ends(0.0, 0.5 * TAU, 64, |phi| value(theta, 0.5 * TAU - phi));
                let part = |from, to| integrate_towards_ends(from, to, 64, ring);
                let exact = part(0.0, theta_o) + part(theta_o, 0.25 * TAU);
                let weight = |i: usize| {
                    // A lattice, fine along the height: the steep facets, which lose light, are few.
                    let [x, uc] =
                        [0.754_877_666_246_692_7, 0.569_840_290_998_053_2].map(|step| (i as f64 * step).fract());
                    let u = vec2(x as f32, (i as f32 + 0.5) / COUNT as f32);
                    let sample = metal.sample(wo.as_vec3(), uc as f32, u, MODE);
                    sample.map_or(0.0, |sample| f64::from(sample.weight.max_component()))
                };
                let mean = (0..COUNT).map(weight).sum::<f64>() / COUNT as f64;
                assert!((mean - exact).abs() < 1e-4, "{kind:?} {alpha} at {theta_o}: {mean} for {exact}");
            }
        }
    }

    #[test]
    fn only_what_is_reflected_changes_and_only_to_less() {
        let facets: [Microfacets; 3] =
            [Ggx::new(0.5, 0.2).into(), Beckmann::new(0.4, 0.4).into(), ShiftedGamma::new(0.3, 0.3, 1.0).into()];
        for facets in facets {
            let metals = [Correlated, Separable].map(|masking| white(facets).masked(masking));
            let glasses =
                [Correlated, Separable].map(|masking| RoughDielectric::with_facets(1.5, facets).masked(masking));
            for (wo, wi) in pairs() {
                let [together, apart] = metals.map(|metal| metal.eval_pdf(wo, wi, MODE));
                assert_eq!(together.1, apart.1, "{facets:?} {wo} {wi}");
                assert!(apart.0.max_component() <= together.0.max_component() * 1.000_001, "{facets:?} {wo} {wi}");
                let [together, apart] = glasses.map(|glass| glass.eval_pdf(wo, wi, MODE));
                assert_eq!(together.1, apart.1, "{facets:?} {wo} {wi}");
                assert!(apart.0.max_component() <= together.0.max_component() * 1.000_001, "{facets:?} {wo} {wi}");
                let [together, apart] = glasses.map(|glass| glass.eval_pdf(wo, -wi, MODE));
                assert_eq!(together, apart, "{facets:?} {wo} {wi}");
            }
        }
    }

    /// Facets, α, wo, wi, and f |cos θ_i|.
    type Known = (Published, f32, [f32; 3], [f32; 3], f32);

    /// What is known of `roughconductor` (of which the first channel) and `roughdielectric` of index 1.5 by Mitsuba 3.9.1, variant `scalar_rgb`,
    /// with wo and wi as they are called here.
    const MITSUBA: [Known; 6] = [
        (
            Published::Ggx,
            0.25,
            [0.609_854_7, -0.740_421_24, 0.282_583_9],
            [-0.456_814_47, 0.843_859_8, 0.281_462_64],
            0.524_019_6,
        ),
        (
            Published::Ggx,
            0.6,
            [-0.868_720_23, 0.459_732_77, 0.184_312_1],
            [-0.794_132, -0.202_965_72, 0.572_851_9],
            0.072_926_14,
        ),
        (
            Published::Beckmann,
            0.25,
            [-0.605_440_4, 0.736_252_84, 0.302_280_78],
            [0.827_272_65, -0.289_084_58, 0.481_715_77],
            0.011_809_245,
        ),
        (
            Published::Ggx,
            0.25,
            [-0.654_555_14, -0.597_070_63, -0.463_750_18],
            [0.762_723_74, 0.633_315_3, -0.131_012_2],
            0.706_646,
        ),
        (
            Published::Ggx,
            0.25,
            [-0.089_976_57, 0.985_904_93, 0.141_051_86],
            [0.025_252_562, -0.803_587_14, -0.594_651_2],
            2.105_373_4,
        ),
        (
            Published::Ggx,
            0.6,
            [0.372_899_7, -0.259_574_56, -0.890_823_7],
            [-0.339_627_53, 0.635_367_2, 0.693_514],
            0.768_327_95,
        ),
    ];

    #[test]
    fn values_are_mitsubas() {
        for (i, (kind, alpha, wo, wi, theirs)) in MITSUBA.into_iter().enumerate() {
            let facets = kind.facets(alpha);
            let (wo, wi) = (Vec3::from(wo), Vec3::from(wi));
            let f = if i < 3 {
                let (eta, k) = (Spectrum::new(0.188, 0.544, 1.332), Spectrum::new(3.403, 2.231, 1.869));
                RoughConductor::with_facets(eta, k, facets).masked(Separable).eval(wo, wi, Lobes::ALL, MODE)
            } else {
                RoughDielectric::with_facets(1.5, facets).masked(Separable).eval(wo, wi, Lobes::ALL, MODE)
            };
            let ours = f.to_array()[0] * wi.z.abs();
            // Its G₁ of Beckmann's facets is the fit of [Walter07, (27)], off by up to 0.32 %.
            let slack = match kind {
                Published::Ggx => 1e-5,
                Published::Beckmann => 0.0064,
            };
            assert!((ours / theirs - 1.0).abs() < slack, "{kind:?} {alpha} {wo} {wi}: {ours} for {theirs}");
        }
    }

    #[test]
    fn what_is_lost_is_compensated() {
        let glass = RoughDielectric::new(1.5, 0.6, 0.6);
        let compensated = glass.compensated().masked(Separable);
        assert_eq!(compensated, glass.masked(Separable).compensated());
        assert_ne!(compensated, glass.compensated());
    }
}
