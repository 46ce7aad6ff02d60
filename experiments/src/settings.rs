//! `--set key=value`: the value is read as TOML, the key is a name or a path of names.

use crate::config::{Experiment, MethodEntry};
use crate::error::{Error, unknown};
use serde_json::Value;
use std::fmt;
use std::str::FromStr;

/// One `--set`.
#[derive(Clone, Debug, PartialEq)]
pub struct Assignment {
    /// The key's parts: `bdpt`, `mis`.
    pub path: Vec<String>,
    /// The value, typed as TOML types it; a bare word is a string.
    pub value: toml::Value,
}

impl FromStr for Assignment {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let example = "write key=value, for example mis=power or bdpt.mis=power";
        let (key, value) = text.split_once('=').ok_or(example)?;
        let path: Vec<String> = key.trim().split('.').map(|part| part.trim().to_owned()).collect();
        if path.iter().any(String::is_empty) {
            return Err(format!("a part of the key is empty; {example}"));
        }
        Ok(Self { path, value: typed(value.trim()) })
    }
}

/// A TOML value; what is none is a string.
fn typed(text: &str) -> toml::Value {
    let read: Option<toml::Table> = toml::from_str(&format!("v = {text}")).ok();
    match read.filter(|table| table.len() == 1).and_then(|mut table| table.remove("v")) {
        Some(value) => value,
        None => toml::Value::String(text.to_owned()),
    }
}

impl fmt::Display for Assignment {
    /// As it was given, but for spaces and quotes.
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        match &self.value {
            toml::Value::String(text) => write!(f, "{}={text}", self.key()),
            other => write!(f, "{}={other}", self.key()),
        }
    }
}

impl Assignment {
    fn key(&self) -> String {
        self.path.join(".")
    }
}

/// The settings that a render's `--set`s give to its method: `mis=power`, `bdpt.mis=power`.
///
/// # Errors
/// If one is meant for another method.
pub fn of_method(assignments: &[Assignment], method: &str) -> Result<Value, Error> {
    let mut settings = serde_json::Map::new();
    for assignment in assignments {
        let key = match assignment.path.as_slice() {
            [key] => key,
            [name, key] if name == method => key,
            _ => {
                let last = &assignment.path[assignment.path.len() - 1];
                return Err(Error::usage(format!(
                    "--set {}: the method is {method}; write {last}=… or {method}.{last}=…",
                    assignment.key()
                )));
            }
        };
        settings.insert(key.clone(), json(&assignment.value));
    }
    Ok(Value::Object(settings))
}

/// Changes an experiment: `METHOD.key` is a setting of all its entries of that name or label, all else a key of its file. Whole keys come first,
/// so that `bdpt.mis=power` is of the `methods` given beside it, wherever they stand.
///
/// # Errors
/// If there is no such key or method, or the value is of another kind.
pub fn change_experiment(experiment: Experiment, assignments: &[Assignment]) -> Result<Experiment, Error> {
    let mut experiment = experiment;
    let (whole, parts): (Vec<_>, Vec<_>) = assignments.iter().partition(|assignment| assignment.path.len() == 1);
    for assignment in whole.into_iter().chain(parts) {
        experiment = change(experiment, assignment)?;
    }
    Ok(experiment)
}

/// The methods of an experiment that a change is of, and which of their settings.
fn meant<'a>(assignment: &'a Assignment, experiment: &Experiment) -> (Vec<usize>, Option<&'a str>) {
    let [first, key] = assignment.path.as_slice() else { return (Vec::new(), None) };
    let methods = (0..experiment.methods.len()).filter(|&i| is_called(&experiment.methods[i], first));
    (methods.collect(), Some(key))
}

fn is_called(entry: &MethodEntry, name: &str) -> bool {
    entry.name == name || entry.label.as_deref() == Some(name)
}

/// The keys of an experiment's file that a change is of: `spp`, `methods.0.settings.mis`.
pub fn keys(assignment: &Assignment, experiment: &Experiment) -> Vec<String> {
    match meant(assignment, experiment) {
        (methods, Some(key)) if !methods.is_empty() => {
            methods.into_iter().map(|i| format!("methods.{i}.settings.{key}")).collect()
        }
        _ => vec![assignment.key()],
    }
}

fn change(mut experiment: Experiment, assignment: &Assignment) -> Result<Experiment, Error> {
    let first = &assignment.path[0];
    if let (methods, Some(key)) = meant(assignment, &experiment)
        && !methods.is_empty()
    {
        for i in methods {
            experiment.methods[i].settings.insert(key.to_owned(), assignment.value.clone());
        }
        return Ok(experiment);
    }
    let bad = |reason: String| Error::usage(format!("--set {}: {reason}", assignment.key()));
    if experiment.methods.iter().any(|entry| is_called(entry, first)) {
        return Err(bad(format!("{first} is a method; write {first}.SETTING=VALUE, such as --set bdpt.mis=power")));
    }
    if !Experiment::KEYS.contains(&first.as_str()) {
        let methods = experiment.methods.iter().map(|entry| entry.name.as_str());
        let mut names: Vec<&str> = Experiment::KEYS.to_vec();
        for name in methods {
            if !names.contains(&name) {
                names.push(name);
            }
        }
        return Err(bad(unknown("key", first, &names)));
    }
    let mut table = toml::Table::try_from(&experiment).map_err(|e| bad(e.to_string()))?;
    insert(&mut table, &assignment.path, &assignment.value).map_err(bad)?;
    table.try_into().map_err(|e: toml::de::Error| bad(integrators::with_nearest(e.message())))
}

fn insert(table: &mut toml::Table, path: &[String], value: &toml::Value) -> Result<(), String> {
    if let [key] = path {
        table.insert(key.clone(), value.clone());
        return Ok(());
    }
    match table.entry(path[0].clone()).or_insert_with(|| toml::Value::Table(toml::Table::new())) {
        toml::Value::Table(inner) => insert(inner, &path[1..], value),
        _ => Err(format!("`{}` holds no keys of its own", path[0])),
    }
}

/// A TOML value as JSON; dates become strings, as do numbers that JSON does not know, so that whoever reads them names them.
pub fn json(value: &toml::Value) -> Value {
    match value {
        toml::Value::String(s) => Value::from(s.as_str()),
        toml::Value::Integer(i) => Value::from(*i),
        toml::Value::Float(f) if !f.is_finite() => Value::from(f.to_string()),
        toml::Value::Float(f) => Value::from(*f),
        toml::Value::Boolean(b) => Value::from(*b),
        toml::Value::Datetime(d) => Value::from(d.to_string()),
        toml::Value::Array(a) => a.iter().map(json).collect(),
        toml::Value::Table(t) => table_to_json(t),
    }
}

/// A TOML table as a JSON object.
pub fn table_to_json(table: &toml::Table) -> Value {
    Value::Object(table.iter().map(|(key, value)| (key.clone(), json(value))).collect())
}

/// The settings that differ from the defaults: `mis=power roulette=off`; empty for none.
pub fn differences(settings: &Value, defaults: &Value) -> String {
    let Value::Object(settings) = settings else { return String::new() };
    let differing = settings.iter().filter(|(key, value)| defaults.get(key) != Some(value));
    let words: Vec<String> = differing
        .map(|(key, value)| match value {
            Value::String(s) => format!("{key}={s}"),
            other => format!("{key}={other}"),
        })
        .collect();
    words.join(" ")
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    fn set(text: &str) -> Assignment {
        text.parse().unwrap()
    }

    #[test]
    fn values_are_typed_as_toml_types_them_and_bare_words_are_strings() {
        assert_eq!(set("mis=power").value, toml::Value::String("power".into()));
        assert_eq!(set("n = 3").value, toml::Value::Integer(3));
        assert_eq!(set("x=0.5").value, toml::Value::Float(0.5));
        assert_eq!(set("size=[4, 2]").value, toml::Value::Array(vec![4.into(), 2.into()]));
        assert_eq!(set("on=true").value, toml::Value::Boolean(true));
        assert_eq!(set("s=\"a b\"").value, toml::Value::String("a b".into()));
        assert_eq!(set("s=1\nv2=2").value, toml::Value::String("1\nv2=2".into()));
        assert_eq!([set("x=nan"), set("x=-inf")].map(|set| super::json(&set.value)), ["NaN", "-inf"]);
    }

    #[test]
    fn a_set_without_key_or_value_is_refused() {
        assert!("mis".parse::<Assignment>().unwrap_err().contains("key=value"));
        assert!(".mis=2".parse::<Assignment>().is_err());
    }

    #[test]
    fn a_setting_may_name_its_method_but_no_other() {
        let both = of_method(&[set("a=1"), set("bdpt.mis=power")], "bdpt").unwrap();
        assert_eq!(both, json!({"a": 1, "mis": "power"}));
        let message = of_method(&[set("path.mis=power")], "bdpt").unwrap_err().to_string();
        assert!(message.contains("bdpt.mis="), "{message}");
    }

    #[test]
    fn a_methods_setting_is_of_the_methods_given_beside_it() {
        let experiment =
            || toml::from_str("scenes = [\"furnace\"]\nmethods = [{name = \"path\"}]\nspp = 16\n").unwrap();
        let sets = [set("bdpt.mis=power"), set("methods=[{name=\"bdpt\"}]")];
        let changed = change_experiment(experiment(), &sets).unwrap();
        assert_eq!(changed.methods[0].settings["mis"].as_str(), Some("power"));
        let message = change_experiment(experiment(), &sets[..1]).unwrap_err().to_string();
        assert!(message.contains("bdpt"), "{message}");
    }

    #[test]
    fn only_what_differs_from_the_defaults_is_named() {
        let defaults = json!({"mis": "balance", "n": 1, "deep": true});
        assert_eq!(differences(&json!({"mis": "power", "n": 1, "deep": false}), &defaults), "deep=false mis=power");
        assert_eq!(differences(&defaults, &defaults), "");
    }
}
