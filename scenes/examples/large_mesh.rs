//! Writes a large mesh, loads it as a scene, and tells how long that took and how much memory at the most:
//!
//! ```text
//! cargo run --release -p scenes --example large_mesh -- 10 grid ply /tmp/large
//! ```
//!
//! The arguments: millions of triangles; `grid` (a height field), `shuffled` (its triangles in no order), `smooth` (with normals and
//! texture coordinates) or `soup` (no triangle shares a vertex), or several as in `smooth-soup`; `ply`, `ascii` or `obj`; and a path without its ending. A file that
//! is there already is not written again.

use scenes::load::{LoadOptions, load};
use std::fs::File;
use std::io::{self, BufWriter, Write};
use std::time::Instant;

fn main() -> io::Result<()> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [millions, kind, format, stem] = arguments.as_slice() else {
        eprintln!("usage: large_mesh MILLIONS grid|shuffled|smooth|soup|smooth-soup ply|ascii|obj PATH");
        std::process::exit(2);
    };
    let side = (millions.parse::<f64>().expect("a number of millions") * 1e6 / 2.0).sqrt() as u64;
    let has = |word: &str| kind.split('-').any(|part| part == word);
    let field = Field { side, shuffled: has("shuffled"), smooth: has("smooth"), soup: has("soup") };
    let path = format!("{stem}.{}", if format == "obj" { "obj" } else { "ply" });
    if !std::path::Path::new(&path).exists() {
        let mut out = BufWriter::new(File::create(&path)?);
        if format == "obj" {
            field.write_obj(&mut out)?
        } else {
            field.write_ply(&mut out, format == "ascii")?
        }
        out.flush()?;
    }
    let size = std::fs::metadata(&path)?.len();
    let begun = Instant::now();
    let scene = load(&path, &LoadOptions::default()).unwrap_or_else(|error| panic!("{error}"));
    let seconds = begun.elapsed().as_secs_f64();
    let peak = peak_memory()?;
    let each = |bytes: u64| bytes as f64 / field.triangles() as f64;
    println!(
        "{} triangles in {seconds:.1} s; peak {:.0} bytes a triangle, {:.0} beyond the file; hash {}",
        field.triangles(),
        each(peak),
        each(peak) - each(size),
        &scene.hash[..12]
    );
    Ok(())
}

/// The most memory that this process has held, where the system tells \[bytes\].
fn peak_memory() -> io::Result<u64> {
    let status = std::fs::read_to_string("/proc/self/status")?;
    let line = status.lines().find_map(|line| line.strip_prefix("VmHWM:")).unwrap_or("0 kB");
    Ok(line.trim().trim_end_matches(" kB").parse::<u64>().unwrap_or(0) * 1024)
}

/// A square of `side` × `side` cells, two triangles each.
struct Field {
    side: u64,
    shuffled: bool,
    smooth: bool,
    soup: bool,
}

impl Field {
    fn triangles(&self) -> u64 {
        2 * self.side * self.side
    }

    fn vertices(&self) -> u64 {
        if self.soup { 3 * self.triangles() } else { (self.side + 1) * (self.side + 1) }
    }

    /// The corners of a triangle on the grid.
    fn corners(&self, index: u64) -> [u64; 3] {
        // A prime far above the number of triangles visits each of them once.
        let index = if self.shuffled { index * 2_147_483_647 % self.triangles() } else { index };
        let (cell, row) = (index / 2, self.side + 1);
        let a = cell / self.side * row + cell % self.side;
        if index % 2 == 0 { [a, a + 1, a + row + 1] } else { [a, a + row + 1, a + row] }
    }

    /// Position, normal and texture coordinates of a vertex of the file.
    fn vertex(&self, index: u64) -> [f32; 8] {
        let point = if self.soup { self.corners(index / 3)[(index % 3) as usize] } else { index };
        let at = |i: u64| i as f32 / self.side as f32;
        let (u, v) = (at(point % (self.side + 1)), at(point / (self.side + 1)));
        let height = 0.1 * (7.0 * u).sin() * (9.0 * v).cos() + 0.01 * (61.0 * u).cos() * (53.0 * v).sin();
        [u, v, height, -0.7 * (7.0 * u).cos() * (9.0 * v).cos(), 0.9 * (7.0 * u).sin() * (9.0 * v).sin(), 1.0, u, v]
    }

    fn face(&self, index: u64) -> [u64; 3] {
        if self.soup { [3 * index, 3 * index + 1, 3 * index + 2] } else { self.corners(index) }
    }

    fn write_ply(&self, out: &mut impl Write, ascii: bool) -> io::Result<()> {
        let encoding = if ascii { "ascii" } else { "binary_little_endian" };
        writeln!(out, "ply\nformat {encoding} 1.0\nelement vertex {}", self.vertices())?;
        let names = &["x", "y", "z", "nx", "ny", "nz", "u", "v"][..if self.smooth { 8 } else { 3 }];
        names.iter().try_for_each(|name| writeln!(out, "property float {name}"))?;
        writeln!(out, "element face {}\nproperty list uchar int vertex_indices\nend_header", self.triangles())?;
        for index in 0..self.vertices() {
            let values = &self.vertex(index)[..names.len()];
            if ascii {
                values.iter().try_for_each(|value| write!(out, "{value} "))?;
                writeln!(out)?;
            } else {
                values.iter().try_for_each(|value| out.write_all(&value.to_le_bytes()))?;
            }
        }
        for index in 0..self.triangles() {
            let [a, b, c] = self.face(index);
            if ascii {
                writeln!(out, "3 {a} {b} {c}")?;
            } else {
                out.write_all(&[3])?;
                [a, b, c].iter().try_for_each(|&corner| out.write_all(&(corner as u32).to_le_bytes()))?;
            }
        }
        Ok(())
    }

    fn write_obj(&self, out: &mut impl Write) -> io::Result<()> {
        for index in 0..self.vertices() {
            let [x, y, z, nx, ny, nz, u, v] = self.vertex(index);
            writeln!(out, "v {x} {y} {z}")?;
            if self.smooth {
                writeln!(out, "vn {nx} {ny} {nz}\nvt {u} {v}")?;
            }
        }
        for index in 0..self.triangles() {
            let [a, b, c] = self.face(index).map(|corner| corner + 1);
            if self.smooth {
                writeln!(out, "f {a}/{a}/{a} {b}/{b}/{b} {c}/{c}/{c}")?;
            } else {
                writeln!(out, "f {a} {b} {c}")?;
            }
        }
        Ok(())
    }
}
