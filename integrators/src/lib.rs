//! The light-transport algorithms of neumann, and what turns their samples into images with variances.
//!
//! The rendering equation's solution is the Neumann series `L = E + TE + T²E + …`; term `k`, the light scattered exactly
//! `k` times, is *order* `k`. Every method here estimates each order it can carry, all in one render.
//!
//! In reading order:
//!
//! - [`contribution`]: how a path was built ([`Technique`]), what a method hands over ([`Contribution`]) and to whom ([`Sink`]);
//! - [`request`]: which orders are asked for;
//! - [`integrator`]: the traits [`Estimator`] and [`Integrator`]; [`method`]: THE LIST, [`Methods`]; [`bias`];
//! - the algorithms, one a file: [`direct`], [`path`] and the [`classics`] that are parts of it, `adaptive`, which spreads samples over pixels by what these err by, [`coherent`] and its bidirectional twin, whose pixels share random numbers, [`light`], [`bdpt`],
//!   [`vcm`] and [`ppm`], which merge vertices with [`photons`], [`metropolis`], which takes samples of `path` and `bdpt` along
//!   Markov chains, [`radiosity`], which looks up light on elements, [`composite`], which leaves each order to one of the others, and
//!   [`exact`], which is the truth where that is known; with what they share: [`start`], [`vertex`], [`walk`], [`connect`],
//!   [`next_event`], [`subsurface`], [`roulette`], [`efficiency`];
//! - [`block`]: how work is cut into pieces; [`film`] and [`splats`]: one block's sums, and the film they are reduced into, in an
//!   order that no thread can change;
//! - [`parts`]: what an image is taken apart into besides orders; [`lpe`]: light-path expressions; [`trail`]: the classes of a path;
//! - [`render`]: replicates; [`statistics`]: their moments; [`fireflies`]: the largest contributions, and how they are made again;
//!   [`tally`]: what replicates add up to; [`measurement`]: what comes out; [`state`]: a render as bytes, to go on later.
//!
//! This crate reads and writes no files, and draws its random numbers only through [`sampling::sampler`].

mod adaptive;
pub mod bdpt;
pub mod bias;
pub mod block;
pub mod classics;
pub mod coherent;
pub mod composite;
pub mod connect;
pub mod contribution;
pub mod direct;
pub mod efficiency;
pub mod exact;
pub mod film;
pub mod fireflies;
pub mod flux;
mod guide;
pub mod guided;
pub mod integrator;
pub mod light;
pub mod lpe;
pub mod measurement;
pub mod method;
pub mod metropolis;
pub mod next_event;
pub mod parts;
pub mod path;
pub mod photons;
pub mod ppm;
pub mod radiosity;
pub mod render;
pub mod request;
mod reservoir;
pub mod roulette;
mod sampled;
pub mod scratch;
mod settings;
pub mod splats;
pub mod start;
pub mod state;
pub mod statistics;
pub mod subsurface;
pub mod tally;
pub mod trail;
pub mod vcm;
pub mod vertex;
pub mod walk;

pub use bias::Bias;
pub use block::Window;
pub use contribution::{Contribution, PathView, Sink, Technique, Wants};
pub use fireflies::{Fireflies, Firefly};
pub use integrator::{Estimator, Integrator};
pub use measurement::{Counters, Layer, Measurement};
pub use method::{MethodError, Methods};
pub use parts::{Part, PartSettings, PathClass, Quantity};
pub use render::{Render, RenderError, RenderSettings};
pub use request::{Orders, Request};
pub use settings::with_nearest;
