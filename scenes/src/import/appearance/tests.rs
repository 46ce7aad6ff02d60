use super::*;
use crate::import::mtl;

/// What is made of the statements of a material.
pub(crate) fn appearance(statements: &str) -> Appearance {
    let materials = mtl::parse(Path::new("a.mtl"), &format!("newmtl a\n{statements}")).unwrap();
    Appearance::of(&materials[0], &mut Images::default())
}

/// `name` of the model, and a word of each note.
#[track_caller]
fn check(statements: &str, name: &str, notes: &[&str]) -> Bsdf {
    let made = appearance(statements);
    let debug = format!("{:?}", made.bsdf);
    assert!(debug.starts_with(&format!("{name}(")), "{statements:?} became {debug}");
    assert_eq!(made.notes.len(), notes.len(), "{statements:?}: {:?}", made.notes);
    for (made, expected) in made.notes.iter().zip(notes) {
        assert!(made.1.contains(expected), "{statements:?}: {made:?} lacks {expected:?}");
    }
    made.bsdf
}

#[test]
fn the_rule_glass() {
    for statements in [
        "illum 7\nNi 1.5",
        "illum 6\nNi 1.5",
        "illum 4\nNi 1.5\nTf 1 1 1",
        "illum 9\nNi 1.5\nd 0.2\nd 0",
        "illum 2\nKd 0\nKs 1\nNs 10\nNi 1.5\nd 0\nTf 1",
        "illum 4\nTr 1\nNi 1.5",
    ] {
        let Bsdf::Dielectric(glass) = check(statements, "Dielectric", &[]) else { unreachable!() };
        assert_eq!(glass.eta, 1.5);
    }
    check("illum 7", "Dielectric", &["without an index Ni"]);
    check("illum 7\nNi 0", "Dielectric", &["Ni of 0 cannot be"]);
    check("illum 7\nNi 1.5\nTf 0.5 1 1", "Dielectric", &["Tf is taken as white"]);
    check("illum 2\nNi 1.5\nd 0.3", "Dielectric", &["partly opaque"]);
    // Exporters write `Tf 1 1 1` and an index for everything: alone they mean nothing.
    check("illum 2\nKd 0.5\nNi 1.5\nd 1\nTr 0\nTf 1 1 1", "Lambert", &[]);
    check("illum 4\nKd 0.5\nd 1", "Lambert", &[]);
    check("illum 2\nKd 0.5\nd 0.8", "Lambert", &[]);
    assert_eq!(appearance("illum 2\nKd 0.5\nd 0.8").opacity, Some(0.8));
}

#[test]
fn the_rule_mirror() {
    for statements in [
        "Kd 0\nKs 0.95\nNs 1000\nillum 5",
        "Kd 0\nKs 0.95\nillum 3",
        "Ks 0.95\nNs 1000",
        "Kd 0.01\nKs 0.95\nNs 10\nillum 5",
    ] {
        let notes: &[&str] = if statements.contains("0.01") { &["the weaker, Kd, is left out"] } else { &[] };
        let Bsdf::Mirror(mirror) = check(statements, "Mirror", notes) else { unreachable!() };
        assert_eq!(mirror.reflectance, Spectrum::splat(0.95));
    }
    check("Ks 1.5\nNs 1000", "Mirror", &["its Ks is above 1"]);
}

#[test]
fn the_rule_metal_and_matte() {
    check("Kd 0.5\nKs 0.9\nNs 40\nillum 2", "RoughConductor", &["Kd, is left out", "alpha 0.218"]);
    check("Ks 0.9\nNs 98", "RoughConductor", &["alpha 0.141"]);
    check("Kd 0.5\nKs 0.9\nillum 1", "Lambert", &[]);
    check("Kd 0.8\nKs 0.5\nNs 250\nillum 2", "Lambert", &["Ks, is left out"]);
    let Bsdf::Lambert(lambert) = check("Kd 0.1 0.2 0.3\nNs 10\nNi 1", "Lambert", &[]) else { unreachable!() };
    assert_eq!(lambert.albedo, Spectrum::new(0.1, 0.2, 0.3));
    let Bsdf::Lambert(lambert) = check("", "Lambert", &[]) else { unreachable!() };
    assert_eq!(lambert.albedo, Spectrum::splat(0.5));
    check("Kd 1.2 1 1", "Lambert", &["its Kd is above 1"]);
    check("Kd 1\nmap_Kd wood.png", "Lambert", &["its map_Kd `wood.png` is left out"]);
    check("Kd spectral a.rfl", "Lambert", &["`Kd spectral a.rfl` is not read"]);
}

/// What these programs write of everything that is matte and opaque.
#[test]
fn the_rule_of_common_exporters() {
    let albedo = |statements: &str, notes: &[&str]| {
        let Bsdf::Lambert(lambert) = check(statements, "Lambert", notes) else { unreachable!() };
        assert_eq!(appearance(statements).opacity, None, "{statements}");
        lambert.albedo
    };
    // Blender.
    let blender = "Ns 225\nKd 0.64 0 0\nKs 0.5 0.5 0.5\nNi 1.45\nd 1\nillum 2";
    assert_eq!(albedo(blender, &["the highlight, Ks, is left out"]), Spectrum::new(0.64, 0.0, 0.0));
    // MeshLab.
    for transparency in ["Tr 1", "Tr 0"] {
        let meshlab = format!("Kd 0.25\nKs 1 1 1\n{transparency}\nillum 2\nNs 0");
        let opaque: &[&str] = if transparency == "Tr 1" { &["is taken for opaque"] } else { &[] };
        let notes = [&["the highlight, Ks, is left out"], opaque].concat();
        assert_eq!(albedo(&meshlab, &notes), Spectrum::splat(0.25));
    }
    for illum in ["", "illum 0\n", "illum 1\n", "illum 2\n"] {
        albedo(&format!("{illum}Kd 0.7\nTr 1"), &["is taken for opaque"]);
    }
    // With a map the colour is kept whatever Ks is; a mirror and glass say that it is lost.
    let mapped = appearance("Kd 0\nKs 0.9\nNs 40\nillum 2\nmap_Kd k.png");
    assert!(matches!(mapped.bsdf, Bsdf::Lambert(_)), "{mapped:?}");
    for (lost, what) in [("Ks 0.9\nillum 3", "it is a metal"), ("illum 7\nNi 1.5", "it is glass")] {
        let told = appearance(&format!("{lost}\nmap_Kd k.png")).notes;
        assert!(told.iter().any(|(_, text)| text == &format!("its map_Kd `k.png` is left out: {what}")), "{told:?}");
    }
    // A transparency short of 1 is an opacity, and glass only where illum says so.
    assert_eq!(appearance("Kd 0.5\nTr 0.75\nillum 2").opacity, Some(0.25));
    check("Tr 0.75\nillum 4\nNi 1.5", "Dielectric", &["partly opaque"]);
}

#[test]
fn the_rule_emission() {
    assert_eq!(appearance("Ke 17 12 4").emission, Some(Spectrum::new(17.0, 12.0, 4.0)));
    assert_eq!(appearance("Ke 0 0 0").emission, None);
    assert_eq!(Appearance::of(&Statements::default(), &mut Images::default()).emission, None);
}
