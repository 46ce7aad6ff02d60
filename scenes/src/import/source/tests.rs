use super::*;

fn fault(text: &str) -> String {
    match prepare(Path::new("a.obj"), text) {
        Ok(_) => panic!("no error for {text:?}"),
        Err(error) => error.to_string(),
    }
}

#[test]
fn errors_name_file_line_and_mend() {
    let vertices = "v 0 0 0\nv 1 0 0\nv 0 1 0\n";
    let cases = [
        ("f 1 2 7", "a.obj:4: there is no vertex 7; the file defines 3, counted from 1"),
        ("f 1 2 0", "a.obj:4: there is no vertex 0; the file defines 3, counted from 1"),
        ("f 1 2 -4", "a.obj:4: there is no vertex -4; 3 of 3 are defined before this line, so -3 is the lowest"),
        (
            "f 1/1 2/1 3/1",
            "a.obj:4: there is no texture coordinate 1; the file defines none; add `vt` lines or leave the index out",
        ),
        ("f 1//2 2//2 3//2\nvn 0 0 1", "a.obj:4: there is no normal 2; the file defines 1, counted from 1"),
        ("f 1 2", "a.obj:4: the face `f 1 2` has 2 corners; a face has at least 3"),
        ("f 1 2 x", "a.obj:4: the vertex index `x` is not a whole number; give one"),
        (
            "f 1 2 99999999999999999999",
            "a.obj:4: the vertex index `99999999999999999999` is not a whole number; give one",
        ),
        ("f 1 2 3/1/1/1", "a.obj:4: there is no texture coordinate 1"),
        ("f 1 2 /1", "a.obj:4: the corner `/1` names no vertex"),
        ("v 0 NaN 0", "a.obj:4: a vertex holds `NaN`; give a finite number, at most 1e15 in magnitude"),
        ("v 0 1e999 0", "a.obj:4: a vertex holds `1e999`; give a finite number"),
        ("v 0 zero 0", "a.obj:4: a vertex holds `zero`; give a number"),
        ("v 0 1", "a.obj:4: `v 0 1` has 2 numbers; a vertex needs 3"),
        ("usemtl", "a.obj:4: `usemtl` names no material; add its name"),
    ];
    for (bad, expected) in cases {
        let message = fault(&format!("{vertices}{bad}\n"));
        assert!(message.starts_with(expected), "{bad}: {message}");
    }
}

#[test]
fn what_is_odd_is_read_as_it_is_meant() {
    let text = "\tv 0 0 0 1 0 0 # red\nv 1 0 0\nv 0 1 \\\n 0\nvn 0 0 1\nf -3 -2//1 \\\n -1\nusemtl\ta b\nl 1 2\n";
    let source = prepare(Path::new("a.obj"), text).unwrap();
    assert_eq!(source.positions, [DVec3::ZERO, DVec3::X, DVec3::Y]);
    assert_eq!(source.normals, [DVec3::Z]);
    assert_eq!(source.corners, [vec![1, 2, 3], vec![], vec![0, 1, 0]]);
    assert_eq!(source.marks, [(1, Mark::Material("a b".to_owned()))]);
    assert_eq!(source.materials["a b"], 8);
    assert_eq!(source.ignored["l"], (9, 1));
    assert_eq!(source.ignored["vertex colours"], (1, 1));
}

#[test]
fn long_texts_are_read_in_pieces_as_if_at_once() {
    let mut text = String::new();
    let count = 40_000;
    for i in 0..count {
        // A line that goes on stands at many places where a piece could end.
        text += &format!("v {i} \\\n{i} 0\nv {i} 1 0\nv 0 {i} 1\ng {}\nf -3 -2 -1\n", i / 9);
    }
    assert!(cut(&text).len() > 4);
    assert_eq!(cut(&text).concat(), text);
    let source = prepare(Path::new("a.obj"), &text).unwrap();
    assert_eq!((source.positions.len(), source.arities.len()), (3 * count, count));
    assert!(source.positions.iter().step_by(3).enumerate().all(|(i, p)| *p == DVec3::new(i as f64, i as f64, 0.0)));
    assert!(source.corners[0].iter().enumerate().all(|(i, corner)| *corner == i as u32 + 1));
    assert!(source.marks.iter().enumerate().all(|(i, mark)| *mark == (i, Mark::Group((i / 9).to_string()))));
    let lines = text.lines().count();
    let message = fault(&(text + "f 1 2 z\n"));
    assert!(message.starts_with(&format!("a.obj:{}: the vertex index `z`", lines + 1)), "{message}");
}

#[test]
fn other_encodings() {
    let latin = decode(Path::new("a.obj"), b"# caf\xe9\nv 0 0 0\n".to_vec()).unwrap();
    assert!(latin.ends_with("v 0 0 0\n"));
    for bytes in [&b"\xff\xfev\0 \0"[..], b"v 0 0 0\n\0\0"] {
        let message = decode(Path::new("a.obj"), bytes.to_vec()).unwrap_err().to_string();
        assert!(message.contains("this is not a plain text file; save it as UTF-8"), "{message}");
    }
}
