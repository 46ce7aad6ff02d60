//! Materials: models, colours, masks, what they emit.

use super::*;

/// The material of the triangle.
fn made(material: Value) -> (toml::Value, Translation) {
    let translation = Fixture::made_of(material).translated();
    (table(&translation)["materials"]["material_0"].clone(), translation)
}

fn kind(material: &toml::Value) -> &str {
    material["type"].as_str().unwrap()
}

fn number(material: &toml::Value, key: &str) -> f64 {
    material[key].as_float().unwrap_or_else(|| panic!("{key} of {material}"))
}

#[test]
fn metals_are_exact_and_dielectrics_near() {
    let factors = json!({ "baseColorFactor": [0.9, 0.6, 0.3, 1], "metallicFactor": 1, "roughnessFactor": 0.4 });
    let (metal, translation) = made(json!({ "pbrMetallicRoughness": factors, "doubleSided": true }));
    assert_eq!((kind(&metal), vector(&metal["base_color"])), ("principled", vec![0.9, 0.6, 0.3]));
    assert_eq!((number(&metal, "metallic"), number(&metal, "roughness")), (1.0, 0.4));
    assert!(notes(&translation, NoteKind::Approximated).is_empty(), "{:?}", translation.notes);
    let (plastic, translation) = made(json!({ "pbrMetallicRoughness": { "metallicFactor": 0 } }));
    assert_eq!((number(&plastic, "base_color"), plastic.get("eta")), (1.0, None));
    assert!(tells(&translation, NoteKind::Approximated, "becomes `principled`, whose diffuse part"));
    assert!(tells(&translation, NoteKind::Approximated, "not `doubleSided`"));
    // What reflects nothing at its surface is matte.
    let (matte, _) = made(json!({
        "pbrMetallicRoughness": { "baseColorFactor": [0.2, 0.4, 0.6, 1], "metallicFactor": 0 },
        "extensions": { "KHR_materials_specular": { "specularFactor": 0 } },
    }));
    assert_eq!((kind(&matte), vector(&matte["albedo"])), ("lambert", vec![0.2, 0.4, 0.6]));
    // Without a material it is the specification's: a white, rough metal.
    let table = table(&Fixture::triangle(json!({})).translated());
    assert_eq!(number(&table["materials"]["default"], "metallic"), 1.0);
}

#[test]
fn indices_and_highlights() {
    let with = |extensions: Value| {
        made(json!({ "pbrMetallicRoughness": { "metallicFactor": 0 }, "extensions": extensions })).0
    };
    assert_eq!(number(&with(json!({ "KHR_materials_ior": { "ior": 1.8 } })), "eta"), 1.8);
    // Half of the 4 % of an index of 1.5: √0.02 = 0.1414.
    let half = number(&with(json!({ "KHR_materials_specular": { "specularFactor": 0.5 } })), "eta");
    assert!((half - 1.141_421_356 / 0.858_578_644).abs() < 1e-8, "{half}");
    let coat = with(json!({ "KHR_materials_clearcoat": { "clearcoatFactor": 0.7, "clearcoatRoughnessFactor": 0.1 } }));
    assert_eq!(number(&coat, "clearcoat"), 0.7);
    assert!((number(&coat, "clearcoat_gloss") - 0.09 / 0.099).abs() < 1e-12);
    let cloth = with(json!({ "KHR_materials_sheen": { "sheenColorFactor": [0.1, 0.5, 0.2] } }));
    assert_eq!((number(&cloth, "sheen"), number(&cloth, "sheen_tint")), (0.5, 0.0));
    let (old, translation) = made(json!({ "extensions": { "KHR_materials_pbrSpecularGlossiness": {
        "diffuseFactor": [0.1, 0.2, 0.3, 1], "specularFactor": [0.04, 0.04, 0.04], "glossinessFactor": 0.75 } } }));
    assert_eq!((vector(&old["base_color"]), number(&old, "roughness")), (vec![0.1, 0.2, 0.3], 0.25));
    assert!((old.get("eta").map_or(1.5, |eta| eta.as_float().unwrap()) - 1.5).abs() < 1e-9);
    assert!(tells(&translation, NoteKind::Approximated, "specular and glossiness"));
    let (_, translation) = made(json!({ "extensions": { "KHR_materials_iridescence": {} } }));
    assert!(tells(&translation, NoteKind::Approximated, "`KHR_materials_iridescence` of materials is left out"));
}

#[test]
fn what_light_goes_through() {
    let with = |through: f64, roughness: f64, base: [f64; 4], volume: Value| {
        let mut extensions = json!({ "KHR_materials_transmission": { "transmissionFactor": through } });
        if !volume.is_null() {
            extensions["KHR_materials_volume"] = volume;
        }
        let factors = json!({ "metallicFactor": 0, "roughnessFactor": roughness, "baseColorFactor": base });
        made(json!({ "pbrMetallicRoughness": factors, "extensions": extensions })).0
    };
    let (white, red) = ([1.0; 4], [1.0, 0.25, 0.25, 1.0]);
    let solid = json!({ "thicknessFactor": 1 });
    assert_eq!(kind(&with(1.0, 0.0, white, json!(null))), "thin_glass");
    assert_eq!(number(&with(1.0, 0.0, white, json!(null)), "eta"), 1.5);
    let wall = with(1.0, 0.0, red, json!({ "thicknessFactor": 0 }));
    assert_eq!((kind(&wall), vector(&wall["transmittance"])), ("null", vec![1.0, 0.25, 0.25]));
    let partly = with(0.5, 0.0, white, json!(null));
    assert_eq!((kind(&partly), number(&partly, "amount")), ("mix", 0.5));
    assert_eq!(kind(&with(1.0, 0.0, white, solid.clone())), "dielectric");
    let ground = with(1.0, 0.3, white, solid.clone());
    assert_eq!((kind(&ground), number(&ground, "roughness")), ("rough_dielectric", 0.3));
    let bottle = with(1.0, 0.0, red, solid);
    assert_eq!((kind(&bottle), number(&bottle, "spec_trans")), ("principled", 1.0));
    let wine = json!({ "thicknessFactor": 2, "attenuationDistance": 1, "attenuationColor": [1, 0.5, 0.5] });
    assert_eq!(vector(&with(1.0, 0.0, white, wine)["base_color"]), [1.0, 0.25, 0.25]);
    // Nothing goes through metal.
    let metal = made(json!({ "extensions": { "KHR_materials_transmission": { "transmissionFactor": 1 } } })).0;
    assert_eq!(kind(&metal), "principled");
    assert!(metal.get("spec_trans").is_none());
}

#[test]
fn textures_are_scaled_read_by_their_channels_and_wrapped() {
    let mut fixture = Fixture::made_of(json!({ "pbrMetallicRoughness": {
        "baseColorTexture": { "index": 0 }, "baseColorFactor": [0.5, 1, 1, 1],
        "metallicRoughnessTexture": { "index": 1 }, "metallicFactor": 0.5 } }));
    fixture.texture(&[[0.2, 0.4, 0.6, 1.0]]);
    fixture.texture(&[[0.0, 0.5, 1.0, 1.0]]);
    fixture.json["textures"][0]["sampler"] = json!(0);
    fixture.json["samplers"] = json!([{ "wrapS": 33071, "wrapT": 33648, "magFilter": 9728 }]);
    let translation = fixture.translated();
    let table = table(&translation);
    let material = &table["materials"]["material_0"];
    assert_eq!(vector(&material["base_color"]["scale"]), [0.5, 1.0, 1.0]);
    assert_eq!(material["base_color"]["wrap"].as_str(), Some("clamp"));
    let [metal, rough] = ["metallic", "roughness"].map(|key| material[key]["channel"].as_str().unwrap());
    assert_eq!((metal, rough, material["metallic"]["scale"].as_float()), ("b", "g", Some(0.5)));
    // One image, named twice and kept once.
    assert_eq!(material["metallic"]["image"], material["roughness"]["image"]);
    assert_eq!(translation.attachments.len(), 3);
    for words in ["`wrapT`", "nearest texel"] {
        assert!(tells(&translation, NoteKind::Approximated, words), "{words}");
    }
}

/// What is written of the triangle's corner (1, 0), and of the base colour.
fn transformed(first: Value, second: Value) -> (Vec<[f32; 2]>, toml::Value, Translation) {
    let mut material = json!({ "pbrMetallicRoughness": { "baseColorTexture": first } });
    if !second.is_null() {
        material["emissiveTexture"] = second;
        material["emissiveFactor"] = json!([1, 1, 1]);
    }
    let mut fixture = Fixture::made_of(material);
    fixture.texture(&[[1.0; 4]]);
    let translation = fixture.translated();
    let uvs = mesh(&translation, 0).uvs.iter().map(|uv| uv.to_array()).collect();
    let base = table(&translation)["materials"]["material_0"]["base_color"].clone();
    (uvs, base, translation)
}

fn turned(transform: Value) -> Value {
    json!({ "index": 0, "extensions": { "KHR_texture_transform": transform } })
}

#[test]
fn textures_are_moved_scaled_and_turned() {
    let (uvs, base, _) = transformed(json!({ "index": 0 }), json!(null));
    assert_eq!((uvs, base.get("uv_scale")), (vec![[0.0, 1.0], [1.0, 1.0], [0.0, 0.75]], None));
    // At the file's (u, v) the image is read at (2u + ¼, 3v + ½) from its upper edge: ours is 1 − (3 (1 − v') + ½).
    let (uvs, base, _) = transformed(turned(json!({ "offset": [0.25, 0.5], "scale": [2, 3] })), json!(null));
    assert_eq!(uvs[1], [1.0, 1.0]);
    assert_eq!((vector(&base["uv_scale"]), vector(&base["uv_offset"])), (vec![2.0, 3.0], vec![0.25, -2.5]));
    // A quarter turn, counter-clockwise as an image is seen, takes (1, 0) to (0, −1): ours is (0, 2).
    let quarter = turned(json!({ "rotation": std::f64::consts::FRAC_PI_2 }));
    let (uvs, base, translation) = transformed(quarter.clone(), quarter.clone());
    let near = |a: [f32; 2], b: [f32; 2]| (a[0] - b[0]).abs() < 1e-6 && (a[1] - b[1]).abs() < 1e-6;
    assert!(near(uvs[1], [0.0, 2.0]) && near(uvs[0], [0.0, 1.0]), "{uvs:?}");
    assert_eq!((base.get("uv_scale"), base.get("uv_offset")), (None, None));
    assert!(!tells(&translation, NoteKind::Approximated, "turned"));
    let (.., translation) = transformed(quarter, json!({ "index": 0 }));
    assert!(tells(&translation, NoteKind::Approximated, "a texture that is turned otherwise"));
}

#[test]
fn one_set_of_coordinates_is_kept() {
    let (uvs, ..) = transformed(json!({ "index": 0, "texCoord": 1 }), json!(null));
    assert_eq!(uvs, [[0.5, 0.5], [0.75, 0.5], [0.5, 0.25]]);
    let (uvs, ..) = transformed(turned(json!({ "texCoord": 1 })), json!({ "index": 0, "texCoord": 1 }));
    assert_eq!(uvs[0], [0.5, 0.5]);
    let (uvs, _, translation) = transformed(json!({ "index": 0 }), json!({ "index": 0, "texCoord": 1 }));
    assert_eq!(uvs[0], [0.0, 1.0]);
    assert!(tells(&translation, NoteKind::Approximated, "by another set of coordinates"));
    let (uvs, base, translation) = transformed(json!({ "index": 0, "texCoord": 2 }), json!(null));
    assert_eq!((uvs.len(), base.as_float()), (0, Some(1.0)));
    assert!(tells(&translation, NoteKind::Approximated, "without its texture coordinates"));
}

#[test]
fn colours_of_vertices_are_multiplied_into_the_mesh() {
    let coloured = |colours: &[f32], texture: bool| {
        let mut pbr = json!({ "baseColorFactor": [0.5, 1, 1, 1] });
        if texture {
            pbr["baseColorTexture"] = json!({ "index": 0 });
        }
        let mut fixture = Fixture::made_of(json!({ "pbrMetallicRoughness": pbr }));
        fixture.texture(&[[1.0; 4]]);
        let accessor = fixture.floats(if colours.len() == 9 { "VEC3" } else { "VEC4" }, colours);
        fixture.attribute("COLOR_0", accessor);
        fixture.translated()
    };
    let varying = [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 2.0];
    let translation = coloured(&varying, false);
    let colours: Vec<_> = mesh(&translation, 0).colours.iter().map(|colour| colour.to_array()).collect();
    assert_eq!(colours, [[0.5, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]);
    let base = |translation: &Translation| table(translation)["materials"]["material_0"]["base_color"].clone();
    assert_eq!(base(&translation)["vertex_colours"].as_bool(), Some(true));
    // One colour for all is a factor; with an image, several are left out.
    let same = [0.5, 0.5, 0.25, 1.0].repeat(3);
    assert_eq!(vector(&base(&coloured(&same, false))), [0.25, 0.5, 0.25]);
    assert_eq!(vector(&base(&coloured(&same, true))["scale"]), [0.25, 0.5, 0.25]);
    let translation = coloured(&varying, true);
    assert!(tells(&translation, NoteKind::Approximated, "colours of vertices are left out"));
    assert!(mesh(&translation, 0).colours.is_empty());
}

#[test]
fn surfaces_emit_in_nits() {
    let shape = |material: Value| {
        let mut fixture = Fixture::made_of(material);
        fixture.texture(&[[0.5, 0.5, 0.5, 1.0]]);
        fixture.texture(&[[0.0, 0.0, 0.0, 1.0]]);
        let translation = fixture.translated();
        (table(&translation)["shapes"][0].clone(), translation)
    };
    let (plain, translation) = shape(json!({ "emissiveFactor": [1, 0.5, 0] }));
    assert_eq!((vector(&plain["emission"]), plain.get("two_sided")), (vec![1.0, 0.5, 0.0], None));
    assert!(!translation.text.contains("constant"), "it is lit by itself");
    let strong = json!({ "KHR_materials_emissive_strength": { "emissiveStrength": 5 } });
    let (strong, _) = shape(json!({ "emissiveFactor": [1, 1, 1], "extensions": strong, "doubleSided": true }));
    assert_eq!((strong["emission"].as_float(), strong["two_sided"].as_bool()), (Some(5.0), Some(true)));
    let (image, _) = shape(json!({ "emissiveFactor": [2, 2, 2], "emissiveTexture": { "index": 0 } }));
    assert_eq!(image["emission"]["scale"].as_float(), Some(2.0));
    let (black, translation) = shape(json!({ "emissiveFactor": [1, 1, 1], "emissiveTexture": { "index": 1 } }));
    assert!(black.get("emission").is_none());
    assert!(tells(&translation, NoteKind::Ignored, "an `emissiveTexture` that is black"));
    let unlit = json!({ "pbrMetallicRoughness": { "baseColorFactor": [0.2, 0.4, 0.6, 1] }, "extensions": { "KHR_materials_unlit": {} } });
    let (unlit, translation) = shape(unlit);
    assert_eq!(vector(&unlit["emission"]), [0.2, 0.4, 0.6]);
    assert_eq!(table(&translation)["materials"]["material_0"]["albedo"].as_float(), Some(0.0));
}

#[test]
fn masks_and_blends() {
    let opacity = |mode: &str, more: Value, texel: Option<[f32; 4]>| {
        let mut material = json!({ "alphaMode": mode, "pbrMetallicRoughness": { "baseColorFactor": [1, 1, 1, 0.6] } });
        if texel.is_some() {
            material["pbrMetallicRoughness"]["baseColorTexture"] = json!({ "index": 0 });
        }
        merge(&mut material, more);
        let mut fixture = Fixture::made_of(material);
        fixture.texture(&[texel.unwrap_or([1.0; 4]), [0.0; 4]]);
        let translation = fixture.translated();
        (table(&translation)["materials"]["material_0"].get("opacity").cloned(), translation)
    };
    assert!(opacity("OPAQUE", json!({}), None).0.is_none());
    assert_eq!(opacity("BLEND", json!({}), None).0.unwrap().as_float(), Some(0.6));
    assert!(opacity("MASK", json!({}), None).0.is_none());
    assert_eq!(opacity("MASK", json!({ "alphaCutoff": 0.7 }), None).0.unwrap().as_float(), Some(0.0));
    let (blend, _) = opacity("BLEND", json!({}), Some([1.0, 1.0, 1.0, 0.5]));
    let blend = blend.unwrap();
    assert_eq!((blend["channel"].as_str(), blend["scale"].as_float()), (Some("a"), Some(0.6)));
    let (mask, translation) = opacity("MASK", json!({ "alphaCutoff": 0.25 }), Some([1.0, 1.0, 1.0, 0.5]));
    let name = mask.unwrap()["image"].as_str().unwrap().to_string();
    let cut = translation.attachments.iter().find(|attachment| attachment.name == name).unwrap();
    let cut = Image::decode(&cut.bytes, None, crate::texture::Encoding::Linear).unwrap();
    assert_eq!([0, 1].map(|i| cut.texel(i)[0]), [1.0, 0.0]);
    let mut fixture = Fixture::made_of(json!({ "alphaMode": "FADE" }));
    fixture.json["materials"][0]["name"] = json!("leaf");
    let error = fixture.fault();
    assert!(error.contains("a.glb:1: material 0 (`leaf`) has the `alphaMode` `FADE`; give OPAQUE"), "{error}");
}

#[test]
fn normal_maps_may_be_made_steeper() {
    let relief = |info: Value, texel: [f32; 4]| {
        let mut fixture = Fixture::made_of(json!({ "normalTexture": info }));
        fixture.texture(&[texel]);
        let translation = fixture.translated();
        (table(&translation)["materials"]["material_0"].get("normal_map").cloned(), translation)
    };
    let tilted = [0.5 + 0.5 * 0.6, 0.5, 0.5 + 0.5 * 0.8, 1.0];
    let (plain, translation) = relief(json!({ "index": 0 }), tilted);
    assert_eq!(plain.unwrap()["image"].as_str(), Some("a_image001.png"));
    assert!(!tells(&translation, NoteKind::Approximated, "normal"));
    let (steep, translation) = relief(json!({ "index": 0, "scale": 2 }), tilted);
    let name = steep.unwrap()["image"].as_str().unwrap().to_string();
    let bytes = &translation.attachments.iter().find(|attachment| attachment.name == name).unwrap().bytes;
    let texel = Image::decode(bytes, None, crate::texture::Encoding::Linear).unwrap().texel(0);
    // (1.2, 0, 0.8) of length 1.442.
    for (channel, expected) in [(0, 0.5 + 0.6 / 1.442_22), (1, 0.5), (2, 0.5 + 0.4 / 1.442_22)] {
        assert!((f64::from(texel[channel]) - expected).abs() < 0.01, "{texel:?}");
    }
    let (none, translation) = relief(json!({ "index": 0 }), [0.5, 0.5, 0.2, 1.0]);
    assert!(none.is_none() && tells(&translation, NoteKind::Approximated, "point inwards"));
}

#[test]
fn factors_beyond_their_range_are_brought_there() {
    let pbr = json!({ "baseColorFactor": [2, -1, 0.5, 1], "roughnessFactor": 3, "metallicFactor": 1 });
    let (material, translation) = made(json!({ "pbrMetallicRoughness": pbr }));
    assert_eq!((vector(&material["base_color"]), number(&material, "roughness")), (vec![1.0, 0.0, 0.5], 1.0));
    assert!(tells(&translation, NoteKind::Approximated, "the factor 2 of a material"));
}

#[test]
fn names_are_kept_and_told_apart() {
    let mut fixture = Fixture::made_of(json!({ "name": "a \"b\" ü" }));
    fixture.push("materials", json!({ "name": "a \"b\" ü" }));
    fixture.place(json!({ "attributes": { "POSITION": 0 }, "material": 1 }));
    let table = table(&fixture.translated());
    let names: Vec<&str> = table["materials"].as_table().unwrap().keys().map(String::as_str).collect();
    assert_eq!(names, ["a \"b\" ü", "a \"b\" ü_2"]);
}
