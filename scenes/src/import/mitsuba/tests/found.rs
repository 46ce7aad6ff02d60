//! What scenes hold that others have written.

use super::*;

#[test]
fn triangles_without_texture_coordinates_have_their_barycentric_ones() {
    let bare = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";
    let checks = "<bsdf type=\"diffuse\"><texture name=\"reflectance\" type=\"checkerboard\"/></bsdf>";
    let shape = |inner: &str| {
        let body = format!("<shape type=\"obj\"><string name=\"filename\" value=\"m.obj\"/>{inner}</shape>");
        made_by("3.0.0", &body, &[("m.obj", bare)]).text
    };
    assert!(shape(checks).contains("corner_uvs = [[0.0, 1.0], [1.0, 1.0], [0.0, 0.0]]"), "{}", shape(checks));
    let unturned = format!("{checks}<boolean name=\"flip_tex_coords\" value=\"False\"/>");
    assert!(shape(&unturned).contains("corner_uvs = [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]]"));
    assert!(!shape("").contains("corner_uvs"));
}

#[test]
fn what_a_transform_flattens_is_left_out() {
    let flat = "<shape type=\"sphere\"><transform name=\"to_world\"><scale y=\"0\"/></transform></shape><shape type=\"disk\"/>";
    let told = notes(&made_of(flat), NoteKind::Approximated);
    assert!(told.contains(&"`shape sphere` that its transform flattens is left out".to_string()), "{told:?}");
    let still = "<shape type=\"sphere\"><transform name=\"to_world\"><rotate angle=\"0\"/></transform></shape>";
    assert!(notes(&made_of(still), NoteKind::Approximated).is_empty());
}

/// Before Mitsuba 2 the faces of an OBJ have the materials that are called as the file has them.
#[test]
fn old_meshes_have_a_material_for_each_name() {
    let mesh = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 1 1 0\nusemtl a\nf 1 2 3\nusemtl b\nf 2 4 3\n";
    let bsdf = |name: &str, value: f64| {
        format!(
            "<bsdf name=\"{name}\" type=\"diffuse\"><rgb name=\"reflectance\" value=\"{value} {value} {value}\"/></bsdf>"
        )
    };
    let body = |names: &[&str]| {
        let materials: String = names.iter().enumerate().map(|(i, name)| bsdf(name, 0.25 * (i + 1) as f64)).collect();
        format!("<shape type=\"obj\"><string name=\"filename\" value=\"m.obj\"/>{materials}</shape>")
    };
    let old = made_by("0.6.0", &body(&["a", "b", "c"]), &[("m.obj", mesh)]);
    assert_eq!(old.attachments.len(), 2, "{}", old.text);
    assert_eq!(old.text.matches("[[shapes]]").count(), 2);
    assert!(notes(&old, NoteKind::Approximated).is_empty(), "{:?}", old.notes);
    assert!(notes(&old, NoteKind::Ignored).contains(&"no faces of the file have the material `c`".to_string()));
    // Faces that no name means have the material without one, or what Mitsuba takes where none is given.
    let rest = made_by("0.6.0", &body(&["a", "c"]), &[("m.obj", mesh)]);
    assert_eq!(rest.text.matches("[[shapes]]").count(), 2, "{}", rest.text);
    let nameless = body(&["a", "c"]).replace("</shape>", "<bsdf type=\"dielectric\"/></shape>");
    let rest = made_by("0.6.0", &nameless, &[("m.obj", mesh)]);
    assert!(rest.text.matches("[[shapes]]").count() == 2 && rest.text.contains("\"dielectric\""), "{}", rest.text);
    assert!(notes(&rest, NoteKind::Approximated).is_empty(), "{:?}", rest.notes);
    let new = made_by("3.0.0", &body(&["a", "b"]), &[("m.obj", mesh)]);
    assert_eq!(new.text.matches("[[shapes]]").count(), 1);
    // What an OBJ says of materials is nothing to who has one for it.
    assert!(!notes(&new, NoteKind::Approximated).concat().contains("matte grey"), "{:?}", new.notes);
}

#[test]
fn what_is_animated_stands_where_it_begins() {
    let keys =
        "<transform time=\"1\"><translate x=\"5\"/></transform><transform time=\"0\"><translate y=\"2\"/></transform>";
    let shape =
        |keys: &str| format!("<shape type=\"rectangle\"><animation name=\"toWorld\">{keys}</animation></shape>");
    let moved = made_by("0.6.0", &shape(keys), &[]);
    let still =
        made_by("0.6.0", &shape(keys).replace("animation", "transform").replace(keys, "<translate y=\"2\"/>"), &[]);
    assert_eq!(moved.text, still.text);
    let told = notes(&moved, NoteKind::Approximated).concat();
    assert!(told.contains("nothing moves: what the `animation` says of time 0 holds"), "{told}");
    assert!(fault(&shape("").replace("toWorld", "to_world")).contains("the `animation` holds no `transform`"));
}
