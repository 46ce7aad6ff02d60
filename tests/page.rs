//! The report in a real browser: it loads without a complaint, keys and wheel do what they say, and its numbers are the records'.
//!
//! Where no browser is to be had, or no axe-core, the tests say so and pass.

use crate::cli::succeed;
use browser::Browser;
use integrators::Methods;
use neumann::machine::Began;
use neumann::manifest::manifest;
use neumann::plan::Plan;
use neumann::progress::Verbosity;
use neumann::report::{page, scenes};
use neumann::result::ExperimentResult;
use neumann::runner;
use neumann::source::Source;
use neumann::states::States;
use neumann::stop::Stop;
use serde_json::{Value, json};
use std::path::{Path, PathBuf};
use tempfile::TempDir;

mod browser;
mod devices;
mod values;

const EXPERIMENT: &str = r#"
title = "Small"
scenes = ["cornell_box"]
max_order = 2
spp = 32
replicates = 8
size = [24, 18]
layers = ["strategies"]
reference = { methods = ["path"], spp = 64 }
methods = [{ name = "path" }, { name = "bdpt" }, { name = "direct" }]
convergence = { size = [8, 8], checkpoints = [1, 2, 4], replicates = 32 }
"#;

/// A small experiment with everything that the page can switch.
fn small() -> TempDir {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("small.toml"), EXPERIMENT).unwrap();
    succeed(folder.path(), &["run", "small.toml", "--out", "out", "--quiet"]);
    folder
}

/// What is shown as A, the text of its label.
const LABEL_A: &str = "document.querySelector('.label.a').textContent";

/// Presses a key and waits until what follows from it is painted.
fn press(browser: &mut Browser, key: &str) {
    let turn = browser.value("Number(document.querySelector('.viewer').dataset.turn)");
    browser.press(key);
    browser.wait(&format!("Number(document.querySelector('.viewer').dataset.turn) > {turn}"));
}

/// Chooses from a list, and waits likewise.
fn choose(browser: &mut Browser, name: &str, value: u32) {
    let turn = browser.value("Number(document.querySelector('.viewer').dataset.turn)");
    browser.value(&format!(
        "(() => {{ const s = document.querySelector('[name={name}]'); s.value = {value}; s.dispatchEvent(new Event('change')) }})()"
    ));
    browser.wait(&format!("Number(document.querySelector('.viewer').dataset.turn) > {turn}"));
}

/// The colours of a piece of the stage, as a text; the whole is one wide and high.
fn painted(browser: &mut Browser, [x, y, w, h]: [f64; 4]) -> Value {
    browser.value(&format!(
        "(() => {{ const c = document.querySelector('.stage canvas'), copy = new OffscreenCanvas(c.width, c.height);
         const context = copy.getContext('2d', {{ willReadFrequently: true }}), [w, h] = [c.width, c.height].map((n) => n & ~1);
         context.drawImage(c, 0, 0);
         return context.getImageData(w * {x}, h * {y}, w * {w}, h * {h}).data.join() }})()"
    ))
}

#[test]
fn keys_wheel_and_switches_do_what_they_say() {
    let Some(mut browser) = Browser::start() else { return };
    let folder = small();
    browser.open(&folder.path().join("out/report.html"));
    browser.value("document.querySelector('.stage').focus()");
    keys_flip_images(&mut browser);
    zoom_is_linked(&mut browser);
    plots_switch(&mut browser);
    pyramids_open(&mut browser);
    assert_eq!(browser.complaints(), [""; 0]);
}

fn keys_flip_images(browser: &mut Browser) {
    const LEFT: [f64; 4] = [0.0, 0.0, 0.4, 1.0];
    let mut seen = vec![painted(browser, LEFT)];
    for (key, label) in [("1", "TE"), ("ArrowRight", "T²E"), ("ArrowLeft", "TE"), ("0", "E"), ("End", "sum")] {
        press(browser, key);
        let shown = browser.value(LABEL_A);
        assert!(shown.as_str().unwrap().contains(&format!("· {label} ")), "{key}: {shown}");
        seen.push(painted(browser, LEFT));
    }
    assert!(seen[0] == seen[5] && seen[1] == seen[3], "the same layer looks otherwise");
    assert!(seen[0] != seen[1] && seen[1] != seen[2] && seen[3] != seen[4], "another layer looks the same");
    // Methods, views and tone maps too.
    let method = browser.value(LABEL_A);
    press(browser, "ArrowDown");
    assert_ne!(browser.value(LABEL_A), method);
    press(browser, "ArrowUp");
    // Against another method than the reference, whose view is another.
    choose(browser, "b-method", 0);
    let first = painted(browser, LEFT);
    for key in ["v", "v", "v", "v", "v"] {
        let before = painted(browser, LEFT);
        press(browser, key);
        assert_ne!(
            painted(browser, LEFT),
            before,
            "the view {}",
            browser.value("document.querySelector('[name=view]').value")
        );
    }
    for key in ["t", "t", "t", "t", "+", "-"] {
        let before = painted(browser, LEFT);
        press(browser, key);
        assert_ne!(painted(browser, LEFT), before, "{key}");
    }
    assert_eq!(painted(browser, LEFT), first, "all keys undone");
    browser.press("?");
    browser.wait("document.querySelector('.help').open");
}

/// Two panes of one image have the same pixels, however one of them is zoomed.
fn zoom_is_linked(browser: &mut Browser) {
    const PANES: [[f64; 4]; 2] = [[0.0, 0.0, 0.5, 0.85], [0.5, 0.0, 0.5, 0.85]];
    press(browser, "c");
    for which in ["a", "b"] {
        let change = format!(
            "(() => {{ const s = document.querySelector('[name={which}-method]'); s.value = 0; s.dispatchEvent(new Event('change')) }})()"
        );
        browser.value(&change);
    }
    browser.wait("document.querySelector('.label.a').textContent === document.querySelector('.label.b').textContent");
    browser
        .wait("document.querySelector('.stage canvas').width > 1.5 * document.querySelector('.stage canvas').height");
    let before = PANES.map(|pane| painted(browser, pane));
    assert_eq!(before[0], before[1]);
    let place = browser.value(
        "(() => { const s = document.querySelector('.stage'); s.scrollIntoView({ block: 'center' }); s.focus({ preventScroll: true });
         const b = s.getBoundingClientRect(); return [b.left + b.width * 0.4, b.top + b.height * 0.3] })()",
    );
    let place = (place[0].as_f64().unwrap(), place[1].as_f64().unwrap());
    browser.wheel(place, -480.0);
    browser.wait("Number(document.querySelector('.viewer').dataset.zoom) === 4");
    let after = PANES.map(|pane| painted(browser, pane));
    assert!(after[0] == after[1] && after[0] != before[0], "one pane is zoomed and the other not");
    browser.press("r");
    browser.wait("Number(document.querySelector('.viewer').dataset.zoom) === 1");
    press(browser, "c");
}

fn plots_switch(browser: &mut Browser) {
    let visible = "[...document.querySelectorAll('.switched figure')].filter((f) => f.offsetParent).length";
    // Three orders and their sum.
    assert_eq!(browser.value(visible), 4);
    browser.value("document.querySelectorAll('.switched [type=radio]')[1].click()");
    assert_eq!(browser.value(visible), 4, "the same against seconds");
    browser.value("document.querySelectorAll('.switched [type=radio]')[2].click()");
    assert_eq!(browser.value(visible), 3, "a figure for each method");
    browser.value("document.querySelectorAll('.switched [type=radio]')[0].click()");
    let drawn = "[...document.querySelectorAll('[data-group=order] [data-name=bdpt]')].filter((g) => g.getBoundingClientRect().width).length";
    let series = browser.value(drawn);
    assert_ne!(series, 0);
    let box_of_bdpt = "[...document.querySelectorAll('.switches')].find((s) => s.offsetParent).querySelectorAll('[type=checkbox]')[1].click()";
    browser.value(box_of_bdpt);
    assert_eq!(browser.value(drawn), 0);
    browser.value(box_of_bdpt);
    assert_eq!(browser.value(drawn), series);
    browser.value("(() => { const s = document.querySelector('.switches select'); s.value = 1; s.dispatchEvent(new Event('change')) })()");
    assert_eq!(browser.value(visible), 1);
}

/// A strategy's picture brings it onto the stage.
fn pyramids_open(browser: &mut Browser) {
    // Alone and weighted, of 2 + 3 + 4 strategies of bdpt; `path` and `direct` have fewer.
    let buttons = "document.querySelectorAll('.pyramids figure[data-method=bdpt] [data-part] button').length";
    assert_eq!(browser.value(buttons), 18);
    let turn = browser.value("Number(document.querySelector('.viewer').dataset.turn)");
    browser.value("document.querySelector('figure[data-method=bdpt] [data-part=s02_t01] button').click()");
    browser.wait(&format!("Number(document.querySelector('.viewer').dataset.turn) > {turn}"));
    let shown = browser.value(LABEL_A);
    assert!(shown.as_str().unwrap().starts_with("bdpt · s02_t01"), "{shown}");
}

/// A result whose every name is the given one.
fn named(name: &str) -> ExperimentResult {
    let source = Source::known("named", None, EXPERIMENT);
    let mut plan = Plan::new(&source, source.parse().unwrap(), &Methods::standard()).unwrap();
    let outcome = runner::run(&mut plan, &mut States::none(), Verbosity::Quiet, &Stop::never()).unwrap();
    let mut manifest = manifest(&plan, outcome.renders, 1, Began::now(), true);
    let mut experiment = plan.experiment.clone();
    [experiment.title, experiment.description] = [name.to_owned(), name.to_owned()];
    let mut methods = outcome.methods;
    for (i, method) in methods.iter_mut().enumerate() {
        method.scene = name.to_owned();
        method.label = format!("{name}{i}");
    }
    for scene in &mut manifest.scenes {
        [scene.name, scene.source] = [name.to_owned(), name.to_owned()];
    }
    ExperimentResult {
        name: name.to_owned(),
        experiment,
        slopes: methods.iter().flat_map(neumann::convergence::slopes).collect(),
        agreement: neumann::agreement::compare(&methods.iter().collect::<Vec<_>>()),
        methods,
        ratios: Vec::new(),
        references: Vec::new(),
        choices: Vec::new(),
        sequences: Vec::new(),
        integrals: Vec::new(),
        fireflies: Vec::new(),
        manifest,
    }
}

#[test]
fn hostile_names_are_seen_as_text() {
    let Some(mut browser) = Browser::start() else { return };
    let folder = tempfile::tempdir().unwrap();
    let hostile = "</template></script><script>window.hurt = 1</script><img src=x onerror=\"window.hurt = 2\"> ' \" & \u{202e}םולש \\u003c";
    for name in [hostile.to_owned(), hostile.repeat(80)] {
        let result = named(&name);
        let file = folder.path().join("report.html");
        std::fs::write(&file, page::page(&result, &scenes(&result), None)).unwrap();
        browser.open(&file);
        let heading = browser.value("document.querySelector('h2').textContent");
        assert_eq!(heading, name.as_str());
        assert_eq!(browser.value("document.querySelectorAll('script').length"), 1);
        assert_eq!(browser.value("typeof window.hurt"), "undefined");
        let options =
            browser.value("[...document.querySelectorAll('[name=a-method] option')].map((o) => o.textContent)");
        assert!(options[0].as_str().unwrap().starts_with(&name), "{options:.300}");
        // And leave the page as wide as it is.
        assert_eq!(browser.value("document.documentElement.scrollWidth <= innerWidth"), true);
        assert_eq!(browser.complaints(), [""; 0]);
    }
}

/// Where `.ci/browser` puts axe-core.
fn axe() -> PathBuf {
    Path::new(env!("CARGO_TARGET_TMPDIR")).join("axe.min.js")
}

#[test]
fn the_page_keeps_the_rules_of_accessibility() {
    let Some(mut browser) = Browser::start() else { return };
    let Ok(axe) = std::fs::read_to_string(axe()) else {
        println!("skipped: no {}; .ci/browser gets it", axe().display());
        return;
    };
    let folder = small();
    for (width, scheme) in [(1280, "light"), (390, "dark")] {
        browser.resize(width, 800);
        browser.prefer(scheme);
        browser.open(&folder.path().join("out/report.html"));
        browser.press("Tab");
        browser.value("document.querySelectorAll('details').forEach((d) => (d.open = true))");
        // The strip is made when it is seen, and the readout when there is a pixel.
        browser.value("document.querySelector('.strip').scrollIntoView()");
        browser.wait("document.querySelector('.strip button')");
        browser.value("document.querySelector('.stage').focus()");
        browser.press("d");
        browser.wait("document.querySelector('.readout table')");
        browser.value(&axe);
        let found = browser.value(
            "axe.run().then((r) => r.violations.map((v) => `${v.id}: ${v.help}: ${v.nodes.slice(0, 3).map((n) => n.html.slice(0, 150)).join(' | ')}`))",
        );
        assert_eq!(found, json!([]), "{width} {scheme}");
    }
}

/// The default report with a thirty-second of its samples, which is as large, and noisier.
fn default_report() -> TempDir {
    let folder = tempfile::tempdir().unwrap();
    succeed(folder.path(), &["run", "comparison", "--spp", "16", "--replicates", "2", "--out", "out", "--quiet"]);
    folder
}

#[test]
fn the_default_report_is_seen_and_below_15_mb() {
    let Some(mut browser) = Browser::start() else { return };
    let folder = default_report();
    let page = folder.path().join("out/report.html");
    let bytes = std::fs::metadata(&page).unwrap().len();
    assert!((5_000_000..15_000_000).contains(&bytes), "{bytes} bytes");
    browser.open(&page);
    assert!(browser.value("document.querySelector('.viewer').dataset.painted").is_string());
    assert_eq!(browser.complaints(), [""; 0]);
}

#[test]
#[ignore = "it is timed, and needs a quiet machine"]
fn the_default_report_is_seen_within_2_seconds() {
    let Some(mut browser) = Browser::start() else { return };
    let folder = default_report();
    browser.open(&folder.path().join("out/report.html"));
    let painted = browser.value("document.querySelector('.viewer').dataset.painted");
    let milliseconds: f64 = painted.as_str().unwrap().parse().unwrap();
    println!("the first image stands after {milliseconds} ms");
    assert!(milliseconds < 2000.0, "{milliseconds} ms");
}
