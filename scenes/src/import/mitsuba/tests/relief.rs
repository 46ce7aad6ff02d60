//! Surfaces in relief, and smooth ones in stretched instances and turned by uneven axes, have the values that they have in Mitsuba.
//!
//! `relief.txt` holds, after every line of shapes, rows of a ray's origin and direction, a direction wi, and f |cos θ_i| in RGB by Mitsuba
//! 3.9.1, variant `scalar_rgb`: of each, in a scene of `mi.load_string`,
//!
//! ```text
//! si = scene.ray_intersect(mi.Ray3f(origin, direction))
//! si.bsdf().eval(mi.BSDFContext(), si, si.to_local(wi))
//! ```
//!
//! Rays and directions are any that are not within 3 degrees of the surface; pairs that nothing is scattered between are thinned out,
//! and without `flip_invalid_normals` so are those that see a lit front from behind. Left out, too, is what is less than 10⁻³, of which
//! single precision has fewer digits.

use super::*;
use crate::ray::Ray;
use crate::scene::Scene;
use sampling::bsdf::TransportMode;
use sampling::vec3;

/// What the values may be off: the digits that are written, and directions that are rounded where they graze a tilted face.
const SLACK: f32 = 1e-4;

/// The images of heights, of normals and of colours, and a mesh without normals.
fn files(folder: &Path) {
    let mesh = "v -1 0 -1\nv 1 0 -1\nv 0 0 1\nv 0 1.6 0\nf 1 2 3\nf 1 4 2\nf 2 4 3\nf 3 4 1\n";
    std::fs::write(folder.join("t.obj"), mesh).unwrap();
    let side = 8;
    let heights =
        image::GrayImage::from_fn(side, side, |x, y| image::Luma([((37 * x + 91 * y + 13 * x * y) % 256) as u8]));
    heights.save(folder.join("h.png")).unwrap();
    let [u, v] =
        [[53, 29, 7], [31, 67, 11]].map(|[a, b, c]| move |x, y| ((a * x + b * y + c * x * y) % 128 + 64) as u8);
    let normals = image::RgbImage::from_fn(side, side, |x, y| image::Rgb([u(x, y), v(x, y), 220]));
    normals.save(folder.join("n.png")).unwrap();
    let colour = |x: u32, y: u32| [(x * 71 + y * 29) % 256, (x * 13 + y * 101) % 256, (x * y * 37 + 90) % 256];
    let colours = image::RgbImage::from_fn(side, side, |x, y| image::Rgb(colour(x, y).map(|c| c as u8)));
    colours.save(folder.join("c.png")).unwrap();
}

fn scene_of(shape: &str) -> Scene {
    let text = format!("<scene version=\"3.0.0\">{SENSOR}{shape}</scene>");
    let folder = folder(&[("a.xml", &text)]);
    files(folder.path());
    let translation = open(&folder).unwrap();
    let approximated = notes(&translation, NoteKind::Approximated);
    assert!(approximated.is_empty(), "{approximated:?}");
    translation.read("a", folder.path(), None).unwrap().build(Skip::Unneeded).unwrap()
}

#[test]
fn values_in_relief_are_mitsubas() {
    let mut wrong = Vec::new();
    let mut scene = None;
    for line in include_str!("relief.txt").lines() {
        if line.starts_with("<shape") {
            scene = Some((scene_of(line), line));
            continue;
        }
        let numbers: Vec<f32> = line.split(' ').map(|number| number.parse().expect("a number")).collect();
        let [ox, oy, oz, dx, dy, dz, ix, iy, iz, theirs @ ..] = &numbers[..] else { panic!("twelve numbers: {line}") };
        let (scene, shape) = scene.as_ref().expect("a shape comes first");
        let (d, wi) = (vec3(*dx, *dy, *dz), vec3(*ix, *iy, *iz));
        let hit = scene.intersect(&Ray::new(vec3(*ox, *oy, *oz), d));
        let value = hit.map(|it| it.eval(-d, wi, TransportMode::Radiance) * wi.dot(it.ns()).abs());
        let Some(ours) = value.map(|value| value.to_array()) else {
            wrong.push(format!("nothing is met: {line}\n  {shape}"));
            continue;
        };
        if ours.iter().zip(theirs).any(|(ours, theirs)| (ours - theirs).abs() > SLACK * theirs.abs().max(1e-3)) {
            wrong.push(format!("{ours:?}, not {theirs:?}: {line}\n  {shape}"));
        }
    }
    assert!(wrong.is_empty(), "{} values:\n{}", wrong.len(), wrong.join("\n"));
}
