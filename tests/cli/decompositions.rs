//! Images taken apart, and put together in another light.

use super::*;
use neumann::export::exr::LayeredImage;

/// A floor under two lamps with labels, of these intensities; emitters are chosen alike whatever they emit.
fn scene(key: [f32; 3], rim: [f32; 3]) -> String {
    let lamp = |label: &str, x: f32, intensity: [f32; 3]| {
        format!(
            "[[emitters]]\ntype = \"point\"\nlabel = \"{label}\"\nposition = [{x}, 1, 0]\nintensity = {intensity:?}\n"
        )
    };
    let floor = "[[shapes]]\ntype = \"quad\"\norigin = [-2, 0, 2]\nedge_u = [4, 0, 0]\nedge_v = [0, 0, -4]\nmaterial = \"grey\"\n";
    let wall = "[[shapes]]\ntype = \"quad\"\nlabel = \"wall\"\norigin = [-2, 0, -2]\nedge_u = [4, 0, 0]\nedge_v = [0, 3, 0]\nmaterial = \"grey\"\n";
    format!(
        "emitter_choice = \"uniform\"\n[camera]\nposition = [0, 1, 4]\ntarget = [0, 0.5, 0]\nwidth = 8\nheight = 8\n\
         [materials.grey]\ntype = \"lambert\"\nalbedo = 0.6\n{floor}{wall}{}{}",
        lamp("key", -1.0, key),
        lamp("rim", 1.0, rim)
    )
}

fn close(a: &LayeredImage, b: &LayeredImage, layer: &str) {
    let [a, b] = [a, b].map(|image| image.layer(layer).unwrap_or_else(|| panic!("no layer {layer}")));
    for (a, b) in a.pixels.iter().flatten().zip(b.pixels.iter().flatten()) {
        assert!((a - b).abs() <= 1e-5 * a.abs().max(b.abs()), "{layer}: {a} {b}");
    }
}

#[test]
fn dimmed_lights_look_as_if_they_were_rendered_so() {
    let [before, after] = [scene([3.0; 3], [1.0, 2.0, 3.0]), scene([6.0, 1.5, 3.0], [1.0, 2.0, 3.0])];
    let folder = folder_with(&[("before.toml", &before), ("after.toml", &after)]);
    let render = |name: &str| {
        let (scene, image) = (format!("{name}.toml"), format!("{name}.exr"));
        let layers = ["--layers", "orders,groups", "--max-order", "3", "--spp", "8"];
        succeed(folder.path(), &[&["render", scene.as_str(), "-o", image.as_str()][..], &layers].concat());
    };
    ["before", "after"].into_iter().for_each(render);
    let told = succeed(folder.path(), &["relight", "before.exr", "key=2,0.5,1", "-o", "relit.exr"]);
    assert!(told.contains("relit.exr") && told.contains("key"), "{told}");
    let [relit, after] = ["relit.exr", "after.exr"].map(|file| read_layers(&folder.path().join(file)).unwrap());
    for layer in ["", "order00", "order01", "order03", "group_key", "group_rim", "group_key_order02"] {
        close(&relit, &after, layer);
    }
    assert_eq!(relit.attributes["neumann:relit"], "key=2,0.5,1");
    // An image that was relit can be relit again.
    succeed(folder.path(), &["relight", "relit.exr", "key=0.5,2,1", "rim=1", "-o", "again.exr"]);
    let [again, before] = ["again.exr", "before.exr"].map(|file| read_layers(&folder.path().join(file)).unwrap());
    close(&again, &before, "");
}

/// Lamps so dim, and so bright, that what is shown is neither black nor white only because it is shown brighter or darker, as is said.
#[test]
fn a_picture_is_the_image_under_the_exposure_that_is_said() {
    is_shown("dim", 0.01, "");
    is_shown("bright", 1e3, "1/");
}

fn is_shown(name: &str, light: f32, over: &str) {
    let [file, exr, png] = ["toml", "exr", "PNG"].map(|ending| format!("{name}.{ending}"));
    let folder = folder_with(&[(&file, &scene([3.0 * light; 3], [light, 2.0 * light, 3.0 * light]))]);
    let render = |output: &str| succeed(folder.path(), &["render", &file, "--spp", "8", "-o", output]);
    render(&exr);
    let told = render(&png);
    let (_, factor) = told.split_once(&format!("shown at ×{over}")).unwrap();
    let factor = factor.split(' ').next().unwrap().parse::<f32>().unwrap();
    assert!(factor > 8.0 && factor.log2().fract() == 0.0, "{told}");
    let factor = if over.is_empty() { factor } else { 1.0 / factor };
    let file = std::io::BufReader::new(std::fs::File::open(folder.path().join(&png)).unwrap());
    let mut reader = png::Decoder::new(file).read_info().unwrap();
    let mut shown = vec![0; reader.output_buffer_size().unwrap()];
    reader.next_frame(&mut shown).unwrap();
    let image = read_layers(&folder.path().join(&exr)).unwrap();
    let linear: Vec<f32> = image.layer("").unwrap().pixels.iter().flatten().copied().collect();
    assert_eq!((shown.len(), linear.len()), (8 * 8 * 3, 8 * 8 * 3));
    for (shown, x) in shown.into_iter().zip(linear) {
        let x = (x * factor).min(1.0);
        let srgb = if x < 0.0031308 { 12.92 * x } else { 1.055 * x.powf(1.0 / 2.4) - 0.055 };
        assert!((f32::from(shown) - 255.0 * srgb).abs() < 0.51, "{shown} {x}");
    }
}

#[test]
fn an_image_has_the_layers_that_were_asked_for() {
    let text = scene([3.0; 3], [1.0; 3]);
    let folder = folder_with(&[("scene.toml", &text)]);
    let wall = "wall=C'wall'.*L";
    let parts = ["--layers", "orders,variance,strategies,groups", "--lpe", wall, "--lpe", "rest=C[^'wall'].*L"];
    let render =
        ["render", "scene.toml", "-i", "bdpt", "--max-order", "2", "--spp", "8", "-o", "x.exr", "--stats", "x.json"];
    succeed(folder.path(), &[&render[..], &parts].concat());
    let image = read_layers(&folder.path().join("x.exr")).unwrap();
    for layer in ["s02_t02", "s02_t02_raw", "s02_t02_weight", "s02_t02_weight_var", "group_key_order01_var", "lpe_wall"]
    {
        assert!(image.layer(layer).is_some(), "{layer}");
    }
    let weights = &image.layer("s01_t02_weight").unwrap().pixels;
    assert!(weights.iter().flatten().all(|w| (0.0..=1.0).contains(w)));
    assert!(folder.path().join("x_strategies.png").is_file());
    // Points are not seen themselves: what is seen is the wall or the rest.
    let pixels = |name: &str| image.layer(name).unwrap().pixels.iter().flatten().copied().collect::<Vec<f32>>();
    for ((all, wall), rest) in pixels("").into_iter().zip(pixels("lpe_wall")).zip(pixels("lpe_rest")) {
        assert!((all - wall - rest).abs() <= 1e-5 * all, "{all} {wall} {rest}");
    }
    let stats = json(folder.path(), "x.json");
    let names: Vec<&str> = stats["parts"].as_array().unwrap().iter().filter_map(|p| p["layer"].as_str()).collect();
    assert!(names.contains(&"lpe_wall") && names.contains(&"s03_t01_raw") && names.contains(&"group_rim"), "{names:?}");
}

#[test]
fn impossible_parts_are_refused_with_the_mend() {
    let text = scene([3.0; 3], [1.0; 3]);
    let folder = folder_with(&[("scene.toml", &text)]);
    let refused = |arguments: &[&str], words: &[&str]| super::refused(folder.path(), arguments, words);
    refused(&["render", "scene.toml", "--lpe", "C.*L"], &["name", "caustics="]);
    refused(&["render", "scene.toml", "--lpe", "x=C.*"], &["C.*", "^"]);
    refused(&["render", "scene.toml", "--lpe", "x=CL", "--lpe", "x=C.L"], &["two classes `x`"]);
    refused(&["render", "scene.toml", "--lpe", "x=C'wal'L"], &["'wal'", "did you mean 'wall'"]);
    refused(&["render", "cornell_box", "-i", "radiosity", "--layers", "strategies"], &["radiosity has no strategies"]);
    let huge =
        ["render", "scene.toml", "-i", "bdpt", "--size", "4096x4096", "--max-order", "20", "--layers", "strategies"];
    refused(&huge, &["taken apart", "GB", "--max-order"]);
    succeed(folder.path(), &["render", "scene.toml", "--spp", "4", "-o", "plain.exr"]);
    refused(&["relight", "plain.exr", "key=2", "-o", "y.exr"], &["plain.exr", "--layers orders,groups"]);
    refused(&["relight", "missing.exr", "key=2", "-o", "y.exr"], &["missing.exr"]);
    succeed(folder.path(), &["render", "scene.toml", "--spp", "4", "--layers", "groups", "-o", "groups.exr"]);
    refused(&["relight", "groups.exr", "kee=2", "-o", "y.exr"], &["did you mean `key`"]);
    refused(&["relight", "groups.exr", "key=2", "key=3", "-o", "y.exr"], &["two factors"]);
    refused(&["relight", "groups.exr", "key=x", "-o", "y.exr"], &["key=2"]);
    assert!(!folder.path().join("y.exr").exists());
}
