//! The meshes of radiosity, and what they cost: the picture in `docs/radiosity.md` and its table.
//!
//! ```console
//! $ cargo run --release --example radiosity_meshes -- docs/images/radiosity_meshes.png 250 1000 4000
//! $ cargo run --release --example radiosity_meshes -- meshes.png constant:10000
//! ```
//!
//! Each number of elements is solved for with orders 0 to 8 in the Cornell box, and drawn with the borders of its elements.

use glam::DVec2;
use integrators::radiosity::Radiosity;
use integrators::radiosity::mesh::albedo;
use integrators::radiosity::solution::Solution;
use integrators::{Orders, Request};
use neumann::export::png::Picture;
use sampling::vec2;
use scenes::{LoadOptions, Scene};
use serde_json::json;
use std::error::Error;
use std::path::PathBuf;
use std::time::Instant;

const SIZE: u32 = 256;
const MAX_ORDER: usize = 8;
const INK: [u8; 3] = [255, 255, 255];

fn main() -> Result<(), Box<dyn Error>> {
    let mut arguments = std::env::args().skip(1);
    let to = PathBuf::from(arguments.next().ok_or("name the picture to write, then numbers of elements")?);
    let scene = scenes::load("cornell_box", &LoadOptions { size: Some((SIZE, SIZE)), ..LoadOptions::default() })?;
    let wanted: Vec<String> = arguments.collect();
    let mut sheet = Picture::filled(SIZE as usize * wanted.len().max(1), SIZE as usize, [0; 3]);
    println!(
        "| basis | elements of each mesh | seconds | matrix \\[MB\\] | million rays | form factors and escape sum to |"
    );
    println!("|---|---|---:|---:|---:|---|");
    for (place, words) in wanted.iter().enumerate() {
        let (basis, elements) = words.split_once(':').unwrap_or(("linear", words));
        let settings: Radiosity =
            serde_json::from_value(json!({"elements": elements.parse::<u32>()?, "basis": basis}))?;
        let start = Instant::now();
        let solved = settings.solve(&scene, &Request::new(Orders::up_to(MAX_ORDER), false));
        let solution = solved.ok_or("the Cornell box is made of triangles")?;
        let (report, seconds) = (&solution.report, start.elapsed().as_secs_f64());
        let [low, high] = report.unbalanced;
        let meshes = report.meshes.iter().map(|n| n.to_string()).collect::<Vec<_>>().join(", ");
        println!(
            "| {basis} | {meshes} | {seconds:.1} | {:.0} | {:.1} | {low:.3} to {high:.3} |",
            report.bytes as f64 / 1e6,
            report.rays as f64 / 1e6
        );
        sheet.paste(&picture(&scene, &solution), place * SIZE as usize, 0);
    }
    sheet.write(&to)?;
    Ok(())
}

/// The sum of all orders, with the elements' borders.
fn picture(scene: &Scene, solution: &Solution) -> Picture {
    let mut picture = Picture::filled(SIZE as usize, SIZE as usize, [0; 3]);
    let places = (0..SIZE).flat_map(|y| (0..SIZE).map(move |x| (x, y)));
    for (x, y) in places {
        let found = |dx: f32, dy: f32| {
            let ray = scene.camera.sample_we(vec2(x as f32 + dx, y as f32 + dy), vec2(0.5, 0.5)).ray;
            let hit = scene.intersect_facet(&ray)?;
            let back = ray.d.dot(hit.interaction.point.ng) > 0.0;
            let at = DVec2::new(f64::from(hit.b.x), f64::from(hit.b.y));
            Some((ray, hit, solution.mesh().find(hit.facet, back, at)?))
        };
        let Some((ray, hit, place)) = found(0.5, 0.5) else { continue };
        let mut radiance = scene.le(&hit.interaction, -ray.d).to_array().map(f64::from);
        let reflected = albedo(&hit.interaction).to_array();
        for order in 1..=MAX_ORDER {
            let irradiance = solution.at(order, place);
            (0..3).for_each(|c| radiance[c] += f64::from(reflected[c]) * irradiance[c] / std::f64::consts::PI);
        }
        let shade = |c: f64| (255.0 * (1.5 * c).clamp(0.0, 1.0).powf(1.0 / 2.2)) as u8;
        picture.blend(x as usize, y as usize, radiance.map(shade), 1.0);
        let element = |dx, dy| found(dx, dy).map(|(_, hit, (element, _))| (hit.facet, element));
        if element(0.5, 0.5) != element(1.5, 0.5) || element(0.5, 0.5) != element(0.5, 1.5) {
            picture.blend(x as usize, y as usize, INK, 0.35);
        }
    }
    picture
}
