//! How many orders there are to be: told by `neumann spectrum`, chosen by `--max-order auto`.

use super::*;

#[test]
fn as_many_orders_are_rendered_as_the_tail_asks_for_and_what_is_left_out_is_told() {
    let folder = tempfile::tempdir().unwrap();
    let render = |more: &[&str]| {
        let image = ["render", "cornell_box", "--size", "32x32", "--spp", "8", "-o", "x.exr", "--stats", "x.json"];
        let told = succeed(folder.path(), &[&image[..], more].concat());
        let pixels = read_layers(&folder.path().join("x.exr")).unwrap().layer("").unwrap().pixels.clone();
        (told, json(folder.path(), "x.json"), pixels)
    };
    let (told, fine, _) = render(&["--max-order", "auto", "--tail", "1e-3"]);
    let truncation = &fine["truncation"];
    let order = truncation["max_order"].as_u64().unwrap();
    assert!(truncation["at_most"].as_f64().unwrap() <= 1e-3 && truncation["left_out"].as_f64().unwrap() > 1e-5);
    assert!(told.contains(&format!("orders 0 to {order}; about")) && told.contains("is left out, at most"), "{told}");
    // A tenth falls below every second order or so, and rays with it.
    let (_, coarse, pixels) = render(&["--max-order", "auto", "--tail", "0.05"]);
    let few = coarse["truncation"]["max_order"].as_u64().unwrap();
    assert!(few >= 2 && few < order && order < 20, "{few} {order}");
    assert!(coarse["rays"]["closest"].as_u64() < fine["rays"]["closest"].as_u64());
    // What is chosen is rendered as if it had been asked for.
    let (_, asked, same) = render(&["--max-order", &few.to_string()]);
    assert!(pixels == same && asked.get("truncation").is_none());
}

#[test]
fn methods_with_a_last_order_and_black_images_have_their_own_words() {
    let folder = tempfile::tempdir().unwrap();
    for (method, last) in [("emission", 0), ("direct", 1)] {
        let render = ["render", "cornell_box", "-i", method, "--size", "8x8", "--spp", "4", "--max-order", "auto"];
        let told = succeed(folder.path(), &render);
        assert!(told.contains(&format!("orders 0 to {last}, which are all that it carries")), "{told}");
    }
    let dark = "[camera]\nposition = [0, 1, 4]\ntarget = [0, 0, 0]\nwidth = 8\nheight = 8\n[materials.grey]\ntype = \"lambert\"\nalbedo = 0.6\n\
        [[shapes]]\ntype = \"sphere\"\ncenter = [0, 0, 0]\nradius = 1\nmaterial = \"grey\"\n";
    std::fs::write(folder.path().join("dark.toml"), dark).unwrap();
    let told = succeed(folder.path(), &["render", "dark.toml", "--spp", "4", "--max-order", "auto"]);
    assert!(told.contains("the image is black"), "{told}");
}

#[test]
fn orders_that_cannot_be_chosen_are_refused_with_the_mend() {
    let folder = tempfile::tempdir().unwrap();
    let refused = |arguments: &[&str]| {
        let output = neumann(folder.path(), arguments);
        assert_eq!(output.status.code(), Some(2));
        text(&output.stderr)
    };
    assert!(refused(&["render", "cornell_box", "--tail", "1e-3"]).contains("only with --max-order auto"));
    assert!(refused(&["render", "--tail", "cornell_box"]).contains("write it before the flag"));
    assert!(refused(&["render", "cornell_box", "--max-order", "auto", "--orders", "1"]).contains("leave out --orders"));
    assert!(refused(&["replay", "cornell_box", "--max-order", "auto", "--pixel", "1,1"]).contains("name it"));
    assert!(refused(&["render", "cornell_box", "--max-order", "many"]).contains("or auto"));
    assert!(refused(&["spectrum", "cornell_box", "--max-order", "3"]).contains("from 7 to"));
}

#[test]
fn a_spectrum_is_told_in_words_and_in_json() {
    let folder = tempfile::tempdir().unwrap();
    let spectrum =
        ["spectrum", "cornell_box", "--paths", "40000", "--spp", "16", "--max-order", "10", "--accuracy", "0.02"];
    let words = succeed(folder.path(), &spectrum);
    for part in
        ["spectral radius of T: at least about 0.5", "bound of the flux beyond order 10: 0.", "have all but 2.0 %"]
    {
        assert!(words.contains(part), "{part}: {words}");
    }
    let told: Value = serde_json::from_str(&succeed(folder.path(), &[&spectrum[..], &["--json"]].concat())).unwrap();
    let flux = |k: usize| told["flux"]["orders"][k]["power"]["value"].as_f64().unwrap();
    let ratio = told["flux"]["orders"][3]["ratio"]["value"].as_f64().unwrap();
    assert!((ratio / (flux(4) / flux(3)) - 1.0).abs() < 1e-9);
    let (beyond, bound) = (told["flux"]["beyond"]["value"].as_f64().unwrap(), told["bound_beyond"].as_f64().unwrap());
    assert!(beyond > 0.0 && beyond < bound, "{beyond} {bound}");
    // Glass scatters all of the light, as far as is known for certain.
    let glass = ["spectrum", "glass_caustic", "--paths", "4000", "--spp", "16", "--max-order", "8"];
    assert!(succeed(folder.path(), &glass).contains("bound of the flux beyond order 8: none"));
}

#[test]
fn meters_tell_what_falls_on_surfaces_and_what_leaves_them() {
    let folder = tempfile::tempdir().unwrap();
    let listed = succeed(folder.path(), &["scene", "cornell_box"]);
    let labels = listed.lines().find(|line| line.trim_start().starts_with("labels")).unwrap().to_owned();
    let label = labels.split_whitespace().nth(1).unwrap().trim_end_matches(',').to_owned();
    let meter = ["meter", "cornell_box", "--on", &label, "--paths", "20000", "--max-order", "3"];
    let words = succeed(folder.path(), &meter);
    assert!(
        words.contains("irradiance [W/m²]") && words.contains("radiosity [W/m²]") && words.contains(&label),
        "{words}"
    );
    let told: Value = serde_json::from_str(&succeed(folder.path(), &[&meter[..], &["--json"]].concat())).unwrap();
    let on = &told["meters"][0];
    let area = on["area"].as_f64().unwrap();
    let number = |of: &Value| of["value"].as_f64().unwrap();
    for row in on["orders"].as_array().unwrap() {
        assert!((number(&row["irradiance"]) * area - number(&row["arriving"])).abs() < 1e-9);
        assert!((number(&row["radiosity"]) * area - number(&row["leaving"])).abs() < 1e-9);
    }
    // What leaves a lamp has its radiance in the mean: of 17, 12 and 4.
    let lamp = ["meter", "cornell_box", "--on", "lamp", "--paths", "20000", "--max-order", "3", "--json"];
    let lamp: Value = serde_json::from_str(&succeed(folder.path(), &lamp)).unwrap();
    let radiance = number(&lamp["meters"][0]["orders"][0]["radiance"]);
    assert!((radiance / 11.0 - 1.0).abs() < 1e-5, "{radiance}");
    let sum: f64 = on["orders"].as_array().unwrap().iter().map(|row| number(&row["leaving"])).sum();
    assert!((number(&on["sum"]["leaving"]) - sum).abs() < 1e-9);
    let output = neumann(folder.path(), &["meter", "cornell_box", "--on", &format!("{label}x")]);
    let message = text(&output.stderr);
    assert!(output.status.code() == Some(2) && message.contains(&format!("did you mean `{label}`")), "{message}");
}
