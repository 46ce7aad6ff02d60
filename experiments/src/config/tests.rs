//! What experiment files may ask for.

use super::*;
use crate::source::Source;

#[test]
fn the_listed_keys_are_those_of_the_struct() {
    let mut experiment = Source::open("samplers").unwrap().parse().unwrap();
    (experiment.seconds, experiment.size) = (Some(1.0), Some(Sizes(vec![[4, 4]])));
    experiment.layers = vec!["groups".to_owned()];
    experiment.lpe = BTreeMap::from([("caustics".to_owned(), "CDS+L".to_owned())]);
    experiment.until = Some(Until { order: OrderChoice::All, relative_error: Some(0.1), detectable_bias: None });
    (experiment.max_spp, experiment.metrics) = (Some(512), vec!["mse".to_owned()]);
    experiment.reference = Some(Reference::of_file("r.exr".to_owned()));
    let mut known = Experiment::KEYS.to_vec();
    known.sort_unstable();
    let mut table: Vec<String> = toml::Table::try_from(&experiment).unwrap().keys().cloned().collect();
    table.sort_unstable();
    assert_eq!(table, known);
}

#[test]
fn faults_of_measurements_over_samples_name_their_own_keys() {
    let mut experiment = Source::open("samplers").unwrap().parse().unwrap();
    experiment.integrals.as_mut().unwrap().replicates = 8;
    assert_eq!(experiment.check().unwrap_err().0, "integrals.replicates");
    experiment.convergence.as_mut().unwrap().checkpoints = vec![4, 4];
    assert_eq!(experiment.check().unwrap_err().0, "convergence.checkpoints");
}

#[test]
fn budgets_without_an_end_and_metrics_without_a_reference_are_faults() {
    let told = |change: &str| -> Fault {
        let table = format!("scenes = [\"furnace\"]\nmethods = [{{ name = \"path\" }}]\nspp = 4\n{change}");
        toml::from_str::<Experiment>(&table).unwrap().check().unwrap_err()
    };
    let key = |change: &str| told(change).0;
    assert!(told("until = { relative_error = 0.1 }").1.contains("max_spp or seconds"));
    assert_eq!(key("max_spp = 8"), "max_spp");
    assert_eq!(key("until = { relative_error = 0.1 }\nmax_spp = 2"), "max_spp");
    assert_eq!(key("until = { detectable_bias = 0.1 }\nmax_spp = 8"), "until");
    assert_eq!(key("until = { relative_error = 1.5 }\nmax_spp = 8"), "until");
    assert_eq!(key("until = { relative_error = 0.1, order = 9 }\nmax_spp = 8"), "until");
    assert_eq!(key("metrics = [\"mse\"]"), "metrics");
    assert!(told("metrics = [\"rlmse\"]\n[reference]").1.contains("did you mean `relmse`"));
    assert_eq!(key("[reference]\nspp = 9"), "reference.spp");
    assert_eq!(key("[reference]\nmethods = [\"path\"]\nfile = \"a.exr\""), "reference.file");
    assert_eq!(key("time_to_error = [0.0]"), "time_to_error");
}

#[test]
fn a_method_is_a_table_or_a_name_alone() {
    let read = |methods: &str| {
        toml::from_str::<Experiment>(&format!("scenes = [\"furnace\"]\nmethods = {methods}\nspp = 4\n"))
    };
    let experiment = read("[\"path\", { name = \"bdpt\", label = \"both\", settings = { light_paths = 2 } }]").unwrap();
    let [path, bdpt] = &experiment.methods[..] else { panic!("{:?}", experiment.methods) };
    assert_eq!((path.name.as_str(), path.label.as_deref(), path.settings.len()), ("path", None, 0));
    assert_eq!((bdpt.name.as_str(), bdpt.label.as_deref(), bdpt.settings.len()), ("bdpt", Some("both"), 1));
    // What is written is read again.
    let again: Experiment = toml::from_str(&toml::to_string(&experiment).unwrap()).unwrap();
    assert_eq!(again.methods, experiment.methods);
    // Faults are told with their place.
    for (methods, told) in [("[3]", "a method's name, or a table"), ("[{ nam = \"path\" }]", "unknown field `nam`")] {
        let error = read(methods).unwrap_err();
        assert!(error.message().contains(told) && error.span().is_some_and(|span| span.start > 20), "{error:?}");
    }
}

#[test]
fn uneven_budgets_name_the_even_ones() {
    assert_eq!(samples_per_replicate(64, 4), Ok(16));
    assert!(samples_per_replicate(10, 4).unwrap_err().contains("8 or 12 samples, or 2 replicates"));
    // One replicate has no variance.
    assert!(samples_per_replicate(1, 4).unwrap_err().ends_with("take 4 samples"));
    assert!(samples_per_replicate(u32::MAX, 4).unwrap_err().contains("4294967296"));
    assert!(samples_per_replicate(0, 4).is_err());
    // Of a prime, and many replicates, the divisor is found at once too.
    let told = samples_per_replicate(4_294_967_291, 4_294_967_290).unwrap_err();
    assert!(told.ends_with("take 4294967290 or 8589934580 samples"), "{told}");
}

#[test]
fn times_that_no_clock_counts_are_refused() {
    for seconds in [0.0, -1.0, f64::NAN, f64::INFINITY, 1e300] {
        assert!(check_seconds(seconds).unwrap_err().contains("seconds"), "{seconds}");
    }
    assert_eq!(check_seconds(3600.0), Ok(()));
}
