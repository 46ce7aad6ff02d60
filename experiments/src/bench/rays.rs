//! `neumann bench rays`: rays per second, by scene, kind of ray and kernel.

use super::meshes::ball_in_a_room;
use crate::cli::print;
use crate::error::{Error, Status};
use sampling::rng::Stream;
use sampling::{Vec2, vec2, warp};
use scenes::{Kernel, LoadOptions, Ray, Scene};
use serde::Serialize;
use std::hint::black_box;
use std::time::Instant;

/// Rows of the bumpy balls: about 10², 10³, … 10⁶ triangles.
const BALLS: [usize; 5] = [8, 23, 71, 224, 708];
/// Rays of a kind that are followed at once.
const RAYS: usize = 1 << 16;
/// How often all of them are followed, each time by every kernel in turn.
const ROUNDS: usize = 9;

/// What was measured of a kernel.
#[derive(Clone, Debug, Serialize)]
struct Row {
    scene: String,
    triangles: usize,
    /// `primary`, `bounce` or `shadow`.
    rays: &'static str,
    kernel: String,
    rays_per_second: f64,
    /// The median over the rounds of its speed relative to that of the portable kernel.
    relative: f64,
}

/// Measures, and prints a table or JSON.
pub(super) fn rays(named: &[String], json: bool) -> Result<Status, Error> {
    let mut rows = Vec::new();
    let all: Vec<&str> = match named.is_empty() {
        true => scenes::builtin_names().to_vec(),
        false => named.iter().map(String::as_str).collect(),
    };
    for name in all {
        measure(scenes::load(name, &LoadOptions::default())?, &mut rows);
    }
    for n in BALLS.iter().filter(|_| named.is_empty()) {
        measure(ball_in_a_room(*n, (256, 256))?, &mut rows);
    }
    let text = match json {
        true => serde_json::to_string_pretty(&rows).unwrap_or_default() + "\n",
        false => table(&rows),
    };
    print(&text)?;
    Ok(Status::Done)
}

fn table(rows: &[Row]) -> String {
    let header = format!(
        "{:<26} {:>9} {:<8} {:<9} {:>10} {:>9}\n",
        "scene", "triangles", "rays", "kernel", "Mray/s", "relative"
    );
    let line = |row: &Row| {
        let speed = row.rays_per_second * 1e-6;
        let Row { scene, triangles, rays, kernel, relative, .. } = row;
        format!("{scene:<26} {triangles:>9} {rays:<8} {kernel:<9} {speed:>10.2} {relative:>9.2}\n")
    };
    header + &rows.iter().map(line).collect::<String>()
}

/// The rays that a path tracer would ask a scene about.
struct Rays {
    primary: Vec<Ray>,
    bounce: Vec<Ray>,
    shadow: Vec<Ray>,
}

impl Rays {
    fn of(scene: &Scene) -> Self {
        let mut stream = Stream::new(1, 1);
        let mut rays = Rays { primary: Vec::new(), bounce: Vec::new(), shadow: Vec::new() };
        let (width, height) = (scene.camera.width() as f32, scene.camera.height() as f32);
        let side = (RAYS as f32).sqrt();
        for index in 0..RAYS {
            let cell = vec2((index as f32 % side).floor(), (index as f32 / side).floor());
            let raster = (cell + random_2d(&mut stream)) / side * vec2(width, height);
            let ray = scene.camera.sample_we(raster, random_2d(&mut stream)).ray;
            rays.primary.push(ray);
            let Some(it) = scene.intersect(&ray) else { continue };
            let local = warp::cosine_hemisphere(random_2d(&mut stream));
            let up = it.frame.to_world(local);
            let up = if it.point.ng.dot(ray.d) > 0.0 { -up } else { up };
            rays.bounce.push(it.point.spawn(up));
            let (uc, u) = (stream.next_f32(), random_2d(&mut stream));
            let chosen = scene.choose_emitter_for(&it.point, uc);
            let Some(sample) = chosen.and_then(|(id, _)| scene.sample_li(id, it.point.p, u)) else { continue };
            rays.shadow.push(match sample.distance.is_finite() {
                true => it.point.segment_to(&sample.endpoint.at),
                false => it.point.spawn(sample.wi),
            });
        }
        rays
    }
}

fn random_2d(stream: &mut Stream) -> Vec2 {
    let x = stream.next_f32();
    vec2(x, stream.next_f32())
}

fn measure(scene: Scene, rows: &mut Vec<Row>) {
    let rays = Rays::of(&scene);
    let kernels = Kernel::available();
    let scenes: Vec<Scene> = kernels
        .iter()
        .map(|&kernel| {
            let mut scene = scene.clone();
            scene.set_kernel(kernel);
            scene
        })
        .collect();
    let closest = |scene: &Scene, rays: &[Ray]| rays.iter().filter(|ray| scene.intersect(ray).is_some()).count();
    let any = |scene: &Scene, rays: &[Ray]| rays.iter().filter(|ray| scene.occluded(ray)).count();
    type Count<'a> = &'a dyn Fn(&Scene, &[Ray]) -> usize;
    let kinds: [(&str, &[Ray], Count); 3] =
        [("primary", &rays.primary, &closest), ("bounce", &rays.bounce, &closest), ("shadow", &rays.shadow, &any)];
    for (kind, rays, count) in kinds {
        if rays.is_empty() {
            continue;
        }
        let mut seconds = vec![Vec::new(); kernels.len()];
        for _ in 0..ROUNDS {
            for (scene, seconds) in scenes.iter().zip(&mut seconds) {
                let start = Instant::now();
                black_box(count(black_box(scene), rays));
                seconds.push(start.elapsed().as_secs_f64());
            }
        }
        let portable = &seconds[kernels.len() - 1];
        for (kernel, seconds) in kernels.iter().zip(&seconds) {
            let relative = median(portable.iter().zip(seconds).map(|(portable, own)| portable / own).collect());
            rows.push(Row {
                scene: scene.name.clone(),
                triangles: scene.counts().triangles,
                rays: kind,
                kernel: kernel.to_string(),
                rays_per_second: rays.len() as f64 / median(seconds.clone()),
                relative,
            });
        }
    }
}

fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    values[values.len() / 2]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_kernel_is_measured_on_every_kind_of_ray() {
        let mut rows = Vec::new();
        measure(ball_in_a_room(8, (256, 256)).unwrap(), &mut rows);
        assert_eq!(rows.len(), 3 * Kernel::available().len());
        assert!(rows.iter().all(|row| row.rays_per_second > 0.0 && row.relative > 0.0));
        assert!(rows.iter().filter(|row| row.kernel == "portable").all(|row| row.relative == 1.0));
        assert!(table(&rows).lines().count() == rows.len() + 1);
    }
}
