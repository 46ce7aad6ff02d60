//! Path classes along a walk: where its word stands in the automata of light-path expressions.
//!
//! A scattering that several kinds of lobes have a part in is all of them at once: it counts by the lobes' shares of f. So what is
//! known of a walk is not one state but the shares of several, whose sum is one. Nothing is decided by the lobe that happened to
//! be sampled, so that the same path is of the same classes however it was built.

use crate::connect::direction;
use crate::contribution::PathView;
use crate::lpe::{Classifier, Event, Scattering, State};
use crate::vertex::{PathVertex, Site};
use sampling::Vec3;
use sampling::bsdf::{Lobes, TransportMode};
use sampling::fault;
use sampling::math::Spectrum;
use sampling::sampler::Subpath;
use scenes::{EmitterId, Interaction, SurfaceId};
use std::ops::Range;

/// The share of a walk that is in a state.
pub type Share = (State, Spectrum);

/// The share of a path that is of some classes: those whose bits are set.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ClassShare {
    /// One bit for each class.
    pub classes: u64,
    /// How much of the path.
    pub share: Spectrum,
}

/// The states of walks at each of their vertices, before they scatter there.
#[derive(Clone, Debug, Default)]
pub struct Trail {
    shares: Vec<Share>,
    /// Where each vertex' shares end.
    ends: Vec<usize>,
}

/// What is kept for telling the classes of paths.
#[derive(Clone, Debug, Default)]
pub struct Trails {
    /// The camera's walk.
    pub camera: Trail,
    /// The walks from emitters.
    pub light: Trail,
    /// The classes of the path at hand.
    pub classes: Vec<ClassShare>,
}

/// A scattering as path classes see it: directions point away from the surface.
#[derive(Clone, Copy, Debug)]
pub struct Bounce<'a> {
    /// Where.
    pub hit: &'a Interaction,
    /// Towards where the walk came from.
    pub wo: Vec3,
    /// Towards where it goes.
    pub wi: Vec3,
    /// Whether it is by a delta lobe.
    pub delta: bool,
}

impl Trail {
    /// Forgets all walks.
    pub fn clear(&mut self) {
        self.shares.clear();
        self.ends.clear();
    }

    /// Begins a walk: what is known of it is a state.
    pub fn begin(&mut self, state: State) {
        self.shares.push((state, Spectrum::ONE));
        self.ends.push(self.shares.len());
    }

    /// The shares at a vertex, by its number among all vertices.
    #[inline]
    pub fn at(&self, vertex: usize) -> &[Share] {
        &self.shares[self.range(vertex)]
    }

    /// The number of the vertex added last.
    #[inline]
    pub fn last(&self) -> usize {
        self.ends.len() - 1
    }

    fn range(&self, vertex: usize) -> Range<usize> {
        let start = vertex.checked_sub(1).map_or(0, |before| self.ends[before]);
        start..self.ends[vertex]
    }

    /// Adds a vertex, which a walk reached by scattering at another.
    pub fn scatter(&mut self, classifier: &Classifier, subpath: Subpath, from: usize, bounce: &Bounce) {
        let (from, first) = (self.range(from), self.shares.len());
        let kinds = kinds(subpath, bounce);
        for index in from {
            let (state, share) = self.shares[index];
            kinds.each(|event, scattering, part| {
                let surface = bounce.hit.surface.0 as usize;
                let next = match subpath {
                    Subpath::Camera => classifier.camera_step(state, event, scattering, surface),
                    Subpath::Light => classifier.light_step(state, event, scattering, surface),
                };
                add(&mut self.shares, first, next, share * part);
            });
        }
        self.ends.push(self.shares.len());
    }

    /// Adds a vertex that a camera walk reached through a body, of whose boundary `hit` is a point.
    pub fn pass_body(&mut self, classifier: &Classifier, hit: &Interaction) {
        let (from, first) = (self.range(self.last()), self.shares.len());
        for index in from {
            let (state, share) = self.shares[index];
            let next = classifier.camera_step(state, Event::Volume, Scattering::Diffuse, hit.surface.0 as usize);
            add(&mut self.shares, first, next, share);
        }
        self.ends.push(self.shares.len());
    }

    /// Takes back the vertex added last.
    pub fn pop(&mut self) {
        self.ends.pop();
        self.shares.truncate(self.ends.last().copied().unwrap_or(0));
    }

    /// Adds the vertices of a subpath, the first included.
    pub fn follow(&mut self, classifier: &Classifier, subpath: Subpath, start: State, vertices: &[PathVertex]) {
        // At the first vertex nothing scatters: the second is where the word begins.
        self.begin(start);
        for (vertex, next) in vertices.iter().zip(vertices.iter().skip(1)) {
            match &vertex.site {
                Site::Surface(hit) => {
                    let bounce = Bounce { hit, wo: vertex.wo, wi: -next.wo, delta: vertex.delta };
                    self.scatter(classifier, subpath, self.last(), &bounce);
                }
                Site::Camera(_) | Site::Emitter(..) => self.begin(start),
            }
        }
    }
}

/// Adds to the share of a state among those from `first` on.
fn add(shares: &mut Vec<Share>, first: usize, state: State, share: Spectrum) {
    match shares[first..].iter_mut().find(|(other, _)| *other == state) {
        Some((_, sum)) => *sum += share,
        None => shares.push((state, share)),
    }
}

/// The classes of a path whose two walks are in these states, replacing what the list held.
pub fn join(classifier: &Classifier, camera: &[Share], light: &[Share], out: &mut Vec<ClassShare>) {
    out.clear();
    for &(c, of_camera) in camera {
        for &(l, of_light) in light {
            let classes = classifier.classes(c, l);
            if classes != 0 {
                out.push(ClassShare { classes, share: of_camera * of_light });
            }
        }
    }
}

/// The classes of a path on which the camera's walk has met an emitter, or was connected to a point on it.
pub fn end(classifier: &Classifier, camera: &[Share], emitter: EmitterId, out: &mut Vec<ClassShare>) {
    join(classifier, camera, &[(classifier.light_start(emitter.0 as usize), Spectrum::ONE)], out);
}

/// The scatterings of a path from the camera on, each as the kind of lobe that has most of it, with the surface.
pub fn word(path: &PathView) -> Vec<(Event, Scattering, SurfaceId)> {
    let PathView { light, camera } = *path;
    let joint = match (light, camera) {
        ([.., y], [.., z]) => direction(z, y),
        _ => Vec3::ZERO,
    };
    // Without a light subpath the camera's last vertex is where the light is.
    let scattering = &camera[..camera.len() - usize::from(light.is_empty() && !camera.is_empty())];
    let along = |subpath, vertices: &[PathVertex], count: usize, joint: Vec3| -> Vec<_> {
        let letter = |i: usize| {
            let Site::Surface(hit) = &vertices[i].site else { return None };
            let next = vertices.get(i + 1);
            let bounce = Bounce {
                hit,
                wo: vertices[i].wo,
                wi: next.map_or(joint, |next| -next.wo),
                delta: next.is_some() && vertices[i].delta,
            };
            let (event, scattering) = kinds(subpath, &bounce).largest();
            Some((event, scattering, hit.surface))
        };
        (0..count).filter_map(letter).collect()
    };
    let mut word = along(Subpath::Camera, camera, scattering.len(), joint);
    word.extend(along(Subpath::Light, light, light.len(), -joint).into_iter().rev());
    word
}

/// The kinds of a scattering and their shares.
struct Kinds {
    event: Event,
    /// Of delta, diffuse and glossy lobes.
    shares: [Option<Spectrum>; 3],
}

impl Kinds {
    fn largest(&self) -> (Event, Scattering) {
        let mut largest = (Scattering::Diffuse, 0.0);
        self.each(|_, scattering, share| {
            if share.luminance() > largest.1 {
                largest = (scattering, share.luminance());
            }
        });
        (self.event, largest.0)
    }

    fn each(&self, mut f: impl FnMut(Event, Scattering, Spectrum)) {
        let kinds = [Scattering::Specular, Scattering::Diffuse, Scattering::Glossy];
        for (scattering, share) in kinds.into_iter().zip(self.shares) {
            if let Some(share) = share {
                f(self.event, scattering, share);
            }
        }
    }
}

fn kinds(subpath: Subpath, bounce: &Bounce) -> Kinds {
    let &Bounce { hit, delta, .. } = bounce;
    // Towards the camera and towards the light, whichever the walk came from, so that it is the same f.
    let (wo, wi) = match subpath {
        Subpath::Camera => (bounce.wo, bounce.wi),
        Subpath::Light => (bounce.wi, bounce.wo),
    };
    let same_side = (wo.dot(hit.point.ng) > 0.0) == (wi.dot(hit.point.ng) > 0.0);
    let (event, side) =
        if same_side { (Event::Reflection, Lobes::REFLECTION) } else { (Event::Transmission, Lobes::TRANSMISSION) };
    if delta {
        return Kinds { event, shares: [Some(Spectrum::ONE), None, None] };
    }
    let diffuse = (Lobes::DIFFUSE_REFLECTION | Lobes::DIFFUSE_TRANSMISSION) & side;
    let glossy = (Lobes::GLOSSY_REFLECTION | Lobes::GLOSSY_TRANSMISSION) & side;
    let lobes = hit.bsdf.lobes();
    let shares = match (lobes.intersects(diffuse), lobes.intersects(glossy)) {
        (true, true) => {
            // The share is of f, which both modes have but for a common factor.
            let f = |lobes| hit.eval_lobes(wo, wi, lobes, TransportMode::Radiance);
            let (d, g) = (f(diffuse), f(glossy));
            [None, Some(fault!("shares_of_lobes_forgotten", share(d, d + g), Spectrum::ONE)), Some(share(g, d + g))]
        }
        (true, false) => [None, Some(Spectrum::ONE), None],
        // What scatters by neither contributes nothing.
        (false, _) => [None, None, Some(Spectrum::ONE)],
    };
    Kinds { event, shares }
}

/// The share of a part in the whole, channel by channel; 0 where there is nothing.
fn share(part: Spectrum, whole: Spectrum) -> Spectrum {
    let (part, whole) = (part.to_array(), whole.to_array());
    let ratio = |c: usize| if whole[c] == 0.0 { 0.0 } else { part[c] / whole[c] };
    Spectrum::new(ratio(0), ratio(1), ratio(2))
}
