//! The page: summary first, then every scene, then what it takes to repeat the experiment.

use super::samplers::{self, Integrals};
use super::summary::{self, Sentence, Tone};
use super::{SceneReport, agreement, choices, errors, fireflies, images, screens, strategies, tables, viewer};
use crate::export::markup::Markup;
use crate::export::notation::brief;
use crate::fireflies::FireflyRecord;
use crate::plot::{Figure, points};
use crate::result::{
    AgreementRow, ChoiceRow, ExperimentResult, MethodRecord, MethodResult, RatioRow, SequenceRow, SlopeRow,
};
use crate::shards::plan::quoted;
use integrators::Part;

/// Nothing may be loaded: the page is whole as it is. No script may run but its own.
const POLICY: &str = "default-src 'none'; img-src data:; style-src 'unsafe-inline'; script-src";

/// The section on samplers without a scene.
const INTEGRALS: &str = "Integrals of known value";

/// The whole file.
pub fn page(result: &ExperimentResult, scenes: &[SceneReport], integrals: Option<&Integrals>) -> String {
    let title = if result.experiment.title.is_empty() { &result.name } else { &result.experiment.title };
    let body = body(result, title, scenes, integrals);
    // Whoever would get a script of theirs into the page had to know what the page hashes to with it.
    let nonce = blake3::hash(body.as_str().as_bytes()).to_hex();
    let policy = format!("{POLICY} 'nonce-{nonce}'");
    let mut m = Markup::default();
    m.verbatim("<!DOCTYPE html>\n");
    m.element("html", &[("lang", &"en")], |m| {
        m.element("head", &[], |m| {
            m.leaf("meta", &[("charset", &"utf-8")]);
            m.leaf("meta", &[("http-equiv", &"Content-Security-Policy"), ("content", &policy)]);
            m.leaf("meta", &[("name", &"viewport"), ("content", &"width=device-width, initial-scale=1")]);
            m.leaf("meta", &[("name", &"color-scheme"), ("content", &"light dark")]);
            m.line("title", &[], format!("{title} · neumann"));
            m.element("style", &[], |m| {
                m.verbatim(include_str!("style.css"));
                m.verbatim(include_str!("viewer/viewer.css"));
            });
        });
        m.element("body", &[], |m| {
            m.append_large(body);
            m.element("script", &[("type", &"module"), ("nonce", &nonce)], |m| {
                viewer::Images::script().into_iter().for_each(|file| m.verbatim(file));
            });
        });
    });
    m.text("\n");
    m.into_string()
}

/// All that is read and seen.
fn body(result: &ExperimentResult, title: &str, scenes: &[SceneReport], integrals: Option<&Integrals>) -> Markup {
    let images = viewer::Images::of(result, scenes);
    let (shrink, pyramid_shrink) = (images::shrink(result), strategies::shrink(result));
    let mut m = Markup::default();
    head(&mut m, result, title, scenes, integrals.is_some());
    m.element("main", &[], |m| {
        if let Some(integrals) = integrals {
            integrals_section(m, integrals);
        }
        for (i, scene) in scenes.iter().enumerate() {
            scene_section(m, result, scene, i, (&images, shrink, pyramid_shrink));
        }
        repeat(m, result);
        explanations(m);
    });
    m
}

fn head(m: &mut Markup, result: &ExperimentResult, title: &str, scenes: &[SceneReport], has_integrals: bool) {
    m.element("header", &[], |m| {
        m.line("h1", &[], title);
        if !result.experiment.description.is_empty() {
            m.line("p", &[("class", &"lead")], &result.experiment.description);
        }
        m.line("p", &[("class", &"facts")], facts(result));
        if !result.manifest.complete {
            let text =
                "This experiment was interrupted: the numbers below are those of the replicates that were finished.";
            m.line("p", &[("class", &"warning")], text);
        }
        m.element("nav", &[("aria-label", &"Contents")], |m| {
            m.element("ul", &[], |m| {
                if has_integrals {
                    m.element("li", &[], |m| m.line("a", &[("href", &"#integrals")], INTEGRALS));
                }
                for (i, scene) in scenes.iter().enumerate() {
                    m.element("li", &[], |m| m.line("a", &[("href", &format!("#scene-{i}"))], scene.name));
                }
                for (id, name) in [("#repeat", "How to repeat it"), ("#terms", "What the numbers mean")] {
                    m.element("li", &[], |m| m.line("a", &[("href", &id)], name));
                }
            });
        });
    });
}

/// One line: how much of what, where and when.
fn facts(result: &ExperimentResult) -> String {
    let manifest = &result.manifest;
    let mut facts = Vec::new();
    if let Some(first) = result.methods.first() {
        let m = &first.measurement;
        facts.push(format!("{} × {} pixels", m.width, m.height));
        facts.push(format!("orders 0 to {}", m.max_order));
    }
    let range = |number: &dyn Fn(&MethodResult) -> u64| {
        let numbers = || result.methods.iter().map(number);
        let (least, most) = (numbers().min()?, numbers().max()?);
        Some(if least == most { least.to_string() } else { format!("{least} to {most}") })
    };
    let samples = range(&|m| m.measurement.samples());
    let replicates = range(&|m| u64::from(m.measurement.replicates));
    if let (Some(samples), Some(replicates)) = (samples, replicates) {
        facts.push(format!("{samples} samples per pixel in {replicates} replicates"));
    }
    facts.push(format!("{:.0} s on {} threads", manifest.seconds, manifest.machine.threads));
    facts.push(manifest.started.clone());
    facts.push(format!("neumann {}", manifest.neumann));
    facts.join(" · ")
}

/// What the samplers are by themselves, without a scene.
fn integrals_section(m: &mut Markup, integrals: &Integrals) {
    m.element("section", &[("id", &"integrals")], |m| {
        m.line("h2", &[], INTEGRALS);
        sentences(m, &integrals.sentences());
        m.line("h3", &[], "Point sets");
        wide(m, "Point sets", |m| m.append(&points::svg(&integrals.samplers, None)));
        m.line("h3", &[], "Errors over the screen");
        wide(m, "Errors over the screen", |m| screens::table(m, &integrals.screens));
        m.line("h3", &[], "Error against samples");
        figures(m, "figures", &integrals.charts);
        integrals.tables(m);
    });
}

fn scene_section(
    m: &mut Markup,
    result: &ExperimentResult,
    scene: &SceneReport,
    index: usize,
    (images, shrink, pyramid_shrink): (&viewer::Images, usize, usize),
) {
    let rows: Vec<&AgreementRow> = result.agreement.iter().filter(|r| r.scene == scene.name).collect();
    let slopes: Vec<&SlopeRow> = result.slopes.iter().filter(|r| r.scene == scene.name).collect();
    let columns = &scene.numbers.columns;
    m.element("section", &[("id", &format!("scene-{index}"))], |m| {
        m.line("h2", &[], scene.name);
        sentences(m, &summary::of_scene(result, &scene.methods, &scene.numbers));

        m.line("h3", &[], "Images");
        images.write(m, index);
        let embedded = match images.shrink {
            1 => String::new(),
            n => format!(
                "So that this page stays below 15 MB, the viewer's images are means of {n} × {n} pixels; the EXR files hold all. "
            ),
        };
        let pictures = match shrink {
            1 => String::new(),
            n => format!("The small pictures are shown at 1/{n} of their size; plots/ has them whole. "),
        };
        wide(m, "Pictures", |m| images::table(m, &scene.methods, columns, shrink));
        let text = format!("{embedded}{pictures}Values in the viewer are within 0.05 % of those of the EXR files, standard errors within 4.5 %.");
        m.line("p", &[("class", &"note")], text);

        let choices: Vec<&ChoiceRow> = result.choices.iter().filter(|row| row.scene == scene.name).collect();
        if !choices.is_empty() {
            m.line("h3", &[], "The best method for every order");
            choices::tables(m, &choices, &scene.labels());
        }

        m.line("h3", &[], "Variance and efficiency");
        figures(m, "figures large", &scene.by_order);
        m.element("div", &[("class", &"side-by-side")], |m| {
            for quantity in &tables::QUANTITIES {
                tables::quantity(m, quantity, &scene.methods, &scene.numbers);
            }
        });
        if scene.numbers.rows.iter().flatten().flatten().any(|row| row.is_lit() && !row.complete) {
            m.line(
                "p",
                &[("class", &"note")],
                "† The method can't carry all of this light here, or is biased, so it is not ranked.",
            );
        }

        let sequences: Vec<&SequenceRow> = result.sequences.iter().filter(|row| row.scene == scene.name).collect();
        if !sequences.is_empty() {
            errors::sequences(m, &sequences);
        }
        if scene.methods.iter().any(|method| !method.marginal.is_empty()) {
            errors::marginal(m, &scene.methods, columns);
        }
        folded(m, "Covariances between orders", |m| errors::covariances(m, &scene.methods));

        if scene.methods.iter().any(|method| method.judged.is_some()) {
            m.line("h3", &[], "Errors against the reference");
            figures(m, "figures", &scene.times);
            errors::tables(m, &result.experiment, &scene.methods, columns);
        }

        if !scene.convergence.is_empty() {
            m.line("h3", &[], "Convergence");
            m.element("div", &[("class", &"switched")], |m| {
                grouped_figures(m, "order", &scene.convergence);
                folded(m, "The same against seconds", |m| {
                    grouped_figures(m, "order, against seconds", &scene.convergence_in_seconds)
                });
                folded(m, "The same, a figure for each method", |m| {
                    grouped_figures(m, "method", &scene.convergence_of_methods)
                });
            });
            let ratios: Vec<&RatioRow> = result.ratios.iter().filter(|r| r.scene == scene.name).collect();
            samplers::ratios(m, &ratios, &scene.methods, columns);
            if !slopes.is_empty() {
                folded(m, "Fitted slopes with their intervals", |m| {
                    tables::slopes(m, &slopes, &scene.methods, columns)
                });
            }
        }
        let apart = scene.methods.iter().filter(|method| has_strategies(method));
        for (i, method) in apart.enumerate() {
            if i == 0 {
                m.line("h3", &[], "Strategies");
                m.line("p", &[("class", &"note")], strategies::WORDS);
            }
            m.element("div", &[("class", &"figures pyramids")], |m| strategies::pyramids(m, method, pyramid_shrink));
        }
        if !rows.is_empty() {
            m.line("h3", &[], "Do the methods agree?");
            tables::agreement(m, &rows);
            agreement::histogram(m, &rows);
            folded(m, "Maps of where they differ", |m| wide(m, "Maps of differences", |m| agreement::maps(m, &rows)));
            folded(m, "Every comparison with all its numbers", |m| tables::agreement_in_full(m, &rows));
        }
        let largest: Vec<&FireflyRecord> = result.fireflies.iter().filter(|r| r.scene == scene.name).collect();
        if !largest.is_empty() {
            folded(m, "The largest contributions, and how to trace them again", |m| fireflies::table(m, &largest));
        }
        scene_facts(m, result, scene);
    });
}

fn has_strategies(method: &MethodResult) -> bool {
    method.measurement.parts.iter().any(Part::is_strategy)
}

/// What scrolls by itself where the page is narrow.
fn wide(m: &mut Markup, label: &str, content: impl FnOnce(&mut Markup)) {
    m.element("div", &[("class", &"scroll"), ("role", &"group"), ("tabindex", &0), ("aria-label", &label)], content);
}

fn sentences(m: &mut Markup, sentences: &[Sentence]) {
    m.element("ul", &[("class", &"summary")], |m| {
        for sentence in sentences {
            let class = if sentence.tone == Tone::Warning { "warning" } else { "finding" };
            m.line("li", &[("class", &class)], &sentence.text);
        }
    });
}

fn figures(m: &mut Markup, class: &'static str, figures: &[Figure]) {
    m.element("div", &[("class", &class)], |m| each_figure(m, figures));
}

/// Figures that the reader may choose among, by what there is one of each for.
fn grouped_figures(m: &mut Markup, group: &'static str, figures: &[Figure]) {
    m.element("div", &[("class", &"figures"), ("data-group", &group)], |m| each_figure(m, figures));
}

fn each_figure(m: &mut Markup, figures: &[Figure]) {
    for figure in figures {
        m.element("figure", &[], |m| {
            m.append(&figure.chart.inline());
            let left_out = figure.chart.left_out();
            if !left_out.is_empty() {
                m.line(
                    "figcaption",
                    &[],
                    format!("Not drawn, having no variance or not all of the light: {}.", left_out.join("; ")),
                );
            }
        });
    }
}

fn folded(m: &mut Markup, title: &'static str, content: impl FnOnce(&mut Markup)) {
    m.element("details", &[], |m| {
        m.line("summary", &[], title);
        content(m);
    });
}

fn scene_facts(m: &mut Markup, result: &ExperimentResult, scene: &SceneReport) {
    m.line("h3", &[], "The scene");
    m.element("dl", &[], |m| {
        let mut fact = |name: &'static str, value: String| {
            m.line("dt", &[], name);
            m.element("dd", &[], |m| m.line("bdi", &[], value));
        };
        if let Some(record) = result.manifest.scenes.iter().find(|s| s.name == scene.name) {
            fact("loaded from", record.source.clone());
            fact("content hash", record.hash.clone());
            fact("pixel filter", record.filter.clone());
            fact("left out, not being needed", or_nothing(&record.skipped));
            fact("approximated when it was loaded", or_nothing(&record.notes));
        }
        m.line("dt", &[], "work");
        for method in &scene.methods {
            m.line("dd", &[], work(method));
        }
    });
}

/// What a method's render cost.
fn work(method: &MethodResult) -> String {
    let counters = &method.measurement.counters;
    let seconds = method.measurement.seconds();
    let rays = (counters.closest + counters.shadow) as f64;
    let million = |n: f64| format!("{:.1} million", n / 1e6);
    format!(
        "{}: {seconds:.2} s, {} rays ({} a second), {} connections",
        brief(&method.label),
        million(rays),
        million(rays / seconds),
        million(counters.connections as f64)
    )
}

fn or_nothing(items: &[String]) -> String {
    if items.is_empty() { "nothing".to_owned() } else { items.join("; ") }
}

fn repeat(m: &mut Markup, result: &ExperimentResult) {
    m.element("section", &[("id", &"repeat")], |m| {
        m.line("h2", &[], "How to repeat it");
        m.element("p", &[], |m| {
            m.text("Command: ");
            let words: Vec<String> = result.manifest.command_line.iter().map(|word| quoted(word)).collect();
            m.line("code", &[], words.join(" "));
        });
        tables::scrolling(m, "Methods and settings", |m| {
            m.line("caption", &[], "Methods with all of their settings");
            m.element("thead", &[], |m| {
                m.element("tr", &[], |m| {
                    for name in ["label", "method", "sampler", "settings"] {
                        m.line("th", &[("scope", &"col")], name);
                    }
                });
            });
            m.element("tbody", &[], |m| {
                for method in &result.manifest.methods {
                    m.element("tr", &[], |m| {
                        m.element("th", &[("scope", &"row")], |m| m.line("bdi", &[], &method.label));
                        m.line("td", &[], &method.method);
                        m.line("td", &[], method.sampler);
                        m.element("td", &[], |m| settings_of(m, result, method));
                    });
                }
            });
        });
        folded(m, "Manifest", |m| {
            let manifest = serde_json::to_string_pretty(&result.manifest).unwrap_or_else(|e| e.to_string());
            m.element("pre", &[("tabindex", &0)], |m| m.line("code", &[], manifest));
        });
        m.line(
            "p",
            &[("class", &"note")],
            "Beside this page: records.csv has every number, SCENE/METHOD.exr every order as linear 32-bit values, plots/ the figures.",
        );
    });
}

/// Of a composite whose runs were chosen: what was, scene by scene.
fn settings_of(m: &mut Markup, result: &ExperimentResult, method: &MethodRecord) {
    let chosen: Vec<_> = result.choices.iter().filter(|row| row.label == method.label).collect();
    if chosen.is_empty() {
        m.line("code", &[], &method.settings);
    }
    for row in chosen {
        m.element("div", &[], |m| {
            m.text(format!("{}: ", row.scene));
            m.line("code", &[], row.choice.setting());
        });
    }
}

fn explanations(m: &mut Markup) {
    m.element("section", &[("id", &"terms")], |m| {
        m.line("h2", &[], "What the numbers mean");
        m.verbatim(include_str!("terms.html"));
    });
}
