//! `neumann list`: what can be named, read from the lists themselves.

use crate::cli::{ListArgs, ListKind, print};
use crate::error::{Error, Status};
use crate::source::Source;
use integrators::Methods;
use sampling::bsdf::Bsdf;
use sampling::filter::Filter;
use sampling::sampler::SamplerKind;

/// Lists one kind, or all kinds under headings.
///
/// # Errors
/// If standard output cannot be written.
pub fn list(args: &ListArgs, methods: &Methods) -> Result<Status, Error> {
    let kinds = [
        ("methods", ListKind::Methods),
        ("bsdfs", ListKind::Bsdfs),
        ("scenes", ListKind::Scenes),
        ("experiments", ListKind::Experiments),
        ("samplers", ListKind::Samplers),
        ("filters", ListKind::Filters),
    ];
    let text = match args.kind {
        Some(kind) => lines(kind, methods).concat(),
        None => {
            let section = |(title, kind)| format!("{title}\n{}\n", indented(&lines(kind, methods)));
            kinds.map(section).concat()
        }
    };
    print(&text)?;
    Ok(Status::Done)
}

fn indented(lines: &[String]) -> String {
    lines.iter().map(|line| format!("  {line}")).collect()
}

/// One line a name: the name first, so that scripts may cut it off.
fn lines(kind: ListKind, methods: &Methods) -> Vec<String> {
    let plain = |names: &[&str]| names.iter().map(|name| format!("{name}\n")).collect();
    match kind {
        ListKind::Methods => {
            let line = |entry: &integrators::method::MethodEntry| {
                let bias = entry.bias.label().map_or(String::new(), |label| format!(" ({label})"));
                let integrators::method::MethodEntry { name, expression, summary, defaults, .. } = entry;
                format!("{name:<12} {expression:<10} {summary}{bias}; settings {defaults}\n")
            };
            methods.entries().iter().map(line).collect()
        }
        ListKind::Bsdfs => Bsdf::MODELS.iter().map(|model| format!("{:<20} {}\n", model.name, model.about)).collect(),
        ListKind::Scenes => plain(scenes::builtin_names()),
        ListKind::Samplers => {
            SamplerKind::ALL.iter().map(|sampler| format!("{sampler:<14} {}\n", sampler.about())).collect()
        }
        ListKind::Filters => Filter::ALL.iter().map(|filter| format!("{filter}\n")).collect(),
        ListKind::Experiments => {
            let title = |name: &str| Source::open(name).and_then(|s| s.parse()).map(|e| e.title).unwrap_or_default();
            let names = crate::source::LIBRARY.iter().map(|(name, _)| *name);
            names.map(|name| format!("{name:<12} {}\n", title(name))).collect()
        }
    }
}
