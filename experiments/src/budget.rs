//! How many samples a render takes, on how many threads, and under which name its random numbers are drawn.

use crate::config::{check_seconds, samples_per_replicate};
use crate::error::Error;
use crate::stop::Stop;
use integrators::{Integrator, Measurement, Render, RenderError, RenderSettings};
use sampling::sampler::{Role, SamplerKind};

/// The part of a time budget that a pilot run has to last for its speed to be believed.
const PILOT_PART: f64 = 0.02;

/// Samples or seconds, shared by independent replicates.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Budget {
    /// Independent images.
    pub replicates: u32,
    effort: Effort,
}

#[derive(Clone, Copy, Debug, PartialEq)]
enum Effort {
    /// Samples per pixel of a replicate.
    Samples(u32),
    /// Wall time of all replicates together.
    Seconds(f64),
}

impl Budget {
    /// So many samples per pixel over all replicates.
    ///
    /// # Errors
    /// If they cannot be divided evenly.
    pub fn samples(spp: u32, replicates: u32) -> Result<Self, String> {
        Ok(Self { replicates, effort: Effort::Samples(samples_per_replicate(spp, replicates)?) })
    }

    /// So many seconds for all replicates.
    ///
    /// # Errors
    /// If the time is not positive.
    pub fn seconds(seconds: f64, replicates: u32) -> Result<Self, String> {
        check_seconds(seconds)?;
        Ok(Self { replicates, effort: Effort::Seconds(seconds) })
    }

    /// Samples per pixel of each replicate, where no pilot has to find them.
    pub fn known_samples(&self) -> Option<u32> {
        match self.effort {
            Effort::Samples(samples) => Some(samples),
            Effort::Seconds(_) => None,
        }
    }

    /// Samples per pixel of each replicate of what `render` makes of settings.
    ///
    /// A time budget is turned into samples by a pilot run on random numbers of its own: to stop when the clock says so
    /// would make the number of samples depend on their values.
    ///
    /// # Errors
    /// If the method cannot render the scene, or the user asked for an end, when nothing is complete yet.
    pub fn samples_per_replicate<'a>(
        &self,
        render: &dyn Fn(RenderSettings) -> Result<Render<'a>, RenderError>,
        settings: &RenderSettings,
        stop: &Stop,
    ) -> Result<u32, Error> {
        let seconds = match self.effort {
            Effort::Samples(samples) => return Ok(samples),
            Effort::Seconds(seconds) => seconds,
        };
        let mut samples: u32 = 1;
        loop {
            let settings = RenderSettings { samples_per_replicate: samples, role: Role::Pilot, ..settings.clone() };
            let mut pilot = render(settings)?;
            pilot.run_replicate(&|_| {});
            stop.check()?;
            if pilot.seconds() >= PILOT_PART * seconds || samples >= 1 << 20 {
                let fitting = seconds / f64::from(self.replicates) * f64::from(samples) / pilot.seconds();
                return Ok((fitting as u32).clamp(1, u32::MAX / self.replicates));
            }
            samples *= 2;
        }
    }
}

/// Threads to render on; all cores that this process may use where none are asked for.
///
/// # Errors
/// If the system refuses so many.
pub fn pool(threads: Option<usize>) -> Result<rayon::ThreadPool, Error> {
    let threads = threads.unwrap_or_else(|| std::thread::available_parallelism().map_or(1, usize::from));
    rayon::ThreadPoolBuilder::new()
        .num_threads(threads)
        .build()
        .map_err(|e| Error::usage(format!("cannot start {threads} threads: {e}; ask for fewer --threads")))
}

/// The name under which a method draws its random numbers: the same settings draw the same numbers in every command, and samplers
/// none that another draws, so that they can be compared by tests for independent samples.
pub fn instance(method: &dyn Integrator, sampler: SamplerKind) -> String {
    let name = format!("{} {}", method.name(), method.settings());
    match sampler {
        SamplerKind::Independent => name,
        other => format!("{name} {other}"),
    }
}

/// What to say of non-finite samples.
pub fn non_finite(measurement: &Measurement, seed: u64) -> String {
    let counts = measurement.layers.iter().zip(&measurement.invalid).filter(|(_, n)| **n > 0);
    let places: Vec<String> = counts.map(|(layer, n)| format!("{n} in order {}", layer.label())).collect();
    format!(
        "non-finite samples occurred and were left out: {}; the same flags with --seed {seed} show them again, \
         --allow-invalid accepts them",
        places.join(", ")
    )
}

/// A name in characters that every file system takes.
pub fn file_name(name: &str) -> String {
    let safe = |c: char| if c.is_ascii_alphanumeric() || c == '-' || c == '_' { c } else { '_' };
    name.chars().map(safe).collect()
}
