use super::{base, expect, load};

const TREE: &str = "[[groups]]\nname = \"tree\"\n[[groups.shapes]]\ntype = \"sphere\"\ncenter = [0, 0, 0]\nradius = 1\nmaterial = \"white\"\n";
const PLACED: &str = "[[shapes]]\ntype = \"instance\"\ngroup = \"tree\"\n";
const WOOD: &str = "[[groups]]\nname = \"wood\"\n";

fn placed(transform: &str) -> String {
    format!("{PLACED}transform = [{transform}]\n")
}

fn member(group: &str) -> String {
    format!("[[groups.shapes]]\ntype = \"instance\"\ngroup = \"{group}\"\n")
}

#[test]
fn groups_and_groups_of_groups_are_read() {
    let wood = format!("{WOOD}{}{}transform = [{{ translate = [9, 0, 0] }}]\n", member("tree"), member("tree"));
    let stretched = placed("{ scale = [1, -2, 3] }, { translate = [0, 5, 0] }");
    let wood_placed = PLACED.replace("tree", "wood");
    let scene = load(&base(&format!("{TREE}{wood}{PLACED}{stretched}{wood_placed}"))).unwrap();
    let counts = scene.counts();
    assert_eq!((counts.instances, counts.spheres, counts.shapes), (4, 2, 2));
    assert_eq!(scene.needs.primitives, 2);
    assert!(!scene.needs.few_primitives && scene.notes.is_empty());
}

#[test]
fn what_emits_in_a_group_is_copied() {
    let lamp = TREE.replace("material", "emission = 2\nmaterial");
    let twice = format!("{lamp}{PLACED}{}", placed("{ scale = 2 }, { translate = [0, 9, 0] }"));
    let scene = load(&base(&twice)).unwrap();
    let counts = scene.counts();
    // The sky is an emitter, too.
    assert_eq!((counts.emitters, counts.instances, counts.spheres), (3, 0, 3));
    assert!((scene.emitters[1].power() / scene.emitters[0].power() - 4.0).abs() < 1e-5);
    let stretched = base(&format!("{lamp}{}", placed("{ scale = [1, 2, 1] }")));
    expect_line(&stretched, 23, "does not leave shapes[0] (a sphere) of the group `tree` a sphere");
}

/// What building refuses is told of its line.
#[track_caller]
fn expect_line(text: &str, line: usize, message: &str) {
    let error = load(text).err().unwrap_or_else(|| panic!("no error, but expected: {message}")).to_string();
    assert!(error.starts_with(&format!("line {line}: ")) && error.contains(message), "{error}");
}

#[test]
fn a_ramp_over_a_group_is_one_over_the_scene() {
    let ramp =
        "[materials.ramp]\ntype = \"lambert\"\nalbedo = { ramp = { base = 0.5, slope = 0.1, axis = [0, 1, 0] } }\n";
    let tree = TREE.replace("white", "ramp");
    let scene = load(&base(&format!("{ramp}{tree}{}", placed("{ translate = [0, 2, 0] }")))).unwrap();
    assert_eq!((scene.counts().instances, scene.counts().spheres), (0, 2));
    let far = load(&base(&format!("{ramp}{tree}{}", placed("{ translate = [0, 9, 0] }")))).unwrap_err().to_string();
    assert!(far.contains("ramp") && far.contains("keep it"), "{far}");
}

#[test]
fn what_is_wrong_with_groups_is_told_with_its_line() {
    let of = |added: &str| base(added);
    expect(
        &of(&format!("{TREE}{}", PLACED.replace("tree", "tre"))),
        "24: `shapes[1].group` is `\"tre\"`; there is no such group: did you mean `tree`?",
    );
    expect(&of(PLACED), "17: `shapes[1].group` is `\"tree\"`; there is no such group; add `[[groups]]`");
    expect(
        &of(&format!("{TREE}{}", member("tree"))),
        "24: `groups[0].shapes[1].group` is `\"tree\"`; a group cannot contain itself",
    );
    let early = format!("{WOOD}{}{TREE}", member("tree"));
    expect(
        &of(&early),
        "19: `groups[0].shapes[0].group` is `\"tree\"`; a group may hold only groups that stand before it",
    );
    expect(&of(WOOD), "15: the group `wood` is empty; add a table `[[groups.shapes]]`");
    expect(
        &of(&format!("{TREE}{}", TREE)),
        "23: `groups[1].name` is `\"tree\"`; there is a group of this name already",
    );
    expect(
        &of(&format!("{TREE}{}", placed("{ scale = [1, 0, 1] }"))),
        "25: `shapes[1].transform` is `[{ scale = [1, 0, 1] }]`; it flattens",
    );
    expect(&of(&format!("{TREE}{PLACED}material = \"white\"\n")), "25: unknown key `material` in `shapes[1]`");
    expect(&of("[[groups]]\nnames = \"tree\"\n"), "15: `groups[0]` lacks `name`");
    expect(&of(&TREE.replace("name =", "flip = true\nname =")), "16: unknown key `flip` in `groups[0]`");
    expect(&of("[groups]\nname = \"tree\"\n"), "15: `groups` is");
    let crushed = format!("{TREE}{}", placed("{ scale = [1e-5, 1, 1] }, { scale = [1e-4, 1e4, 1] }"));
    expect_line(&of(&crushed), 22, "is scaled or stretched beyond");
}

#[test]
fn a_group_that_is_placed_nowhere_is_noted() {
    let scene = load(&base(TREE)).unwrap();
    assert_eq!(scene.notes, ["the group `tree` is placed nowhere"]);
    assert_eq!(scene.counts().spheres, 1);
}

/// Each group holds ten of the one before: ten thousand million trees.
#[test]
fn groups_of_groups_are_bounded() {
    let mut text = TREE.to_owned();
    let mut last = "tree".to_owned();
    for level in 0..10 {
        text += &format!("[[groups]]\nname = \"wood{level}\"\n{}", member(&last).repeat(10));
        last = format!("wood{level}");
    }
    let error = load(&base(&format!("{text}{}", PLACED.replace("tree", &last)))).unwrap_err().to_string();
    assert!(error.contains("brings the instances, with those within others, to 6000000"), "{error}");
    assert!(error.starts_with("line "), "{error}");
    let lamps = text.replace("material", "emission = 1\nmaterial");
    let error = load(&base(&format!("{lamps}{}", PLACED.replace("tree", &last)))).unwrap_err().to_string();
    assert!(error.contains("brings the surfaces that are copied"), "{error}");
    let mut chain = TREE.to_owned();
    let mut last = "tree".to_owned();
    for level in 0..70 {
        chain += &format!("[[groups]]\nname = \"n{level}\"\n{}", member(&last));
        last = format!("n{level}");
    }
    let error = load(&base(&format!("{chain}{}", PLACED.replace("tree", &last)))).unwrap_err().to_string();
    assert!(error.contains("more than 64 groups within one another"), "{error}");
}

#[test]
fn the_hash_depends_on_groups_and_where_they_are() {
    let hash = |added: &str| load(&base(added)).unwrap().hash;
    let texts = [
        String::new(),
        format!("{TREE}{PLACED}"),
        format!("{TREE}{PLACED}{PLACED}"),
        format!("{TREE}{}", placed("{ translate = [0, 1, 0] }")),
        format!("{TREE}{}", placed("{ scale = [1, 1, -1] }")),
        format!("{}{PLACED}", TREE.replace("radius = 1", "radius = 2")),
    ];
    let hashes: std::collections::BTreeSet<String> = texts.iter().map(|text| hash(text)).collect();
    assert_eq!(hashes.len(), texts.len());
    assert_eq!(hash(&texts[1]), hash(&texts[1]));
}
