//! Names the build by its sources: results made by different code must not be taken for one another.

use std::path::{Path, PathBuf};

/// What the numbers follow from.
const SOURCES: [&str; 9] = [
    "Cargo.lock",
    "Cargo.toml",
    "sampling/src",
    "scenes/src",
    "scenes/library",
    "integrators/src",
    "experiments/src",
    "experiments/library",
    "experiments/build.rs",
];

fn main() {
    let mut files = Vec::new();
    for source in SOURCES {
        println!("cargo::rerun-if-changed={source}");
        collect(Path::new(source), &mut files);
    }
    files.sort();
    let mut hash = Fnv(0xcbf2_9ce4_8422_2325);
    for file in files {
        hash.write(file.to_string_lossy().as_bytes());
        hash.write(&std::fs::read(&file).unwrap_or_default());
    }
    println!("cargo::rustc-env=NEUMANN_BUILD={:016x}", hash.0);
    let told = |name: &str| std::env::var(name).unwrap_or_default();
    println!("cargo::rustc-env=NEUMANN_COMPILER={}", compiler(&told("RUSTC")).unwrap_or_default());
    println!("cargo::rustc-env=NEUMANN_TARGET={}", told("TARGET"));
    println!("cargo::rustc-env=NEUMANN_PROFILE={}", told("PROFILE"));
    println!("cargo::rustc-env=NEUMANN_FEATURES={}", told("CARGO_CFG_TARGET_FEATURE"));
}

/// The compiler's own name for itself.
fn compiler(path: &str) -> Option<String> {
    let output = std::process::Command::new(path).arg("--version").output().ok()?;
    Some(String::from_utf8_lossy(&output.stdout).trim().to_owned())
}

fn collect(path: &Path, files: &mut Vec<PathBuf>) {
    let Ok(entries) = std::fs::read_dir(path) else { return files.push(path.to_owned()) };
    entries.flatten().for_each(|entry| collect(&entry.path(), files));
}

/// The 64-bit hash of Fowler, Noll and Vo: enough to tell two builds apart.
struct Fnv(u64);

impl Fnv {
    fn write(&mut self, bytes: &[u8]) {
        let length = (bytes.len() as u64).to_le_bytes();
        for &byte in length.iter().chain(bytes) {
            self.0 = (self.0 ^ u64::from(byte)).wrapping_mul(0x0000_0100_0000_01b3);
        }
    }
}
