//! The laws that neumann obeys, a module each.

mod agreement;
mod bsdf_laws;
mod cli;
mod determinism;
mod faults;
mod meshes;
mod mis_weights;
mod needs;
mod orders;
mod roulette;
mod splats;
mod statistics;
mod support;
