//! One sample of an image traced again: its contributions, vertex by vertex.

use crate::error::Error;
use integrators::contribution::{Contribution, PathView, Technique};
use integrators::integrator::{Pass, Replicate};
use integrators::lpe::Example;
use integrators::trail;
use integrators::vertex::{PathVertex, Site};
use integrators::{Firefly, Integrator, RenderSettings, Request};
use sampling::sampler::StreamKey;
use scenes::Scene;
use serde::Serialize;
use std::fmt::Write;

/// Which sample of an image.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Place {
    /// Which independent image.
    pub replicate: u32,
    /// Column and row of the pixel.
    pub pixel: (u32, u32),
    /// Number of the sample in its pixel and replicate.
    pub sample: u32,
}

/// A contribution with its path.
#[derive(Clone, Debug, Serialize)]
pub struct Shown {
    /// Number of scatterings.
    pub order: usize,
    /// How the path was built.
    pub technique: Technique,
    /// Where it lands \[pixels\].
    pub raster: [f32; 2],
    /// What the image gets: raw value times weight \[W/(m²·sr)\].
    pub value: [f32; 3],
    /// What this technique alone would give.
    pub raw: [f32; 3],
    /// The MIS weight.
    pub weight: f64,
    /// An expression that the path belongs to, by the kinds of lobes that have most of each scattering.
    pub path: String,
    /// Its vertices from the camera to the light.
    pub vertices: Vec<ShownVertex>,
}

/// A vertex of a shown path.
#[derive(Clone, Debug, Serialize)]
pub struct ShownVertex {
    /// Which subpath it is of: `camera` or `light`.
    pub subpath: &'static str,
    /// What stands there: the surface's material and label, the emitter's label, `camera`.
    pub at: String,
    /// Where \[m\]; for what is infinitely far, a point of the scene's bounds.
    pub position: [f32; 3],
    /// The geometric normal; zero off surfaces; where it is infinitely far, the direction of flight.
    pub normal: [f32; 3],
    /// The subpath's weight up to here.
    pub throughput: [f32; 3],
    /// Density with which its own subpath generates it \[1/m²\], or \[1/sr\] at an environment; 0 where the method keeps none.
    pub density: f64,
    /// Density with which a subpath from the other end would; 0 where the method keeps none.
    pub density_reverse: f64,
    /// Whether the subpath left it by a delta lobe.
    pub delta: bool,
}

/// Traces samples of a method's image of a scene again: what all of them need is gathered once.
pub struct Retracing<'a> {
    scene: &'a Scene,
    method: &'a dyn Integrator,
    settings: &'a RenderSettings,
    request: Request,
    names: Names,
}

impl<'a> Retracing<'a> {
    /// Of an image by these settings, with the number of samples per replicate that it had, since samplers stratify by it.
    ///
    /// # Errors
    /// If the method cannot render the scene.
    pub fn new(scene: &'a Scene, method: &'a dyn Integrator, settings: &'a RenderSettings) -> Result<Self, Error> {
        let request = integrators::render::request(scene, method, settings, &integrators::PartSettings::default())?;
        let names = Names { surfaces: scene.labels.surfaces(), emitters: scene.labels.emitters() };
        Ok(Self { scene, method, settings, request, names })
    }

    /// The contributions of a sample.
    ///
    /// # Errors
    /// If there is no such sample, or the method has none that stands alone.
    pub fn sample(&self, place: Place) -> Result<Vec<Shown>, Error> {
        // Before a replicate is begun, which may take a pilot.
        self.check(place)?;
        self.sample_of(&mut *self.begin(place.replicate), place)
    }

    /// Begins a replicate.
    fn begin(&self, number: u32) -> Box<dyn Pass + '_> {
        self.method.begin(self.scene, &self.request, self.replicate(number))
    }

    fn replicate(&self, number: u32) -> Replicate {
        let RenderSettings { seed, instance, role, sampler, samples_per_replicate, .. } = self.settings;
        let key = StreamKey::new(*seed, instance, *role, number);
        Replicate { number, key, sampler: *sampler, samples: *samples_per_replicate }
    }

    fn sample_of(&self, pass: &mut dyn Pass, place: Place) -> Result<Vec<Shown>, Error> {
        let mut shown = Vec::new();
        let mut show = |c: &Contribution| {
            if self.request.wants(c.technique.order()) {
                shown.push(self.names.show(c));
            }
        };
        match pass.replay(place.pixel, place.sample, &mut show) {
            true => Ok(shown),
            false => Err(Error::usage(format!(
                "{} has no samples that stand alone, so none can be replayed",
                self.method.name()
            ))),
        }
    }

    /// The path of every contribution that a render kept; `None` if its sample does not give it again, to the bit.
    ///
    /// # Errors
    /// Those of [`Self::sample`].
    pub fn find(&self, fireflies: &[&Firefly]) -> Result<Vec<Option<Shown>>, Error> {
        let mut by_replicate: Vec<usize> = (0..fireflies.len()).collect();
        by_replicate.sort_by_key(|&i| fireflies[i].replicate);
        let mut shown: Vec<_> = fireflies.iter().map(|_| None).collect();
        // What a replicate begins with, such as a pilot, is done once for all of its samples.
        for of_one in by_replicate.chunk_by(|&a, &b| fireflies[a].replicate == fireflies[b].replicate) {
            let mut pass = self.begin(fireflies[of_one[0]].replicate);
            for &i in of_one {
                shown[i] = self.find_in(&mut *pass, fireflies[i])?;
            }
        }
        Ok(shown)
    }

    fn find_in(&self, pass: &mut dyn Pass, firefly: &Firefly) -> Result<Option<Shown>, Error> {
        let Firefly { replicate, pixel, sample, technique, raster, value, weight } = *firefly;
        let place = Place { replicate, pixel, sample };
        self.check(place)?;
        let same = |shown: &Shown| {
            let bits = |values: &[f32]| -> Vec<u32> { values.iter().map(|v| v.to_bits()).collect() };
            shown.technique == technique
                && bits(&shown.raster) == bits(&raster.to_array())
                && bits(&shown.raw) == bits(&value.to_array())
                && shown.weight.to_bits() == weight.to_bits()
        };
        Ok(self.sample_of(pass, place)?.into_iter().find(same))
    }

    fn check(&self, place: Place) -> Result<(), Error> {
        let (width, height) = (self.scene.camera.width(), self.scene.camera.height());
        let (x, y) = place.pixel;
        if x >= width || y >= height {
            return Err(Error::usage(format!(
                "--pixel {x},{y}: the image has {width}x{height} pixels, counted from 0"
            )));
        }
        let samples = self.method.most_samples(self.scene, &self.request, self.replicate(place.replicate));
        if place.sample >= samples {
            let last = samples - 1;
            return Err(Error::usage(format!(
                "--sample {}: a replicate has {samples} samples per pixel, 0 to {last}; give --spp and --replicates of the image",
                place.sample
            )));
        }
        Ok(())
    }
}

/// What surfaces and emitters go by.
struct Names {
    surfaces: Vec<Vec<String>>,
    emitters: Vec<Vec<String>>,
}

impl Names {
    fn show(&self, c: &Contribution) -> Shown {
        let PathView { light, camera } = c.path;
        let surface = |id: scenes::SurfaceId| self.surfaces[id.0 as usize].clone();
        let word = trail::word(&c.path).into_iter().map(|(event, kind, id)| (event, kind, surface(id)));
        let light_names = c.emitter.map(|emitter| self.emitters[emitter.0 as usize].clone()).unwrap_or_default();
        let path = Example { scatterings: word.collect(), light: light_names };
        let of_camera = camera.iter().map(|vertex| self.vertex("camera", vertex));
        let of_light = light.iter().rev().map(|vertex| self.vertex("light", vertex));
        Shown {
            order: c.technique.order(),
            technique: c.technique,
            raster: c.raster.to_array(),
            value: (c.value * c.weight as f32).to_array(),
            raw: c.value.to_array(),
            weight: c.weight,
            path: path.to_string(),
            vertices: of_camera.chain(of_light).collect(),
        }
    }

    fn vertex(&self, subpath: &'static str, vertex: &PathVertex) -> ShownVertex {
        let at = match &vertex.site {
            Site::Camera(_) => "camera".to_owned(),
            Site::Surface(hit) => self.surfaces[hit.surface.0 as usize].join(" "),
            Site::Emitter(emitter, _) => match self.emitters[emitter.0 as usize].join(" ") {
                label if label.is_empty() => format!("emitter {}", emitter.0),
                label => label,
            },
        };
        ShownVertex {
            subpath,
            at,
            position: vertex.at.p.to_array(),
            normal: vertex.at.ng.to_array(),
            throughput: vertex.beta.to_array(),
            density: vertex.pdf_fwd,
            density_reverse: vertex.pdf_rev,
            delta: vertex.delta,
        }
    }
}

/// A contribution for people to read.
pub fn in_words(shown: &Shown) -> String {
    let triple = |v: &[f32; 3]| format!("{:>11.4e} {:>11.4e} {:>11.4e}", v[0], v[1], v[2]);
    let point = |v: &[f32; 3]| format!("{:>10.5} {:>10.5} {:>10.5}", v[0], v[1], v[2]);
    let [r, g, b] = shown.value;
    let mut text = format!("order {}, ", shown.order);
    text += &match shown.technique {
        Technique::Connect { s, t } => format!("s = {s}, t = {t}"),
        Technique::Merge { s, t } => format!("merged s = {s}, t = {t}"),
        Technique::Whole { .. } => "as a whole".to_owned(),
    };
    let _ = writeln!(text, ", at {:.3} {:.3}: {r:.6e} {g:.6e} {b:.6e}", shown.raster[0], shown.raster[1]);
    let [r, g, b] = shown.raw;
    let _ = writeln!(text, "  raw {r:.6e} {g:.6e} {b:.6e}, weight {:.6}, path {}", shown.weight, shown.path);
    let widest = shown.vertices.iter().map(|vertex| vertex.at.chars().count()).max().unwrap_or(0).max(6);
    let _ = writeln!(
        text,
        "  {:<6} {:<widest$} {:>32} {:>32} {:>35} {:>11} {:>11}",
        "of", "vertex", "position [m]", "normal", "throughput", "density", "reverse"
    );
    for v in &shown.vertices {
        let delta = if v.delta { "  delta" } else { "" };
        let _ = writeln!(
            text,
            "  {:<6} {:<widest$} {} {} {} {:>11.4e} {:>11.4e}{delta}",
            v.subpath,
            v.at,
            point(&v.position),
            point(&v.normal),
            triple(&v.throughput),
            v.density,
            v.density_reverse
        );
    }
    text
}
