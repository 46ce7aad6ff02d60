//! What a method hands over for every path: where it lands, how it was built, what it carries.

use crate::trail::ClassShare;
use crate::vertex::PathVertex;
use sampling::math::Spectrum;
use sampling::{Vec2, Vec3};
use scenes::EmitterId;
use serde::{Deserialize, Serialize};

/// How a path was built. It fixes the path's order, so order and technique cannot disagree.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Technique {
    /// A light subpath of `s` vertices joined to a camera subpath of `t`; order `s + t − 2`.
    Connect {
        /// Light vertices.
        s: u16,
        /// Camera vertices.
        t: u16,
    },
    /// Subpaths whose last vertices were merged; order `s + t − 3`.
    Merge {
        /// Light vertices.
        s: u16,
        /// Camera vertices.
        t: u16,
    },
    /// An order known as a whole, such as a radiosity solution's.
    Whole {
        /// The order.
        order: u16,
    },
}

impl Technique {
    /// The connection of `s` light vertices to `t` camera vertices. Numbers beyond 65 535 count as that.
    #[inline]
    pub fn connect(s: usize, t: usize) -> Self {
        let number = |n: usize| u16::try_from(n).unwrap_or(u16::MAX);
        Technique::Connect { s: number(s), t: number(t) }
    }

    /// The merge of a light subpath's last vertex, one of `s`, with a camera subpath's, one of `t`. Numbers are bounded as above.
    #[inline]
    pub fn merge(s: usize, t: usize) -> Self {
        match Self::connect(s, t) {
            Technique::Connect { s, t } => Technique::Merge { s, t },
            whole => whole,
        }
    }

    /// Whether it brings light to wherever it lands, and not to the pixel whose sample it is of.
    #[inline]
    pub fn splats(self) -> bool {
        matches!(self, Technique::Connect { t: 0 | 1, .. })
    }

    /// Number of scatterings of the path.
    #[inline]
    pub fn order(self) -> usize {
        match self {
            Technique::Connect { s, t } => s as usize + t as usize - 2,
            Technique::Merge { s, t } => s as usize + t as usize - 3,
            Technique::Whole { order } => order as usize,
        }
    }
}

/// The vertices of a path, for sinks that ask for them. Methods that store no vertices give empty slices.
#[derive(Clone, Copy, Debug, Default)]
pub struct PathView<'p> {
    /// The light subpath, from the emitter on.
    pub light: &'p [PathVertex],
    /// The camera subpath, from the camera on.
    pub camera: &'p [PathVertex],
}

/// One path's share of the image.
#[derive(Clone, Copy, Debug)]
pub struct Contribution<'p> {
    /// Where it lands \[pixels, y down\].
    pub raster: Vec2,
    /// How the path was built.
    pub technique: Technique,
    /// The unweighted estimate: what this technique alone would give.
    pub value: Spectrum,
    /// The MIS weight: in [0, 1], but for optimal weights, which may be any number.
    pub weight: f64,
    /// The path's vertices, for sinks that ask for them.
    pub path: PathView<'p>,
    /// The emitter whose light it is; `None` where that is not one emitter's.
    pub emitter: Option<EmitterId>,
    /// The path's classes, for sinks that ask for them.
    pub classes: &'p [ClassShare],
}

impl Contribution<'_> {
    /// A contribution of which no more is told than a film needs.
    #[inline]
    pub fn new(raster: Vec2, technique: Technique, value: Spectrum, weight: f64) -> Self {
        Self { raster, technique, value, weight, path: PathView::default(), emitter: None, classes: &[] }
    }
}

/// What a sink wants beyond weighted values; methods leave out the work for the rest when compiled.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Wants {
    /// The path's vertices.
    pub vertices: bool,
    /// The path's classes, where a request has any.
    pub classes: bool,
}

impl Wants {
    /// Weighted values and nothing else.
    pub const NOTHING: Self = Self { vertices: false, classes: false };
}

/// Whoever takes contributions: a film, or a test.
pub trait Sink {
    /// What is asked for.
    const WANTS: Wants;
    /// Takes one contribution. Non-finite ones are counted, not added.
    fn add(&mut self, contribution: Contribution);
    /// Is told that a walk of [`path`](crate::path) goes on from a point in direction `wi`, with this weight; for those who learn from it.
    #[inline]
    fn goes_on(&mut self, _p: Vec3, _wi: Vec3, _beta: Spectrum) {}
}
