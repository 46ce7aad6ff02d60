//! `neumann render`: one scene, one method, one image with all its orders.

use crate::budget::{self, Budget};
use crate::choice::Choice;
use crate::cli::{ImageArgs, MaxOrder, RenderArgs, print};
use crate::error::{Error, Status};
use crate::export::exr::{ImageMeta, LayerSelection, write_measurement};
use crate::export::png::{Picture, exposure_of};
use crate::export::pyramid;
use crate::export::tone::Exposure;
use crate::export::write_atomically;
use crate::live::{Display, Live};
use crate::machine::{VERSION, require_memory};
use crate::output;
use crate::parts;
use crate::path_class;
use crate::progress::{Progress, Verbosity, while_loading};
use crate::statistics_file::{Context, Seconds, Statistics};
use crate::stop::Stop;
use crate::subject::{DEFAULT_SPP, Subject};
use crate::truncation::{DEFAULT_PART, Truncation};
use integrators::composite::{self, Composite};
use integrators::render::{self, check_window};
use integrators::{Integrator, Measurement, Methods, Orders, Part, PartSettings, Render, RenderSettings, Window};
use scenes::Scene;
use std::path::{Path, PathBuf};
use std::time::Instant;

/// Renders and writes what was asked for.
///
/// # Errors
/// If anything asked for is impossible: found out before the image is begun, but for a disk that fills up.
pub fn render(args: &RenderArgs, methods: &Methods, verbosity: Verbosity, stop: &Stop) -> Result<Status, Error> {
    let mut job = while_loading(verbosity, || Job::prepare(args, methods))?;
    let live = args.live.as_ref().map(|address| Live::open(address.as_deref())).transpose()?;
    let pool = budget::pool(args.threads)?;
    if job.method.name() == composite::NAME && args.image.max_order == Some(MaxOrder::Auto) {
        let message = "a composite's methods are for known orders; name the last one in place of --max-order auto";
        return Err(Error::usage(message));
    }
    if Composite::is_open(&*job.method) {
        pool.install(|| job.compose(args.seconds, methods, stop))?;
    }
    if args.image.max_order == Some(MaxOrder::Auto) {
        let allowed = args.image.tail.flatten().unwrap_or(DEFAULT_PART);
        pool.install(|| job.truncate(allowed, stop))?;
    }
    let (measurement, status) = pool.install(|| job.run(Display { verbosity, live }, stop))?;
    let write = Instant::now();
    let picture = job.write(&measurement, args.layers)?;
    let seconds = Seconds { render: measurement.seconds(), write: write.elapsed().as_secs_f64(), ..job.seconds };
    if let Some(path) = &args.stats {
        let statistics = Statistics::new(&measurement, job.context(pool.current_num_threads()), seconds);
        write_atomically(path, statistics.to_json().as_bytes())?;
    }
    match verbosity {
        Verbosity::Normal => print(&job.summary(&measurement, picture))?,
        // What became of a file is what no one asked to be quiet about.
        Verbosity::Quiet => job.scene.notes.iter().for_each(|note| tell!("note: {note}")),
    }
    if let Status::Interrupted(_) = status {
        tell!("stopped early: {} holds the replicates that were complete", job.output.display());
    }
    let invalid: u64 = measurement.invalid.iter().sum();
    if invalid > 0 && !args.allow_invalid {
        tell!("error: {}", budget::non_finite(&measurement, job.settings.seed));
        return Ok(if status == Status::Done { Status::Failed } else { status });
    }
    Ok(status)
}

/// Everything that a render needs, checked.
struct Job {
    scene: Scene,
    /// The pixels asked for.
    window: Window,
    method: Box<dyn Integrator>,
    settings: RenderSettings,
    /// What the image is taken apart into.
    parts: PartSettings,
    budget: Budget,
    /// How the runs of its composite were chosen, if they were.
    choice: Option<Choice>,
    /// How the last order was chosen, if it was.
    truncation: Option<Truncation>,
    output: PathBuf,
    seconds: Seconds,
}

impl Job {
    fn prepare(args: &RenderArgs, methods: &Methods) -> Result<Self, Error> {
        let ImageArgs { spp, replicates, .. } = args.image;
        let budget = match (args.seconds, spp.unwrap_or(DEFAULT_SPP)) {
            (Some(seconds), _) => Budget::seconds(seconds, replicates),
            (None, spp) => Budget::samples(spp, replicates),
        };
        let budget = budget.map_err(Error::Usage)?;
        if args.layers.variance && replicates < 2 {
            let told = "variances are told by independent images; take --replicates 2 or more, or leave `variance` out of --layers";
            return Err(Error::Usage(told.to_owned()));
        }
        let Subject { scene, method, settings, seconds } = Subject::load(&args.image, methods)?;
        let output = output_path(args, &scene)?;
        let window = args.crop.clone().unwrap_or_else(|| Window::of(&scene));
        check_window(&scene, &window)?;
        let parts = parts::settings(args.layers, &args.lpe)?;
        let (choice, truncation) = (None, None);
        Ok(Self { scene, window, method, settings, parts, budget, choice, truncation, output, seconds })
    }

    /// Chooses the runs of its composite.
    fn compose(&mut self, seconds: Option<f64>, methods: &Methods, stop: &Stop) -> Result<(), Error> {
        let samples = self.budget.known_samples().map(|samples| f64::from(samples * self.budget.replicates));
        let takes = |sample: f64| seconds.unwrap_or_else(|| samples.unwrap_or_default() * sample);
        let choice = Choice::new(&mut self.scene, methods, &self.settings, &takes, stop)?;
        self.method = choice.composite(methods)?;
        self.settings.instance = budget::instance(&*self.method, self.settings.sampler);
        self.choice = Some(choice);
        Ok(())
    }

    /// Takes as many orders as it needs to leave out no more than this part of the image.
    fn truncate(&mut self, allowed: f64, stop: &Stop) -> Result<(), Error> {
        let chosen = Truncation::choose(&self.scene, &*self.method, &self.settings, allowed, stop)?;
        self.settings.orders = Orders::up_to(chosen.max_order);
        self.truncation = Some(chosen);
        Ok(())
    }

    /// All replicates, or those that were complete when the user asked for an end.
    fn run(&self, display: Display, stop: &Stop) -> Result<(Measurement, Status), Error> {
        let pixels = u64::from(self.window.width()) * u64::from(self.window.height());
        let request = render::request(&self.scene, &*self.method, &self.settings, &self.parts)?;
        if self.parts.strategies && !request.parts().list().iter().any(Part::is_strategy) {
            let message = "has no strategies to be told apart in these orders; leave `strategies` out of --layers";
            return Err(Error::usage(format!("{} {message}", self.method.name())));
        }
        // Of strategies the tails are told.
        let request = if self.parts.strategies { request.with_fireflies() } else { request };
        let layers = request.film_layers() as u64;
        let what = if layers > 2 * request.layers().len() as u64 { "this image, taken apart," } else { "this image" };
        let image = u64::from(self.scene.camera.width()) * u64::from(self.scene.camera.height());
        let kept = self.method.bytes(image, &request);
        require_memory(u128::from(Render::bytes(pixels, layers)) + u128::from(kept), what)?;

        let render = |settings: RenderSettings| {
            Render::of_request(&self.scene, &*self.method, settings, self.window.clone(), request.clone())
        };
        let samples_per_replicate = self.budget.samples_per_replicate(&render, &self.settings, stop)?;
        let mut render = render(RenderSettings { samples_per_replicate, ..self.settings.clone() })?;
        let mut progress = Progress::new(f64::from(self.budget.replicates), display);
        let name = format!("{} in {}", self.method.name(), self.scene.name);
        progress.say(name.clone());
        while render.replicates() < self.budget.replicates {
            progress.during(1.0, |report| render.run_replicate(report));
            progress.show(&name, &render, render.replicates() == self.budget.replicates);
            if let Some(signal) = stop.signal() {
                return Ok((render.finish(), Status::Interrupted(signal)));
            }
        }
        Ok((render.finish(), Status::Done))
    }

    /// Writes the image with its layers, or a picture of it, whose exposure is returned.
    fn write(&self, m: &Measurement, layers: LayerSelection) -> Result<Option<Exposure>, Error> {
        if output::has_ending(&self.output, "png") {
            let exposure = exposure_of(m, None).unwrap_or_default();
            Picture::of(m, None, exposure, 1).write(&self.output)?;
            return Ok(Some(exposure));
        }
        write_measurement(&self.output, m, &self.meta(), layers)?;
        if layers.strategies {
            pyramid::write(&self.pyramid(), m, &format!("{} in {}", self.method.name(), self.scene.name))?;
        }
        Ok(None)
    }

    /// Where the sheet of strategies goes: beside the image.
    fn pyramid(&self) -> PathBuf {
        let stem = self.output.file_stem().unwrap_or_default().to_string_lossy();
        self.output.with_file_name(format!("{stem}_strategies.png"))
    }

    fn meta(&self) -> ImageMeta {
        ImageMeta {
            software: format!("neumann {VERSION}"),
            scene: self.scene.name.clone(),
            scene_hash: self.scene.hash.clone(),
            method: self.method.name().to_owned(),
            settings: self.method.settings(),
            sampler: self.settings.sampler.to_string(),
            filter: self.scene.camera.filter().to_string(),
            seed: self.settings.seed,
        }
    }

    fn context(&self, threads: usize) -> Context {
        Context {
            scene: self.scene.name.clone(),
            method: self.method.name().to_owned(),
            settings: self.method.settings(),
            seed: self.settings.seed,
            sampler: self.settings.sampler.to_string(),
            filter: self.scene.camera.filter().to_string(),
            threads,
            skipped: self.scene.needs.skipped(),
            missing_light: path_class::missing(&*self.method, &self.scene),
            bias: self.method.bias(),
            truncation: self.truncation,
            choice: self.choice.clone(),
        }
    }

    fn summary(&self, m: &Measurement, picture: Option<Exposure>) -> String {
        let mut text = format!(
            "{}: {} in {}, {}x{}, {} samples per pixel in {} replicates, {:.2} s\n",
            self.output.display(),
            self.method.name(),
            self.scene.name,
            m.width,
            m.height,
            m.samples(),
            m.replicates,
            m.seconds()
        );
        if let Some(exposure) = picture {
            text += &format!("  shown at {exposure} its brightness\n");
        }
        if let Some(choice) = &self.choice {
            text += &format!("  {}\n", choice.in_words());
        }
        if let Some(truncation) = &self.truncation {
            text += &format!("  {}\n", truncation.in_words());
        }
        for missing in path_class::missing(&*self.method, &self.scene) {
            text += &format!("  {} cannot carry here: {missing}\n", self.method.name());
        }
        if let Some(bias) = self.method.bias().label() {
            text += &format!("  {} is {bias}\n", self.method.name());
        }
        if let Some(words) = parts::unbounded_in_words(m) {
            text += &format!("  {words}\n");
        }
        for note in &self.scene.notes {
            text += &format!("  note: {note}\n");
        }
        text
    }
}

/// Where the image goes; it and the statistics are known to be writable then.
fn output_path(args: &RenderArgs, scene: &Scene) -> Result<PathBuf, Error> {
    let default = || PathBuf::from(format!("{}_{}.exr", budget::file_name(&scene.name), args.image.method));
    let output = args.output.clone().unwrap_or_else(default);
    let exr = || if output.is_dir() { output.join("image.exr") } else { output.with_extension("exr") };
    let refused = |why: &str| Err(Error::usage(format!("{}: {why} call it {}", output.display(), exr().display())));
    if output::has_ending(&output, "png") {
        let LayerSelection { orders: _, variance, strategies, groups } = args.layers;
        if variance || strategies || groups || !args.lpe.is_empty() {
            return refused("a .png is the image alone, without layers;");
        }
    } else if !output::has_ending(&output, "exr") {
        return refused("images are OpenEXR files, or .png to be looked at;");
    }
    output::check_file(&output)?;
    if let Some(stats) = &args.stats {
        check_stats(stats, &output)?;
    }
    Ok(output)
}

fn check_stats(stats: &Path, output: &Path) -> Result<(), Error> {
    if stats == output {
        return Err(Error::usage(format!("{}: --output and --stats name the same file", stats.display())));
    }
    output::check_file(stats)
}
