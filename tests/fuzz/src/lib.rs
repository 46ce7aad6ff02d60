//! What all targets share: a folder in memory for files that name one another, and what is asked of a scene that opens.
//!
//! A target fails by a panic, by debug assertions and overflow among others; by an error that has no file or no mend; by a hit that
//! is not finite; and, as libFuzzer's flags say, by time and memory.

use integrators::lpe::{Classifier, Expression};
use neumann::shards::file::Look;
use sampling::bsdf::{MerlTable, TransportMode};
use sampling::{Vec3, vec2};
use scenes::{Scene, SceneError, Skip};
use std::path::{Path, PathBuf};
use std::sync::OnceLock;

/// A triangle of two materials.
const OBJ: &str =
    "mtllib part.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nusemtl a\nf 1/1 2/1 3/1\nusemtl b\nf 3/1 2/1 1/1\n";

/// A Mitsuba scene of a mesh in another file.
const XML: &str = r#"<scene version="3.0.0"><sensor type="perspective"><transform name="to_world">
<lookat origin="0 0 9" target="0 0 0" up="0 1 0"/></transform></sensor><emitter type="constant"/>
<shape type="serialized"><string name="filename" value="part.serialized"/><integer name="shape_index" value="1"/></shape></scene>"#;

/// A scene of an image, whatever it is used for.
const PICTURE: &str = r#"camera = { position = [0, 0, 3], target = [0, 0, 0] }
[materials.m]
type = "lambert"
albedo = { image = "part.png", scale = 0.5 }
opacity = { image = "part.png", channel = "g" }
[[shapes]]
type = "sphere"
center = [0, 0, 0]
radius = 1
material = "m"
[[emitters]]
type = "environment"
image = "part.png"
"#;

/// Files that lie beside the one that is tried, so that names may lead somewhere.
const BESIDE: [(&str, &str); 7] = [
    ("mtl.obj", OBJ),
    ("serialized.xml", XML),
    ("image.toml", PICTURE),
    ("a.obj", OBJ),
    ("a.xml", r#"<scene version="3.0.0"><bsdf type="diffuse" id="m"/><include filename="scene.xml"/></scene>"#),
    ("a.pbrt", r#"MakeNamedMaterial "m" "string type" "diffuse" Include "scene.pbrt""#),
    ("part.mtl", "newmtl a\nKd 0.5 0.5 0.5\n"),
];

/// Goes to a folder of this process alone; `TMPDIR` should lie in memory.
fn enter_folder() -> &'static Path {
    static FOLDER: OnceLock<PathBuf> = OnceLock::new();
    FOLDER.get_or_init(|| {
        let folder = std::env::temp_dir().join(format!("neumann-fuzz-{}", std::process::id()));
        std::fs::create_dir_all(&folder).expect("a folder for files");
        for (name, text) in BESIDE {
            std::fs::write(folder.join(name), text).expect("a file beside the one that is tried");
        }
        std::env::set_current_dir(&folder).expect("the folder is there");
        folder
    })
}

fn write(name: &str, bytes: &[u8]) {
    std::fs::write(enter_folder().join(name), bytes).expect("the file that is tried");
}

/// Opens these bytes as a scene of this name, and looks at what opens.
pub fn scene(name: &str, bytes: &[u8]) {
    part(name, bytes, name);
}

/// Opens a scene that names a file of these bytes.
pub fn part(name: &str, bytes: &[u8], scene: &str) {
    write(name, bytes);
    let opened = scenes::load::open_with_notes(scene, None)
        .and_then(|(builder, _)| builder.build(Skip::Unneeded).map_err(|error| scenes::load::placed(error, scene)));
    match opened {
        Ok(scene) => look(&scene),
        Err(error) => check(&error),
    }
}

/// Reads an experiment and makes it ready.
pub fn experiment(bytes: &[u8]) {
    write("experiment.toml", bytes);
    let Ok(source) = neumann::source::Source::open("experiment.toml") else { return };
    if let Ok(experiment) = source.parse() {
        _ = neumann::plan::Plan::new(&source, experiment, &integrators::Methods::standard());
    }
}

/// Reads each line as an expression, and decides whether they are disjoint and complete.
pub fn expressions(bytes: &[u8]) {
    let text = String::from_utf8_lossy(bytes);
    let read: Vec<Expression> = text.lines().take(3).filter_map(|line| Expression::parse(line).ok()).collect();
    for expression in &read {
        assert!(Expression::parse(&expression.to_string()).is_ok(), "{expression}");
    }
    _ = Classifier::new(&read, &[vec!["wall".to_owned()]], &[vec!["lamp".to_owned()]]);
}

/// Reads a measured reflectance, and looks at it.
pub fn merl(bytes: &[u8]) {
    _ = MerlTable::read(bytes);
}

/// Reads an image of the program's own.
pub fn layers(bytes: &[u8]) {
    write("layers.exr", bytes);
    if let Err(error) = neumann::export::exr::read_layers(Path::new("layers.exr")) {
        assert!(error.to_string().contains("layers.exr"), "{error}");
    }
}

/// Looks through a shard.
pub fn shard(bytes: &[u8]) {
    write("a.shard", bytes);
    let [whole, records] =
        [Look::Bytes, Look::Records].map(|look| neumann::shards::file::scan(Path::new("a.shard"), look));
    // What is whole is so when less of it is looked at.
    assert!(whole.is_err() || records.is_ok());
}

/// Reads a plan.
pub fn plan(bytes: &[u8]) {
    write(neumann::shards::plan::FILE, bytes);
    _ = neumann::shards::plan::ShardPlan::read(Path::new("."));
}

/// Reads a figure.
pub fn figure(bytes: &[u8]) {
    write("figure.toml", bytes);
    let Ok(source) = neumann::source::Source::open("figure.toml") else { return };
    _ = neumann::figure::file::FigureFile::open(&source);
}

/// Every error names its file and its mend.
fn check(error: &SceneError) {
    match error {
        SceneError::Invalid { file, message, mend, .. } => {
            assert!(file.is_some() && !message.is_empty() && !mend.is_empty(), "{error}");
        }
        SceneError::Unreadable { mend, .. } | SceneError::Unknown { mend, .. } => assert!(!mend.is_empty(), "{error}"),
    }
}

/// Some rays of the camera, what they meet, and a light walk's start.
fn look(scene: &Scene) {
    let (width, height) = (scene.camera.width() as f32, scene.camera.height() as f32);
    for u in [vec2(0.5, 0.5), vec2(0.3, 0.7), vec2(0.9, 0.1), vec2(0.01, 0.02)] {
        let start = scene.camera.sample_we(u * vec2(width, height), u);
        assert!(start.ray.o.is_finite() && start.ray.d.is_finite(), "the camera's ray is {:?}", start.ray);
        let Some(it) = scene.intersect(&start.ray) else {
            _ = scene.environment_le(start.ray.d);
            continue;
        };
        let wo = -start.ray.d;
        let finite = [it.point.p, it.point.ng, it.ns()].iter().all(|x: &Vec3| x.is_finite());
        assert!(finite && it.t.is_finite(), "the hit is {it:?}");
        _ = scene.le(&it, wo);
        _ = it.sample(wo, u.x, u, TransportMode::Radiance);
        if let Some((id, _)) = scene.choose_emitter_for(&it.point, u.y) {
            _ = scene.sample_li(id, it.point.p, u);
        }
        if let Some(odds) = scene.emitter_odds(&it, wo) {
            let (id, pmf) = odds.choose(u.y);
            assert!(pmf > 0.0 && pmf <= 1.0 && pmf == odds.pmf(id), "the odds are {odds:?}");
        }
    }
    if let Some((id, _)) = scene.choose_emitter(0.5) {
        _ = scene.sample_le(id, vec2(0.4, 0.6), vec2(0.2, 0.7));
    }
}
