use super::*;
use integrators::integrator::Pixel;
use integrators::scratch::Scratch;
use integrators::{Contribution, Estimator, Integrator, Methods, Orders, Render, RenderSettings, Request, Sink, Wants};
use sampling::sampler::{Sampler, SamplerKind};
use scenes::Scene;
use serde::{Deserialize, Serialize};
use serde_json::json;

/// `path`, with the contributions of some pixels dimmed.
#[derive(Serialize, Deserialize, Default)]
struct Dimmed {
    factor: f32,
    columns: u32,
    path: integrators::path::Path,
}

struct Dimmer<'s, S> {
    of: &'s Dimmed,
    out: &'s mut S,
}

impl<S: Sink> Sink for Dimmer<'_, S> {
    const WANTS: Wants = S::WANTS;

    fn add(&mut self, mut contribution: Contribution) {
        if contribution.raster.x < self.of.columns as f32 {
            contribution.value *= self.of.factor;
        }
        self.out.add(contribution);
    }
}

impl Estimator for Dimmed {
    fn estimate<S: Sink>(
        &self,
        scene: &Scene,
        request: &Request,
        pixel: Pixel,
        sampler: &mut Sampler,
        scratch: &mut Scratch,
        out: &mut S,
    ) {
        self.path.estimate(scene, request, pixel, sampler, scratch, &mut Dimmer { of: self, out });
    }
}

/// What a method measures of a scene in so many replicates of so many samples.
fn result(
    scene: &Scene,
    method: &dyn Integrator,
    label: &str,
    last: usize,
    seed: u64,
    (replicates, samples): (u32, u32),
) -> MethodResult {
    let settings = RenderSettings {
        samples_per_replicate: samples,
        ..crate::subject::render_settings(method, Orders::up_to(last), false, seed, SamplerKind::Independent)
    };
    let mut render = Render::new(scene, method, settings).unwrap();
    (0..replicates).for_each(|_| render.run_replicate(&|_| {}));
    MethodResult {
        scene: scene.name.clone(),
        method: label.to_owned(),
        label: label.to_owned(),
        entry: String::new(),
        sampler: SamplerKind::Independent,
        settings: method.settings(),
        setting: String::new(),
        measurement: render.finish(),
        intervals: None,
        judged: None,
        marginal: Vec::new(),
        convergence: Vec::new(),
        largest_hits: Vec::new(),
        missing_light: Vec::new(),
        bias: integrators::Bias::None,
        skipped: Vec::new(),
    }
}

/// The Cornell box by `path`, and by `path` dimmed in so many of 32 columns.
fn results(factor: f32, columns: u32) -> [MethodResult; 2] {
    let methods = Methods::standard().with::<Dimmed>("dimmed", "path, dimmed");
    let options = scenes::LoadOptions { size: Some((32, 32)), ..Default::default() };
    let scene = scenes::load("cornell_box", &options).unwrap();
    let run = |name: &str, settings: serde_json::Value| {
        result(&scene, &*methods.build(name, &settings).unwrap(), name, 1, 3, (8, 16))
    };
    [run("path", json!({})), run("dimmed", json!({"factor": factor, "columns": columns}))]
}

/// Verdicts of order 1 between the two.
fn verdict(factor: f32, columns: u32) -> AgreementRow {
    let results = results(factor, columns);
    compare(&[&results[0], &results[1]]).swap_remove(1)
}

#[test]
fn means_that_coincide_by_chance_are_not_exact() {
    let mut results = results(1.0, 0);
    let mean = results[0].measurement.replicate_means[0][1][0];
    for (result, mean) in results.iter_mut().zip([mean, 1.003 * mean]) {
        result.measurement.replicate_means.iter_mut().for_each(|means| means[1] = [mean; 3]);
    }
    let row = compare(&[&results[0], &results[1]]).swap_remove(1);
    assert!((row.mean_b / row.mean_a - 1.003).abs() < 1e-9 && row.verdict == Verdict::Agree, "{row:?}");
    assert!(row.t.abs() < 3.0 && row.detectable_bias > 0.005, "{row:?}");
}

#[test]
fn a_bias_is_found_over_the_image_and_in_a_part_of_it() {
    let same = verdict(1.0, 0);
    assert_eq!((same.verdict, same.rejected), (Verdict::Agree, 0), "{same:?}");
    assert!(same.detectable_bias < 0.03, "{same:?}");
    let everywhere = verdict(0.95, 32);
    assert_eq!(everywhere.verdict, Verdict::Differ, "{everywhere:?}");
    // A quarter less in an eighth of the image, at its dark edge, moves the mean by less than can be found there.
    let locally = verdict(0.75, 4);
    assert_eq!(locally.verdict, Verdict::Differ, "{locally:?}");
    assert!(locally.rejected > 0, "{locally:?}");
}

/// Two methods of seven are dimmed alike in all blocks, so that ten pairs differ, and eleven do not. A hundredth of the pairs and orders that are
/// named may be named by chance, in either family: one in five looks, more than 5 with a probability of 8·10⁻⁴.
#[test]
fn what_differs_in_many_blocks_lets_no_others_pass_for_it() {
    let methods = Methods::standard().with::<Dimmed>("dimmed", "path, dimmed");
    let options = scenes::LoadOptions { size: Some((96, 96)), ..Default::default() };
    let scene = scenes::load("cornell_box", &options).unwrap();
    let method = |name: &str, settings: serde_json::Value| methods.build(name, &settings).unwrap();
    let (path, dimmed) = (method("path", json!({})), method("dimmed", json!({"factor": 0.5, "columns": 96})));
    let (mut named, mut by_chance) = (0, 0);
    for look in 0..5 {
        let results = [&path, &path, &path, &path, &path, &dimmed, &dimmed];
        let results = results
            .into_iter()
            .zip(7 * look..)
            .map(|(method, seed)| result(&scene, &**method, method.name(), 1, seed, (16, 4)));
        for row in compare(&results.collect::<Vec<_>>().iter().collect::<Vec<_>>()) {
            let differ = usize::from(row.verdict == Verdict::Differ);
            *(if row.a == row.b { &mut by_chance } else { &mut named }) += differ;
        }
    }
    println!("{named} of 100 that differ are named, and {by_chance} of 110 that do not");
    assert!(named == 100 && by_chance <= 5, "{named} {by_chance}");
}

/// A lamp whose edges reach some blocks by the filter's negative lobes alone: their means are below zero, and rest on few contributions.
/// Each look fails with a probability of at most 2 % (two families), and four or more of 20 with one of 6·10⁻⁴.
#[test]
fn negative_lobes_of_a_filter_raise_no_false_alarm() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("lamp.toml");
    let lamp = "[camera]\nposition = [0, 0, 3]\ntarget = [0, 0, 0]\nwidth = 64\nheight = 64\nfov = 40\nfilter = \"mitchell\"\n\
                [materials.white]\ntype = \"lambert\"\nalbedo = 0.6\n[[shapes]]\ntype = \"quad\"\norigin = [-0.4, -0.3, 0]\n\
                edge_u = [0.7, 0.1, 0]\nedge_v = [0, 0.5, 0.2]\nmaterial = \"white\"\nemission = 1.5\n";
    std::fs::write(&file, lamp).unwrap();
    let scene = scenes::load(&file.to_string_lossy(), &scenes::LoadOptions::default()).unwrap();
    let methods = Methods::standard();
    let [path, light] = ["path", "light"].map(|name| methods.build(name, &json!({})).unwrap());
    let failing = (0..20).filter(|&seed| {
        let results =
            [result(&scene, &*path, "path", 0, seed, (16, 2)), result(&scene, &*light, "light", 0, seed, (16, 2))];
        let row = compare(&[&results[0], &results[1]]).swap_remove(0);
        assert!(row.blocks > 100 && row.mean_a > 0.0 && row.mean_b > 0.0, "{row:?}");
        row.verdict != Verdict::Agree
    });
    let failing = failing.count();
    assert!(failing <= 3, "{failing} of 20 fail");
}

/// What a method has not met once may be rare; where it is known that there is none, all that is found is too much.
#[test]
fn nothing_against_something_decides_nothing_unless_nothing_is_the_truth() {
    let mut results = results(0.0, 32);
    let verdict = |results: &[MethodResult]| compare(&[&results[0], &results[1]]).swap_remove(1).verdict;
    assert_eq!(verdict(&results), Verdict::Inconclusive);
    results[1].method = "exact".to_owned();
    assert_eq!(verdict(&results), Verdict::Differ);
}

/// Pairs of which one found no light are no discoveries, in whose company less would do to be one.
#[test]
fn what_found_nothing_does_not_loosen_the_test_of_others() {
    let [mut a, mut b] = results(1.0, 0);
    let wave = |i: usize| 1.0 + 0.01 * (1.7 * i as f64).sin();
    let mut pair = |shift: f64| {
        for (result, shift, first) in [(&mut a, 0.0, 0), (&mut b, shift, 100)] {
            let means = result.measurement.replicate_means.iter_mut().enumerate();
            means.for_each(|(i, means)| means[1] = [wave(first + i) + shift; 3]);
        }
        [a.clone(), b.clone()]
    };
    let [_, dark] = results(0.0, 32);
    let row =
        |[a, b]: &[MethodResult; 2], others: &[&MethodResult]| compare(&[&[a, b], others].concat()).swap_remove(1);
    let shifts = (0..200).map(|i| 1e-4 * f64::from(i));
    // Too little to be found among two tests, but enough if there were discoveries beside it.
    let near = shifts.map(&mut pair).find(|pair| row(pair, &[]).p < 0.0075).unwrap();
    let alone = row(&near, &[]);
    assert!(alone.p > 0.005 && alone.verdict == Verdict::Agree, "{alone:?}");
    let beside = row(&near, &[&dark]);
    assert_eq!((beside.verdict, beside.p), (Verdict::Agree, alone.p), "{beside:?}");
}

/// Who lacks light may lack paths that are rare and bring much, if there are such paths in the method that has less of it.
#[test]
fn what_may_be_paths_not_met_yet_decides_nothing() {
    let judged = |factor: f32, hit: f64| {
        let mut results = results(factor, 32);
        results[1].largest_hits = vec![[hit; 3]; 2];
        compare(&[&results[0], &results[1]]).swap_remove(1)
    };
    let lacking = judged(0.9, 1e6);
    assert_eq!((lacking.verdict, lacking.lacking.as_deref()), (Verdict::Inconclusive, Some("dimmed")), "{lacking:?}");
    assert!(lacking.hidden_bias > 1.0 && lacking.detectable_bias < 0.03, "{lacking:?}");
    // A tenth of the light in paths of radiance 1 is thousands of paths.
    let regular = judged(0.9, 1.0);
    assert_eq!((regular.verdict, regular.lacking.as_deref()), (Verdict::Differ, None), "{regular:?}");
    assert!(regular.hidden_bias < 0.01, "{regular:?}");
    // Paths that were not met explain no more light than the other found.
    assert_eq!(judged(1.1, 1e6).verdict, Verdict::Differ);
}

/// Were all values 0 but one in so many, means would be skewed by this much; and no values but those of replicates are known less.
#[test]
fn the_skewness_of_a_mean_is_at_least_what_it_shows_and_what_its_samples_allow() {
    let means = [1.0, 1.1, 0.9, 1.0];
    let known = measured::lean(&means, None);
    assert!((known - 1.5 * (0.005_f64 / 3.0).sqrt()).abs() < 1e-12, "{known}");
    let (rare, n) = (1e-3, 100_000);
    let kurtosis = (1.0 - 3.0 * rare * (1.0 - rare)) / (rare * (1.0 - rare));
    let lean = measured::lean(&means, Some((kurtosis, n)));
    let skewness = (1.0 - 2.0 * rare) / (rare * (1.0 - rare) * n as f64).sqrt();
    assert!((lean / (1.5 * skewness) - 1.0).abs() < 1e-3, "{lean} {skewness}");
    assert!(measured::lean(&[0.0; 4], None).is_infinite() && measured::lean(&[2.0; 4], None) == 0.0);
}
