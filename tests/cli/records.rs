//! What an experiment leaves behind.

use super::*;

#[test]
fn an_experiment_leaves_records_images_a_manifest_and_a_report() {
    let folder = folder_with(&[("tiny.toml", EXPERIMENT)]);
    let said = succeed(folder.path(), &["run", "tiny.toml"]);
    assert!(said.contains("no two methods differ") && said.contains("report.html"), "{said}");
    let results = folder.path().join("results/tiny");

    let records = std::fs::read_to_string(results.join("records.csv")).unwrap();
    let header =
        "experiment,scene,method,setting,sampler,order,spp,replicates,seconds,quantity,channel,value,ci_low,ci_high";
    assert_eq!(records.lines().next(), Some(header));
    assert!(records.lines().all(|line| line.split(',').count() == 14));
    for quantity in
        ["mean", "variance", "efficiency", "rays_closest", "checkpoint_variance", "agreement_detectable_bias"]
    {
        assert!(records.contains(&format!(",{quantity},")), "{quantity} is not in the records");
    }
    let told = include_str!("../../docs/experiments.md");
    for quantity in records.lines().skip(1).filter_map(|line| line.split([',', ':']).nth(9)) {
        assert!(told.contains(&format!("`{quantity}")), "{quantity} is not told");
    }
    let manifest = json(&results, "manifest.json");
    assert_eq!((manifest["complete"].as_bool(), manifest["experiment"]["spp"].as_u64()), (Some(true), Some(8)));
    for file in manifest["files"].as_array().unwrap() {
        assert!(results.join(file.as_str().unwrap()).is_file(), "{file} is missing");
    }
    let image = read_layers(&results.join("furnace/bdpt.exr")).unwrap();
    assert!(image.layer("order02_var").is_some());
    assert!(std::fs::read_to_string(results.join("report.html")).unwrap().contains("</html>"));
    assert!(!files(&results).iter().any(|(name, _)| name.contains("partial") || name.contains("tmp")));
}

#[test]
fn samplers_are_compared_and_tried_on_integrals() {
    let text = format!(
        "{}[integrals]\nsize = [2, 2]\ncheckpoints = [4, 16]\nreplicates = 32\n",
        EXPERIMENT.replace("[[methods]]\nname = \"bdpt\"\n", "").replace("furnace", "cornell_box")
    );
    let folder = folder_with(&[("s.toml", &format!("sampler = [\"independent\", \"sobol\"]\n{text}"))]);
    let said = succeed(folder.path(), &["run", "s.toml"]);
    assert!(said.contains("cornell_box, sobol against independent, 2 samples per pixel: RMSE · order 0"), "{said}");
    let results = folder.path().join("results/s");
    let records = std::fs::read_to_string(results.join("records.csv")).unwrap();
    let has = |start: &str, quantity: &str| {
        let found = records.lines().any(|line| line.starts_with(start) && line.contains(&format!(",{quantity},")));
        assert!(found, "no {quantity} in rows that begin with {start}");
    };
    has("s,cornell_box,path,,sobol,1,", "mean");
    has("s,cornell_box,path,,sobol,1,", "rmse_ratio");
    has("s,cornell_box,path vs path,", "agreement_t");
    ["exact", "mean", "mse", "integral_p", "slope", "rmse_ratio"].iter().for_each(|q| has("s,gaussian_3,,,sobol,", q));
    let manifest = json(&results, "manifest.json");
    assert_eq!(manifest["methods"][1]["sampler"].as_str(), Some("sobol"));
    assert_eq!(manifest["scenes"][0]["filter"].as_str(), Some("box"));
    for file in
        ["cornell_box/sobol.exr", "plots/samplers_points.svg", "plots/samplers_screens.png", "plots/integral_edge.svg"]
    {
        assert!(results.join(file).is_file(), "{file} is missing");
    }
}
