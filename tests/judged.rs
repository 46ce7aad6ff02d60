//! A biased method is told by its bias², and only that.

use crate::support::builtin;
use integrators::integrator::Pixel;
use integrators::scratch::Scratch;
use integrators::{Contribution, Estimator, Methods, Request, Sink, Wants};
use neumann::cli::RunArgs;
use neumann::progress::Verbosity;
use neumann::stop::Stop;
use sampling::sampler::Sampler;
use scenes::Scene;
use serde::{Deserialize, Serialize};
use std::path::Path;

/// `path`, a tenth darker at order 2.
#[derive(Serialize, Deserialize, Default)]
struct Dim {
    path: integrators::path::Path,
}

/// What is left of order 2.
const LEFT: f32 = 0.9;

struct Dimmer<'s, S>(&'s mut S);

impl<S: Sink> Sink for Dimmer<'_, S> {
    const WANTS: Wants = S::WANTS;

    fn add(&mut self, mut contribution: Contribution) {
        if contribution.technique.order() == 2 {
            contribution.value *= LEFT;
        }
        self.0.add(contribution);
    }
}

impl Estimator for Dim {
    fn estimate<S: Sink>(
        &self,
        scene: &Scene,
        request: &Request,
        pixel: Pixel,
        sampler: &mut Sampler,
        scratch: &mut Scratch,
        out: &mut S,
    ) {
        self.path.estimate(scene, request, pixel, sampler, scratch, &mut Dimmer(out));
    }
}

/// Value and interval of a quantity.
fn row(folder: &Path, method: &str, order: &str, quantity: &str) -> (f64, f64, f64) {
    let table = std::fs::read_to_string(folder.join("records.csv")).unwrap();
    let rows = table.lines().map(|line| line.split(',').collect::<Vec<_>>());
    let mut mine = rows.filter(|r| r[2] == method && r[5] == order && r[9] == quantity && r[10] == "all");
    let found = mine.next().unwrap_or_else(|| panic!("no {quantity} of {method} at {order}"));
    let number = |text: &str| text.parse().unwrap_or(f64::NAN);
    (number(found[11]), number(found[12]), number(found[13]))
}

/// In the furnace order 2 is known, and so is what a tenth of it squared is. Five p-values of what has no bias are above 10⁻³: false-alarm
/// rate 0.5 %, and that of the three intervals 10 %, of a fixed seed.
#[test]
fn a_method_that_loses_light_is_told_by_its_bias() {
    let folder = tempfile::tempdir().unwrap();
    let (file, out) = (folder.path().join("dim.toml"), folder.path().join("out"));
    let table = "scenes = [\"furnace\"]\nspp = 512\nreplicates = 32\nmax_order = 3\nsize = [12, 12]\ntime_to_error = [1e-4, 0.1]\n\
        [[methods]]\nname = \"path\"\n[[methods]]\nname = \"dim\"\n[reference]\nspp = 16\nreplicates = 4\n";
    std::fs::write(&file, table).unwrap();
    let methods = Methods::standard().with::<Dim>("dim", "path with a fault");
    let experiment = file.to_string_lossy().into_owned();
    let args = RunArgs { experiment, out: Some(out.clone()), ..RunArgs::default() };
    neumann::run_command::run(&args, &methods, Verbosity::Quiet, &Stop::never()).unwrap();

    let scene = builtin("furnace", 4);
    let radiance = scene.exact(2, sampling::Vec3::ZERO, sampling::Vec3::Z).unwrap();
    let square = radiance.to_array().iter().map(|v| f64::from(*v).powi(2)).sum::<f64>() / 3.0;
    let expected = square * f64::from(1.0 - LEFT).powi(2);
    let relative = expected / (square + 0.01);
    let (value, low, high) = row(&out, "dim", "2", "bias2");
    println!("bias² {value:e} [{low:e}, {high:e}], {expected:e} expected");
    assert!(low < expected && expected < high && low > 0.5 * expected && high < 2.0 * expected);
    assert!(row(&out, "dim", "2", "bias2_p").0 < 1e-4);
    // MSE is variance and bias².
    let variance = row(&out, "dim", "2", "variance").0 / 16.0;
    let mse = row(&out, "dim", "2", "mse");
    assert!(mse.1 < variance + expected && variance + expected < mse.2, "{mse:?} {variance:e}");
    // So small an error is never reached, and a larger one later than without the bias.
    assert!(1e-4 < relative && relative < 0.1, "{relative}");
    let never = row(&out, "dim", "2", "time_to_error:0.0001");
    assert!(never.0.is_infinite() && never.1.is_infinite(), "{never:?}");
    assert!(row(&out, "dim", "2", "time_to_error:0.1").2.is_finite());
    for (method, order) in [("dim", "1"), ("dim", "3"), ("path", "1"), ("path", "2"), ("path", "3")] {
        let p = row(&out, method, order, "bias2_p").0;
        println!("{method} at {order}: p = {p:.4} without a bias");
        assert!(p > 1e-3, "{method} at {order}: {p:e}");
        assert!(row(&out, method, order, "time_to_error:0.0001").0.is_finite());
    }
    let page = std::fs::read_to_string(out.join("report.html")).unwrap();
    assert!(page.contains("Biased, against the reference: dim at T²E"), "the report says so");
}
