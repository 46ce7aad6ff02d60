//! Expressions by hand: what is read, what is refused and where, what the algebra decides.

mod random;

use super::*;

fn parse(text: &str) -> Expression {
    Expression::parse(text).unwrap_or_else(|e| panic!("{e}"))
}

fn any_scene(texts: &[&str]) -> Classifier {
    let expressions: Vec<Expression> = texts.iter().map(|text| parse(text)).collect();
    Classifier::for_any_scene(&expressions).unwrap()
}

/// Whether two expressions have the same paths.
fn same(a: &str, b: &str) -> bool {
    let classifier = any_scene(&[a, b]);
    classifier.from_camera.accepts.iter().all(|&classes| classes == 0 || classes == 3)
}

#[test]
fn one_set_of_paths_is_written_in_many_ways() {
    for (a, b) in [
        ("CD+L", "C D D* L"),
        ("C.*L", "L(D|S)*E"),
        ("C[DG]+S+L", "LS+D+E"),
        ("C(R|T|V)L", "C.L"),
        ("C[^D]L", "C(G|S)L"),
        ("C<RD>L", "C<R.D>L"),
        ("C<[RT]S>?L", "C(<RS>|<TS>){0,1}L"),
        ("C'a'L", "C<.'a'>L"),
        ("C\"a\"L", "C'a'L"),
        ("C[^'a''b']L", "C[^['a''b']]L"),
        ("C<R[^'a']>L", "C[^[TV]'a']L"),
        ("C.L'key'", "C.<L.'key'>"),
        ("CL", "C[L'key'[^L'key']]"),
        ("CD{2,4}L", "CDD(DD?)?L"),
        ("CD{2,}L", "CDDD*L"),
        ("C(D{2}){3}L", "CD{6}L"),
        ("CD{0,2}L", "C(D|DD)?L"),
        ("L.*SE", "CS.*L"),
        ("(CDL)|(CSL)", "C[DS]L"),
        ("C D\tL\n", "CDL"),
        ("L(D|S)(D|S)+E", "C..+L"),
        ("C[^<RD'a'>]L", "C[[^<RD>][^'a']]L"),
    ] {
        assert!(same(a, b), "{a} and {b}");
        assert!(!same(a, "CDDDDDDDGL"), "{a}");
    }
    assert!(!same("C'a'L", "C'b'L"));
    assert!(!same("LDE", "CDL"), "the lecture's D is glossy as well");
}

#[test]
fn expressions_are_shown_as_written() {
    let expression = parse(" C <RD'floor'>.* L\"Schlüssel\" ");
    assert_eq!(expression.to_string(), " C <RD'floor'>.* L\"Schlüssel\" ");
    assert_eq!(expression.names().collect::<Vec<_>>(), ["floor", "Schlüssel"]);
    assert_eq!(expression.notation(), Notation::Production);
    assert_eq!(parse("L(D|S)*E").notation(), Notation::Lecture);
    assert_eq!(parse("C'E'L").notation(), Notation::Production);
}

#[test]
fn orders_are_counted() {
    for (text, least, most) in [
        ("CL", 0, Some(0)),
        ("C.*L", 0, None),
        ("CD+SL", 2, None),
        ("CD{2,4}(S|TT)?L", 2, Some(6)),
        ("L(D|S)(D|S)+E", 2, None),
        ("CL|CDDL", 0, Some(2)),
    ] {
        assert_eq!(parse(text).orders(), (least, most), "{text}");
    }
}

/// What is said, and the column of the caret.
fn refused(text: &str) -> (String, usize) {
    match Expression::parse(text) {
        Ok(_) => panic!("`{text}` was read"),
        Err(error) => (error.message().to_owned(), error.column()),
    }
}

#[test]
fn faults_are_told_at_their_place_with_the_mend() {
    for (text, column, words) in [
        ("", 0, "there is no expression"),
        ("  ", 0, "there is no expression"),
        ("DL", 0, "write `C` before this"),
        ("L", 0, "write `C` before this"),
        ("C", 1, "write `L` at the end"),
        ("CD", 2, "write `L` at the end"),
        ("CDL?", 4, "write `L` at the end"),
        ("CDCL", 2, "leave this `C` out"),
        ("C+L", 0, "leave this `C` out"),
        ("C?DL", 2, "write `C` before this"),
        ("CDLD", 3, "write `L` last of all"),
        ("CL+", 1, "write `L` last of all"),
        ("C(D|L)L", 6, "write `L` last of all"),
        ("C(D|L)", 6, "write `L` at the end"),
        ("D.*E", 0, "every path begins at a light: write `L`"),
        ("LDS", 0, "write `C` before this"),
        ("CDE", 2, "write one of `C` and `E`"),
        ("LGE", 1, "from the camera `C` to `L`"),
        ("L<D>E", 1, "from the camera `C` to `L`"),
        ("LxE", 1, "the lecture's notation"),
        ("CXL", 1, "`X` is no vertex"),
        ("CdL", 1, "write `D`"),
        ("C*DL", 0, "leave this `C` out"),
        ("*", 0, "here nothing does"),
        ("CD**L", 3, "put what the first one repeats in ( )"),
        ("CD{2}?L", 5, "put what the first one repeats in ( )"),
        ("CD{}L", 3, "a number is missing"),
        ("CD{2L", 4, "should be closed"),
        ("CD{0}L", 2, "leave it out"),
        ("CD{3,2}L", 2, "write `{2,3}`"),
        ("CD{1,1000000}L", 5, "at most"),
        ("CD{99999999999999999999999}L", 3, "at most"),
        ("C(DL", 1, "write `)`"),
        ("CD)L", 2, "closes nothing"),
        ("C(|D)L", 2, "written with `?`"),
        ("C()L", 2, "written with `?`"),
        ("CL|", 3, "written with `?`"),
        ("C<RTL", 3, "no vertex is this"),
        ("C<RDL>", 4, "a light is a vertex of its own"),
        ("C<RD", 1, "never closed"),
        ("C<>L", 1, "nothing is said"),
        ("C[]L", 1, "this set is empty"),
        ("C[D", 1, "never closed"),
        ("C[^.]L", 1, "leaves no vertex"),
        ("C[DL]", 3, "not both"),
        ("C[C]L", 2, "the camera stands alone"),
        ("C<D|S>L", 3, "write `[ ]` for a choice"),
        ("C>L", 1, "closes nothing"),
        ("C^DL", 1, "as in `[^'floor']`"),
        ("C'floorL", 1, "write ' where it ends"),
        ("C''L", 1, "at least one character"),
        ("C'a''b'DL'c'd", 12, "write `D`"),
        ("C'fußboden'XL", 11, "`X` is no vertex"),
        ("C'日本'XL", 7, "`X` is no vertex"),
        ("C'e\u{301}'XL", 4, "`X` is no vertex"),
    ] {
        let (message, at) = refused(text);
        assert!(message.contains(words), "`{text}`: {message}");
        assert_eq!(at, column, "`{text}`: {message}");
    }
}

#[test]
fn the_caret_stands_under_the_place() {
    let error = Expression::parse("C<RD>X L").unwrap_err().to_string();
    let lines: Vec<&str> = error.lines().collect();
    assert_eq!(lines[1..], ["  C<RD>X L", "       ^"]);
    // Of a long text only what is near; white space and control characters are blanks.
    let long = format!("C{}\n\u{7}X{}L", "D".repeat(200), "S".repeat(200));
    let error = Expression::parse(&long).unwrap_err();
    let text = error.to_string();
    let lines: Vec<&str> = text.lines().collect();
    assert_eq!(lines.len(), 3, "{text}");
    assert_eq!(lines[1].chars().nth(2 + error.column()), Some('\u{20}'), "{text}");
}

#[test]
fn nothing_blows_up() {
    let deep = |n: usize| format!("C{}D{}L", "(".repeat(n), ")".repeat(n));
    assert!(refused(&deep(1000)).0.contains("nested"));
    parse(&deep(MAX_DEPTH));
    assert!(refused(&format!("C{}L", "<".repeat(2000))).0.contains("nested"));
    assert!(refused(&"C".repeat(10_000_000)).0.contains("bytes long"));
    assert!(refused("C((D{1000}){1000}){1000}L").0.contains("written out"));
    assert!(refused(&format!("C{}L", "(".repeat(60) + "D" + &"){1000}".repeat(60))).0.contains("written out"));
    assert!(
        refused(&format!("C[{}]L", (0..100).map(|i| format!("'{i}'")).collect::<String>())).0.contains("alternatives")
    );
    assert!(refused(&format!("C{}L", (0..200).map(|i| format!("'{i}'")).collect::<String>())).0.contains("names"));
    // Two to the thirtieth states.
    let doubling = [parse("C.*D.{30}L")];
    assert!(matches!(Classifier::for_any_scene(&doubling), Err(LpeError::TooLarge { what: "states", .. })));
    let reversed = [parse("C.{30}D.*L")];
    assert!(matches!(Classifier::for_any_scene(&reversed), Err(LpeError::TooLarge { what: "states", .. })));
    let many = vec![parse("CL"); MAX_EXPRESSIONS + 1];
    assert_eq!(Classifier::for_any_scene(&many).unwrap_err(), LpeError::Expressions(65));
    let long = [parse("CD{0,1000}S{0,1000}L")];
    match Classifier::for_any_scene(&long) {
        Ok(classifier) => assert!(classifier.states().0 <= MAX_STATES),
        Err(error) => assert!(matches!(error, LpeError::TooLarge { .. }), "{error}"),
    }
    // As many names as there can be, in one set each.
    let text = |i: usize| format!("C.*<R'{i}'>.*L'l{i}'");
    let expressions: Vec<Expression> = (0..MAX_EXPRESSIONS).map(|i| parse(&text(i))).collect();
    assert!(Classifier::for_any_scene(&expressions[..8]).is_ok());
    match Classifier::for_any_scene(&expressions) {
        Ok(classifier) => assert!(classifier.states().0 <= MAX_STATES),
        Err(error) => assert!(matches!(error, LpeError::TooLarge { .. }), "{error}"),
    }
}

#[test]
fn sets_are_disjoint_or_share_a_path() {
    assert!(any_scene(&["CL", "C[DG].*L", "CS.*L"]).overlap().is_none());
    let (a, b, path) = any_scene(&["CL", "CD.*L", "C.SL"]).overlap().unwrap();
    assert_eq!((a, b, path.to_string().as_str()), (1, 2, "C <RD> <RS> L"));
    let (a, b, path) = any_scene(&["C<RD>L", "C'floor'L'key'"]).overlap().unwrap();
    assert_eq!((a, b, path.to_string().as_str()), (0, 1, "C <RD'floor'> L'key'"));
    // A surface may have two names.
    let (_, _, path) = any_scene(&["C'a'L", "C'b'L"]).overlap().unwrap();
    assert_eq!(path.to_string(), "C <RD'a''b'> L");
    let (_, _, path) = any_scene(&["CL'a'", "CL'b'"]).overlap().unwrap();
    assert_eq!(path.to_string(), "C <L'a''b'>");
}

#[test]
fn sets_are_complete_or_leave_a_path_out() {
    let left_out = |texts: &[&str]| any_scene(texts).gap().map(|path| path.to_string());
    assert_eq!(left_out(&["CL", "C[DG].*L", "CS.*L"]), None);
    assert_eq!(left_out(&["C.*L"]), None);
    assert_eq!(left_out(&["C.+L"]).as_deref(), Some("C L"));
    assert_eq!(left_out(&["CL", "CD.*L", "CS.*L"]).as_deref(), Some("C <RG> L"));
    assert_eq!(left_out(&["C.*L'key'"]).as_deref(), Some("C L"));
    assert_eq!(left_out(&["C.*L'key'", "C.*[^L'key']"]), None);
    assert_eq!(left_out(&["C[^'floor']*L"]).as_deref(), Some("C <RD'floor'> L"));
    assert_eq!(left_out(&["C.{0,20}L"]).map(|path| path.matches('<').count()), Some(21));
    assert_eq!(left_out(&[]).as_deref(), Some("C L"));
}

#[test]
fn light_is_divided_by_what_the_manual_shows() {
    for set in [
        &["CL", "C[DG]+S+L", "CS.*L", "C[DG]+(S+[DG].*)?L"][..],
        &["C'floor'L", "C<'wood'[^'floor']>L", "C[^'floor''wood']L", "CL|C..+L"],
        &["C.*L'key'", "C.*[^L'key']"],
        &["LE", "LD(D|S)*E", "LS(D|S)*E"],
    ] {
        let classifier = any_scene(set);
        assert!(classifier.overlap().is_none() && classifier.gap().is_none(), "{set:?}");
    }
    assert!(any_scene(&["C'floor'L", "C'wood'L"]).overlap().is_some());
}

#[test]
fn examples_are_shortest_and_differ() {
    let paths =
        |text: &str| -> Vec<String> { any_scene(&[text]).examples(0, 3).iter().map(ToString::to_string).collect() };
    assert_eq!(paths("CL"), ["C L"]);
    assert_eq!(paths("C.*L"), ["C L", "C <RD> L", "C <RD> <RD> L"]);
    assert_eq!(paths("LS+DE"), ["C <RD> <RS> L", "C <RD> <RS> <RS> L", "C <RD> <RS> <RS> <RS> L"]);
    assert_eq!(paths("C<TS'it''s'>L").len(), 1, "two names");
    assert_eq!(paths("C\"it's\"L"), ["C <RD\"it's\"> L"]);
    assert!(any_scene(&["C<'a''b''c'>L"]).example(0).is_none(), "three names are more than any scene has");
}

#[test]
fn a_minimal_automaton_is_as_small_as_it_can_be() {
    // After C; dead; a D seen; and the end.
    assert_eq!(any_scene(&["CD+L"]).states(), (4, 4));
    assert_eq!(any_scene(&["C(D|DD+|D{5}|D+)L"]).states(), (4, 4));
    // From the camera the last four scatterings are remembered, from the light three are counted; beside that there are the
    // end, the dead, and the light's place.
    let (from_camera, from_light) = any_scene(&["C.*D.{3}L"]).states();
    assert_eq!((from_camera, from_light), (16 + 2, 4 + 3));
}

fn names(entries: &[&[&str]]) -> Vec<Vec<String>> {
    entries.iter().map(|names| names.iter().map(|n| (*n).to_owned()).collect()).collect()
}

#[test]
fn paths_are_classified_from_both_ends() {
    let expressions = ["C<RD'floor'>L'key'", "C.*SL", "C.*L"].map(parse);
    let surfaces = names(&[&["wall", "room"], &["floor", "room"]]);
    let lights = names(&[&["sky"], &["key"]]);
    let classifier = Classifier::new(&expressions, &surfaces, &lights).unwrap();
    assert!(classifier.unknown_names().is_empty());
    let (floor, key) = (1, 1);
    let start = classifier.camera_start();
    let seen = classifier.camera_step(start, Event::Reflection, Scattering::Diffuse, floor);
    assert_eq!(classifier.emitted(seen, key), 0b101);
    assert_eq!(classifier.emitted(seen, 0), 0b100);
    assert_eq!(classifier.emitted(start, key), 0b100);
    let lit = classifier.light_step(classifier.light_start(key), Event::Reflection, Scattering::Diffuse, floor);
    assert_eq!(classifier.classes(start, lit), 0b101);
    assert_eq!(classifier.classes(seen, lit), 0b100);
    let mirror = classifier.light_step(classifier.light_start(key), Event::Reflection, Scattering::Specular, 0);
    assert_eq!(classifier.classes(seen, mirror), 0b110);
}

#[test]
fn names_that_nothing_has_are_told() {
    let expressions = ["C'flor'L", "C<R'floor'>.*L'floor'", "C'Flor'L'key'"].map(parse);
    let scene = (names(&[&["floor"], &["wall"]]), names(&[&["key"]]));
    let classifier = Classifier::new(&expressions, &scene.0, &scene.1).unwrap();
    let told: Vec<String> = classifier.unknown_names().iter().map(|n| format!("{}: {n}", n.expression)).collect();
    assert_eq!(
        told,
        [
            "0: no surface is called 'flor'; did you mean 'floor'?",
            "2: no surface is called 'Flor'; did you mean 'floor'?",
            "1: no light is called 'floor'",
        ]
    );
    assert!(classifier.example(0).is_none());
}

#[test]
fn a_scene_with_many_surfaces_has_few_letters() {
    let surfaces: Vec<Vec<String>> = (0..100_000).map(|i| vec![format!("s{i}")]).collect();
    let expressions = [parse("C'floor'*'s7'L"), parse("C's77777'.*L")];
    let classifier = Classifier::new(&expressions, &surfaces, &names(&[&[]])).unwrap();
    assert_eq!(classifier.alphabet.letters.len(), 3 + 1);
    let state = classifier.camera_step(classifier.camera_start(), Event::Volume, Scattering::Diffuse, 77_777);
    assert_eq!(classifier.emitted(state, 0), 0b10);
}
