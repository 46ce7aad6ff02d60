use super::{base, expect, load, replaced};

const DISK: &str =
    "[[shapes]]\ntype = \"disk\"\ncenter = [0, 2, 0]\nedge_u = [1, 0, 0]\nedge_v = [0, 0, 2]\nmaterial = \"white\"\n";
const TUBE: &str =
    "[[shapes]]\ntype = \"cylinder\"\nfrom = [0, 2, 0]\nto = [0, 3, 0]\nradius = 0.5\nmaterial = \"white\"\n";

#[test]
fn disks_and_cylinders_are_read() {
    let scene = load(&base(&format!("{DISK}transform = [{{ scale = [1, 2, 3] }}]\n{TUBE}flip = true\nemission = 2\n")))
        .unwrap();
    let counts = scene.counts();
    assert_eq!((counts.shapes, counts.spheres, counts.disks, counts.cylinders), (3, 1, 1, 1));
    assert_eq!(scene.needs.primitives, 3);
    let of = |shape: &str, from: &str, to: &str| base(&shape.replacen(from, to, 1));
    expect(
        &of(DISK, "[0, 0, 2]", "[3, 0, 0]"),
        "19: `shapes[1].edge_v` is `[3, 0, 0]`; `edge_u` and `edge_v` must span",
    );
    expect(&of(TUBE, "[0, 3, 0]", "[0, 2, 0]"), "18: `shapes[1].to` is `[0, 2, 0]`; it must differ from `from`");
    expect(&of(TUBE, "0.5", "0"), "19: `shapes[1].radius` is `0`; it must be above 0");
    expect(&of(TUBE, "radius", "radios"), "19: unknown key `radios` in `shapes[1]`; did you mean `radius`?");
    expect(
        &base(&format!("{TUBE}transform = [{{ scale = [1, 2, 1] }}]")),
        "21: `shapes[1].transform` is `[{ scale = [1, 2, 1] }]`; a cylinder must stay a cylinder",
    );
}

#[test]
fn what_shapes_emit_may_be_a_texture() {
    let emitting = |emission: &str| base(&format!("{DISK}emission = {emission}\n"));
    let scene = load(&emitting("{ checkerboard = [0, [1, 2, 3]], uv_scale = [2, 8] }")).unwrap();
    assert!(scene.needs.textures && scene.emitters.len() == 2);
    // Half of the disk's 2π m² emits 2 W/(m² sr) on the mean.
    let power = scene.emitters[0].power();
    let expected = 2.0 * std::f64::consts::PI.powi(2);
    assert!((power / expected - 1.0).abs() < 0.02, "{power} instead of {expected}");
    expect(
        &emitting("{ checkerboard = [0, -1] }"),
        "21: `shapes[1].emission` is `{ checkerboard = [0, -1] }`; light cannot be",
    );
    expect(
        &emitting("{ checkerboard = [0, 0] }"),
        "21: `shapes[1].emission` is `{ checkerboard = [0, 0] }`; an emitter must",
    );
    expect(
        &emitting("{ image = \"missing.png\" }"),
        "21: `shapes[1].emission.image` is `\"missing.png\"`; cannot read",
    );
    // Along the ellipse's long edge the ramp just stays above zero; over a ball of that size it would not.
    assert!(load(&emitting("{ ramp = { base = 1, slope = 0.9, axis = [1, 0, 0] } }")).is_ok());
    expect(&emitting("{ ramp = { base = 1, slope = 0.9, axis = [0, 0, 1] } }"), "15: the emission ramp falls to -0.79");
    let mesh = "[[shapes]]\ntype = \"mesh\"\nvertices = [[0, 0, 0], [1, 0, 0], [0, 1, 0]]\nfaces = [[0, 1, 2]]\nmaterial = \"white\"\n";
    for (emission, missing) in
        [("{ checkerboard = [0, 1] }", "texture coordinates"), ("{ vertex_colours = true }", "vertex colours")]
    {
        let message = load(&base(&format!("{mesh}emission = {emission}\n"))).unwrap_err().to_string();
        assert!(message.contains("the radiance of shapes[1] (a mesh)") && message.contains(missing), "{message}");
    }
}

#[test]
fn matrices_have_twelve_numbers_or_sixteen() {
    let with = |matrix: &str| {
        let text = replaced("radius = 1", &format!("radius = 1\ntransform = [{{ matrix = {matrix} }}]"));
        load(&text).map(|scene| (scene.origin.as_vec3() + scene.bounds.center, scene.bounds.radius))
    };
    let (center, radius) = with("[0,-2,0,5, 2,0,0,6, 0,0,2,7]").unwrap();
    assert!(center.distance(sampling::vec3(5.0, 6.0, 7.0)) < 1e-5 && (radius - 2.0).abs() < 1e-5);
    assert_eq!(with("[0,-2,0,5, 2,0,0,6, 0,0,2,7, 0,0,0,1]").unwrap(), (center, radius));
    for (matrix, mend) in [
        ("[1,0,0,0, 0,1,0,0, 0,0,1,0, 0,0,0,2]", "its last row must be 0, 0, 0, 1"),
        ("[1,0,0,0, 0,1,0,0, 1,1,0,0]", "it flattens the shape"),
        ("[1,0,0,0]", "12 or 16 numbers"),
    ] {
        let message = with(matrix).unwrap_err().to_string();
        assert!(message.contains(mend), "{message}");
    }
}
