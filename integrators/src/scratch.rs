//! Memory that a method reuses from sample to sample.

use crate::measurement::Counters;
use crate::subsurface::Found;
use crate::trail::Trails;
use crate::vertex::PathVertex;
use std::ops::Range;

/// One thread's buffers and counters; nothing in it outlives a sample but its capacity, the counters, and light subpaths that serve the
/// next one.
#[derive(Clone, Debug, Default)]
pub struct Scratch {
    /// The camera subpath.
    pub camera: Vec<PathVertex>,
    /// The light subpaths, one after another.
    pub light: Vec<PathVertex>,
    /// Where each of them is.
    pub light_paths: Vec<LightPath>,
    /// Whether the light subpaths serve this sample, too, since it has the random numbers of the one before.
    pub keeps_light: bool,
    /// The classes of paths, where they are asked for.
    pub trails: Trails,
    /// What probing a body has found.
    pub found: Found,
    /// Work done.
    pub counters: Counters,
}

/// One of several light subpaths.
#[derive(Clone, Debug)]
pub struct LightPath {
    /// Its vertices in [`Scratch::light`].
    pub vertices: Range<usize>,
    /// The density of its first vertex by next-event estimation from the second.
    pub next_event: f64,
}
