//! Materials, textures and shapes.

use sampling::bsdf::fresnel_conductor;
use sampling::math::Spectrum;

use super::*;

/// The material's table of a ball of this material, which scene files may hold.
fn material(text: &str, files: &[(&str, &str)]) -> (toml::Table, Translation) {
    let translation = made_with(&format!("{text} Shape \"sphere\""), files);
    if files.is_empty() {
        translation.read("a", Path::new("."), None).unwrap().build(Skip::Unneeded).unwrap();
    }
    let table = table(&translation);
    let name = table["shapes"][0]["material"].as_str().unwrap().to_string();
    (table["materials"][&name].as_table().unwrap().clone(), translation)
}

fn model(text: &str) -> toml::Table {
    material(text, &[]).0
}

fn float(table: &toml::Table, key: &str) -> f64 {
    table[key].as_float().unwrap_or_else(|| panic!("{key} of {table}"))
}

#[test]
fn roughness_is_the_square_of_the_width_unless_it_is_the_width() {
    let conductor = |text: &str| model(&format!("Material \"conductor\" {text}"));
    assert_eq!(float(&conductor("\"float roughness\" .25"), "alpha"), 0.5);
    assert_eq!(float(&conductor("\"float roughness\" .25 \"bool remaproughness\" false"), "alpha"), 0.25);
    let uneven = conductor("\"float uroughness\" .04 \"float vroughness\" .16");
    assert_eq!((float(&uneven, "alpha_x"), float(&uneven, "alpha_y")), (0.2, 0.4));
    assert_eq!(conductor("")["type"].as_str(), Some("conductor"));
    // pbrt takes what is narrower than 0.001 for smooth.
    assert_eq!(conductor("\"float roughness\" 9e-7")["type"].as_str(), Some("conductor"));
    assert_eq!(
        conductor("\"float roughness\" .001 \"bool remaproughness\" false")["type"].as_str(),
        Some("rough_conductor")
    );
}

#[test]
fn every_model_of_the_fourth_version() {
    let kind = |text: &str| model(&format!("Material {text}"))["type"].as_str().unwrap().to_string();
    assert_eq!(float(&model("Material \"diffuse\""), "albedo"), 0.5);
    assert_eq!(kind("\"coateddiffuse\""), "plastic");
    assert_eq!(kind("\"coateddiffuse\" \"float roughness\" .1"), "rough_plastic");
    assert_eq!(kind("\"dielectric\" \"float eta\" 1.8"), "dielectric");
    assert_eq!(float(&model("Material \"dielectric\" \"spectrum eta\" \"glass-BK7\""), "eta"), 1.5168);
    assert_eq!(kind("\"dielectric\" \"float roughness\" .1"), "rough_dielectric");
    assert_eq!(kind("\"thindielectric\""), "thin_glass");
    assert_eq!(kind("\"interface\""), "null");
    assert_eq!(kind("\"diffusetransmission\""), "diffuse_transmission");
    for near in ["subsurface", "hair", "measured", "coatedconductor", "kdsubsurface", "of my own"] {
        let (_, translation) = material(&format!("Material \"{near}\""), &[]);
        assert!(!notes(&translation, NoteKind::Approximated).is_empty(), "{near}");
    }
    let silver = model("Material \"conductor\" \"spectrum eta\" \"metal-Ag-eta\" \"spectrum k\" \"metal-Ag-k\"");
    // What the spectra reflect at normal incidence and at 85° in daylight, integrated by another program.
    let near = |model: &toml::Table, known: [[f32; 3]; 2], slack: f32| {
        let colour = |key: &str| {
            let list: Vec<f32> = vector(&model[key]).into_iter().map(|x| x as f32).collect();
            Spectrum::new(list[0], list[1], list[2])
        };
        for (cos, known) in [1.0, 85_f32.to_radians().cos()].into_iter().zip(known) {
            let found = fresnel_conductor(cos, colour("eta"), colour("k")).to_array();
            assert!(found.iter().zip(known).all(|(a, b)| (a - b).abs() < slack), "{found:?} against {known:?}");
        }
    };
    near(&silver, [[0.9715, 0.9599, 0.9153], [0.9786, 0.978, 0.9703]], 5e-4);
    near(&model("Material \"conductor\""), [[0.9552, 0.6377, 0.5382], [0.9763, 0.8368, 0.8003]], 4e-3);
    let aluminium = model("Material \"conductor\" \"spectrum eta\" \"metal-Al-eta\" \"spectrum k\" \"metal-Al-k\"");
    near(&aluminium, [[0.9132, 0.9215, 0.9245], [0.8501, 0.887, 0.9175]], 5e-4);
    let rgb = model("Material \"conductor\" \"rgb eta\" [.2 .9 1.1] \"rgb k\" [3.9 2.4 2.1]");
    assert_eq!(vector(&rgb["k"]), [3.9, 2.4, 2.1]);
    // At the normal, (k² + (1 − η)²) / (k² + (1 + η)²) is the reflectance.
    let grey = model("Material \"conductor\" \"rgb reflectance\" [.5 .5 .5]");
    let k = float(&grey, "k");
    assert!((k * k / (k * k + 4.0) - 0.5).abs() < 1e-12 && float(&grey, "eta") == 1.0);
}

#[test]
fn rough_glass_hides_its_facets_as_pbrts_does() {
    let rough = model("Material \"dielectric\" \"float roughness\" .1");
    assert_eq!(rough["masking"].as_str(), Some("correlated_throughout"));
}

#[test]
fn of_the_third_version_only_glass_is_smooth_and_glass_may_be_coloured() {
    let zero =
        |kind: &str| model(&format!("Material \"{kind}\" \"float roughness\" 0"))["type"].as_str().unwrap().to_string();
    assert_eq!(zero("metal"), "rough_conductor");
    assert_eq!(zero("plastic"), "rough_plastic");
    let glass = |text: &str| material(&format!("Material \"glass\" {text}"), &[]);
    let smooth = "\"float uroughness\" 0 \"float vroughness\" 0";
    assert_eq!(glass(smooth).0["type"].as_str(), Some("dielectric"));
    let (green, translation) = glass("\"rgb Kt\" [.1 .9 .2] \"float uroughness\" .1 \"float vroughness\" .1");
    assert_eq!((green["type"].as_str(), float(&green, "reflection")), (Some("tinted"), 1.0));
    assert_eq!(vector(&green["transmission"]), [0.1, 0.9, 0.2]);
    assert!(notes(&translation, NoteKind::Approximated).is_empty());
}

#[test]
fn names_of_the_third_version_are_made_new() {
    let matte = model("Material \"matte\" \"color Kd\" [.1 .2 .3] \"float sigma\" 20");
    assert_eq!((matte["type"].as_str(), float(&matte, "sigma")), (Some("oren_nayar"), 20.0));
    assert_eq!(model("Material \"matte\" \"rgb Kd\" [.1 .2 .3]")["type"].as_str(), Some("lambert"));
    let kind = |text: &str| model(&format!("Material {text}"))["type"].as_str().unwrap().to_string();
    assert_eq!(kind("\"glass\" \"float index\" 1.4"), "dielectric");
    assert_eq!(kind("\"mirror\""), "mirror");
    assert_eq!(kind("\"metal\""), "rough_conductor");
    for coated in ["plastic", "uber", "substrate"] {
        assert_eq!(kind(&format!("\"{coated}\"")), "rough_plastic");
    }
    assert_eq!(kind("\"translucent\""), "lambert");
    assert_eq!(kind("\"\""), "null");
}

#[test]
fn mixtures_name_their_parts_wherever_they_are() {
    let named =
        "MakeNamedMaterial \"a\" \"string type\" \"diffuse\" MakeNamedMaterial \"b\" \"string type\" \"conductor\"";
    let mix = model(&format!("Material \"mix\" \"string materials\" [\"a\" \"b\"] \"float amount\" .3 {named}"));
    assert_eq!((mix["type"].as_str(), float(&mix, "amount")), (Some("mix"), 0.3));
    assert_eq!((mix["first"].as_str(), mix["second"].as_str()), (Some("a_part"), Some("b_part")));
    let old = "\"string namedmaterial1\" \"a\" \"string namedmaterial2\" \"b\" \"rgb amount\" [.3 .3 .3]";
    assert_eq!(float(&model(&format!("{named} Material \"mix\" {old}")), "amount"), 0.7);
    assert_eq!(
        model("NamedMaterial \"b\" MakeNamedMaterial \"b\" \"string type\" \"dielectric\"")["type"].as_str(),
        Some("dielectric")
    );
}

#[test]
fn textures() {
    let files = [("wood.png", ""), ("bump.png", "")];
    let albedo = |texture: &str| {
        let text = format!("{texture} Material \"diffuse\" \"texture reflectance\" \"t\"");
        material(&text, &files).0["albedo"].clone()
    };
    let image = "Texture \"t\" \"spectrum\" \"imagemap\" \"string filename\" \"wood.png\"";
    let plain = albedo(image);
    assert_eq!((plain["image"].as_str(), plain["encoding"].as_str()), (Some("wood.png"), Some("srgb")));
    let dressed = albedo(&format!(
        "{image} \"float scale\" .5 \"string wrap\" \"clamp\" \"string encoding\" \"linear\" \"float su\" 2 \"float sv\" 3 \"float udelta\" .25"
    ));
    assert_eq!((dressed["encoding"].as_str(), dressed["wrap"].as_str()), (Some("linear"), Some("clamp")));
    assert_eq!((vector(&dressed["uv_scale"]), vector(&dressed["uv_offset"])), (vec![2.0, 3.0], vec![0.25, 0.0]));
    assert_eq!(dressed["scale"].as_float(), Some(0.5));
    // Theirs are 1 wide, ours ½.
    let board =
        "Texture \"t\" \"spectrum\" \"checkerboard\" \"rgb tex1\" [.1 .2 .3] \"float uscale\" 8 \"float vscale\" 8";
    let board = albedo(board);
    assert_eq!((vector(&board["checkerboard"][0]), vector(&board["uv_scale"])), (vec![0.1, 0.2, 0.3], vec![4.0, 4.0]));
    assert_eq!(albedo("Texture \"t\" \"spectrum\" \"constant\" \"rgb value\" [.5 .5 .5]").as_float(), Some(0.5));
    let dimmed = albedo(&format!(
        "{} Texture \"t\" \"spectrum\" \"scale\" \"texture tex\" \"w\" \"float scale\" .5",
        image.replace("\"t\"", "\"w\"")
    ));
    assert_eq!((dimmed["image"].as_str(), dimmed["scale"].as_float()), (Some("wood.png"), Some(0.5)));
    let mixed = "Texture \"t\" \"spectrum\" \"mix\" \"rgb tex1\" [0 0 0] \"rgb tex2\" [1 1 1] \"float amount\" .25";
    assert_eq!(albedo(mixed).as_float(), Some(0.25));
    assert_eq!(albedo("Texture \"t\" \"spectrum\" \"marble\"").as_float(), Some(0.5));
    let relief = "Texture \"b\" \"float\" \"imagemap\" \"string filename\" \"bump.png\" \"string encoding\" \"linear\" \"float scale\" .01 \
                  Material \"diffuse\" \"texture displacement\" \"b\"";
    let whole = material(relief, &files).0;
    assert_eq!(whole["relief"].as_str(), Some("plain"));
    let bump = whole["bump_map"].clone();
    assert_eq!((bump["image"].as_str(), bump["scale"].as_float()), (Some("bump.png"), Some(0.01)));
    let normal = material("Material \"diffuse\" \"string normalmap\" \"bump.png\"", &files).0["normal_map"].clone();
    assert_eq!(normal["encoding"].as_str(), Some("linear"));
}

#[test]
fn a_mask_of_a_shape_makes_a_material_of_its_own() {
    let text =
        "Material \"diffuse\" Shape \"sphere\" \"float alpha\" .5 Shape \"sphere\" Shape \"disk\" \"float alpha\" .5";
    let translation = made_of(text);
    let table = table(&translation);
    let names: Vec<&str> = (0..3).map(|i| table["shapes"][i]["material"].as_str().unwrap()).collect();
    assert_eq!((names[0] == names[2], names[0] == names[1]), (true, false));
    assert_eq!(table["materials"][names[0]]["opacity"].as_float(), Some(0.5));
    translation.read("a", Path::new("."), None).unwrap().build(Skip::Unneeded).unwrap();
}

#[test]
fn spectra() {
    let files = [("flat.spd", "300 0.25 # dark\n900 0.25\n")];
    let albedo = |text: &str| material(&format!("Material \"diffuse\" {text}"), &files).0["albedo"].clone();
    assert_eq!(albedo("\"spectrum reflectance\" \"flat.spd\""), albedo("\"spectrum reflectance\" [ 300 .25 900 .25 ]"));
    let flat = albedo("\"spectrum reflectance\" [ 300 .25 900 .25 ]");
    let channels = flat.as_array().map_or_else(|| vec![flat.as_float().unwrap(); 3], |_| vector(&flat));
    assert!(channels.iter().all(|c| (c - 0.25).abs() < 1e-9), "{flat}");
    let (_, translation) = material("Material \"diffuse\" \"rgb reflectance\" [1.5 .5 -1]", &[]);
    assert!(notes(&translation, NoteKind::Approximated)[0].contains("not from 0 to 1"));
    assert!(translation.text.contains("albedo = [1.0, 0.5, 0.0]"), "{}", translation.text);
}

#[test]
fn meshes() {
    let built = |text: &str| {
        let translation = made_of(text);
        let scene = translation.read("a", Path::new("."), None).unwrap().build(Skip::Unneeded).unwrap();
        (scene.counts().triangles, translation)
    };
    let triangle = "Shape \"trianglemesh\" \"point3 P\" [0 0 0 1 0 0 0 1 0]";
    let (count, translation) = built(&format!("{triangle} {triangle} \"integer indices\" [0 1 2]"));
    assert_eq!((count, translation.attachments.len()), (2, 1));
    // Without normals, the front is where corners turn after the transform.
    assert!(
        !translation.text.contains("flip") && built(&format!("Scale -1 1 1 {triangle}")).1.text.contains("flip = true")
    );
    let normals = "\"normal N\" [0 0 1 0 0 1 0 0 1]";
    assert!(!built(&format!("Scale -1 1 1 {triangle} {normals}")).1.text.contains("flip"));
    let patch = |z: f64| format!("Shape \"bilinearmesh\" \"point3 P\" [0 0 0 1 0 0 0 1 0 1 1 {z}]");
    assert_eq!(built(&patch(0.0)).0, 2);
    let (count, translation) = built(&patch(1.0));
    assert_eq!((count, notes(&translation, NoteKind::Approximated).len()), (128, 1));
    // Texture coordinates that cross bend over a flat patch.
    let (count, translation) = built(&format!("{} \"point2 uv\" [0 0 1 0 1 1 0 1]", patch(0.0)));
    assert_eq!((count, notes(&translation, NoteKind::Approximated).len()), (128, 1));
    assert_eq!(built(&format!("{} \"point2 uv\" [0 0 2 0 0 3 2 3]", patch(0.0))).0, 2);
    let twice = built("Shape \"sphere\" \"float radius\" 1 \"float radius\" 2 \"float raduis\" 2").1;
    let told = notes(&twice, NoteKind::Approximated);
    assert!(told[0].contains("more than one `radius` in `Shape sphere`: the first holds"), "{told:?}");
    assert!(
        told[1].contains("`raduis` of `Shape sphere` is not known, and is left out: did you mean `radius`?"),
        "{told:?}"
    );
    let control = "Shape \"loopsubdiv\" \"integer levels\" 3 \"point3 P\" [0 0 0 1 0 0 0 1 0 0 0 1] \"integer indices\" [0 1 2 0 1 3]";
    assert_eq!(built(control).0, 2);
}

#[test]
fn files_of_meshes_are_named_and_unpacked() {
    let ply = "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\nelement face 1\n\
               property list uchar int vertex_indices\nend_header\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n";
    let text = format!(
        "{CAMERA} Shape \"plymesh\" \"string filename\" \"m/a.ply\" Shape \"plymesh\" \"string filename\" \"b.ply.gz\""
    );
    let folder = folder(&[("a.pbrt", &text), ("m/a.ply", ply)]);
    let mut packed = flate2::write::GzEncoder::new(Vec::new(), flate2::Compression::fast());
    std::io::Write::write_all(&mut packed, ply.as_bytes()).unwrap();
    std::fs::write(folder.path().join("b.ply.gz"), packed.finish().unwrap()).unwrap();
    let translation = open(&folder).unwrap();
    assert!(translation.text.contains("file = \"m/a.ply\"") && translation.text.contains("file = \"a_mesh001.obj\""));
    let scene = translation.read("a", folder.path(), None).unwrap().build(Skip::Unneeded).unwrap();
    assert_eq!(scene.counts().triangles, 2);
}

#[test]
fn quadrics_are_whole_and_stay_round() {
    let shape = |text: &str| {
        let translation = made_of(text);
        translation.read("a", Path::new("."), None).unwrap().build(Skip::Unneeded).unwrap();
        (table(&translation)["shapes"][0].clone(), notes(&translation, NoteKind::Approximated))
    };
    let (tube, none) = shape("Shape \"cylinder\" \"float zmin\" 0 \"float zmax\" 2 \"float radius\" .5");
    assert_eq!((vector(&tube["to"]), none), (vec![0.0, 0.0, 2.0], Vec::new()));
    for part in ["sphere\" \"float zmax\" .5", "disk\" \"float innerradius\" .5", "cylinder\" \"float phimax\" 90"] {
        assert!(shape(&format!("Shape \"{part}")).1[0].contains("taken as whole"), "{part}");
    }
    assert_eq!(shape("Scale 1 2 1 Shape \"sphere\"").0["type"].as_str(), Some("mesh"));
    assert_eq!(shape("Scale 1 1.00001 1 Shape \"sphere\"").0["type"].as_str(), Some("sphere"));
}

#[test]
fn what_passes_an_interface_is_told_where_the_series_ends() {
    let told = |integrator: &str| {
        let ball = "Material \"interface\" Shape \"sphere\"";
        let camera = CAMERA.replace("Integrator \"path\"", integrator);
        let folder = folder(&[("a.pbrt", format!("{camera}\n{ball}\n").as_str())]);
        notes(&open(&folder).unwrap(), NoteKind::Approximated)
    };
    let [usual, few, many] =
        ["", "Integrator \"path\" \"integer maxdepth\" 3", "Integrator \"path\" \"integer maxdepth\" 65"].map(told);
    let is_told = |notes: &[String]| notes.iter().any(|note| note.contains("`maxdepth` does not count it"));
    assert!(is_told(&usual) && is_told(&few) && !is_told(&many), "{usual:?} {few:?} {many:?}");
}
