//! The laws that neumann obeys, a module each.

mod agreement;
mod bsdf_laws;
mod cameras;
mod cli;
mod crops;
mod determinism;
mod emitters;
mod environment;
mod false_alarms;
mod faults;
mod irradiance;
mod meshes;
mod mis_weights;
mod needs;
mod orders;
mod refraction;
mod roulette;
mod samplers;
mod scattering;
mod shading_normals;
mod splats;
mod statistics;
mod subsurface;
mod support;
mod textures;
mod variants;
