//! `neumann figure`: figures from results, in all their forms, and what is said where one cannot be drawn.

use super::*;

const RESULTS: &str = "scenes = [\"glass_caustic\"]\nspp = 64\nreplicates = 16\nmax_order = 3\nsize = [24, 18]\n\
    reference = { methods = [\"bdpt\"], spp = 512 }\n\
    [[methods]]\nname = \"path\"\n[[methods]]\nname = \"light\"\n[[methods]]\nname = \"bdpt\"\n\
    [convergence]\nsize = [8, 8]\ncheckpoints = [1, 2]\nreplicates = 32\n";
const CROPS: &str = "width = 120\ncaptions = [\"samples\", \"seconds\", \"mse\", \"rmse\", \"relmse\"]\n\
    [[rows]]\nresults = \"out\"\ncrops = [[0, 0, 6, 6], [10, 8, 6, 6]]\n\
    images = [{ method = \"path\" }, { method = \"light\" }, { method = \"bdpt\", label = \"ours\" }, { method = \"reference\" }]\n\
    [[rows]]\nresults = \"out\"\norder = 2\nexposure = 1.5\ntone = \"filmic\"\n\
    images = [{ method = \"bdpt\" }, { file = \"out/glass_caustic/path.exr\" }]\n";
const PLOT: &str = "width = 85\n[plot]\nresults = \"out\"\nquantity = \"variance\"\n";

fn finished() -> TempDir {
    let folder = folder_with(&[("r.toml", RESULTS), ("crops.toml", CROPS), ("plot.toml", PLOT)]);
    succeed(folder.path(), &["run", "r.toml", "--out", "out", "--quiet"]);
    folder
}

#[test]
fn figures_are_drawn_in_every_form_and_of_the_size_asked_for() {
    let folder = finished();
    let read = |name: &str| std::fs::read(folder.path().join(name)).unwrap();
    let said = succeed(folder.path(), &["figure", "crops.toml", "-o", "c.svg", "-o", "c.pdf", "-o", "c.png"]);
    assert_eq!(said, "c.svg\nc.pdf\nc.png\n");
    let svg = text(&read("c.svg"));
    // Two rows: one of a large image and two parts of four, one of two whole images; all of 120 mm at 96 pixels an inch.
    assert_eq!(svg.matches("<image").count(), 1 + 2 * 4 + 2);
    assert!(!svg.contains("<text") && svg.contains("width=\"453.5"), "{}", &svg[..300]);
    let pdf = read("c.pdf");
    assert!(pdf.starts_with(b"%PDF-") && text(&pdf).contains("/MediaBox [0 0 340."));
    assert!(read("c.png").starts_with(b"\x89PNG"));
    succeed(folder.path(), &["figure", "plot.toml"]);
    let plot = text(&read("plot.svg"));
    assert!(["#0072b2", "#d55e00", "#009e73"].iter().all(|colour| plot.contains(colour)), "three methods");
    let said = succeed(folder.path(), &["figure", "out"]);
    assert_eq!(said.lines().count(), 3 * std::fs::read_dir(folder.path().join("out/plots")).unwrap().count() - 3);
    let variance = text(&read("out/figures/glass_caustic_variance.svg"));
    assert!(variance.contains("width=\"321.2") && !variance.contains("<text"));
}

#[test]
fn errors_below_images_are_those_of_the_records_where_a_method_carries_all_light() {
    use neumann::figure::file::{Caption, FigureFile};
    use neumann::figure::{images, numbers};
    let folder = finished();
    let file = folder.path().join("crops.toml");
    let source = neumann::source::Source::file(&file, "").unwrap();
    let shown = images::read(&source, &FigureFile::open(&source).unwrap()).unwrap().remove(0);
    let methods = integrators::Methods::standard();
    let error = |image: usize, caption| numbers::error(&shown, &shown.images[image], caption, &methods).unwrap();
    let records = std::fs::read_to_string(folder.path().join("out/records.csv")).unwrap();
    let recorded = |method: &str, quantity: &str| -> [f64; 3] {
        let rows = records.lines().map(|line| line.split(',').collect::<Vec<_>>());
        let row = rows.into_iter().find(|r| (r[2], r[5], r[9], r[10]) == (method, "total", quantity, "all")).unwrap();
        [11, 12, 13].map(|column| row[column].parse::<f64>().unwrap() / 16.0)
    };
    for (image, method) in [(0, "path"), (2, "bdpt")] {
        for (caption, quantity) in [(Caption::Mse, "mse"), (Caption::Relmse, "relmse")] {
            let (number, [value, low, high]) = (error(image, caption).unwrap(), recorded(method, quantity));
            assert_eq!((number.value, number.interval), (value, Some((low, high))), "{method} {quantity}");
        }
        let (mse, rmse) = (error(image, Caption::Mse).unwrap(), error(image, Caption::Rmse).unwrap());
        assert_eq!(rmse.value, mse.value.sqrt());
    }
    // What `light` cannot carry does not fall with replicates: its error is that of the image, above a sixteenth of a replicate's.
    let light = error(1, Caption::Relmse).unwrap();
    assert!(light.interval.is_none() && light.value > recorded("light", "relmse")[2], "{light:?}");
    assert_eq!(error(3, Caption::Relmse), None, "the reference has no error against itself");
}

#[test]
fn what_cannot_be_drawn_is_told_with_its_line() {
    let folder = finished();
    let with = |from: &str, to: &str, words: &[&str]| {
        assert!(CROPS.contains(from) || PLOT.contains(from), "{from}");
        let text = if CROPS.contains(from) { CROPS } else { PLOT };
        std::fs::write(folder.path().join("f.toml"), text.replacen(from, to, 1)).unwrap();
        refused(folder.path(), &["figure", "f.toml"], words);
    };
    with("\"path\"", "\"pth\"", &["f.toml:6: ", "did you mean `path`", "reference"]);
    with("results = \"out\"\ncrops", "results = \"gone\"\ncrops", &["f.toml:4: ", "gone holds no results"]);
    with("[10, 8, 6, 6]", "[20, 8, 6, 6]", &["f.toml:5: ", "24x18"]);
    with("order = 2", "order = 7", &["f.toml:12: ", "has no order 7", "order03"]);
    with("order = 2", "layer = \"lpe_x\"", &["has no layer `lpe_x`"]);
    with(
        "results = \"out\"\ncrops",
        "results = \"out\"\nscene = \"glas_caustic\"\ncrops",
        &["f.toml:5: ", "did you mean `glass_caustic`"],
    );
    with("\"variance\"", "\"varianc\"", &["f.toml:4: ", "did you mean `variance`"]);
    with("\"variance\"\n", "\"variance\"\nmethods = [\"bpdt\"]\n", &["f.toml:5: ", "did you mean `bdpt`"]);
    refused(folder.path(), &["figure", "gone.toml"], &["gone.toml", "docs/figures.md"]);
    refused(folder.path(), &["figure", "crops.toml", "-o", "a.jpg"], &["a.jpg", ".svg, .pdf, .png"]);
    refused(folder.path(), &["figure", "."], &["holds no plots", "neumann run"]);
}

#[test]
fn shells_and_manuals_know_every_command() {
    let folder = folder_with(&[]);
    let commands = ["run", "report", "figure", "render", "verify", "completions"];
    for shell in ["bash", "zsh", "fish", "powershell", "elvish"] {
        let script = succeed(folder.path(), &["completions", shell]);
        assert!(commands.iter().all(|command| script.contains(command)) && script.contains("max-order"), "{shell}");
    }
    assert!(succeed(folder.path(), &["man"]).contains(".TH neumann 1"));
    succeed(folder.path(), &["man", "--out", "pages"]);
    for command in commands {
        let page = std::fs::read_to_string(folder.path().join(format!("pages/neumann-{command}.1"))).unwrap();
        assert!(page.contains(&format!(".TH neumann-{command} 1")), "{page:.300}");
    }
    let help = succeed(folder.path(), &["--help"]);
    assert!(help.contains("Examples:") && help.contains("neumann figure results/comparison"));
    // What is no terminal has no colours, in an error neither.
    let message = text(&neumann(folder.path(), &["rendr"]).stderr);
    assert!(message.contains("render") && !message.contains('\u{1b}'), "{message}");
}
