//! Every kind of bad input: one message with the place and the mend, and nothing half-written.

use super::*;

#[test]
fn unknown_names_are_answered_with_the_nearest() {
    let folder = folder_with(&[]);
    let refused = |arguments: &[&str], words: &[&str]| refused(folder.path(), arguments, words);
    refused(&["render", "cornel_box"], &["cornel_box", "did you mean `cornell_box`"]);
    refused(&["render", "furnace", "-i", "bptd"], &["bptd", "did you mean `bdpt`"]);
    refused(&["render", "furnace", "-i", "bdpt", "--set", "miss=power"], &["miss", "did you mean `mis`"]);
    refused(&["render", "furnace", "-i", "bdpt", "--set", "mis=powr"], &["mis", "powr", "did you mean `power`"]);
    refused(&["render", "furnace", "-i", "bdpt", "--set", "path.mis=power"], &["path.mis", "bdpt.mis"]);
    refused(&["render", "furnace", "--sampler", "stratifed"], &["did you mean `stratified`"]);
    refused(&["render", "furnace", "--filter", "gausian"], &["did you mean `gaussian`"]);
    refused(&["bsdf", "lambrt"], &["did you mean `lambert`"]);
    refused(
        &["bsdf", "lambert", "--set", "albdo=0.3"],
        &["--set albdo=0.3: ", "in `lambert`", "did you mean `albedo`"],
    );
    refused(&["bsdf", "lambert", "--set", "albedo=3"], &["--set albedo=3: `albedo` is", "from 0 to 1"]);
    refused(&["bsdf", "ward", "--set", "kd=0.8", "--set", "ks=0.8"], &["--set ks=0.8: ", "creates light"]);
    refused(
        &["bsdf", "distribution_based", "--set", "half_vectors=[1, 1e300]"],
        &["number 2 is not finite or larger than 3.4e38"],
    );
    refused(&["bsdf"], &["MODEL"]);
    refused(&["render", "furnace", "--layers", "order"], &["`order`", "`beauty`", "did you mean `orders`"]);
    refused(&["run", "comparsion"], &["did you mean `comparison`"]);
    for command in ["render", "scene", "verify"] {
        refused(&[command, "comparison"], &["comparison is an experiment", "`neumann run comparison`"]);
    }
    refused(&["run", "cornell_box"], &["cornell_box is a scene", "`neumann render cornell_box`"]);
    refused(&["scene", "furnce"], &["did you mean `furnace`"]);
    refused(&["rendr", "furnace"], &["render"]);
    refused(&["render", "furnace", "--sede", "3"], &["--seed"]);
    refused(&["list", "method"], &["methods"]);
    refused(&["lpe", "CD", "CL"], &["write `L` at the end", "\n  CD\n    ^"]);
    refused(&["lpe", "a=CL", "a=CDL"], &["`a` is given twice"]);
    refused(&["lpe", "C.*D.{30}L"], &["more than 4096 states"]);
}

#[test]
fn impossible_values_are_refused_with_the_mend() {
    let folder = folder_with(&[]);
    let refused = |arguments: &[&str], words: &[&str]| refused(folder.path(), arguments, words);
    refused(&["render", "furnace", "--spp", "0"], &["--spp", "from 1 to"]);
    refused(&["render", "furnace", "--replicates", "0"], &["--replicates", "from 1 to"]);
    refused(&["render", "furnace", "--layers", "variance", "--replicates", "1"], &["--replicates 2"]);
    refused(&["render", "furnace", "--seed", "-1"], &["--seed", "from 0 to"]);
    refused(&["render", "furnace", "--tail", "-1"], &["invalid value '-1'", "--tail"]);
    refused(&["render", "-5"], &["there is no scene `-5`"]);
    refused(&["spectrum", "furnace", "--accuracy", "-1"], &["invalid value '-1'", "--accuracy"]);
    refused(&["bench", "leaks", "--rays", "-1"], &["invalid value '-1'", "--rays"]);
    refused(&["render", "furnace", "--spp", "10"], &["4 replicates", "8 or 12 samples"]);
    refused(&["render", "furnace", "--size", "0x8"], &["--size", "at least 1"]);
    refused(&["render", "furnace", "--size", "8"], &["--size", "256x256"]);
    refused(&["render", "furnace", "--crop", "1,2,3"], &["--crop", "32,16,64,64"]);
    refused(&["render", "furnace", "--crop", "0,0,0,3"], &["--crop", "at least 1"]);
    refused(&["render", "furnace", "--size", "8x8", "--crop", "4,4,5,4"], &["crop", "8x8"]);
    refused(&["render", "furnace", "--threads", "0"], &["--threads"]);
    refused(&["render", "furnace", "--seconds", "0"], &["seconds"]);
    refused(&["render", "furnace", "--seconds", "nan"], &["seconds"]);
    refused(&["render", "furnace", "--seconds", "1e300"], &["seconds", "ten years"]);
    refused(&["render", "furnace", "--seconds", "1", "--spp", "4"], &["--spp", "--seconds"]);
    refused(&["render", "furnace", "--orders", "2,9"], &["order 9", "--max-order"]);
    refused(&["render", "furnace", "--orders", "x"], &["`x`"]);
    refused(&["render", "furnace", "--size", "10000x10000", "--max-order", "5000"], &["memory", "--size"]);
    refused(&["render", "furnace", "--set", "mis"], &["key=value"]);
}

#[test]
fn faulty_scene_files_are_named_with_the_line() {
    let unknown_key = ROOM.replace("albedo = 0.5", "albdo = 0.5");
    let missing_mesh = format!("{ROOM}[[shapes]]\ntype = \"mesh\"\nfile = \"gone.obj\"\nmaterial = \"white\"\n");
    let folder = folder_with(&[
        ("key.toml", &unknown_key),
        ("broken.toml", &ROOM.replace("width = 8", "width = = 8")),
        ("mesh.toml", &missing_mesh),
        ("broken.obj", "v 0 0 0\nv 1 0 zero\nv 0 1 0\nf 1 2 3\n"),
        ("range.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 7\n"),
        ("scene.txt", "not a scene"),
        ("size.toml", &ROOM.replace("width = 8", "width = 0")),
    ]);
    let refused = |scene: &str, words: &[&str]| refused(folder.path(), &["render", scene], words);
    refused("key.toml", &["key.toml:10", "albdo", "did you mean `albedo`"]);
    refused("broken.toml", &["broken.toml:6"]);
    refused("mesh.toml", &["mesh.toml:", "gone.obj"]);
    refused("broken.obj", &["broken.obj:2"]);
    refused("range.obj", &["range.obj:4"]);
    refused("size.toml", &["size.toml:6"]);
    refused("gone.toml", &["gone.toml"]);
    refused("scene.txt", &["scene.txt"]);
}

#[test]
fn faulty_experiment_files_are_named_with_the_line() {
    let second = format!("{EXPERIMENT}[[methods]]\nname = \"light\"\n[[methods]]\nname = \"bpdt\"\n");
    let folder = folder_with(&[
        ("second.toml", &second),
        ("slope.toml", &EXPERIMENT.replace("[4, 4]", "[4, 0]")),
        ("sampler.toml", &format!("sampler = [\"sobol\", \"sobel\"]\n{EXPERIMENT}")),
        ("key.toml", &EXPERIMENT.replace("spp", "spb")),
        ("broken.toml", "scenes = [\"furnace\"\nspp"),
        ("spp.toml", &EXPERIMENT.replace("spp = 8", "spp = 9")),
        ("method.toml", &EXPERIMENT.replace("\"bdpt\"", "\"bpdt\"")),
        ("scene.toml", &EXPERIMENT.replace("furnace", "furnce")),
        ("metric.toml", &format!("{EXPERIMENT}[reference]\n").replace("spp = 8", "metrics = [\"rlmse\"]\nspp = 8")),
        ("until.toml", &format!("until = {{ relative_error = 0.1 }}\n{EXPERIMENT}")),
        (
            "nobody.toml",
            &format!("{EXPERIMENT}[reference]\nmethods = [\"direct\"]\n").replace("furnace", "cornell_box"),
        ),
        ("whose.toml", &format!("{EXPERIMENT}[reference]\nmethods = [\"bpdt\"]\n")),
        ("zero.toml", &EXPERIMENT.replace("[8, 8]", "[0, 8]")),
        ("room.toml", "[camera]\nfov = 40\n"),
    ]);
    let refused = |file: &str, words: &[&str]| refused(folder.path(), &["run", file], words);
    refused("key.toml", &["key.toml:2", "did you mean `spp`"]);
    refused("second.toml", &[&format!("second.toml:{}: ", second.lines().count()), "did you mean `bdpt`"]);
    refused("slope.toml", &["slope.toml:11: "]);
    refused("sampler.toml", &["sampler.toml:1: ", "did you mean `sobol`"]);
    refused("broken.toml", &["broken.toml:"]);
    refused("spp.toml", &["spp.toml:2", "8 or 12 samples"]);
    refused("method.toml", &["method.toml:", "did you mean `bdpt`"]);
    refused("scene.toml", &["scene.toml:1: ", "did you mean `furnace`"]);
    refused("zero.toml", &["zero.toml:5"]);
    refused("room.toml", &["room.toml is a scene", "`neumann render room.toml`"]);
    refused("metric.toml", &["metric.toml:2: ", "did you mean `relmse`"]);
    refused("until.toml", &["until.toml:1: ", "give max_spp or seconds"]);
    refused("nobody.toml", &["nobody.toml:15: ", "none of direct carries all light of order 2", "max_order = 1"]);
    refused("whose.toml", &["whose.toml:15: ", "did you mean `bdpt`"]);
    refused("./gone.toml", &["gone.toml", "neumann list experiments"]);
}

#[test]
fn outputs_that_cannot_be_written_are_refused_before_rendering() {
    let folder = folder_with(&[("file", "")]);
    std::fs::create_dir(folder.path().join("folder.exr")).unwrap();
    // So many samples that the test would never end if rendering began.
    let render = ["render", "cornell_box", "--spp", "4000000000"];
    let refused = |rest: &[&str], words: &[&str]| refused(folder.path(), &[&render[..], rest].concat(), words);
    refused(&["-o", "no/such/folder/a.exr"], &["no/such/folder/a.exr", "a folder that is there"]);
    refused(&["-o", "folder.exr"], &["folder.exr", "folder"]);
    refused(&["-o", "file/a.exr"], &["file/a.exr"]);
    refused(&["-o", "a.jpg"], &["a.jpg", "call it a.exr"]);
    for more in [["--layers", "strategies"], ["--layers", "orders,variance"], ["--lpe", "caustics=CDS+L"]] {
        refused(&[&["-o", "a.png"][..], &more].concat(), &["a.png", "without layers", "call it a.exr"]);
    }
    refused(&["--stats", "no/s.json"], &["no/s.json"]);
    refused(&["-o", "a.exr", "--stats", "a.exr"], &["same file"]);
    let run = ["run", "comparison", "--spp", "4000000000", "--out"];
    super::refused(folder.path(), &[&run[..], &["file"]].concat(), &["file"]);
    super::refused(folder.path(), &[&run[..], &["."]].concat(), &["--out"]);
}

#[test]
fn a_film_that_memory_cannot_hold_and_no_threads_are_refused_before_anything_is_written() {
    let folder = folder_with(&[]);
    let large = ["run", "comparison", "--size", "16000x16000", "--max-order", "999", "--out", "large"];
    refused(folder.path(), &large, &["memory", "--size"]);
    refused(folder.path(), &["run", "comparison", "--threads", "0", "--out", "none"], &["from 1 to"]);
    assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 0);
}

/// Whoever has stopped listening hears no message, and changes no exit status.
#[test]
fn closed_pipes_change_no_status() {
    let folder = folder_with(&[("room.toml", super::ROOM)]);
    let status = |arguments: &[&str]| {
        let closed = || {
            let (reader, writer) = std::io::pipe().unwrap();
            drop(reader);
            writer
        };
        let mut command = super::command(folder.path(), arguments);
        command.stdout(closed()).stderr(closed()).status().unwrap().code()
    };
    assert_eq!(status(&["render", "nope"]), Some(2));
    assert_eq!(status(&["list", "methods"]), Some(0));
    assert_eq!(status(&["scene", "room.toml"]), Some(0));
    let render = ["render", "room.toml", "--size", "4x4", "--spp", "4", "-o", "a.exr", "--stats", "a.json"];
    assert_eq!(status(&render), Some(0));
    assert!(folder.path().join("a.exr").exists() && folder.path().join("a.json").exists());
}
