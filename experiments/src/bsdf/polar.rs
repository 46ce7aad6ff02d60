//! A model's values in the plane of incidence, as a polar plot in SVG.

use super::{INCIDENCE, albedo, incident, transmits};
use crate::export::markup::{Attributes, Markup};
use crate::plot::pen::{self, STYLE, Sheet, colour, coordinates, line, rounded};
use sampling::bsdf::{Bsdf, BsdfSample, Lobes, TransportMode};
use sampling::vec3;

const RADIUS: f64 = 170.0;
const MARGIN: f64 = 34.0;
const TOP: f64 = 72.0;
const STEPS: usize = 720;

/// The plot as a file of its own. The radius is the cube root of f_s |cos θ_i|, so that a lobe and the diffuse light beside it can be seen
/// together; dashed rays are delta lobes, their length the cube root of their share.
pub fn svg(bsdf: &Bsdf, name: &str) -> String {
    let angles = if transmits(bsdf) { STEPS } else { STEPS / 2 };
    let curves: Vec<Vec<(f64, f64)>> = INCIDENCE.iter().map(|&degrees| curve(bsdf, degrees, angles)).collect();
    let most = curves.iter().flatten().map(|&(_, value)| value).fold(0.0, f64::max);
    let height = TOP + RADIUS * if transmits(bsdf) { 2.0 } else { 1.0 } + MARGIN;
    let width = 2.0 * (RADIUS + MARGIN);
    let label = &format!("Polar plot of {name} in the plane of incidence");
    let sheet = Sheet { label, size: (width, height), font_size: 11, style: Some(STYLE) };
    let drawing = sheet.draw(|m| {
        m.line("text", &[("x", &8), ("y", &17), ("font-size", &14), ("font-weight", &600)], name);
        let unit = match most > 0.0 {
            true => format!("radius ∝ ∛(f cos θ); outer ring {} /sr; dashed: delta lobes", digits(most)),
            false => "dashed: delta lobes, radius ∝ ∛share".to_owned(),
        };
        m.line("text", &[("x", &8), ("y", &33), ("opacity", &0.75)], unit);
        rings(m, transmits(bsdf));
        for (i, (degrees, curve)) in INCIDENCE.iter().zip(&curves).enumerate() {
            let places = curve.iter().map(|&(angle, value)| place(angle, (value / most.max(f64::MIN_POSITIVE)).cbrt()));
            let stroke = colour(i);
            if most > 0.0 {
                let line: Attributes =
                    &[("points", &coordinates(places)), ("fill", &"none"), ("stroke", &stroke), ("stroke-width", &1.6)];
                m.leaf("polyline", line);
            }
            deltas(m, bsdf, *degrees, stroke);
            arrow(m, *degrees, stroke);
        }
    });
    pen::file(&drawing)
}

/// (angle from the normal \[rad\], f_s |cos θ_i|) around the plane of incidence; the largest channel.
fn curve(bsdf: &Bsdf, degrees: f32, angles: usize) -> Vec<(f64, f64)> {
    let wo = incident(degrees);
    let step = std::f32::consts::TAU / STEPS as f32;
    let at = |i: usize| {
        let angle = (i as f32 + 0.5) * step - std::f32::consts::FRAC_PI_2;
        let wi = vec3(angle.sin(), 0.0, angle.cos());
        let f = bsdf.eval(wo, wi, Lobes::ALL, TransportMode::Radiance).max_component();
        (angle as f64, (f * wi.z.abs()) as f64)
    };
    (0..angles).map(at).collect()
}

/// Where a value stands: the angle from the normal, to the right, and the radius in [0, 1].
fn place(angle: f64, radius: f64) -> (f64, f64) {
    let (x, y) = (RADIUS + MARGIN, TOP + RADIUS);
    (rounded(x + RADIUS * radius * angle.sin()), rounded(y - RADIUS * radius * angle.cos()))
}

fn rings(m: &mut Markup, whole: bool) {
    for share in [0.125_f64, 1.0] {
        let r = rounded(RADIUS * share.cbrt());
        let (centre, base) = place(0.0, 0.0);
        let path = match whole {
            true => format!("M{} {base}a{r} {r} 0 1 1 {} 0a{r} {r} 0 1 1 {} 0", centre - r, 2.0 * r, -2.0 * r),
            false => format!("M{} {base}a{r} {r} 0 0 1 {} 0", centre - r, 2.0 * r),
        };
        m.leaf("path", &[("d", &path), ("fill", &"none"), ("stroke", &"currentColor"), ("opacity", &0.25)]);
    }
    line(m, place(-std::f64::consts::FRAC_PI_2, 1.0), place(std::f64::consts::FRAC_PI_2, 1.0), 0.6);
}

/// A short arrow from outside: where the light comes from, with its angle.
fn arrow(m: &mut Markup, degrees: f32, stroke: &str) {
    let angle = -(degrees as f64).to_radians();
    let ((x1, y1), (x2, y2), (x, y)) = (place(angle, 1.08), place(angle, 0.94), place(angle, 1.13));
    m.leaf("line", &[("x1", &x1), ("y1", &y1), ("x2", &x2), ("y2", &y2), ("stroke", &stroke), ("stroke-width", &3)]);
    m.line("text", &[("x", &x), ("y", &y), ("text-anchor", &"middle"), ("fill", &stroke)], format!("{degrees}°"));
}

/// A dashed ray for every delta lobe in the plane of incidence.
fn deltas(m: &mut Markup, bsdf: &Bsdf, degrees: f32, stroke: &str) {
    for BsdfSample { wi, weight, pdf, .. } in albedo::delta_lobes(bsdf, incident(degrees)) {
        let (angle, share) = ((wi.x as f64).atan2(wi.z as f64), (weight.max_component() * pdf) as f64);
        let ((x1, y1), (x2, y2)) = (place(0.0, 0.0), place(angle, share.cbrt()));
        let ray: Attributes = &[
            ("x1", &x1),
            ("y1", &y1),
            ("x2", &x2),
            ("y2", &y2),
            ("stroke", &stroke),
            ("stroke-width", &1.6),
            ("stroke-dasharray", &"5 4"),
        ];
        m.leaf("line", ray);
    }
}

/// Three digits.
fn digits(x: f64) -> String {
    if (0.01..1000.0).contains(&x) { format!("{x:.3}") } else { format!("{x:.2e}") }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_example_is_drawn_with_finite_numbers() {
        for (name, bsdf) in Bsdf::all_examples() {
            let svg = svg(&bsdf, name);
            assert!(svg.ends_with("</svg>\n") && !svg.contains("NaN") && !svg.contains("inf"), "{name} {bsdf:?}");
        }
    }
}
