//! The laws that neumann obeys, a module each.

mod agreement;
mod determinism;
mod meshes;
mod mis_weights;
mod needs;
mod orders;
mod roulette;
mod splats;
mod support;
