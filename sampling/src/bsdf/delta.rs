//! Models that are delta lobes alone.

/// Their values and densities, which are 0: a delta lobe is found by samples only.
macro_rules! scatters_by_delta_lobes {
    () => {
        #[inline]
        fn eval(
            &self,
            _wo: glam::Vec3,
            _wi: glam::Vec3,
            _lobes: $crate::bsdf::Lobes,
            _mode: $crate::bsdf::TransportMode,
        ) -> $crate::math::Spectrum {
            $crate::math::Spectrum::ZERO
        }

        #[inline]
        fn pdf(&self, _wo: glam::Vec3, _wi: glam::Vec3, _mode: $crate::bsdf::TransportMode) -> f32 {
            0.0
        }
    };
}
pub(super) use scatters_by_delta_lobes;
