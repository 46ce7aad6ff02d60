//! What people read of an experiment: one self-contained `report.html`, with the plots and picture sheets beside it.
//!
//! [`numbers`] takes the figures from the measurements, [`summary`] says them in sentences, [`tables`] and [`images`] show
//! them, [`viewer`] has the images themselves, [`fireflies`] the largest contributions, [`agreement`] where methods differ, [`strategies`] by which paths it was found, [`errors`] how far they are from a reference, [`samplers`] and [`screens`] do the same for samplers, [`page`] puts the page together. The HTML is written in Rust, through [`crate::export::markup`]: what a template
//! engine would add here is its syntax, its errors at run time and its time to build, while here a name can't become markup
//! and a missing number doesn't compile.

pub mod agreement;
pub mod choice_picture;
pub mod choices;
pub mod errors;
pub mod fireflies;
pub mod images;
pub mod numbers;
pub mod page;
pub mod samplers;
pub mod screens;
pub mod strategies;
pub mod summary;
pub mod tables;
pub mod viewer;

use crate::budget::file_name;
use crate::export::{ExportError, png, write_atomically};
use crate::plot::{self, Against};
use crate::result::{ExperimentResult, MethodResult};
use numbers::Numbers;
use std::path::Path;

/// One scene of an experiment with all that is derived from it.
pub struct SceneReport<'a> {
    /// The scene's name.
    pub name: &'a str,
    /// Its methods, in the experiment's order.
    pub methods: Vec<&'a MethodResult>,
    /// Their numbers.
    pub numbers: Numbers,
    /// Variance and efficiency by order.
    pub by_order: Vec<plot::Figure>,
    /// Times to errors, by order; empty where nothing was judged.
    pub times: Vec<plot::Figure>,
    /// Convergence of every order and of their sum, a line for each method; empty where it wasn't measured.
    pub convergence: Vec<plot::Figure>,
    /// The same against seconds.
    pub convergence_in_seconds: Vec<plot::Figure>,
    /// That against samples with a figure for each method.
    pub convergence_of_methods: Vec<plot::Figure>,
}

impl SceneReport<'_> {
    /// The methods' labels, in the order of their colours.
    pub fn labels(&self) -> Vec<&str> {
        self.methods.iter().map(|method| method.label.as_str()).collect()
    }

    /// All its plots.
    pub fn figures(&self) -> impl Iterator<Item = &plot::Figure> {
        let convergence =
            self.convergence.iter().chain(&self.convergence_in_seconds).chain(&self.convergence_of_methods);
        self.by_order.iter().chain(&self.times).chain(convergence)
    }
}

/// Derives what is shown of every scene.
pub fn scenes(result: &ExperimentResult) -> Vec<SceneReport<'_>> {
    let scene = |name| {
        let methods: Vec<&MethodResult> = result.of_scene(name).collect();
        let numbers = Numbers::of(&methods);
        let by_order = plot::by_order(name, &methods, &numbers);
        let [convergence, convergence_in_seconds] = [Against::Samples, Against::Seconds]
            .map(|against| plot::convergence(name, &methods, &result.slopes, &numbers, against));
        let convergence_of_methods = plot::convergence_of_methods(name, &methods, &result.slopes, &numbers);
        let times = plot::times(name, &methods, &numbers, &result.experiment.time_to_error);
        SceneReport {
            name,
            methods,
            numbers,
            by_order,
            times,
            convergence,
            convergence_in_seconds,
            convergence_of_methods,
        }
    };
    result.scenes().into_iter().map(scene).collect()
}

/// Writes `report.html` and `plots/` into the experiment's folder: of each scene every plot as SVG, and a sheet of pictures
/// that compares the methods. The scenes' names are taken to be fit for files.
///
/// # Errors
/// If a file can't be written.
pub fn write(dir: &Path, result: &ExperimentResult) -> Result<(), ExportError> {
    let plots = dir.join("plots");
    std::fs::create_dir_all(&plots).map_err(|source| ExportError::Write { path: plots.clone(), source })?;
    let scenes = scenes(result);
    for scene in &scenes {
        for figure in scene.figures() {
            write_atomically(&plots.join(format!("{}.svg", figure.file)), figure.chart.file().as_bytes())?;
        }
        let rows: Vec<_> = scene.methods.iter().map(|m| (m.label.as_str(), &m.measurement)).collect();
        let methods = scene.labels();
        for choice in result.choices.iter().filter(|choice| choice.scene == scene.name) {
            let file = format!("{}_{}.svg", scene.name, file_name(&choice.label));
            write_atomically(&plots.join(file), choice_picture::file(choice, &methods).as_bytes())?;
        }
        png::write_comparison_sheet(&plots.join(format!("{}_orders.png", scene.name)), &rows, scene.name)?;
    }
    let integrals = samplers::Integrals::of(result);
    if let Some(integrals) = &integrals {
        integrals.write(&plots)?;
    }
    write_atomically(&dir.join("report.html"), page::page(result, &scenes, integrals.as_ref()).as_bytes())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::export::testing::measurement;
    use crate::fireflies::FireflyRecord;
    use crate::observations::Intervals;
    use crate::result::{
        AgreementRow, Checkpoint, Machine, Manifest, MethodRecord, Program, RatioRow, SceneRecord, SlopeRow, Verdict,
    };
    use integrators::Layer;
    use sampling::sampler::SamplerKind;

    fn method(scene: &str, name: &str, label: &str, replicates: u32) -> MethodResult {
        let point = |samples: u32, variance| Checkpoint {
            samples,
            replicates: 32,
            seconds: 0.1,
            replicate_seconds: Vec::new(),
            order: Some(Layer::Order(1)),
            variance,
            ci: (variance * 0.9, variance * 1.1),
            mean: 1.0,
            replicate_variances: Vec::new(),
        };
        MethodResult {
            scene: scene.to_owned(),
            method: name.to_owned(),
            label: label.to_owned(),
            entry: label.to_owned(),
            sampler: SamplerKind::Independent,
            settings: serde_json::json!({"note": scene}),
            setting: String::new(),
            measurement: measurement(name, replicates, false),
            intervals: None,
            judged: None,
            marginal: Vec::new(),
            convergence: vec![point(1, 1.0), point(2, 0.0), point(4, f64::NAN)],
            largest_hits: Vec::new(),
            missing_light: if name == "direct" { vec![scene.to_owned()] } else { Vec::new() },
            bias: integrators::Bias::None,
            skipped: Vec::new(),
        }
    }

    /// Two methods in one scene, every name being the given one.
    fn result(name: &str, replicates: u32) -> ExperimentResult {
        let table = "scenes = [\"cornell_box\"]\nmethods = [{ name = \"path\" }]\nspp = 4";
        let mut experiment: crate::config::Experiment = toml::from_str(table).unwrap();
        experiment.title = name.to_owned();
        experiment.description = name.to_owned();
        let methods = vec![method(name, "direct", "direct", replicates), method(name, "path", name, replicates)];
        let agreement = AgreementRow {
            scene: name.to_owned(),
            a: "direct".to_owned(),
            b: name.to_owned(),
            order: Layer::Order(1),
            mean_a: 0.0,
            mean_b: f64::NAN,
            t: f64::INFINITY,
            p: 0.0,
            blocks: 6,
            rejected: 6,
            smallest_adjusted_p: 0.0,
            lacking: None,
            hidden_bias: 0.0,
            detectable_bias: f64::INFINITY,
            verdict: Verdict::Differ,
            tests: Vec::new(),
            columns: 0,
        };
        let slope = SlopeRow {
            scene: name.to_owned(),
            label: name.to_owned(),
            order: Some(Layer::Order(1)),
            slope: f64::NAN,
            ci: (f64::NAN, f64::NAN),
            intercept: f64::NAN,
            points: 1,
            on_seconds: None,
        };
        let scene = SceneRecord {
            name: name.to_owned(),
            source: name.to_owned(),
            hash: name.to_owned(),
            filter: "box".to_owned(),
            skipped: vec![name.to_owned()],
            notes: vec![name.to_owned()],
            reference: String::new(),
            composites: std::collections::BTreeMap::new(),
            missing: std::collections::BTreeMap::new(),
        };
        let record = MethodRecord {
            label: name.to_owned(),
            method: name.to_owned(),
            settings: serde_json::json!(name),
            sampler: SamplerKind::Sobol,
            instance: name.to_owned(),
        };
        let machine =
            Machine { platform: name.to_owned(), cpu: name.to_owned(), threads: 2, kernels: "portable".to_owned() };
        let manifest = Manifest {
            neumann: "0.1.0".to_owned(),
            program: Program::default(),
            name: name.to_owned(),
            file: None,
            command_line: vec![name.to_owned()],
            experiment: experiment.clone(),
            key: name.to_owned(),
            scenes: vec![scene],
            methods: vec![record],
            renders: Vec::new(),
            machine,
            shards: Vec::new(),
            started: "2026-01-31T12:00:00Z".to_owned(),
            ended: "2026-01-31T12:01:00Z".to_owned(),
            seconds: 60.0,
            complete: false,
        };
        let firefly = FireflyRecord {
            scene: name.to_owned(),
            method: name.to_owned(),
            layer: name.to_owned(),
            rank: 0,
            size: f32::INFINITY,
            share: f64::NAN,
            replicate: 0,
            pixel: (0, 0),
            sample: 0,
            replay: name.to_owned(),
            path: None,
        };
        let name = name.to_owned();
        let ratio = RatioRow {
            scene: name.clone(),
            label: name.clone(),
            baseline: "direct".to_owned(),
            order: Some(Layer::Order(1)),
            samples: 4,
            ratio: 0.5,
            ci: (f64::NAN, f64::INFINITY),
        };
        ExperimentResult {
            name,
            experiment,
            methods,
            agreement: vec![agreement],
            slopes: vec![slope],
            ratios: vec![ratio],
            references: Vec::new(),
            choices: Vec::new(),
            sequences: Vec::new(),
            integrals: Vec::new(),
            fireflies: vec![firefly],
            manifest,
        }
    }

    /// The page without its script.
    fn words(page: &str) -> &str {
        page.split("<script").next().unwrap()
    }

    #[test]
    fn hostile_names_are_text_on_the_page_and_in_the_plots() {
        let name = "</td></svg><script>alert('x')</script><img src=x onerror=\"y\">&\u{202e}\0";
        let result = result(&name.repeat(20), 2);
        let scenes = scenes(&result);
        let plots = scenes.iter().flat_map(SceneReport::figures);
        let mut files: Vec<String> = plots.map(|figure| figure.chart.file()).collect();
        let page = page::page(&result, &scenes, None);
        // The one script is the page's own, and no other may run.
        let (before, script) = page.split_once("<script type=\"module\" nonce=\"").unwrap();
        let (nonce, _) = script.split_once('"').unwrap();
        assert!(before.contains(&format!("script-src &#39;nonce-{nonce}&#39;")) && nonce.len() == 64);
        files.extend([before.to_owned(), script.to_owned()]);
        for file in files {
            assert!(!file.contains("<script") && !file.contains("<img src=x") && !file.contains('\0'));
        }
    }

    #[test]
    fn the_page_is_whole_in_itself_and_says_what_was_not_finished() {
        let folder = tempfile::tempdir().unwrap();
        let result = result("room", 2);
        write(folder.path(), &result).unwrap();
        let page = std::fs::read_to_string(folder.path().join("report.html")).unwrap();
        assert!(page.contains("interrupted") && page.contains("data:image/png;base64,"));
        assert!(!page.contains("href=\"http") && !page.contains("src=\"http") && !words(&page).contains("NaN"));
        // Every picture has a text in its place: four layers and sums of two methods, `direct` having no order 2.
        let page = words(&page);
        assert_eq!(page.matches("<img ").count(), page.matches(" alt=\"").count());
        for plot in ["room_variance.svg", "room_efficiency.svg", "room_convergence_order01.svg", "room_orders.png"] {
            assert!(folder.path().join("plots").join(plot).exists(), "{plot}");
        }
    }

    #[test]
    fn a_single_replicate_has_a_report_without_variances() {
        let result = result("room", 1);
        let scenes = scenes(&result);
        assert!(scenes[0].numbers.rows.iter().flatten().flatten().all(|row| row.efficiency.is_none()));
        assert!(page::page(&result, &scenes, None).contains("</html>"));
    }

    /// With the squares of the sum of eight replicates after the first, times some factor.
    fn noted(times: f64) -> MethodResult {
        let mut method = result("room", 9).methods.remove(1);
        let squares = (0..8).map(|i| times * (1.0 + 0.1 * (f64::from(i) + times).sin())).collect();
        let (variance, efficiency, covariance) = (Vec::new(), Vec::new(), Vec::new());
        method.intervals =
            Some(Intervals { variance, efficiency, covariance, squares: vec![squares], seconds: vec![0.5; 8] });
        method.measurement.replicate_seconds = vec![0.5; 9];
        method
    }

    #[test]
    fn a_quarter_of_the_variance_in_the_same_time_is_four_times_the_efficiency() {
        let ratio = noted(1.0).efficiency_over(&noted(4.0), None).expect("all is noted");
        let (low, high) = ratio.interval.expect("nine replicates");
        assert!((3.0..4.0).contains(&low) && (4.0..5.0).contains(&high), "{ratio:?}");
        assert!(low < ratio.value && ratio.value < high, "{ratio:?}");
        assert!(noted(1.0).efficiency_over(&result("room", 2).methods[1], None).is_none());
    }

    #[test]
    fn a_method_that_misses_light_of_an_order_is_not_ranked_there() {
        let result = result("room", 2);
        let numbers = &scenes(&result)[0].numbers;
        let total = numbers.columns.len() - 1;
        assert_eq!(numbers.columns[total], None);
        let row = |method: usize, column: usize| numbers.rows[method][column].unwrap();
        assert!(!row(0, total).complete && row(1, total).complete);
        assert!(numbers.ranking(total).iter().all(|&(method, _)| method == 1));
        let m = &result.methods[1].measurement;
        let variance = m.total_variance.unwrap().iter().sum::<f64>() / 3.0;
        let expected = 1.0 / (variance * m.seconds() / 2.0);
        assert!((row(1, total).efficiency.unwrap() / expected - 1.0).abs() < 1e-12);
    }
}
