//! `neumann bench start`: how long a process takes to its first sample.

use super::meshes::bumpy_ball;
use super::turns::Middle;
use super::{named, tell};
use crate::cli::StartArgs;
use crate::error::{Error, Status};
use serde::Serialize;
use serde_json::Value;
use std::fs::File;
use std::io::{BufWriter, Write};
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::time::Instant;

/// What was measured of a scene.
#[derive(Clone, Debug, Serialize)]
struct Row {
    scene: String,
    /// Of the OBJ file that was made.
    triangles: Option<usize>,
    /// Seconds (wall time) from the start of a process that takes one sample of each of 8×8 pixels to its end.
    seconds: Middle,
    /// Those of them in which the scene was read.
    load: Middle,
    /// Those in which it was built.
    build: Middle,
    /// The most memory that the process has held \[bytes\].
    peak_memory_bytes: Option<u64>,
}

/// A process that was watched.
struct Run {
    seconds: f64,
    load: f64,
    build: f64,
    peak_memory_bytes: Option<u64>,
}

/// Measures, and prints a table or JSON.
pub(super) fn start(args: &StartArgs) -> Result<Status, Error> {
    let folder = Folder::new()?;
    let mut scenes: Vec<(String, Option<usize>)> =
        named(&args.scenes).into_iter().map(|name| (name.to_owned(), None)).collect();
    let rows = ((args.triangles as f64 / 2.0).sqrt().round() as usize).max(2);
    let (path, triangles) = write_obj(&folder.0, rows)?;
    scenes.push((path.to_string_lossy().into_owned(), Some(triangles)));
    let mut runs: Vec<Vec<Run>> = scenes.iter().map(|_| Vec::new()).collect();
    for round in 0..=args.rounds {
        for ((scene, _), runs) in scenes.iter().zip(&mut runs) {
            let run = watch(scene, &folder.0)?;
            // The first one finds nothing in memory that was read before.
            if round > 0 {
                runs.push(run);
            }
        }
    }
    let rows: Vec<Row> = scenes.into_iter().zip(runs).map(row).collect();
    tell(&rows, args.json, || table(&rows))
}

fn row(((scene, triangles), runs): ((String, Option<usize>), Vec<Run>)) -> Row {
    let middle = |of: fn(&Run) -> f64| Middle::of(runs.iter().map(of));
    Row {
        scene: if triangles.is_some() { "OBJ file".to_owned() } else { scene },
        triangles,
        seconds: middle(|run| run.seconds),
        load: middle(|run| run.load),
        build: middle(|run| run.build),
        peak_memory_bytes: runs.iter().filter_map(|run| run.peak_memory_bytes).max(),
    }
}

/// Has this program render as little as can be.
fn watch(scene: &str, folder: &Path) -> Result<Run, Error> {
    let (image, statistics) = (folder.join("image.exr"), folder.join("statistics.json"));
    let program =
        std::env::current_exe().map_err(|e| Error::usage(format!("cannot tell what this program is: {e}")))?;
    let mut command = Command::new(&program);
    command.args([
        "render",
        scene,
        "--size",
        "8x8",
        "--spp",
        "1",
        "--replicates",
        "1",
        "--layers",
        "beauty",
        "--quiet",
    ]);
    command.arg("-o").arg(image).arg("--stats").arg(&statistics).stdin(Stdio::null());
    let start = Instant::now();
    let output = command.output().map_err(|source| io("start", &program, source))?;
    let seconds = start.elapsed().as_secs_f64();
    if !output.status.success() {
        return Err(Error::usage(format!("{scene}: {}", String::from_utf8_lossy(&output.stderr).trim())));
    }
    let text = std::fs::read_to_string(&statistics).map_err(|source| io("read", &statistics, source))?;
    let told: Value = serde_json::from_str(&text).unwrap_or_default();
    let part = |key: &str| told["seconds"][key].as_f64().unwrap_or(f64::NAN);
    Ok(Run { seconds, load: part("load"), build: part("build"), peak_memory_bytes: told["peak_memory_bytes"].as_u64() })
}

/// Writes a bumpy ball as an OBJ file, and gives the number of its triangles.
fn write_obj(folder: &Path, rows: usize) -> Result<(PathBuf, usize), Error> {
    let path = folder.join("ball.obj");
    let mesh = bumpy_ball(rows);
    let write = || {
        let mut file = BufWriter::new(File::create(&path)?);
        for p in &mesh.positions {
            writeln!(file, "v {} {} {}", p.x as f32, p.y as f32, p.z as f32)?;
        }
        for [a, b, c] in &mesh.triangles {
            writeln!(file, "f {} {} {}", a + 1, b + 1, c + 1)?;
        }
        file.flush()
    };
    write().map_err(|source| io("write", &path, source))?;
    Ok((path.clone(), mesh.triangles.len()))
}

fn io(action: &'static str, path: &Path, source: std::io::Error) -> Error {
    Error::Io {
        action,
        path: path.to_owned(),
        source,
        mend: "see that the system's folder for temporary files can be used",
    }
}

/// A folder that lasts as long as this does.
struct Folder(PathBuf);

impl Folder {
    fn new() -> Result<Self, Error> {
        let path = std::env::temp_dir().join(format!("neumann-bench-{}", std::process::id()));
        std::fs::create_dir_all(&path).map_err(|source| io("write", &path, source))?;
        Ok(Self(path))
    }
}

impl Drop for Folder {
    fn drop(&mut self) {
        // What cannot be removed now is the system's to remove later.
        let _ = std::fs::remove_dir_all(&self.0);
    }
}

fn table(rows: &[Row]) -> String {
    let header = format!(
        "{:<20} {:>9} {:>10} {:>8} {:>8} {:>10} {:>10} {:>12}\n",
        "scene", "triangles", "start [ms]", "from", "to", "load [ms]", "build [ms]", "memory [MB]"
    );
    let line = |row: &Row| {
        let Row { scene, triangles, seconds, load, build, peak_memory_bytes } = row;
        let triangles = triangles.map_or("-".to_owned(), |n| n.to_string());
        let memory = peak_memory_bytes.map_or("-".to_owned(), |bytes| format!("{:.1}", bytes as f64 / 1e6));
        let [start, low, high, load, build] =
            [seconds.median, seconds.low, seconds.high, load.median, build.median].map(|seconds| seconds * 1e3);
        format!(
            "{scene:<20} {triangles:>9} {start:>10.1} {low:>8.1} {high:>8.1} {load:>10.1} {build:>10.1} {memory:>12}\n"
        )
    };
    header + &rows.iter().map(line).collect::<String>()
}
