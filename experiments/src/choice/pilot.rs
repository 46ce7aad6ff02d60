//! What a pilot finds of a method: the covariances of its layers, and what they cost.

use super::regions;
use super::search::{Candidate, Cost};
use crate::error::Error;
use crate::path_class::{carries, largest_hit, missing};
use crate::statistics::covariances::Covariances;
use crate::statistics::positive;
use crate::stop::Stop;
use integrators::composite::Run;
use integrators::measurement::Counters;
use integrators::parts::PartSettings;
use integrators::render;
use integrators::{Integrator, Layer, Render, RenderSettings, Window};
use sampling::moments::Moments;
use sampling::sampler::Role;
use scenes::Scene;

/// Independent images of a pilot: twice the fewest of which variances have intervals, for these are very wide of so few.
pub const REPLICATES: u32 = 16;
/// The samples of a replicate as whose its images are cut in blocks: those of long renders have the longest.
const LONG: u32 = 1024;
/// Samples per pixel of the renders whose rays are counted.
const COUNTED: u32 = 2;
/// By how many standard errors of both a mean must lie below another for the method to lack light.
const LACKS: f64 = 4.0;
/// By how many of the other's alone for it to have missed what it meets by chance.
const MISSES: f64 = 2.0;

/// A method that may take part.
pub struct Entry<'m> {
    /// The run that it would be, of no orders yet.
    pub run: &'m Run,
    /// The method.
    pub method: &'m dyn Integrator,
    /// How it would render all layers.
    pub settings: RenderSettings,
    /// The light that it loses.
    pub lost: Vec<String>,
    /// Which of the layers it carries.
    pub carries: Vec<bool>,
}

impl<'m> Entry<'m> {
    /// A method in a scene that it supports.
    pub fn new(
        scene: &Scene,
        run: &'m Run,
        method: &'m dyn Integrator,
        settings: &RenderSettings,
        layers: &[Layer],
    ) -> Self {
        let max_order = settings.orders.max_order();
        let lost = missing(method, scene);
        let range = method.orders(max_order);
        let has = |layer: &Layer| match layer {
            Layer::Order(k) => range.contains(k),
            Layer::Tail => *range.end() == max_order,
        };
        let carries = layers.iter().map(|layer| has(layer) && carries(&lost, Some(*layer), max_order)).collect();
        let settings = RenderSettings {
            instance: crate::budget::instance(method, settings.sampler),
            role: Role::Pilot,
            ..settings.clone()
        };
        Self { run, method, settings, lost, carries }
    }

    /// Its settings for some layers alone; `number` tells pilots from one another.
    pub fn of_layers(&self, layers: &[Layer], number: u32, samples_per_replicate: u32) -> RenderSettings {
        let tail = layers.contains(&Layer::Tail);
        let orders = self.settings.orders.clone().only(|k| layers.contains(&Layer::Order(k)));
        let instance = format!("{}, choice {number}", self.settings.instance);
        RenderSettings { orders, tail, samples_per_replicate, instance, ..self.settings.clone() }
    }

    /// Those of the layers that it carries.
    pub fn own(&self, layers: &[Layer]) -> Vec<Layer> {
        layers.iter().zip(&self.carries).filter(|(_, carries)| **carries).map(|(layer, _)| *layer).collect()
    }
}

/// A pilot at work.
pub struct Pilot<'a> {
    render: Render<'a>,
    samples: f64,
    pixels: f64,
    covariances: Covariances,
    /// The same of the cells that may be regions, for a method that has such.
    cells: Vec<(Window, Covariances)>,
    /// Seconds of each image.
    times: Vec<f64>,
}

impl<'a> Pilot<'a> {
    /// Of a method with such settings. It notes its largest contributions as an experiment's renders do, which takes time.
    ///
    /// # Errors
    /// If the method cannot render the scene.
    pub fn new(scene: &'a Scene, method: &'a dyn Integrator, settings: RenderSettings) -> Result<Self, Error> {
        let samples = f64::from(settings.samples_per_replicate);
        let window = Window::whole(scene.camera.width(), scene.camera.height());
        let pixels = window.width() as usize * window.height() as usize;
        let request = render::request(scene, method, &settings, &PartSettings::default())?.with_fireflies();
        let layers = request.layers().len();
        let covariances = Covariances::new(pixels, layers);
        let of_cell = |cell: Window| {
            let pixels = cell.width() as usize * cell.height() as usize;
            (cell, Covariances::new(pixels, layers))
        };
        let cells = if method.divides() { regions::cells(scene).map(of_cell).collect() } else { Vec::new() };
        let render = Render::of_request(scene, method, settings, window, request)?.cut_as(LONG);
        Ok(Self { render, samples, pixels: pixels as f64, covariances, cells, times: Vec::new() })
    }

    /// Renders an image more.
    ///
    /// # Errors
    /// If the user asked for an end.
    pub fn step(&mut self, stop: &Stop) -> Result<(), Error> {
        let before = self.render.seconds();
        self.render.run_replicate(&|_| {});
        self.times.push(self.render.seconds() - before);
        self.covariances.push(|layer, pixel| self.render.last_replicate(layer, pixel));
        let row = self.render.window().width();
        for (cell, covariances) in &mut self.cells {
            let place = |i: u32| (cell.y.start + i / cell.width()) * row + cell.x.start + i % cell.width();
            covariances.push(|layer, i| self.render.last_replicate(layer, place(i as u32) as usize));
        }
        stop.check()
    }

    /// Seconds of a sample of every pixel.
    pub fn seconds(&self) -> f64 {
        self.render.seconds() / f64::from(self.render.replicates()) / self.samples
    }

    /// Samples taken of each pixel.
    pub fn samples(&self) -> f64 {
        self.samples * self.times.len() as f64
    }

    /// Seconds of each image.
    pub fn times(&self) -> &[f64] {
        &self.times
    }

    /// The variance of one sample of these layers' sum, image and channel mean.
    pub fn variance(&self, layers: &[Layer]) -> f64 {
        mean(&self.squares(layers))
    }

    /// What each replicate but the first adds to it, see [`positive`].
    pub fn squares(&self, layers: &[Layer]) -> Vec<f64> {
        let squares = self.covariances.squares_over(&self.places(layers));
        squares.into_iter().map(|square| square * self.samples).collect()
    }

    /// The same cell by cell.
    pub fn squares_of_cells(&self, layers: &[Layer]) -> Vec<Vec<f64>> {
        let places = self.places(layers);
        let of = |(_, covariances): &(Window, Covariances)| -> Vec<f64> {
            covariances.squares_over(&places).into_iter().map(|square| square * self.samples).collect()
        };
        self.cells.iter().map(of).collect()
    }

    /// Whether it has all of these layers.
    pub fn has(&self, layers: &[Layer]) -> bool {
        layers.iter().all(|layer| self.render.layers().contains(layer))
    }

    /// Where it has these layers.
    fn places(&self, layers: &[Layer]) -> Vec<usize> {
        let found = self.render.layers();
        (0..found.len()).filter(|&i| layers.contains(&found[i])).collect()
    }

    /// Image means and their standard errors, layer by layer.
    fn means(&self) -> Vec<(f64, f64)> {
        let moments = |layer: usize| -> Moments {
            self.render.replicate_means().map(|means| means[layer].iter().sum::<f64>() / 3.0).collect()
        };
        (0..self.render.layers().len()).map(moments).map(|m| (m.mean, m.variance_of_mean().sqrt())).collect()
    }
}

/// The mean of values.
pub fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len() as f64
}

/// A pilot of every method in the layers that it carries, with this number, so many samples and so many images.
///
/// # Errors
/// If a method cannot render, or the user asked for an end.
pub fn of_all<'a>(
    scene: &'a Scene,
    entries: &[Entry<'a>],
    layers: &[Layer],
    (number, samples, replicates): (u32, u32, u32),
    stop: &Stop,
) -> Result<Vec<Pilot<'a>>, Error> {
    let pilot =
        |entry: &Entry<'a>| Pilot::new(scene, entry.method, entry.of_layers(&entry.own(layers), number, samples));
    let mut pilots = entries.iter().map(pilot).collect::<Result<Vec<_>, _>>()?;
    take_turns(&mut pilots, replicates, stop)?;
    Ok(pilots)
}

/// So many images of each, by turns, so that the machine's drift hits all alike.
///
/// # Errors
/// If the user asked for an end.
pub fn take_turns(pilots: &mut [Pilot], replicates: u32, stop: &Stop) -> Result<(), Error> {
    for _ in 0..replicates {
        pilots.iter_mut().try_for_each(|pilot| pilot.step(stop))?;
    }
    Ok(())
}

/// What is known of every method by its own pilot and the rays of renders of single layers. Those that lack light which another has met are
/// taken to carry no such layer.
///
/// # Errors
/// If a method cannot render, or the user asked for an end.
pub fn candidates(
    scene: &Scene,
    entries: &[Entry],
    pilots: &[Pilot],
    layers: &[Layer],
    stop: &Stop,
) -> Result<Vec<Candidate>, Error> {
    let mut seen: Vec<Vec<Option<(f64, f64)>>> = Vec::new();
    for (entry, pilot) in entries.iter().zip(pilots) {
        let means = pilot.means();
        let of = |layer: &Layer| pilot.render.layers().iter().position(|own| own == layer).map(|own| means[own]);
        let known = layers.iter().zip(&entry.carries).map(|(layer, carries)| of(layer).filter(|_| *carries));
        seen.push(known.collect());
    }
    // By how much a method's mean lies below what the others have found at least.
    let deficit = |m: usize, k: usize, errors: f64| {
        let (mean, error) = seen[m][k]?;
        let least = seen.iter().filter_map(|other| other[k]).map(|(other, of_other)| other - errors * of_other);
        Some((least.fold(f64::NEG_INFINITY, f64::max) - mean, error))
    };
    let lacks = |m: usize, k: usize| deficit(m, k, LACKS).is_none_or(|(deficit, error)| deficit > LACKS * error);
    let mut candidates = Vec::new();
    for (m, (entry, pilot)) in entries.iter().zip(pilots).enumerate() {
        let carries = (0..layers.len()).map(|k| !lacks(m, k)).collect();
        let doubts = doubts(pilot);
        let of = |covariances: &Covariances| covariance(pilot, covariances, &doubts, layers);
        let mut covariance = of(&pilot.covariances);
        let mut cells: Vec<Vec<f64>> = pilot.cells.iter().map(|(_, cell)| of(cell)).collect();
        for (k, &layer) in layers.iter().enumerate() {
            // Light that is met by chance alone comes in pieces as bright as the emitter: what is missing yet will bring as much variance.
            let hit = largest_hit(entry.method, scene, layer).iter().sum::<f64>() / 3.0;
            let missing = deficit(m, k, MISSES).map_or(0.0, |(deficit, _)| deficit.max(0.0));
            cells.iter_mut().chain([&mut covariance]).for_each(|own| own[k * (layers.len() + 1)] += hit * missing);
        }
        let cost = cost(scene, entry, layers, stop)?;
        let own: Vec<usize> = (0..layers.len()).filter(|&k| entry.carries[k]).collect();
        let work = cost.of(&own);
        candidates.push(Candidate { carries, covariance, cells, cost: cost.times(pilot.seconds() / work.max(1.0)) });
    }
    Ok(candidates)
}

/// By how much the standard deviation of each of a pilot's layers may be greater than it is found to be, as its variance's interval allows: few images
/// may have missed what is rare.
fn doubts(pilot: &Pilot) -> Vec<f64> {
    let doubt = |own: usize| {
        let found = positive::variance(&pilot.covariances.squares(own), own as u64);
        found.interval.map_or(1.0, |(_, high)| (high / found.value).sqrt())
    };
    (0..pilot.render.layers().len()).map(doubt).collect()
}

/// Covariances of one sample between all layers, those that the pilot has not being 0.
fn covariance(pilot: &Pilot, covariances: &Covariances, doubts: &[f64], layers: &[Layer]) -> Vec<f64> {
    let place = |layer: &Layer| pilot.render.layers().iter().position(|own| own == layer);
    let places: Vec<Option<usize>> = layers.iter().map(place).collect();
    let entry = |i: usize, j: usize| match (places[i], places[j]) {
        (Some(i), Some(j)) => covariances.value(i, j) * doubts[i] * doubts[j] * pilot.samples,
        _ => 0.0,
    };
    (0..layers.len() * layers.len()).map(|at| entry(at / layers.len(), at % layers.len())).collect()
}

/// The work of a sample's layers, in rays and subpaths.
fn cost(scene: &Scene, entry: &Entry, layers: &[Layer], stop: &Stop) -> Result<Cost, Error> {
    let mut work = [Vec::new(), Vec::new()];
    for k in 0..layers.len() {
        for (work, first) in work.iter_mut().zip([0, k]) {
            let asked: Vec<Layer> = (first..=k).filter(|&j| entry.carries[j]).map(|j| layers[j]).collect();
            if asked.is_empty() {
                work.push(work.last().copied().unwrap_or(0.0));
                continue;
            }
            let mut render = Pilot::new(scene, entry.method, entry.of_layers(&asked, 3, COUNTED))?;
            render.render.run_replicate(&|_| {});
            stop.check()?;
            let pixels = render.pixels * f64::from(COUNTED);
            work.push(rays(render.render.finish().counters) / pixels);
        }
    }
    Ok(Cost::new(&work[0], &work[1]))
}

/// The work of a sample of these layers, cell by cell, its mean over the image being 1.
///
/// # Errors
/// If the method cannot render, or the user asked for an end.
pub fn work_of_cells(scene: &Scene, entry: &Entry, layers: &[Layer], stop: &Stop) -> Result<Vec<f64>, Error> {
    let (mut work, mut sum, mut area) = (Vec::new(), 0.0, 0.0);
    for cell in regions::cells(scene) {
        let pixels = f64::from(cell.width()) * f64::from(cell.height());
        let mut render = Render::cropped(scene, entry.method, entry.of_layers(layers, 3, COUNTED), cell)?;
        render.run_replicate(&|_| {});
        stop.check()?;
        let counted = rays(render.finish().counters);
        work.push(counted / (pixels * f64::from(COUNTED)));
        (sum, area) = (sum + counted / f64::from(COUNTED), area + pixels);
    }
    let mean = sum / area;
    Ok(work.into_iter().map(|work| work / mean).collect())
}

/// Rays, and subpaths, each of which is worth about as much.
fn rays(counters: Counters) -> f64 {
    (counters.closest + counters.shadow + counters.camera_paths + counters.light_paths) as f64
}
