//! The points of samplers, seen from above: what a pixel's samples look like at an address, at two, and in pixels side by side.

use super::pen::{self, STYLE, Sheet, colour, line, rounded};
use crate::export::markup::{Attributes, Markup};
use sampling::Vec2;
use sampling::sampler::{Purpose, Role, Sampler, SamplerKind, StreamKey, Subpath};

/// Side of a panel, and the room around it [SVG units].
const SIDE: f64 = 132.0;
const GAP: f64 = 12.0;
const TOP: f64 = 24.0;
/// Height of the line of words above a row of panels.
const WORDS: f64 = 20.0;

/// One row of panels.
struct Row {
    words: &'static str,
    /// Points by pixel.
    points: fn(SamplerKind) -> Vec<Vec<Vec2>>,
    /// Lines of the grid that stratified samples keep to.
    cells: usize,
}

const ROWS: [Row; 4] = [
    Row {
        words: "64 samples of a pixel on the film",
        points: |kind| points(kind, 64, 1, |s| s.get_2d(Purpose::Film)),
        cells: 8,
    },
    Row {
        words: "The same samples where walks leave their first surface",
        points: |kind| points(kind, 64, 1, |s| at_vertex(s, 1).get_2d(Purpose::Direction)),
        cells: 8,
    },
    Row {
        words: "Place on the film across, choice of an emitter up: two purposes together",
        points: |kind| {
            points(kind, 64, 1, |s| {
                let x = s.get_2d(Purpose::Film).x;
                Vec2::new(x, at_vertex(s, 1).get_1d(Purpose::NextEmitter))
            })
        },
        cells: 8,
    },
    Row {
        words: "16 samples of each of four pixels side by side, a colour a pixel",
        points: |kind| points(kind, 16, 4, |s| at_vertex(s, 2).get_2d(Purpose::Direction)),
        cells: 8,
    },
];

fn at_vertex(sampler: &mut Sampler, vertex: u32) -> &mut Sampler {
    sampler.start_vertex(Subpath::Camera, vertex);
    sampler
}

/// Points of the first pixels of an image of two rows.
fn points(kind: SamplerKind, samples: u32, pixels: u64, draw: fn(&mut Sampler) -> Vec2) -> Vec<Vec<Vec2>> {
    let key = StreamKey::new(0, "points", Role::Estimate, 0);
    let mut sampler = Sampler::new(kind, key, samples, (2, 2));
    let mut of_pixel = |pixel| {
        let point = |sample| {
            sampler.start_sample(pixel, sample);
            draw(&mut sampler)
        };
        (0..samples).map(point).collect()
    };
    (0..pixels).map(&mut of_pixel).collect()
}

/// The picture as a file of its own.
pub fn file(samplers: &[SamplerKind]) -> String {
    pen::file(&svg(samplers, Some(STYLE)))
}

/// A column a sampler, a row a way to look at it.
pub fn svg(samplers: &[SamplerKind], style: Option<&'static str>) -> Markup {
    let width = samplers.len() as f64 * (SIDE + GAP) + GAP;
    let height = TOP + ROWS.len() as f64 * (SIDE + GAP + WORDS);
    let label = "Points of samplers in the unit square";
    Sheet { label, size: (width, height), font_size: 12, style }.draw(|m| {
        for (column, kind) in samplers.iter().enumerate() {
            let x = GAP + column as f64 * (SIDE + GAP);
            m.line("text", &[("x", &x), ("y", &16), ("font-weight", &600)], kind);
        }
        for (i, row) in ROWS.iter().enumerate() {
            let y = TOP + i as f64 * (SIDE + GAP + WORDS);
            m.line("text", &[("x", &GAP), ("y", &(y + 14.0)), ("font-size", &11), ("opacity", &0.75)], row.words);
            for (column, &kind) in samplers.iter().enumerate() {
                panel(m, row, kind, (GAP + column as f64 * (SIDE + GAP), y + WORDS));
            }
        }
    })
}

fn panel(m: &mut Markup, row: &Row, kind: SamplerKind, (x, y): (f64, f64)) {
    for i in 0..=row.cells {
        let at = SIDE * i as f64 / row.cells as f64;
        let opacity = if i == 0 || i == row.cells { 0.5 } else { 0.12 };
        line(m, (x + at, y), (x + at, y + SIDE), opacity);
        line(m, (x, y + at), (x + SIDE, y + at), opacity);
    }
    for (pixel, points) in (row.points)(kind).iter().enumerate() {
        // Strokes of no length, whose round ends are dots.
        let dot = |p: &Vec2| {
            let at = |origin: f64, u: f32| rounded(origin + f64::from(u) * SIDE);
            format!("M{} {}h0", at(x, p.x), at(y, 1.0 - p.y))
        };
        let dots: String = points.iter().map(dot).collect();
        let attributes: Attributes = &[
            ("d", &dots),
            ("stroke", &colour(pixel)),
            ("stroke-width", &3.6),
            ("stroke-linecap", &"round"),
            ("fill", &"none"),
        ];
        m.leaf("path", attributes);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_sampler_has_all_its_points() {
        let svg = file(SamplerKind::ALL);
        assert_eq!(svg.matches("h0").count(), SamplerKind::ALL.len() * 4 * 64);
        assert!(!svg.contains("NaN"));
    }
}
