//! Laws of parameters: what may be said of a model makes one.

use super::{Draws, listed, test_directions};
use sampling::Spectrum;
use sampling::bsdf::{Argument, Arguments, Bsdf, Domain, Lambert, MAX_PARAMETERS, ModelEntry, Preset, TransportMode};

#[test]
fn every_model_is_made_from_its_presets() {
    'models: for ModelEntry { name, about, parameters, from_arguments, .. } in Bsdf::MODELS {
        assert!(parameters.len() <= MAX_PARAMETERS && !about.is_empty(), "{name}");
        let mut arguments = Arguments::presets(parameters);
        for (place, parameter) in parameters.iter().enumerate() {
            let what = format!("{name}.{}", parameter.name);
            assert!(
                parameters.iter().filter(|other| other.name == parameter.name).count() == 1,
                "{what} is listed twice"
            );
            match (parameter.preset, parameter.domain) {
                (Preset::Number(x), Domain::Number(..) | Domain::Colour(..)) => {
                    assert!(parameter.domain.holds(x), "{what}")
                }
                (Preset::Choice(word), Domain::Choice(words)) => assert!(words.contains(&word), "{what}"),
                (Preset::Absent, _) => {}
                // No file can be made up; its model has unit tests of its own.
                (Preset::Required(_), Domain::File { .. }) => continue 'models,
                (Preset::Required(example), domain) => {
                    let Some(argument) = stand_in(domain) else { panic!("{what}: {example} for {domain}") };
                    arguments.set(place, argument);
                }
                (preset, domain) => panic!("{what}: {preset:?} in {domain}"),
            }
        }
        from_arguments(&arguments).unwrap_or_else(|misfit| panic!("{name}: {misfit}"));
    }
}

/// Something that a parameter which must be given may be; `None` where there is no such thing.
fn stand_in(domain: Domain) -> Option<Argument> {
    static LAMBERT: Bsdf = Bsdf::Lambert(Lambert { albedo: Spectrum::splat(0.5) });
    match domain {
        Domain::Number(from, to) => Some(Argument::Number(0.5 * (from + to))),
        Domain::Colour(from, to) => Some(Argument::Colour(Spectrum::splat(0.5 * (from + to)))),
        Domain::Choice(_) => Some(Argument::Choice(0)),
        Domain::Numbers { least, read } => read(&vec![1.0; least]).ok().map(Argument::Table),
        Domain::File { .. } => None,
        Domain::Model => Some(Argument::Model(&LAMBERT)),
    }
}

/// A parameter's lowest and highest values and what is next to the lowest, where widths are too narrow to be resolved.
fn extremes(domain: Domain) -> Vec<Argument> {
    match domain {
        Domain::Number(from, to) => [from, from + 1e-8, from + 1e-4, to].map(Argument::Number).to_vec(),
        Domain::Colour(from, to) => [from, from + 1e-8, to].map(|x| Argument::Colour(Spectrum::splat(x))).to_vec(),
        Domain::Choice(words) => (0..words.len()).map(Argument::Choice).collect(),
        Domain::Numbers { .. } | Domain::File { .. } | Domain::Model => Vec::new(),
    }
}

#[test]
fn extreme_parameters_make_models_that_scatter_finite_light() {
    let mut draws = Draws::new("extremes");
    for ModelEntry { name, parameters, from_arguments, .. } in Bsdf::MODELS {
        let mut usual = Arguments::presets(parameters);
        for (place, parameter) in parameters.iter().enumerate() {
            if matches!(parameter.preset, Preset::Required(_)) {
                usual.set(place, stand_in(parameter.domain).unwrap_or(Argument::Absent));
            }
        }
        if parameters.iter().any(|parameter| matches!(parameter.domain, Domain::File { .. })) {
            continue;
        }
        for (place, parameter) in parameters.iter().enumerate() {
            for extreme in extremes(parameter.domain) {
                let mut arguments = usual;
                arguments.set(place, extreme);
                // One width along, one across.
                if let Some(across) = parameters.iter().position(|other| other.name == "alpha_y")
                    && parameter.name == "alpha_x"
                {
                    arguments.set(across, Argument::Number(0.2));
                }
                let what = format!("{name} with {} = {extreme:?}", parameter.name);
                match from_arguments(&arguments) {
                    Ok(model) => scatters_finite_light(&model, &mut draws, &what),
                    // Every width is a model, and so is every word.
                    Err(misfit) => assert!(
                        !["roughness", "alpha", "alpha_x", "distribution"].contains(&parameter.name),
                        "{what}: {misfit}"
                    ),
                }
            }
        }
    }
}

/// Whether samples and values are finite and not negative.
fn scatters_finite_light(model: &Bsdf, draws: &mut Draws, what: &str) {
    let good = |f: Spectrum| f.is_finite() && f.to_array().iter().all(|c| *c >= 0.0);
    for (i, wo) in test_directions().into_iter().enumerate() {
        for j in 0..64 {
            let (uc, u) = draws.at(0, (64 * i + j) as u32);
            let Some(sample) = model.sample(wo, uc, u, TransportMode::Radiance) else { continue };
            assert!(good(sample.weight) && sample.pdf.is_finite() && sample.pdf > 0.0, "{what}, wo {wo:?}: {sample:?}");
            let (f, pdf) = model.eval_pdf(wo, sample.wi, TransportMode::Radiance);
            assert!(good(f) && pdf.is_finite() && pdf >= 0.0, "{what}, wo {wo:?}, {sample:?}: {f:?} {pdf}");
        }
    }
}

#[test]
fn every_model_in_the_list_has_examples() {
    for ModelEntry { name, examples, .. } in Bsdf::MODELS {
        assert!(examples().iter().any(|model| model.name() == *name), "{name} has no examples");
        assert_eq!(Bsdf::MODELS.iter().filter(|other| other.name == *name).count(), 1, "{name} is listed twice");
    }
    for (name, model) in listed() {
        assert!(!model.lobes().is_empty(), "{name} has no lobes: {model:?}");
        let survival = model.survival();
        assert!(survival > 0.0 && survival <= 1.0, "{name} survives with {survival}: {model:?}");
    }
}
