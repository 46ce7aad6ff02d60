//! Samplers at work on integrals of known value: mean squared errors over replicates, and how fast they fall.

use super::{Integral, Numbers};
use crate::config::Convergence;
use crate::convergence::{checkpoint_of_squares, fit};
use crate::error::Error;
use crate::progress::Progress;
use crate::result::IntegralResult;
use crate::states::{States, Unit};
use crate::statistics::welch::{Sample, rounding, welch};
use crate::stop::Stop;
use integrators::state::Stored;
use integrators::stored;
use rayon::prelude::*;
use sampling::moments::Moments;
use sampling::sampler::{Role, Sampler, SamplerKind, StreamKey};
use std::io::{self, Write};
use std::time::Instant;

/// One replicate's estimates of an integral in all pixels of its screen.
#[derive(Clone, Copy, Debug, Default)]
struct Estimates {
    /// Their mean.
    mean: f64,
    /// The mean of their squared errors.
    square: f64,
}

stored!(Estimates { mean, square });

/// A sampler's estimates at one number of samples.
struct Measured {
    /// Samples of a replicate.
    samples: u32,
    /// Mean wall time of a replicate \[s\].
    seconds: f64,
    /// `[replicate][integral]`.
    replicates: Vec<Vec<Estimates>>,
}

stored!(Measured { samples, seconds, replicates });

/// Every integral by every sampler, samplers in turn. What an earlier run has measured is taken up; after an early end, what is
/// complete.
///
/// # Errors
/// If a state cannot be read or written.
pub fn measure(
    samplers: &[SamplerKind],
    settings: &Convergence,
    seed: u64,
    states: &mut States,
    progress: &mut Progress,
    stop: &Stop,
) -> Result<Vec<IntegralResult>, Error> {
    let integrals = Integral::all();
    let mut results = Vec::new();
    for &sampler in samplers {
        let mut of_sampler: Vec<IntegralResult> = integrals.iter().map(|&i| blank(i, sampler)).collect();
        for measured in checkpoints(&integrals, sampler, settings, seed, states, progress, stop)? {
            for (i, result) in of_sampler.iter_mut().enumerate() {
                let estimates: Vec<Estimates> = measured.replicates.iter().map(|replicate| replicate[i]).collect();
                push(result, measured.samples, measured.seconds, &estimates);
            }
        }
        of_sampler.iter_mut().for_each(|result| result.slope = fit(&result.points.iter().collect::<Vec<_>>()));
        results.extend(of_sampler);
    }
    Ok(results)
}

/// The checkpoints of one sampler.
fn checkpoints(
    integrals: &[Integral],
    sampler: SamplerKind,
    settings: &Convergence,
    seed: u64,
    states: &mut States,
    progress: &mut Progress,
    stop: &Stop,
) -> Result<Vec<Measured>, Error> {
    if let Some(shards) = states.shards() {
        let read = |&samples: &u32| shards.read(&content(sampler, settings, samples, seed), |from| Stored::read(from));
        return settings.checkpoints.iter().map(read).collect();
    }
    let unit = Unit::new(&format!("integrals-{sampler}"), &format!("{seed} {settings:?}"));
    let mut measured: Vec<Measured> = states.load(&unit, Stored::read)?.unwrap_or_default();
    let mut saved = measured.len();
    for &samples in &settings.checkpoints[..saved] {
        progress.skip(work(settings, samples));
    }
    for &samples in &settings.checkpoints[saved..] {
        if stop.signal().is_some() {
            break;
        }
        states.check_renders(&format!("integrals by {sampler}"))?;
        progress.say(format!("integrals, {sampler} at {samples} samples"));
        let checkpoint =
            progress.during(work(settings, samples), |_| checkpoint(integrals, sampler, settings, samples, seed));
        let seconds = checkpoint.seconds * f64::from(settings.replicates);
        measured.push(checkpoint);
        if states.due(seconds) {
            saved = measured.len();
            states.save(&unit, saved as u32, |to| measured.write(to))?;
        }
    }
    if saved < measured.len() {
        states.save(&unit, measured.len() as u32, |to| measured.write(to))?;
    }
    Ok(measured)
}

/// One checkpoint of one sampler.
fn checkpoint(
    integrals: &[Integral],
    sampler: SamplerKind,
    settings: &Convergence,
    samples: u32,
    seed: u64,
) -> Measured {
    let start = Instant::now();
    let replicate = |r| replicate(integrals, sampler, settings, samples, seed, r);
    let replicates = (0..settings.replicates).into_par_iter().map(replicate).collect();
    Measured { samples, seconds: start.elapsed().as_secs_f64() / f64::from(settings.replicates), replicates }
}

/// Measures one checkpoint of one sampler, and writes it for [`measure`] to read elsewhere.
///
/// # Errors
/// If it cannot be written.
pub fn write_checkpoint(
    sampler: SamplerKind,
    settings: &Convergence,
    samples: u32,
    seed: u64,
    to: &mut dyn Write,
) -> io::Result<()> {
    checkpoint(&Integral::all(), sampler, settings, samples, seed).write(to)
}

/// The hash of what a checkpoint follows from, the program apart.
pub fn content(sampler: SamplerKind, settings: &Convergence, samples: u32, seed: u64) -> blake3::Hash {
    blake3::hash(format!("integrals {sampler} {settings:?} {samples} {seed}").as_bytes())
}

/// Seconds that one sample of one pixel takes, from a replicate of the first checkpoint.
pub fn seconds_per_sample(sampler: SamplerKind, settings: &Convergence, seed: u64) -> f64 {
    let (samples, [width, height]) = (settings.checkpoints.first().copied().unwrap_or(1), settings.size);
    let start = Instant::now();
    replicate(&Integral::all(), sampler, settings, samples, seed, 0);
    let threads = rayon::current_num_threads() as f64;
    start.elapsed().as_secs_f64() / (f64::from(width) * f64::from(height) * f64::from(samples) * threads)
}

/// Samples of all pixels of all replicates.
pub fn work(settings: &Convergence, samples: u32) -> f64 {
    let [width, height] = settings.size.map(f64::from);
    width * height * f64::from(settings.replicates) * f64::from(samples)
}

fn blank(integral: Integral, sampler: SamplerKind) -> IntegralResult {
    let (name, dimension, exact) = (integral.to_string(), integral.dimension(), integral.exact());
    IntegralResult { integral: name, dimension, sampler, exact, points: Vec::new(), p: Vec::new(), slope: None }
}

/// Adds a checkpoint, and the test whether its mean is the truth.
fn push(result: &mut IntegralResult, samples: u32, seconds: f64, estimates: &[Estimates]) {
    let moments: Moments = estimates.iter().map(|e| e.mean).collect();
    let squares = estimates.iter().map(|e| e.square).collect();
    let truth = Sample { mean: result.exact, variance: 0.0, n: 2 };
    result.p.push(welch(truth, Sample::from(&moments), rounding(0)).p);
    result.points.push(checkpoint_of_squares(samples, seconds, moments.mean, squares));
}

/// One replicate of all integrals, which share the numbers of its samples.
fn replicate(
    integrals: &[Integral],
    kind: SamplerKind,
    settings: &Convergence,
    samples: u32,
    seed: u64,
    replicate: u32,
) -> Vec<Estimates> {
    let [width, height] = settings.size;
    let key = StreamKey::new(seed, &format!("integrals, {kind} at {samples}"), Role::Estimate, replicate);
    let mut sampler = Sampler::new(kind, key, samples, (width, height));
    let pixels = u64::from(width) * u64::from(height);
    let exact: Vec<f64> = integrals.iter().map(|i| i.exact()).collect();
    let mut estimates = vec![Estimates::default(); integrals.len()];
    let mut sums = vec![0.0; integrals.len()];
    for pixel in 0..pixels {
        sums.fill(0.0);
        for sample in 0..samples {
            sampler.start_sample(pixel, sample);
            let numbers = Numbers::draw(&mut sampler);
            sums.iter_mut().zip(integrals).for_each(|(sum, integral)| *sum += integral.eval(&numbers));
        }
        for ((estimate, sum), exact) in estimates.iter_mut().zip(&sums).zip(&exact) {
            let mean = sum / f64::from(samples);
            estimate.mean += mean / pixels as f64;
            estimate.square += (mean - exact).powi(2) / pixels as f64;
        }
    }
    estimates
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::progress::Verbosity;

    fn measured(samplers: &[SamplerKind]) -> Vec<IntegralResult> {
        let settings = Convergence { size: [4, 4], checkpoints: vec![4, 16, 64], replicates: 32 };
        let folder = tempfile::tempdir().unwrap();
        let mut states = States::open(folder.path(), None);
        states.create().unwrap();
        let mut progress = Progress::new(1.0, Verbosity::Quiet);
        measure(samplers, &settings, 1, &mut states, &mut progress, &Stop::never()).unwrap()
    }

    /// 63 means of each of six samplers: the smallest p-value is below 10⁻⁶ by chance in one run of 2600.
    #[test]
    fn every_sampler_is_unbiased_on_every_integral() {
        for result in measured(SamplerKind::ALL) {
            for (point, p) in result.points.iter().zip(&result.p) {
                let (integral, sampler) = (&result.integral, result.sampler);
                let what = format!("{integral}, {sampler} at {}: {} for {}", point.samples, point.mean, result.exact);
                assert!(*p > 1e-6, "{what}, p = {p}");
            }
        }
    }

    /// Independent samples have a slope of −1; its standard error here is at most 0.05, so that 0.25 is five of them. Owen-scrambled
    /// nets have −3 on smooth functions of two dimensions and −1.5 on edges, in the limit of many samples.
    #[test]
    fn slopes_are_those_of_theory() {
        let results = measured(&[SamplerKind::Independent, SamplerKind::Sobol]);
        let (independent, sobol) = results.split_at(results.len() / 2);
        for result in independent {
            let slope = result.slope.unwrap().slope;
            assert!((slope + 1.0).abs() < 0.25, "{}: {slope}", result.integral);
        }
        let slope = |name: &str| sobol.iter().find(|r| r.integral == name).unwrap().slope.unwrap().slope;
        assert!(slope("spot") < -1.9 && slope("gaussian_2") < -1.7, "{} {}", slope("spot"), slope("gaussian_2"));
        assert!((-1.9..-1.2).contains(&slope("edge")), "{}", slope("edge"));
    }
}
