//! What scattering models become.

use super::*;

/// A ball of this material; its table as it is written.
fn material(bsdf: &str) -> (String, Vec<String>) {
    material_by("3.0.0", bsdf)
}

fn material_by(version: &str, bsdf: &str) -> (String, Vec<String>) {
    let translation = made_by(version, &format!("<shape type=\"sphere\">{bsdf}</shape>"), &[]);
    translation.read("a", Path::new("."), None).unwrap().build(Skip::Unneeded).unwrap();
    let from = translation.text.find("[materials").unwrap();
    let to = translation.text.find("[[shapes]]").unwrap();
    (translation.text[from..to].trim().to_string(), notes(&translation, NoteKind::Approximated))
}

#[track_caller]
fn check(bsdf: &str, expected: &str, approximations: usize) {
    let two_sided = format!("<bsdf type=\"twosided\" id=\"m\">{bsdf}</bsdf>");
    let (text, notes) = material(&two_sided);
    assert_eq!(text, format!("[materials.m]\n{expected}"), "{notes:?}");
    assert_eq!(notes.len(), approximations, "{notes:?}");
}

#[test]
fn matte_and_mirrors() {
    check("<bsdf type=\"diffuse\"/>", "type = \"lambert\"\nalbedo = 0.5", 0);
    let rgb = "<rgb name=\"reflectance\" value=\"0.1, 0.2 0.3\"/>";
    check(&format!("<bsdf type=\"diffuse\">{rgb}</bsdf>"), "type = \"lambert\"\nalbedo = [0.1, 0.2, 0.3]", 0);
    let hex = "<rgb name=\"reflectance\" value=\"#ff0000\"/>";
    check(&format!("<bsdf type=\"diffuse\">{hex}</bsdf>"), "type = \"lambert\"\nalbedo = [1.0, 0.0, 0.0]", 0);
    check("<bsdf type=\"conductor\"/>", "type = \"mirror\"\nreflectance = 1.0", 0);
    let gold = "<bsdf type=\"conductor\"><string name=\"material\" value=\"Au\"/></bsdf>";
    let index = "eta = [0.143036, 0.375307, 1.44205]\nk = [3.983, 2.38556, 1.60336]";
    check(gold, &format!("type = \"conductor\"\n{index}"), 0);
    check(
        &gold.replace("Au", "gold"),
        "type = \"conductor\"\neta = [4.36967, 2.91651, 1.6549]\nk = [5.20655, 4.23131, 3.7547]",
        1,
    );
    check("<bsdf type=\"null\"/>", "type = \"null\"", 0);
}

#[test]
fn what_reflects_without_twosided_is_black_from_behind() {
    let sided = |bsdf: &str| {
        let (text, notes) = material(bsdf);
        assert!(notes.is_empty(), "{notes:?}");
        text
    };
    let grey = "<bsdf type=\"diffuse\" id=\"m\"/>";
    let front = "[materials.m_front]\ntype = \"lambert\"\nalbedo = 0.5\n\n";
    let whole = "[materials.m]\ntype = \"sided\"\nfront = \"m_front\"";
    assert_eq!(sided(grey), format!("{front}{whole}"));
    let usual = format!("{front}{whole}").replace("\nalbedo = 0.5", "");
    assert_eq!(sided(""), usual.replace("materials.m", "materials.default").replace("\"m", "\"default"));
    // What is black anyway, and what light goes through, need no sides.
    let black = "<bsdf type=\"diffuse\" id=\"m\"><rgb name=\"reflectance\" value=\"0\"/></bsdf>";
    assert_eq!(sided(black), "[materials.m]\ntype = \"lambert\"\nalbedo = 0.0");
    assert!(!sided("<bsdf type=\"dielectric\"/>").contains("sided"));
    // A mask is for both sides, a map for the one that there is.
    let over = |kind: &str, own: &str| {
        let inner = grey.replace(" id=\"m\"", "");
        format!("<bsdf type=\"{kind}\" id=\"m\">{own}{inner}</bsdf>")
    };
    let mask = over("mask", "<float name=\"opacity\" value=\"0.3\"/>");
    assert_eq!(sided(&mask), format!("{front}{whole}\nopacity = 0.3"));
    let bump = material(&over("bumpmap", "<texture type=\"checkerboard\"/>")).0;
    assert!(bump.contains("albedo = 0.5\nbump_map = ") && bump.ends_with(whole), "{bump}");
    let blend = "<bsdf type=\"blendbsdf\" id=\"m\"><bsdf type=\"diffuse\"/><bsdf type=\"conductor\"/></bsdf>";
    let text = sided(blend);
    assert!(text.contains("[materials.m_front]\ntype = \"mix\"") && text.ends_with(whole), "{text}");
    assert!(material_by("0.6.0", "<bsdf type=\"phong\" id=\"m\"/>").0.ends_with(whole));
}

#[test]
fn twosided_may_have_two_materials() {
    let two = |front: &str, back: &str| {
        let sides = format!("<bsdf type=\"{front}\"/><bsdf type=\"{back}\"/>");
        material(&format!("<bsdf type=\"twosided\" id=\"m\">{sides}</bsdf>"))
    };
    let (text, notes) = two("diffuse", "conductor");
    let front = "[materials.m_front]\ntype = \"lambert\"\nalbedo = 0.5";
    let back = "[materials.m_back]\ntype = \"mirror\"\nreflectance = 1.0";
    let whole = "[materials.m]\ntype = \"sided\"\nfront = \"m_front\"\nback = \"m_back\"";
    assert_eq!(text, format!("{front}\n\n{back}\n\n{whole}"));
    assert!(notes.is_empty(), "{notes:?}");
    let (text, notes) = two("diffuse", "dielectric");
    assert_eq!(text, front.replace("_front", ""));
    assert_eq!(notes.len(), 1, "{notes:?}");
}

#[test]
fn glass_and_metal() {
    let eta = 1.5046 / 1.000_277;
    check("<bsdf type=\"dielectric\"/>", &format!("type = \"dielectric\"\neta = {eta:?}"), 0);
    let water = "<string name=\"int_ior\" value=\"water\"/><float name=\"ext_ior\" value=\"1\"/>";
    check(&format!("<bsdf type=\"thindielectric\">{water}</bsdf>"), "type = \"thin_glass\"\neta = 1.333", 0);
    let rough = "<float name=\"alpha\" value=\"0.2\"/><string name=\"distribution\" value=\"ggx\"/>";
    check(
        &format!("<bsdf type=\"roughdielectric\">{water}{rough}</bsdf>"),
        "type = \"rough_dielectric\"\neta = 1.333\ndistribution = \"ggx\"\nmasking = \"separable\"\nalpha = 0.2",
        0,
    );
    let index = "<rgb name=\"eta\" value=\"0.2 0.9 1.1\"/><rgb name=\"k\" value=\"3.9 2.4 2.1\"/>";
    let metal = "masking = \"separable\"\nalpha_x = 0.1\nalpha_y = 0.3\neta = [0.2, 0.9, 1.1]\nk = [3.9, 2.4, 2.1]";
    let along = "<float name=\"alpha_u\" value=\"0.1\"/><float name=\"alpha_v\" value=\"0.3\"/>";
    for (distribution, said, notes) in
        [("beckmann", "", 1), ("ggx", "<string name=\"distribution\" value=\"ggx\"/>", 0)]
    {
        check(
            &format!("<bsdf type=\"roughconductor\">{index}{along}{said}</bsdf>"),
            &format!("type = \"rough_conductor\"\ndistribution = \"{distribution}\"\n{metal}"),
            notes,
        );
    }
}

#[test]
fn factors_of_mirror_images_tint_what_does_not_vary() {
    let metal = |factor: &str| {
        let index = "<rgb name=\"eta\" value=\"1\"/><rgb name=\"k\" value=\"2\"/>";
        let factor = format!("<rgb name=\"specular_reflectance\" value=\"{factor}\"/>");
        material(&format!("<bsdf type=\"twosided\" id=\"m\"><bsdf type=\"conductor\">{index}{factor}</bsdf></bsdf>"))
    };
    let (text, notes) = metal("0.4 0.6 0.8");
    let whole = "[materials.m_untinted]\ntype = \"conductor\"\neta = 1.0\nk = 2.0";
    let tinted = "[materials.m]\ntype = \"tinted\"\nof = \"m_untinted\"\nreflection = [0.4, 0.6, 0.8]";
    assert_eq!(text, format!("{whole}\n\n{tinted}"));
    assert!(notes.is_empty());
    let glass = "<bsdf type=\"dielectric\" id=\"m\"><rgb name=\"specular_transmittance\" value=\"0.5\"/></bsdf>";
    let (text, notes) = material(glass);
    assert!(text.ends_with("type = \"tinted\"\nof = \"m_untinted\"\ntransmission = 0.5") && notes.is_empty(), "{text}");
    // What varies is dimmed by black patches, which have no hue.
    let rough = |factor: &str| {
        let alpha = "<texture name=\"alpha\" type=\"checkerboard\"/>";
        let factor = format!("<rgb name=\"specular_reflectance\" value=\"{factor}\"/>");
        material(&format!(
            "<bsdf type=\"twosided\" id=\"m\"><bsdf type=\"roughconductor\">{alpha}{factor}</bsdf></bsdf>"
        ))
    };
    let (text, notes) = rough("0.5");
    assert!(text.ends_with("first = \"m_untinted\"\nsecond = \"black\"\namount = 0.5"), "{text}");
    let (text, more) = rough("0.25 0.5 0.75");
    assert!(text.ends_with("amount = 0.5") && more.len() == notes.len() + 1, "{text}");
}

#[test]
fn coats_reflect_within_what_mitsubas_do() {
    let coat = |kind: &str, more: &str| {
        let rgb = "<rgb name=\"diffuse_reflectance\" value=\"0.2\"/><float name=\"int_ior\" value=\"1.5\"/>";
        let ext = "<float name=\"ext_ior\" value=\"1\"/>";
        let (text, notes) = material(&format!("<bsdf type=\"{kind}\" id=\"m\">{rgb}{ext}{more}</bsdf>"));
        let table: toml::Table = text.parse().unwrap();
        let table = table["materials"]["m_front"].as_table().unwrap().clone();
        (
            table["internal_reflectance"].as_float().unwrap(),
            table["interreflection"].as_str().unwrap().to_string(),
            notes,
        )
    };
    // As quadrature has it, to the error of the fit.
    let inside = 1.0 - f64::from(sampling::bsdf::diffuse_transmittance(1.5)) / 2.25;
    let (reflected, kind, notes) = coat("plastic", "");
    assert!((reflected - inside).abs() < 1e-3 && kind == "white" && notes.is_empty(), "{reflected} {inside} {notes:?}");
    assert_eq!(coat("plastic", "<boolean name=\"nonlinear\" value=\"true\"/>").1, "coloured");
    let (reflected, _, notes) = coat("roughplastic", "<string name=\"distribution\" value=\"ggx\"/>");
    assert!(reflected < inside && reflected > 0.5 && notes.is_empty(), "{reflected} {notes:?}");
    assert_eq!(coat("roughplastic", "").2.len(), 1);
}

#[test]
fn older_models() {
    let (text, notes) =
        material_by("0.6.0", "<bsdf type=\"phong\" id=\"m\"><float name=\"exponent\" value=\"9\"/></bsdf>");
    assert!(text.starts_with("[materials.m_front]\ntype = \"phong\"\nkd = 0.5\nks = 0.2\nn = 9.0"), "{text}");
    assert!(notes.is_empty(), "{notes:?}");
    let ward = "<bsdf type=\"ward\" id=\"m\"><float name=\"alphaU\" value=\".1\"/><float name=\"alphaV\" value=\".2\"/>\
                <spectrum name=\"specularReflectance\" value=\"0.3\"/></bsdf>";
    let (text, _) = material_by("0.6.0", ward);
    let expected = "[materials.m_front]\ntype = \"ward\"\nkd = 0.5\nks = 0.3\nalpha_x = 0.1\nalpha_y = 0.2";
    assert!(text.starts_with(expected), "{text}");
    // What would create light is scaled down.
    let bright = "<bsdf type=\"phong\" id=\"m\"><rgb name=\"diffuseReflectance\" value=\"1\"/>\
                  <rgb name=\"specularReflectance\" value=\"1\"/></bsdf>";
    assert!(material_by("0.5.0", bright).0.contains("kd = 0.5\nks = 0.5\nn = 30.0"));
    let usual = "<bsdf type=\"conductor\" id=\"m\"/>";
    assert!(material_by("0.6.0", usual).0.contains("k = [3.91326, 2.45305, 2.14209]\n\n"));
}

#[test]
fn layers_and_blends() {
    let mask = "<bsdf type=\"mask\"><float name=\"opacity\" value=\"0.3\"/><bsdf type=\"diffuse\"/></bsdf>";
    check(mask, "type = \"lambert\"\nalbedo = 0.5\nopacity = 0.3", 0);
    let bump = "<bsdf type=\"bumpmap\"><float name=\"scale\" value=\"2\"/><texture type=\"checkerboard\">\
                <rgb name=\"color0\" value=\"0\"/><rgb name=\"color1\" value=\"1\"/></texture><bsdf type=\"diffuse\"/></bsdf>";
    let map = "{ checkerboard = [0.0, 2.0], uv_scale = [1.0, -1.0], uv_offset = [0.0, 1.0] }";
    // Either side of a `twosided` rises, but what a map over one raises on the front is a dent of the back.
    let in_relief = |bsdf: &str, more: &str| {
        let (text, notes) = material(bsdf);
        assert!(notes.is_empty(), "{notes:?}");
        let front = format!("type = \"lambert\"\nalbedo = 0.5\nbump_map = {map}{more}");
        let sided = "[materials.m]\ntype = \"sided\"\nfront = \"m_front\"";
        let is_sided = text.starts_with(&format!("[materials.m_front]\n{front}\n\n{sided}"));
        assert!(is_sided || text == format!("[materials.m]\n{front}"), "{text}");
        text.lines().filter(|line| line.starts_with("back") || line.contains("sided")).count()
    };
    let twosided = |inner: &str| format!("<bsdf type=\"twosided\" id=\"m\">{inner}</bsdf>");
    assert_eq!(in_relief(&twosided(bump), ""), 2);
    let over = bump.replace("<bsdf type=\"bumpmap\">", "<bsdf type=\"bumpmap\" id=\"m\">");
    assert_eq!(in_relief(&over, ""), 1);
    let diffuse = "<bsdf type=\"diffuse\"/>";
    assert_eq!(in_relief(&over.replace(diffuse, &twosided(diffuse).replace(" id=\"m\"", "")), ""), 0);
    let both = format!("{diffuse}<bsdf type=\"conductor\"/>");
    let (text, _) = material(&over.replace(diffuse, &twosided(&both).replace(" id=\"m\"", "")));
    assert!(text.contains(&map.replace("[0.0, 2.0]", "[-0.0, -2.0]")), "{text}");
    for (turning, shadowing, expected) in [
        ("true", "false", "\nrelief = \"turned\""),
        ("false", "true", "\nrelief = \"shadowed\""),
        ("false", "false", "\nrelief = \"plain\""),
        ("true", "true", ""),
    ] {
        let flags = format!(
            "<bsdf type=\"bumpmap\"><boolean name=\"flip_invalid_normals\" value=\"{turning}\"/>\
             <boolean name=\"use_shadowing_function\" value=\"{shadowing}\"/>"
        );
        in_relief(&twosided(&bump.replace("<bsdf type=\"bumpmap\">", &flags)), expected);
    }
    let blend = "<bsdf type=\"blendbsdf\" id=\"m\"><float name=\"weight\" value=\"0.25\"/>\
                 <bsdf type=\"twosided\"><bsdf type=\"diffuse\"/></bsdf><bsdf type=\"dielectric\"/></bsdf>";
    let (text, notes) = material(blend);
    assert!(text.ends_with("type = \"mix\"\nfirst = \"m_part1\"\nsecond = \"m_part2\"\namount = 0.25"), "{text}");
    assert!(notes.is_empty(), "{notes:?}");
    let squares = "<bsdf type=\"diffuse\"><texture name=\"reflectance\" type=\"checkerboard\"/></bsdf></bsdf>";
    let (text, notes) = material(&blend.replace("<bsdf type=\"dielectric\"/></bsdf>", squares));
    let left_out = notes.iter().any(|note| note.contains("left out"));
    assert!(text.contains("albedo = { checkerboard") && !left_out, "{text} {notes:?}");
    // From behind, one part of the two is black.
    let back = "[materials.m_back]\ntype = \"mix\"\nfirst = \"m_part1\"\nsecond = \"black\"\namount = 0.25";
    assert!(text.contains(back) && text.ends_with("front = \"m_front\"\nback = \"m_back\""), "{text}");
    let three = "<bsdf type=\"mixturebsdf\" id=\"m\"><string name=\"weights\" value=\"0.2, 0.3, 0.5\"/>\
                 <bsdf type=\"diffuse\"/><bsdf type=\"diffuse\"/><bsdf type=\"dielectric\"/></bsdf>";
    let (text, _) = material_by("0.6.0", three);
    assert!(text.contains("first = \"m_part1\"\nsecond = \"m_part2\"\namount = 0.6"), "{text}");
    assert!(text.ends_with("first = \"m_mix1\"\nsecond = \"m_part3\"\namount = 0.5"), "{text}");
}

#[test]
fn principled_says_all_that_it_is() {
    let (text, notes) = material(
        "<bsdf type=\"principled\" id=\"m\"><float name=\"roughness\" value=\"0.3\"/>\
                                  <float name=\"specular\" value=\"0.5\"/></bsdf>",
    );
    let table: toml::Table = text.parse().unwrap();
    let number = |key: &str| table["materials"]["m_front"][key].as_float().unwrap();
    assert_eq!((number("roughness"), number("sheen_tint"), number("clearcoat_gloss")), (0.3, 0.0, 0.0));
    // F₀ = 0.04 is an index of 1.5.
    assert!((number("eta") - 1.5).abs() < 1e-12);
    assert!(notes.is_empty(), "{notes:?}");
    // Tints have a luminance of 1.
    let tinted = "<bsdf type=\"principled\" id=\"m\"><float name=\"spec_tint\" value=\"1\"/></bsdf>";
    let (tinted, notes) = material(tinted);
    let is_said = |text: &str| text.contains("tints = \"luminance\"");
    assert!(is_said(&tinted) && !is_said(&text) && notes.is_empty(), "{tinted} {notes:?}");
}

#[test]
fn what_is_passed_is_told_where_the_series_ends_and_counts_otherwise() {
    let mask = "<shape type=\"disk\"><bsdf type=\"mask\"><float name=\"opacity\" value=\"0.5\"/><bsdf type=\"diffuse\"/></bsdf></shape>";
    let null = "<shape type=\"disk\"><bsdf type=\"null\"/></shape>";
    let told = |kind: &str, depth: &str, shape: &str| {
        let integrator =
            format!("<integrator type=\"{kind}\"><integer name=\"max_depth\" value=\"{depth}\"/></integrator>");
        let text = format!("<scene version=\"3.0.0\">{integrator}{SENSOR}{shape}</scene>");
        notes(&open(&folder(&[("a.xml", &text)])).unwrap(), NoteKind::Approximated).concat()
    };
    assert!(told("path", "6", mask).contains("where Mitsuba counts it towards `max_depth`"));
    assert!(told("volpath", "6", null).contains("where Mitsuba does not count it towards `max_depth`"));
    for exact in [told("path", "-1", mask), told("path", "6", null), told("volpath", "6", mask)] {
        assert!(exact.is_empty(), "{exact}");
    }
}

#[test]
fn what_is_under_a_coat_is_kept() {
    let coated =
        "<bsdf type=\"coating\" id=\"m\"><float name=\"thickness\" value=\"2\"/><bsdf type=\"dielectric\"/></bsdf>";
    let (text, notes) = material(coated);
    assert!(
        text.contains("type = \"dielectric\"") && notes.concat().contains("the coat of a `coating` is left out"),
        "{text} {notes:?}"
    );
    let (text, notes) =
        material("<bsdf type=\"difftrans\" id=\"m\"><rgb name=\"transmittance\" value=\"0.5 0.5 0.5\"/></bsdf>");
    assert!(
        text.contains("type = \"diffuse_transmission\"\nreflectance = 0.0\ntransmittance = 0.5") && notes.is_empty(),
        "{text} {notes:?}"
    );
}
