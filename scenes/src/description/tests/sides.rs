//! Materials with a front and a back.

use super::{SKY, expect, load};
use crate::ray::Ray;
use crate::scene::Scene;
use sampling::bsdf::{Bsdf, TransportMode};
use sampling::{Vec3, vec3};

const CAMERA: &str = "[camera]\nposition = [0, 0, 3]\ntarget = [0, 0, 0]\n";
const PARTS: &str = "[materials.red]\ntype = \"lambert\"\nalbedo = [0.5, 0, 0]\n[materials.metal]\ntype = \"mirror\"\nreflectance = 1\n";

/// Lines 1–3 camera, 4–9 parts, 10–11 the beginning of the material; then its keys, and a quad across z.
fn text(keys: &str, shape: &str) -> String {
    let quad = "type = \"quad\"\norigin = [-1, -1, 0]\nedge_u = [2, 0, 0]\nedge_v = [0, 2, 0]\nmaterial = \"two\"";
    format!("{CAMERA}{PARTS}[materials.two]\ntype = \"sided\"\n{keys}\n[[shapes]]\n{quad}\n{shape}\n{SKY}")
}

/// What a ray along z meets, from above and from below.
fn met(scene: &Scene) -> [String; 2] {
    [1.0, -1.0].map(|z| {
        let ray = Ray::new(vec3(0.1, 0.2, 2.0 * z), vec3(0.0, 0.0, -z));
        let it = scene.intersect(&ray).expect("it is across the axis");
        let above = vec3(0.0, 0.6, 0.8 * z);
        match it.bsdf {
            Bsdf::Lambert(lambert) => {
                assert!(it.eval(above, -above, TransportMode::Radiance).is_zero(), "nothing comes to the other side");
                lambert.albedo.to_array().map(|c| c.to_string()).join(" ")
            }
            _ => "metal".to_owned(),
        }
    })
}

const BOTH: &str = "front = \"red\"\nback = \"metal\"";

#[test]
fn the_side_is_that_of_the_front_wherever_it_has_been_turned() {
    let of = |keys: &str, shape: &str| met(&load(&text(keys, shape)).unwrap());
    let (red, black) = ("0.5 0 0", "0 0 0");
    assert_eq!(of(BOTH, ""), [red, "metal"]);
    assert_eq!(of(BOTH, "flip = true"), ["metal", red]);
    assert_eq!(of(BOTH, "transform = [{ scale = [-1, 1, 1] }]"), [red, "metal"], "the image of the front");
    assert_eq!(of(BOTH, "transform = [{ scale = [1, 1, -1] }]"), ["metal", red], "the image of the front");
    assert_eq!(of("front = \"red\"", ""), [red, black]);
    assert_eq!(of("back = \"red\"", ""), [black, red]);
    let ball = |flip: &str| {
        let text = text(BOTH, flip).replace(
            "type = \"quad\"\norigin = [-1, -1, 0]\nedge_u = [2, 0, 0]\nedge_v = [0, 2, 0]",
            "type = \"sphere\"\ncenter = [0, 0, 0]\nradius = 1",
        );
        let scene = load(&text).unwrap();
        let inside = scene.intersect(&Ray::new(Vec3::ZERO, vec3(0.0, 0.6, 0.8))).unwrap();
        (met(&scene), matches!(inside.bsdf, Bsdf::Lambert(_)))
    };
    assert_eq!(ball(""), ([red, red].map(str::to_owned), false));
    assert_eq!(ball("flip = true"), (["metal", "metal"].map(str::to_owned), true));
}

#[test]
fn an_instance_has_the_sides_of_its_group() {
    let placed = |transform: &str| {
        let text = text(BOTH, "").replace("[[shapes]]", "[[groups]]\nname = \"g\"\n[[groups.shapes]]");
        let instance = format!("[[shapes]]\ntype = \"instance\"\ngroup = \"g\"\ntransform = [{transform}]\n");
        met(&load(&format!("{text}{instance}")).unwrap())
    };
    assert_eq!(placed("{ scale = [1, 2, 1] }"), ["0.5 0 0", "metal"]);
    assert_eq!(placed("{ scale = [-1, 2, 1] }"), ["0.5 0 0", "metal"]);
    assert_eq!(placed("{ rotate = { axis = [0, 1, 0], angle = 180 } }"), ["metal", "0.5 0 0"]);
}

#[test]
fn what_a_scene_needs_is_what_either_side_needs() {
    let of = |keys: &str, parts: &str| load(&format!("{}{parts}", text(keys, ""))).unwrap();
    let needs = of(BOTH, "").needs;
    assert!(needs.delta_lobes && needs.non_delta_lobes && !needs.only_lambertian && !needs.masks && !needs.textures);
    assert!(of("front = \"red\"\nback = \"red\"", "").needs.only_lambertian);
    let varying = |keys: &str| format!("[materials.some]\ntype = \"lambert\"\n{keys}\n");
    let noisy = varying("albedo = { noise = { size = 0.1 } }");
    let scene = of("front = \"red\"\nback = \"some\"", &noisy);
    assert!(scene.needs.textures && scene.needs.only_lambertian && !scene.needs.tangents);
    let [front, back] = met(&scene);
    assert!(front == "0.5 0 0" && back != front && back != "0 0 0", "{back}");
    assert!(of("back = \"some\"", &varying("bump_map = { noise = { size = 0.1 } }")).needs.tangents);
    assert!(of("front = \"red\"\nopacity = 0.5", "").needs.masks);
    assert!(load(&text(&format!("{BOTH}\nopacity = {{ checkerboard = [0, 1] }}"), "")).unwrap().needs.masks);
    let hash = |keys: &str| load(&text(keys, "")).unwrap().hash;
    assert_ne!(hash(BOTH), hash("front = \"metal\"\nback = \"red\""));
    assert_ne!(hash("front = \"red\""), hash("back = \"red\""));
}

#[test]
fn sides_that_cannot_be_are_told() {
    // Whether light goes through is known once the surface is looked at; which file that is, by whoever loads it.
    let through = |keys: &str, part: &str| {
        let told = load(&format!("{}[materials.glass]\n{part}\n", text(keys, ""))).expect_err("refused").to_string();
        let expected = "line 10: light goes through a side of material `two`; make its `front` and its `back` of what reflects alone";
        assert_eq!(told, expected);
    };
    through("front = \"glass\"", "type = \"dielectric\"");
    through("back = \"glass\"", "type = \"principled\"\nspec_trans = { checkerboard = [0, 1] }");
    expect(&text("front = \"two\"", ""), "12: `materials.two.front` is `\"two\"`; a material cannot contain itself");
    let other = "[materials.other]\ntype = \"sided\"\nfront = \"red\"\n";
    let two =
        "12: `materials.two.front` is `\"other\"`; it must be the name of a material that has not two sides itself";
    expect(&format!("{}{other}", text("front = \"other\"", "")), two);
    let body = "[materials.other]\ntype = \"subsurface\"\nalbedo = 0.5\nmean_free_path = 0.1\n";
    let without = "12: `materials.two.front` is `\"other\"`; it must be the name of a material without subsurface";
    expect(&format!("{}{body}", text("front = \"other\"", "")), without);
    let mask = "[materials.other]\ntype = \"lambert\"\nopacity = 0.5\n";
    let without = "12: `materials.two.front` is `\"other\"`; it must be the name of a material without opacity";
    expect(&format!("{}{mask}", text("front = \"other\"", "")), without);
    expect(&text("front = \"rde\"", ""), "12: `materials.two.front` is `\"rde\"`; there is no such material");
    expect(&text("front = \"red\"\nbump_map = 1", ""), "13: unknown key `bump_map` in `materials.two`");
    let mix = "[materials.mixed]\ntype = \"mix\"\nfirst = \"two\"\nsecond = \"red\"\n";
    let told = load(&format!("{}{mix}", text(BOTH, ""))).expect_err("refused").to_string();
    assert!(told.contains("has not two sides; give each side a mix"), "{told}");
}
