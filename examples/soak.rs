//! Random scenes, rendered by every method and compared pair by pair and order by order, for as long as is asked:
//!
//! ```console
//! $ cargo run --release --example soak -- 3600          # seconds
//! $ cargo run --release --example soak -- 60 7 found    # with another seed, and where scenes are kept that fail
//! $ cargo run --release --example soak -- 60 7 found 31 # from scene 31 on
//! ```
//!
//! A scene that methods differ in is looked at again with other random numbers and more samples, since a few of them do not tell a bias
//! from light that one method meets far too seldom. A bias is of the same methods in the same order at every look. What differs every time
//! is kept as a scene file, which `neumann verify` takes, and the status is 1. Where a lobe fills less than a thousandth of a steradian, methods
//! that meet it by connections alone count for nothing: what they have not met is no difference, and no sample of theirs shows it.

use integrators::Methods;
use neumann::cli::VerifyArgs;
use neumann::progress::Verbosity;
use neumann::stop::Stop;
use neumann::verify_command::{Findings, Pair, findings, in_words};
use sampling::bsdf::{Bsdf, Domain, ModelEntry, Preset};
use sampling::rng::{Stream, mix2};
use scenes::{LoadOptions, load};
use std::collections::BTreeMap;
use std::error::Error;
use std::fmt::Write as _;
use std::path::Path;
use std::process::ExitCode;
use std::time::Instant;

/// Samples per pixel of the first look at a scene, and of those at one that failed the ones before.
const LOOKS: [u32; 4] = [32, 512, 4096, 32768];
/// Size of the images, such that means are compared over several pixels: single ones may owe all they have to a path in a thousand.
const SIZE: (u32, u32) = (64, 64);
/// Methods that find what a lobe shows by connections alone: to emitters, or to the camera.
const BY_CONNECTIONS: [&str; 3] = ["local", "whitted", "light"];
/// The width α below which a lobe is narrow: it fills some 4πα² sr.
const NARROW: f32 = 0.01;

fn main() -> ExitCode {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    match soak(&arguments) {
        Ok(0) => ExitCode::SUCCESS,
        Ok(_) => ExitCode::from(1),
        Err(error) => {
            eprintln!("error: {error}");
            ExitCode::from(2)
        }
    }
}

/// How many scenes methods differ in.
fn soak(arguments: &[String]) -> Result<usize, Box<dyn Error>> {
    let [seconds, seed, folder, first] =
        [(0, "60"), (1, "1"), (2, "soak"), (3, "0")].map(|(i, usual)| arguments.get(i).map_or(usual, |s| s));
    let (seconds, seed, first): (f64, u64, usize) = (seconds.parse()?, seed.parse()?, first.parse()?);
    let (stop, start, methods) = (Stop::on_signals()?, Instant::now(), Methods::standard());
    std::fs::create_dir_all(folder)?;
    let (mut scenes, mut again, mut found) = (0, 0, 0);
    let mut refused: BTreeMap<String, usize> = BTreeMap::new();
    while start.elapsed().as_secs_f64() < seconds && stop.signal().is_none() {
        let number = first + scenes + refused.values().sum::<usize>();
        let (text, narrow) = Author::new(mix2(seed, number as u64)).scene();
        let path = Path::new(folder).join(format!("soak_{seed}_{number}.toml"));
        std::fs::write(&path, text)?;
        let name = path.to_string_lossy();
        if let Err(error) = load(&name, &LoadOptions::default()) {
            // Parameters that do not go together.
            *refused.entry(error.to_string().split(": ").skip(1).collect::<Vec<_>>().join(": ")).or_default() += 1;
            std::fs::remove_file(&path)?;
            continue;
        }
        match look((&name, narrow), seed, &methods, &stop) {
            Ok((looks, left)) => {
                scenes += 1;
                again += usize::from(looks > 1);
                if let Some(left) = left {
                    found += 1;
                    println!("methods differ in {name}\n{}", left.in_words());
                    continue;
                }
            }
            // A chain that finds no light to begin with.
            Err(error) => *refused.entry(error.to_string()).or_default() += 1,
        }
        std::fs::remove_file(&path)?;
    }
    println!("{scenes} scenes in {:.0} s: {again} were looked at again, {found} fail", start.elapsed().as_secs_f64());
    refused.iter().for_each(|(reason, times)| println!("  {times} times no scene: {reason}"));
    Ok(found)
}

/// How many looks a scene had, of which it is known whether some lobe is narrow, and what all of them found wrong with it; `None` if nothing.
fn look(
    (scene, narrow): (&str, bool),
    seed: u64,
    methods: &Methods,
    stop: &Stop,
) -> Result<(usize, Option<Suspects>), Box<dyn Error>> {
    let mut suspects: Option<Suspects> = None;
    for (number, spp) in LOOKS.into_iter().enumerate() {
        let args = VerifyArgs {
            scene: Some(scene.to_owned()),
            spp,
            seconds: None,
            replicates: 16,
            max_order: Some(5),
            size: Some(SIZE),
            seed: mix2(seed, number as u64),
            threads: None,
            stress: false,
            json: false,
        };
        let found = findings(scene, &args, methods, Verbosity::Quiet, stop)?;
        println!("{}", in_words(&found));
        if stop.signal().is_some() {
            return Ok((number + 1, None));
        }
        let mut now = Suspects::of(&found, narrow);
        if let Some(before) = suspects {
            now.pairs.retain(|name, _| before.pairs.contains_key(name));
            now.otherwise &= before.otherwise;
        }
        if now.pairs.is_empty() && !now.otherwise {
            return Ok((number + 1, None));
        }
        suspects = Some(now);
    }
    Ok((LOOKS.len(), suspects))
}

/// What may be wrong with a scene.
struct Suspects {
    /// By both methods and the order: by how much they differ, and the standard error of that.
    pairs: BTreeMap<[String; 3], (f64, f64)>,
    /// What is no difference between two methods: samples that are not finite, irradiances.
    otherwise: bool,
}

impl Suspects {
    fn of(findings: &Findings, narrow: bool) -> Self {
        let told = |pair: &&Pair| {
            let (a, b, _) = pair.name();
            !(narrow && [a, b].iter().any(|method| BY_CONNECTIONS.contains(method)))
        };
        let pairs = findings.differences().filter(told).map(|pair| {
            let (a, b, order) = pair.name();
            ([a, b, order].map(str::to_owned), pair.difference())
        });
        Self { pairs: pairs.collect(), otherwise: !findings.is_sound() }
    }

    fn in_words(&self) -> String {
        let pair = |([a, b, order], (difference, error)): (&[String; 3], &(f64, f64))| {
            format!(
                "  {a} and {b} in order {order} at every look, at the last by {difference:.3e}, error {error:.1e}\n"
            )
        };
        let pairs: String = self.pairs.iter().map(pair).collect();
        if self.otherwise {
            pairs + "  samples that are not finite, or irradiances that are not the truth's\n"
        } else {
            pairs
        }
    }
}

/// Who writes a scene.
struct Author {
    dice: Stream,
    text: String,
    materials: Vec<String>,
    /// Whether there may be emitters that no ray meets. Then nothing is a mirror or smooth glass, of which most methods lose some of their
    /// light, so that there would be nothing to compare.
    points: bool,
    /// Whether a lobe is narrow.
    narrow: bool,
}

/// Models that never are mirrors.
const ROUGH: [&str; 9] = [
    "lambert",
    "oren_nayar",
    "phong",
    "ward",
    "blinn_phong",
    "lafortune",
    "cook_torrance",
    "principled",
    "diffuse_transmission",
];

impl Author {
    fn new(seed: u64) -> Self {
        let mut dice = Stream::new(seed, 0);
        let points = dice.next_f32() < 0.3;
        Self { dice, text: String::new(), materials: Vec::new(), points, narrow: false }
    }

    /// A number between two.
    fn number(&mut self, low: f32, high: f32) -> f32 {
        low + (high - low) * self.dice.next_f32()
    }

    /// One of so many.
    fn one_of(&mut self, count: usize) -> usize {
        ((self.dice.next_f32() * count as f32) as usize).min(count - 1)
    }

    fn happens(&mut self, probability: f32) -> bool {
        self.dice.next_f32() < probability
    }

    fn vector(&mut self, low: f32, high: f32) -> String {
        let [x, y, z] = [(); 3].map(|()| self.number(low, high));
        format!("[{x:.3}, {y:.3}, {z:.3}]")
    }

    fn line(&mut self, line: impl AsRef<str>) {
        self.text += line.as_ref();
        self.text.push('\n');
    }

    /// A room of 4 m or what is left of one, things in it, lights and a camera; and whether a lobe is narrow.
    fn scene(mut self) -> (String, bool) {
        self.line("title = \"a random scene\"\nmax_order = 5\n");
        self.camera();
        self.line("[materials.white]\ntype = \"lambert\"\nalbedo = 0.6\n\n[materials.glass]\ntype = \"dielectric\"\n");
        self.materials.push("white".into());
        for i in 0..4 {
            self.material(&format!("m{i}"));
        }
        self.room();
        for _ in 0..1 + self.one_of(5) {
            self.thing();
        }
        self.lights();
        (self.text, self.narrow)
    }

    fn camera(&mut self) {
        let (at, to) = (self.vector(-1.2, 1.2), self.vector(-1.8, 1.8));
        self.line(format!("[camera]\nposition = {at}\ntarget = {to}\nwidth = 64\nheight = 64"));
        let fov = self.number(20.0, 90.0);
        match self.one_of(6) {
            0 => self.line(format!("type = \"thin_lens\"\nfov = {fov}\nlens_radius = 0.1\nfocus_distance = 1.5")),
            1 => self.line("type = \"orthographic\"\nextent = 1.5"),
            2 => self.line("type = \"equirectangular\""),
            _ => self.line(format!("fov = {fov}")),
        }
        let filter = ["box", "triangle", "gaussian", "mitchell"][self.one_of(4)];
        self.line(format!("filter = \"{filter}\"\n"));
    }

    /// A material of any model, with some of its parameters at random.
    fn material(&mut self, name: &str) {
        let able = |entry: &&ModelEntry| {
            let table = |p: &sampling::bsdf::Parameter| {
                matches!(p.domain, Domain::Numbers { .. } | Domain::File { .. })
                    && matches!(p.preset, Preset::Required(_))
            };
            !entry.parameters.iter().any(table)
        };
        let points = self.points;
        let fits = |entry: &&ModelEntry| !points || ROUGH.contains(&entry.name);
        let models: Vec<&ModelEntry> = Bsdf::MODELS.iter().filter(able).filter(fits).collect();
        let model = models[self.one_of(models.len())];
        self.line(format!("[materials.{name}]\ntype = \"{}\"", model.name));
        for parameter in model.parameters {
            let required = matches!(parameter.preset, Preset::Required(_));
            let value = match parameter.domain {
                Domain::Model => Some(format!("\"{}\"", ["white", "glass"][self.one_of(2)])),
                _ if !required && self.happens(0.6) => None,
                Domain::Number(low, high) => {
                    let x = self.number(low.max(0.0), high.min(2.5));
                    self.narrow |= match parameter.name {
                        "roughness" => x * x < NARROW,
                        "alpha" | "alpha_x" | "alpha_y" => x < NARROW,
                        // Its width falls from 0.1 to 0.001.
                        "clearcoat_gloss" => x > 0.9,
                        _ => false,
                    };
                    Some(format!("{x:.4}"))
                }
                Domain::Colour(low, high) if high <= 1.0 => Some(self.vector(low, 0.8)),
                Domain::Colour(low, high) => Some(self.vector(low.max(0.1), high.min(4.0))),
                Domain::Choice(words) => Some(format!("\"{}\"", words[self.one_of(words.len())])),
                Domain::Numbers { .. } | Domain::File { .. } => None,
            };
            if let Some(value) = value {
                self.line(format!("{} = {value}", parameter.name));
            }
        }
        if self.happens(0.15) {
            let screen = self.happens(0.5);
            self.line(match screen {
                true => "opacity = { checkerboard = [0.0, 1.0], uv_scale = 6 }",
                false => "bump_map = { noise = { size = 0.3, high = 0.05 } }",
            });
        }
        self.line("");
        self.materials.push(name.to_owned());
    }

    fn any_material(&mut self) -> String {
        let i = self.one_of(self.materials.len());
        self.materials[i].clone()
    }

    fn room(&mut self) {
        let walls: [[&str; 3]; 6] = [
            ["[-2, -2, 2]", "[4, 0, 0]", "[0, 0, -4]"],
            ["[-2, 2, -2]", "[4, 0, 0]", "[0, 0, 4]"],
            ["[-2, -2, -2]", "[4, 0, 0]", "[0, 4, 0]"],
            ["[2, -2, 2]", "[-4, 0, 0]", "[0, 4, 0]"],
            ["[-2, -2, 2]", "[0, 0, -4]", "[0, 4, 0]"],
            ["[2, -2, -2]", "[0, 0, 4]", "[0, 4, 0]"],
        ];
        let closed = self.happens(0.6);
        for [origin, u, v] in walls {
            if !closed && self.happens(0.3) {
                continue;
            }
            let material = if self.happens(0.7) { "white".to_owned() } else { self.any_material() };
            self.line(format!("[[shapes]]\ntype = \"quad\"\norigin = {origin}\nedge_u = {u}\nedge_v = {v}\nmaterial = \"{material}\"\n"));
        }
    }

    fn thing(&mut self) {
        let (at, material) = (self.vector(-1.5, 1.5), self.any_material());
        let size = self.number(0.1, 0.7);
        let (u, v) = (self.vector(-0.8, 0.8), self.vector(-0.8, 0.8));
        self.line("[[shapes]]");
        match self.one_of(5) {
            0 => self.line(format!("type = \"disk\"\ncenter = {at}\nedge_u = {u}\nedge_v = {v}")),
            1 => {
                let to = self.vector(-1.5, 1.5);
                self.line(format!("type = \"cylinder\"\nfrom = {at}\nto = {to}\nradius = {size:.3}"));
            }
            2 => {
                let corners: Vec<String> = (0..4).map(|_| self.vector(-1.5, 1.5)).collect();
                let corners = corners.join(", ");
                self.line(format!(
                    "type = \"mesh\"\nvertices = [{corners}]\nfaces = [[0, 1, 2], [0, 3, 1], [1, 3, 2], [0, 2, 3]]"
                ));
            }
            _ => self.line(format!("type = \"sphere\"\ncenter = {at}\nradius = {size:.3}")),
        }
        self.line(format!("material = \"{material}\""));
        if self.happens(0.2) {
            self.line("flip = true");
        }
        if self.happens(0.2) {
            let two = self.happens(0.5);
            self.line(format!("emission = 2\ntwo_sided = {two}"));
        }
        self.line("");
    }

    fn lights(&mut self) {
        let lamps = self.one_of(3);
        for _ in 0..=lamps {
            let (at, to, i) = (self.vector(-1.5, 1.5), self.vector(-1.5, 1.5), self.number(0.5, 4.0));
            let mut text = String::new();
            let kind = if self.points { self.one_of(4) } else { 3 };
            let _ = match kind {
                0 => writeln!(text, "[[emitters]]\ntype = \"point\"\nposition = {at}\nintensity = {i:.2}"),
                1 => writeln!(
                    text,
                    "[[emitters]]\ntype = \"spot\"\nposition = {at}\ntarget = {to}\nintensity = {i:.2}\ncutoff = 50\nbeam = 20"
                ),
                2 => writeln!(text, "[[emitters]]\ntype = \"directional\"\ndirection = {to}\nirradiance = {i:.2}"),
                _ => writeln!(
                    text,
                    "[[shapes]]\ntype = \"quad\"\norigin = {at}\nedge_u = [0.7, 0, 0]\nedge_v = [0, 0.2, 0.6]\nmaterial = \"white\"\nemission = {i:.2}"
                ),
            };
            self.line(text);
        }
        if self.happens(0.3) {
            self.line("[[emitters]]\ntype = \"constant\"\nradiance = 0.5");
        }
    }
}
