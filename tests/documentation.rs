//! The documentation is true: every command in it runs, in a small size, and every link leads somewhere.

use crate::cli::{folder_with, neumann};
use std::path::{Path, PathBuf};

/// What the documentation calls the reader's own files.
const THEIRS: [(&str, &str); 6] = [
    ("my_scene.toml", ROOM),
    ("room.toml", ROOM),
    ("my_experiment.toml", EXPERIMENT),
    ("scene.xml", MITSUBA),
    ("figure.toml", FIGURE),
    ("CornellBox-Glass.obj", OBJ),
];

const ROOM: &str = r#"
[camera]
position = [0, 0, 3]
target = [0, 0, 0]
fov = 40
width = 16
height = 16

[materials.white]
type = "lambert"
albedo = 0.5

[[shapes]]
type = "quad"
origin = [-1, -1, -1]
edge_u = [2, 0, 0]
edge_v = [0, 2, 0]
material = "white"

[[shapes]]
type = "sphere"
center = [0, 0.8, 0]
radius = 0.1
material = "white"
emission = 4
label = "key"

[[shapes]]
type = "sphere"
center = [0.5, 0, 0]
radius = 0.1
material = "white"
emission = 4
label = "window"
"#;

const EXPERIMENT: &str =
    "scenes = [\"furnace\"]\nspp = 8\nreplicates = 4\nmax_order = 2\nsize = [8, 8]\nmethods = [{ name = \"path\" }]\n";

const MITSUBA: &str = r#"<scene version="3.0.0">
    <sensor type="perspective"><film type="hdrfilm"><integer name="width" value="8"/><integer name="height" value="8"/></film>
        <transform name="to_world"><lookat origin="0, 0, 4" target="0, 0, 0" up="0, 1, 0"/></transform></sensor>
    <shape type="sphere"><bsdf type="diffuse"/></shape>
    <emitter type="constant"/>
</scene>"#;

const FIGURE: &str =
    "[[rows]]\nresults = \"results/comparison\"\nimages = [{ method = \"path\" }, { method = \"bdpt\" }]\n";

const OBJ: &str = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";

fn repository() -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR"))
}

/// All chapters, the README first.
fn chapters() -> Vec<PathBuf> {
    let mut found: Vec<PathBuf> =
        std::fs::read_dir(repository().join("docs")).unwrap().map(|entry| entry.unwrap().path()).collect();
    found.retain(|path| path.extension().is_some_and(|e| e == "md"));
    found.push(repository().join("docs/bsdfs/README.md"));
    found.sort();
    [vec![repository().join("README.md"), repository().join("CONTRIBUTING.md")], found].concat()
}

/// The words of a command as a shell has them: quotes hold together, and ` #` begins a comment.
fn words(line: &str) -> Vec<String> {
    let mut words = vec![String::new()];
    let (mut quoted, mut any) = (false, false);
    for c in line.chars() {
        match c {
            '\'' => (quoted, any) = (!quoted, true),
            ' ' if !quoted => {
                if any {
                    words.push(String::new());
                }
                any = false;
            }
            '#' if !quoted && !any => break,
            c => {
                words.last_mut().unwrap().push(c);
                any = true;
            }
        }
    }
    if !any {
        words.pop();
    }
    words
}

/// The commands of a chapter: lines of its blocks that call the program.
fn commands(text: &str) -> Vec<(usize, Vec<String>)> {
    let mut inside = false;
    let mut found = Vec::new();
    for (number, line) in text.lines().enumerate() {
        if line.starts_with("```") {
            inside = !inside;
        }
        let line = line.strip_prefix("$ ").unwrap_or(line);
        if let (true, Some(arguments)) = (inside, line.strip_prefix("neumann ")) {
            let words = words(arguments);
            // Prose in a drawing, such as what crates use: a command's first word is one that the program knows.
            if !words.is_empty() {
                found.push((number + 1, words));
            }
        }
    }
    found
}

/// The same command with less to do.
fn small(mut arguments: Vec<String>) -> Vec<String> {
    let sizes: &[(&str, &str)] = match arguments[0].as_str() {
        "render" => &[("--size", "16x16"), ("--spp", "4"), ("--replicates", "2")],
        "run" => &[("--size", "8x8"), ("--spp", "4"), ("--replicates", "2")],
        "verify" => &[("--spp", "8"), ("--replicates", "4")],
        "spectrum" => &[("--spp", "4")],
        _ => &[],
    };
    for (flag, value) in sizes {
        match arguments.iter().position(|word| word == flag) {
            Some(at) => arguments[at + 1] = (*value).to_owned(),
            None if *flag == "--spp" && arguments.iter().any(|word| word == "--seconds") => {}
            None => arguments.extend([(*flag).to_owned(), (*value).to_owned()]),
        }
    }
    if let Some(at) = arguments.iter().position(|word| word == "--seconds") {
        arguments[at + 1] = "0.2".to_owned();
    }
    if arguments.starts_with(&["run".to_owned(), "samplers".to_owned()]) {
        // Six samplers, at sizes of their own.
        let set = ["convergence.size=[8, 8]", "convergence.checkpoints=[4, 16]", "integrals.size=[2, 2]"];
        arguments.extend(set.iter().flat_map(|change| ["--set".to_owned(), (*change).to_owned()]));
    }
    arguments
}

/// What a command needs beside its own words to be run here.
fn prepared(chapter: &Path, folder: &Path, arguments: Vec<String>) -> Vec<Vec<String>> {
    let said = arguments.join(" ");
    if said.starts_with("figure results/comparison") {
        let small = "run comparison --size 8x8 --spp 4 --replicates 2 --out results/comparison";
        return vec![small.split(' ').map(str::to_owned).collect(), arguments];
    }
    if said.starts_with("run docs/figures/caustic.toml") {
        // Parts of this image are enlarged, so that it keeps its size.
        let set = ["reference.spp=16", "reference.replicates=8", "convergence.size=[8, 8]"];
        let set = set.iter().flat_map(|change| ["--set", change]);
        let less = ["--spp", "4", "--replicates", "4"].into_iter().chain(set).map(str::to_owned).collect();
        return vec![[arguments, less].concat()];
    }
    if let Some(at) = arguments.iter().position(|word| word == "--shard") {
        let count: usize = arguments[at + 1].split_once('/').unwrap().1.parse().unwrap();
        let shard = |i: usize| {
            let mut arguments = arguments.clone();
            arguments[at + 1] = format!("{i}/{count}");
            arguments
        };
        return (1..=count).map(shard).collect();
    }
    if arguments[0] == "diff" && !folder.join(&arguments[1]).exists() {
        panic!("{}: {said} comes before what it compares", chapter.display());
    }
    // A shorter or smaller run into the folder of another one of the same name would be refused.
    let fresh = arguments[0] == "run" && folder.join("results").join(&arguments[1]).exists();
    let mut arguments = small(arguments);
    // There is no window here.
    arguments.retain(|word| word != "--live");
    if fresh {
        arguments.push("--fresh".to_owned());
    }
    vec![arguments]
}

/// Runs all commands of a chapter in one folder, in order, but experiments, models and spectra that another one has; gives how many there are.
fn run_commands(chapter: &Path, of_another: &[Vec<String>]) -> usize {
    let mut commands = commands(&std::fs::read_to_string(chapter).unwrap());
    let all = commands.len();
    let alone = |arguments: &[String]| matches!(arguments[0].as_str(), "run" | "bsdf" | "spectrum");
    commands.retain(|(_, arguments)| !alone(arguments) || !of_another.contains(arguments));
    let folder = folder_with(&THEIRS);
    let folder = folder.path();
    for inner in ["path/to", "docs/figures", "docs/images"] {
        std::fs::create_dir_all(folder.join(inner)).unwrap();
    }
    std::fs::copy(folder.join("CornellBox-Glass.obj"), folder.join("path/to/CornellBox-Glass.obj")).unwrap();
    for figure in ["caustic.toml", "crops.toml", "convergence.toml"] {
        std::fs::copy(repository().join("docs/figures").join(figure), folder.join("docs/figures").join(figure))
            .unwrap();
    }
    for (line, arguments) in &commands {
        for arguments in prepared(chapter, folder, arguments.clone()) {
            let words: Vec<&str> = arguments.iter().map(String::as_str).collect();
            let output = neumann(folder, &words);
            let said = String::from_utf8_lossy(&output.stderr);
            assert!(output.status.success(), "{}:{line}: neumann {}: {said}", chapter.display(), words.join(" "));
        }
    }
    all
}

#[test]
fn the_commands_of_the_readme_run() {
    assert!(run_commands(&chapters()[0], &[]) > 15);
}

#[test]
fn the_commands_of_the_chapters_run() {
    let chapters = chapters();
    let readme = commands(&std::fs::read_to_string(&chapters[0]).unwrap());
    let readme: Vec<Vec<String>> = readme.into_iter().map(|(_, arguments)| arguments).collect();
    let all: usize = chapters[1..].iter().map(|chapter| run_commands(chapter, &readme)).sum();
    assert!(all > 40, "{all}");
}

/// Where a text links to, of this repository.
fn links(text: &str) -> Vec<&str> {
    let after = text.split("](").skip(1).filter_map(|rest| rest.split_once(')'));
    let files = after.map(|(link, _)| link.split('#').next().unwrap_or(link));
    files.filter(|link| !link.is_empty() && !link.contains("://") && !link.contains(' ')).collect()
}

#[test]
fn every_link_leads_to_a_file() {
    for chapter in chapters() {
        let text = std::fs::read_to_string(&chapter).unwrap();
        for link in links(&text) {
            assert!(chapter.parent().unwrap().join(link).exists(), "{}: {link}", chapter.display());
        }
    }
}

#[test]
fn every_chapter_is_in_the_book() {
    let docs = repository().join("docs");
    let summary = std::fs::read_to_string(docs.join("SUMMARY.md")).unwrap();
    let listed: Vec<PathBuf> = links(&summary).into_iter().map(|link| docs.join(link)).collect();
    for chapter in chapters().into_iter().filter(|path| path.starts_with(&docs) && !path.ends_with("SUMMARY.md")) {
        assert_eq!(listed.iter().filter(|path| **path == chapter).count(), 1, "{}", chapter.display());
    }
}
