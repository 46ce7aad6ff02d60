//! What fuzzing starts from: `seeds CORPUS SCENES` writes, for every target, what the unit tests of its parser hold as text, the
//! library, and whatever small file of its kind lies in the folder of real scenes; and beside them the words that the parser knows.

// Brings what the counters of coverage call.
use libfuzzer_sys as _;
use std::io::Write;
use std::path::{Path, PathBuf};

const MAX_BYTES: u64 = 6000;

/// Targets, the folder of their parser's tests, and what a text of the tests is to be put in.
const TESTS: [(&str, &str, &str, &str); 12] = [
    (
        "toml",
        "scenes/src/description",
        "camera = { position = [0, 0, 3], target = [0, 0, 0] }\n[materials.white]\ntype = \"lambert\"\n",
        "",
    ),
    ("obj", "scenes/src/import/tests.rs", "", ""),
    ("obj", "scenes/src/import/source.rs", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n", ""),
    ("mtl", "scenes/src/import/mtl.rs", "newmtl a\nmap_Kd a.png\n", ""),
    ("mtl", "scenes/src/import/tests.rs", "", ""),
    ("ply", "scenes/src/import/ply", "", ""),
    ("mitsuba", "scenes/src/import/mitsuba", "<scene version=\"3.0.0\"><sensor type=\"perspective\"/>\n", "</scene>"),
    ("pbrt", "scenes/src/import/pbrt", "Camera \"perspective\" WorldBegin\n", ""),
    ("lpe", "integrators/src/lpe", "", ""),
    ("lpe", "tests/parts.rs", "", "\nC.*L"),
    ("figure", "experiments/src/figure", "", ""),
    ("experiment", "experiments/src", "scenes = [\"furnace\"]\nspp = 8\n", "\n[[methods]]\nname = \"path\"\n"),
];

/// Targets, where their parser is, and more words.
const WORDS: [(&str, &str, &[&str]); 12] = [
    (
        "toml",
        "scenes/src/description",
        &["nan", "inf", "-1e-300", "[[shapes]]", "[[emitters]]", "[[groups]]", "[[groups.shapes]]"],
    ),
    ("toml", "sampling/src/bsdf", &[]),
    ("obj", "scenes/src/import/source.rs", &["f 1 2 3", "v 0 0 0", "vn 0 0 1", "-1", "//", "nan", "1e39"]),
    (
        "mtl",
        "scenes/src/import/mtl.rs",
        &["newmtl a", "Kd 1 0 0", "Ke", "Ns", "illum 7", "map_Kd ", "Tf", "d 0.5", "Ni"],
    ),
    ("ply", "scenes/src/import/ply", &["element face ", "property list uchar int vertex_indices\\x0A", "4294967295"]),
    ("mitsuba", "scenes/src/import/mitsuba", &["$", "a.obj", "a.xml", "<ref id=\\\"m\\\"/>", "NaN", "1e400"]),
    (
        "pbrt",
        "scenes/src/import/pbrt",
        &["a.obj", "a.pbrt", "[", "]", "1e400", "AttributeBegin", "\\\"float radius\\\" [1]"],
    ),
    ("lpe", "integrators/src/lpe", &["<R", "<T", "'wall'", "'lamp'", "{2,3}", "[^DG]", ".*", "L(", "E"]),
    ("figure", "experiments/src/figure", &["[[images]]", "captions", "[[0, 0, 4, 4]]"]),
    ("gltf", "scenes/src/import/gltf", &["4294967295", "-1", "1e39", "null", "5125", "5121"]),
    (
        "exr",
        "",
        &[
            "channels",
            "chlist",
            "compression",
            "dataWindow",
            "displayWindow",
            "box2i",
            "tiles",
            "tiledesc",
            "chunkCount",
        ],
    ),
    (
        "image",
        "",
        &[
            "IHDR",
            "IDAT",
            "PLTE",
            "tRNS",
            "acTL",
            "-Y 1 +X 1\\x0A",
            "FORMAT=32-bit_rle_rgbe\\x0A",
            "\\xff\\xc2",
            "\\xff\\xda",
        ],
    ),
];

/// Endings of whole files, and the target that they are for.
const ENDINGS: [(&str, &str); 13] = [
    ("toml", "toml"),
    ("obj", "obj"),
    ("mtl", "mtl"),
    ("ply", "ply"),
    ("xml", "mitsuba"),
    ("serialized", "serialized"),
    ("pbrt", "pbrt"),
    ("gltf", "gltf"),
    ("glb", "gltf"),
    ("exr", "exr"),
    ("png", "image"),
    ("jpg", "image"),
    ("hdr", "image"),
];

fn main() -> std::io::Result<()> {
    let mut arguments = std::env::args_os().skip(1).map(PathBuf::from);
    let corpus = arguments.next().unwrap_or("corpus".into());
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../..");
    for (target, tests, before, after) in TESTS {
        for file in sources(&root.join(tests)) {
            for text in literals(&std::fs::read_to_string(file)?).iter().filter(|text| text.len() > 8) {
                keep(&corpus, target, format!("{before}{text}{after}").as_bytes())?;
            }
        }
    }
    for (target, folder) in [("toml", "scenes/library"), ("experiment", "experiments/library")] {
        for file in files(&root.join(folder)) {
            keep(&corpus, target, &std::fs::read(file)?)?;
        }
    }
    for file in arguments.flat_map(|folder| files(&folder)) {
        let ending = file.extension().unwrap_or_default().to_string_lossy().to_lowercase();
        let small = file.metadata().is_ok_and(|found| found.len() <= MAX_BYTES);
        if let Some((_, target)) = ENDINGS.iter().find(|(known, _)| small && *known == ending) {
            keep(&corpus, target, &std::fs::read(file)?)?;
        }
    }
    write_words(&corpus, &root)?;
    write_binaries(&corpus)
}

/// A dictionary for each target: the short literals of its parser.
fn write_words(corpus: &Path, root: &Path) -> std::io::Result<()> {
    for (target, ..) in WORDS {
        let of_target = || WORDS.iter().filter(|(other, ..)| *other == target);
        let mut words: Vec<String> =
            of_target().flat_map(|(_, _, more)| more.iter().map(ToString::to_string)).collect();
        for file in
            of_target().filter(|(_, path, _)| !path.is_empty()).flat_map(|(_, path, _)| sources(&root.join(path)))
        {
            let source = std::fs::read_to_string(file)?;
            let plain = |word: &String| {
                word.len() < 32 && word.bytes().all(|b| b.is_ascii_alphanumeric() || b == b'_' || b == b'-')
            };
            words.extend(literals(source.split("#[cfg(test)]").next().unwrap_or("")).into_iter().filter(plain));
        }
        words.sort();
        words.dedup();
        let lines: String = words.iter().filter(|word| word.len() > 1).map(|word| format!("\"{word}\"\n")).collect();
        std::fs::write(corpus.join(format!("{target}.words")), lines)?;
    }
    Ok(())
}

/// All files of a folder and of those in it, or the file itself.
fn files(path: &Path) -> Vec<PathBuf> {
    match std::fs::read_dir(path) {
        Ok(entries) => entries.flatten().flat_map(|entry| files(&entry.path())).collect(),
        Err(_) => vec![path.to_path_buf()],
    }
}

/// Those of Rust among them.
fn sources(path: &Path) -> impl Iterator<Item = PathBuf> + use<> {
    files(path).into_iter().filter(|file| file.extension().is_some_and(|ending| ending == "rs"))
}

/// The string literals of a source, roughly.
fn literals(source: &str) -> Vec<String> {
    let mut found = Vec::new();
    for part in source.split("r#\"").skip(1) {
        found.extend(part.split_once("\"#").map(|(text, _)| text.to_owned()));
    }
    let mut characters = source.chars();
    while let Some(character) = characters.next() {
        if character != '"' {
            continue;
        }
        let mut text = String::new();
        while let Some(character) = characters.next().filter(|&character| character != '"') {
            match (character, if character == '\\' { characters.next() } else { None }) {
                (_, Some('n')) => text.push('\n'),
                (_, Some('t')) => text.push('\t'),
                (_, Some('\n')) => {}
                (_, Some(escaped)) => text.push(escaped),
                (plain, None) => text.push(plain),
            }
        }
        if text.len() > 1 {
            found.push(text.replace("{{", "{").replace("}}", "}"));
        }
    }
    found
}

fn keep(corpus: &Path, target: &str, bytes: &[u8]) -> std::io::Result<()> {
    let folder = corpus.join(target);
    std::fs::create_dir_all(&folder)?;
    let name = bytes
        .iter()
        .fold(0xcbf2_9ce4_8422_2325u64, |hash, &byte| (hash ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3));
    if bytes.len() as u64 > MAX_BYTES { Ok(()) } else { std::fs::write(folder.join(format!("{name:016x}")), bytes) }
}

/// Files that no text holds: meshes and images of a few corners and texels.
fn write_binaries(corpus: &Path) -> std::io::Result<()> {
    for (kind, order) in [("binary_little_endian", false), ("binary_big_endian", true)] {
        let mut bytes = format!(
            "ply\nformat {kind} 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\nproperty uchar red\n\
             element face 1\nproperty list uchar int vertex_indices\nend_header\n"
        )
        .into_bytes();
        let word = |x: u32| if order { x.to_be_bytes() } else { x.to_le_bytes() };
        for corner in [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0f32]] {
            corner.iter().for_each(|x| bytes.extend(word(x.to_bits())));
            bytes.push(200);
        }
        bytes.push(3);
        (0..3).for_each(|i| bytes.extend(word(i)));
        keep(corpus, "ply", &bytes)?;
    }
    keep(corpus, "serialized", &serialized()?)?;
    write_gltf(corpus)?;
    let texels = image::Rgb32FImage::from_fn(3, 2, |x, y| image::Rgb([x as f32, y as f32, 0.5]));
    let floats = image::DynamicImage::ImageRgb32F(texels);
    let bytes = image::DynamicImage::ImageRgba8(floats.to_rgba8());
    let encoded = |image: &image::DynamicImage, format| {
        let mut out = std::io::Cursor::new(Vec::new());
        image.write_to(&mut out, format).expect("an image of floats or of bytes, as its format asks");
        out.into_inner()
    };
    keep(corpus, "image", &encoded(&bytes, image::ImageFormat::Png))?;
    keep(corpus, "image", &encoded(&image::DynamicImage::ImageLuma16(floats.to_luma16()), image::ImageFormat::Png))?;
    keep(corpus, "image", &encoded(&image::DynamicImage::ImageRgb8(floats.to_rgb8()), image::ImageFormat::Jpeg))?;
    keep(corpus, "image", &encoded(&floats, image::ImageFormat::Hdr))?;
    use exr::prelude::{Encoding, Image, SpecificChannels, WritableImage};
    for encoding in
        [Encoding::UNCOMPRESSED, Encoding::FAST_LOSSLESS, Encoding::SMALL_LOSSLESS, Encoding::SMALL_FAST_LOSSLESS]
    {
        let channels =
            SpecificChannels::rgba(|place: exr::math::Vec2<usize>| (place.0 as f32, place.1 as f32, 0.5f32, 1.0f32));
        let mut out = std::io::Cursor::new(Vec::new());
        let image = Image::from_encoded_channels((3, 2), encoding, channels);
        image.write().to_buffered(&mut out).expect("an image can be written to memory");
        let bytes = out.into_inner();
        keep(corpus, "exr", &bytes)?;
        keep(corpus, "layers", &bytes)?;
    }
    Ok(())
}

/// Two meshes of one triangle, in Mitsuba's container.
fn serialized() -> std::io::Result<Vec<u8>> {
    let (mut bytes, mut starts) = (Vec::new(), Vec::new());
    for flags in [0x1000u32, 0x2003] {
        starts.extend((bytes.len() as u64).to_le_bytes());
        bytes.extend([0x1c, 0x04, 0x04, 0x00]);
        let mut encoder = flate2::write::ZlibEncoder::new(Vec::new(), flate2::Compression::none());
        encoder.write_all(&[&flags.to_le_bytes()[..], b"name\0", &3u64.to_le_bytes(), &1u64.to_le_bytes()].concat())?;
        for x in [
            0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0f64, 0.0, 0.0, 1.0, 0.0, 0.0, 1.0, 0.0, 0.0, 1.0, 0.0, 0.0, 1.0,
            0.0, 0.0, 1.0,
        ] {
            if flags & 0x2000 != 0 {
                encoder.write_all(&x.to_le_bytes())?
            } else {
                encoder.write_all(&(x as f32).to_le_bytes())?
            }
        }
        (0u32..3).try_for_each(|i| encoder.write_all(&i.to_le_bytes()))?;
        bytes.extend(encoder.finish()?);
    }
    bytes.extend(starts);
    bytes.extend(2u32.to_le_bytes());
    Ok(bytes)
}

/// A triangle of 36 bytes and three indices, with and without a container.
fn write_gltf(corpus: &Path) -> std::io::Result<()> {
    let text = |uri: &str| {
        format!(
            r#"{{"asset":{{"version":"2.0"}},"scene":0,"scenes":[{{"nodes":[0,1]}}],"nodes":[{{"mesh":0,"rotation":[0,0,0,1],"scale":[1,2,1]}},
{{"mesh":0,"translation":[0,0,1],"children":[2]}},{{"camera":0,"extensions":{{"KHR_lights_punctual":{{"light":0}}}}}}],
"meshes":[{{"primitives":[{{"attributes":{{"POSITION":0}},"indices":1,"material":0,"mode":4}}]}}],
"materials":[{{"pbrMetallicRoughness":{{"baseColorFactor":[1,0.5,0.5,1],"metallicFactor":0.1,"roughnessFactor":0.4}},"emissiveFactor":[1,1,1],
"alphaMode":"MASK","doubleSided":true,"extensions":{{"KHR_materials_emissive_strength":{{"emissiveStrength":3}},"KHR_materials_transmission":{{"transmissionFactor":1}},"KHR_materials_ior":{{"ior":1.4}}}}}}],
"cameras":[{{"type":"perspective","perspective":{{"yfov":0.6,"znear":0.1}}}}],
"extensionsUsed":["KHR_lights_punctual"],"extensions":{{"KHR_lights_punctual":{{"lights":[{{"type":"spot","intensity":2,"spot":{{"outerConeAngle":0.5}}}}]}}}},
"accessors":[{{"bufferView":0,"componentType":5126,"count":3,"type":"VEC3","min":[0,0,0],"max":[1,1,0]}},
{{"bufferView":1,"byteOffset":0,"componentType":5123,"count":3,"type":"SCALAR"}}],
"bufferViews":[{{"buffer":0,"byteLength":36,"byteStride":12}},{{"buffer":0,"byteOffset":36,"byteLength":6}}],"buffers":[{{{uri}"byteLength":44}}]}}"#
        )
    };
    let data = "AAAAAAAAAAAAAAAAAACAPwAAAAAAAAAAAAAAAAAAgD8AAAAAAAABAAIAAAA=";
    keep(corpus, "gltf", text(&format!("\"uri\":\"data:application/octet-stream;base64,{data}\",")).as_bytes())?;
    let mut json = text("").into_bytes();
    json.resize(json.len().next_multiple_of(4), b' ');
    let mut body: Vec<u8> =
        [0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0f32].iter().flat_map(|x| x.to_le_bytes()).collect();
    body.extend([0, 0, 1, 0, 2, 0, 0, 0]);
    let mut file = b"glTF\x02\0\0\0".to_vec();
    file.extend((28 + json.len() as u32 + body.len() as u32).to_le_bytes());
    for (kind, chunk) in [(b"JSON", json), (b"BIN\0", body)] {
        file.extend((chunk.len() as u32).to_le_bytes());
        file.extend(kind);
        file.extend(chunk);
    }
    keep(corpus, "gltf", &file)
}
