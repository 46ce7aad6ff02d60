//! Memory that a method reuses from sample to sample.

use crate::connect::PathDensities;
use crate::measurement::Counters;
use crate::subsurface::Found;
use crate::vertex::PathVertex;

/// One thread's buffers and counters; nothing in it outlives a sample but its capacity and the counters.
#[derive(Clone, Debug, Default)]
pub struct Scratch {
    /// The camera subpath.
    pub camera: Vec<PathVertex>,
    /// The light subpath.
    pub light: Vec<PathVertex>,
    /// The densities of the path at hand.
    pub densities: PathDensities,
    /// What probing a body has found.
    pub found: Found,
    /// Work done.
    pub counters: Counters,
}
