use super::{BALL, CAMERA, Origin, SKY, expect, load, read, replaced};
use crate::needs::Skip;
use crate::ray::Ray;
use sampling::bsdf::Bsdf;
use sampling::vec3;
use std::path::Path;

fn with_albedo(texture: &str) -> String {
    replaced("albedo = 0.7", &format!("albedo = {texture}"))
}

/// The albedo of the ball from 3 m in front.
fn seen(text: &str, folder: &Path) -> f32 {
    let origin = Origin { scene: "test", file: "test.toml", folder: Some(folder), attachments: &[] };
    let scene = read(text, origin, None).unwrap().build(Skip::default()).unwrap();
    match scene.intersect(&Ray::new(vec3(0.0, 0.1, 3.0), vec3(0.0, 0.0, -1.0))).unwrap().bsdf {
        Bsdf::Lambert(lambert) => lambert.albedo.mean(),
        other => panic!("not Lambertian: {other:?}"),
    }
}

#[test]
fn every_texture_is_read() {
    let folder = tempfile::tempdir().unwrap();
    image::GrayImage::from_pixel(2, 2, image::Luma([128])).save(folder.path().join("grey.png")).unwrap();
    let textures = [
        ("{ checkerboard = [0.2, 0.2], uv_scale = [4, 2], uv_offset = [0.5, 0] }", 0.2),
        ("{ noise = { low = 0.4, high = 0.4, size = 0.1, octaves = 3, seed = 2 } }", 0.4),
        ("{ image = \"grey.png\" }", 0.215_861),
        (
            "{ image = \"grey.png\", encoding = \"linear\", wrap = \"mirror\", channel = \"g\", scale = 0.5 }",
            64.0 / 255.0,
        ),
    ];
    for (texture, expected) in textures {
        let albedo = seen(&with_albedo(texture), folder.path());
        assert!((albedo - expected).abs() < 1e-5, "{texture}: {albedo}");
    }
    let alpha = with_albedo("{ image = \"grey.png\", channel = \"a\" }");
    let origin = Origin { scene: "test", file: "test.toml", folder: Some(folder.path()), attachments: &[] };
    let refused = |text: &str| match read(text, origin, None) {
        Ok(_) => panic!("accepted: {text}"),
        Err(error) => error.to_string(),
    };
    let message = refused(&alpha);
    assert!(message.contains("has no alpha"), "{message}");
    let misspelt = with_albedo("{ image = \"gray.png\" }");
    let message = refused(&misspelt);
    assert!(message.contains("did you mean `grey.png`?"), "{message}");
    let coloured = format!(
        "{CAMERA}[materials.white]\ntype = \"lambert\"\nalbedo = {{ vertex_colours = true }}\n[[shapes]]\ntype = \"mesh\"\nvertices = [[-5, -5, 0], [5, -5, 0], [0, 5, 0]]\nfaces = [[0, 1, 2]]\ncolours = [0.3, 0.3, 0.3]\nuvs = [[0, 0], [1, 0], [0, 1]]\nmaterial = \"white\"\n{SKY}"
    );
    assert!((seen(&coloured, folder.path()) - 0.3).abs() < 1e-6);
}

#[test]
fn parts_of_a_mix_may_vary_but_have_no_maps() {
    let mix = |keys: &str| {
        let materials = format!(
            "albedo = 0.7\n[materials.stripes]\ntype = \"lambert\"\nalbedo = {{ noise = {{ size = 0.1 }} }}\n{keys}\n[materials.leaf]\ntype = \"mix\"\nfirst = \"stripes\"\nsecond = \"white\"\namount = {{ noise = {{ size = 0.2 }} }}\n"
        );
        load(&replaced("albedo = 0.7", &materials).replace("material = \"white\"", "material = \"leaf\""))
    };
    let needs = mix("").unwrap().needs;
    assert!(needs.textures && needs.only_lambertian);
    let error = mix("opacity = 0.5").expect_err("refused").to_string();
    assert!(error.contains("of a material without normal map, bump map and opacity"), "{error}");
}

#[test]
fn what_is_tinted_does_not_vary_but_its_colours_may() {
    let tinted = |albedo: &str| {
        let clay = format!("albedo = 0.7\n[materials.clay]\ntype = \"plastic\"\nalbedo = {albedo}\n");
        let leaf = "[materials.leaf]\ntype = \"tinted\"\nof = \"clay\"\nreflection = { noise = { size = 0.2 } }\n";
        load(&replaced("albedo = 0.7", &format!("{clay}{leaf}")).replace("material = \"white\"", "material = \"leaf\""))
    };
    assert!(tinted("0.5").is_ok());
    let error = tinted("{ noise = { size = 0.1 } }").expect_err("refused").to_string();
    assert!(error.contains("materials.leaf.of") && error.contains("of which no texture gives a parameter"), "{error}");
}

#[test]
fn mixes_do_not_grow_without_limit() {
    let mixes_of = |first: &str, second: &str, count: usize, keys: &str| {
        let mix = |i: usize| {
            let (first, second) = (first.replace('#', &(i - 1).to_string()), second.replace('#', &(i - 1).to_string()));
            format!("[materials.m{i}]\ntype = \"mix\"\nfirst = \"{first}\"\nsecond = \"{second}\"\n")
        };
        let all: String = (1..=count).rev().map(mix).collect();
        load(&replaced("albedo = 0.7", &format!("albedo = 0.7\n{all}[materials.m0]\ntype = \"lambert\"\n{keys}")))
    };
    let mixes = |first: &str, second: &str, count: usize| {
        mixes_of(first, second, count, "albedo = { noise = { size = 0.1 } }\n")
    };
    assert!(mixes("m#", "white", 60).is_ok());
    let error = mixes("m#", "m#", 30).expect_err("refused").to_string();
    assert!(error.contains("is mixed of 128 materials; mix at most 64"), "{error}");
    let error = mixes_of("m#", "m#", 60, "albedo = 0.2\n").expect_err("refused").to_string();
    assert!(error.contains("is mixed of 128 materials; mix at most 64"), "{error}");
    let error = mixes("m#", "white", 3000).expect_err("refused").to_string();
    assert!(error.contains("mixes of mixes are nested at most 64 deep"), "{error}");
}

#[test]
fn relief_and_opacity_are_read() {
    let with = |keys: &str| load(&replaced("albedo = 0.7", &format!("albedo = 0.7\n{keys}"))).unwrap().needs;
    assert!(with("bump_map = { noise = { size = 0.1, high = 0.01 } }").textures);
    assert!(with("normal_map = { checkerboard = [[0.6, 0.5, 0.9], [0.4, 0.5, 0.9]] }").tangents);
    assert!(with("opacity = 0.5").masks && !with("opacity = 1").masks);
    assert!(!with("bump_map = { noise = { size = 0.1 } }").only_lambertian, "a tilted face has ways to choose from");
    let hash = |relief: &str| {
        load(&replaced("albedo = 0.7", &format!("albedo = 0.7\nbump_map = {{ noise = {{ size = 0.1 }} }}\n{relief}")))
            .unwrap()
            .hash
    };
    assert_eq!(hash("relief = \"turned_and_shadowed\""), hash(""));
    assert_ne!(hash("relief = \"plain\""), hash(""));
}

#[test]
fn a_width_may_vary_down_to_nothing() {
    let metal = "type = \"rough_conductor\"\nreflectance = 1\nalpha = { checkerboard = [0, 0.4] }";
    let needs = load(&replaced("type = \"lambert\"\nalbedo = 0.7", metal)).unwrap().needs;
    assert!(needs.delta_lobes && needs.non_delta_lobes);
}

#[test]
fn bad_textures_are_told() {
    let cases = [
        ("{ imge = \"a.png\" }", "6: `materials.white.albedo` is `{ imge = \"a.png\" }`; did you mean `image`?"),
        ("{ image = \"missing.png\" }", "6: `materials.white.albedo.image` is `\"missing.png\"`; cannot read"),
        (
            "{ checkerboard = [0.2, 1.5] }",
            "6: `materials.white.albedo` is `{ checkerboard = [0.2, 1.5] }`; it reaches 1.5; keep it a colour",
        ),
        ("{ checkerboard = [0.2] }", "6: `materials.white.albedo.checkerboard` is `[0.2]`; it must be two colours"),
        ("{ checkerboard = [0, 1], uv_scale = 0 }", "6: `materials.white.albedo.uv_scale` is `0`; it is 0"),
        ("{ noise = { size = 0 } }", "6: `materials.white.albedo.noise.size` is `0`; it must be above 0"),
        (
            "{ noise = { size = 1, octaves = 99 } }",
            "6: `materials.white.albedo.noise.octaves` is `99`; it must be from 1 to 16",
        ),
        ("{ vertex_colours = false }", "6: `materials.white.albedo.vertex_colours` is `false`; it must be true"),
    ];
    for (texture, expected) in cases {
        expect(&with_albedo(texture), expected);
    }
    let after = |keys: &str| replaced("albedo = 0.7", &format!("albedo = 0.7\n{keys}"));
    expect(&after("opacity = [0, 1, 0]"), "7: `materials.white.opacity` is `[0, 1, 0]`; it must be a number");
    let inwards = "7: `materials.white.normal_map` is `[0.5, 0.5, 0.2]`; its normals, 2c − 1 of a colour c, point into";
    expect(&after("normal_map = [0.5, 0.5, 0.2]"), inwards);
    let message = load(&with_albedo("{ vertex_colours = true }")).unwrap_err().to_string();
    assert!(message.contains("is read by vertex colours, which there are none of"), "{message}");
    expect(&after("opacity = 2"), "7: `materials.white.opacity` is `2`; it reaches 2; keep it a number from 0 to 1");
    expect(
        &after("bump_map = 0.1\nnormal_map = [0.5, 0.5, 1]"),
        "7: `materials.white.bump_map` is `0.1`; there is a `normal_map` as well",
    );
    expect(
        &after("relief = \"plain\""),
        "7: `materials.white.relief` is `\"plain\"`; there is no `normal_map` and no `bump_map`; add one",
    );
    expect(
        &after("bump_map = 0.1\nrelief = \"plane\""),
        "8: `materials.white.relief` is `\"plane\"`; did you mean `plain`?",
    );
    let lamp =
        replaced("radius = 1", "radius = 1\nemission = 1").replace("albedo = 0.7", "albedo = 0.7\nopacity = 0.5");
    let message = load(&lamp).unwrap_err().to_string();
    assert!(message.contains("emits, but its material has an `opacity`"), "{message}");
    let bare = with_albedo("{ vertex_colours = true }").replace(
        BALL,
        "[[shapes]]\ntype = \"mesh\"\nvertices = [[0, 0, 0], [1, 0, 0], [0, 1, 0]]\nfaces = [[0, 1, 2]]\nmaterial = \"white\"\n",
    );
    let message = load(&bare).unwrap_err().to_string();
    assert!(message.contains("material `white`") && message.contains("vertex colours"), "{message}");
}
