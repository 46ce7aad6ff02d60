//! How a method's settings are read.

use crate::method::MethodError;
use serde::Serialize;
use serde::de::DeserializeOwned;
use serde_json::Value;

/// What these settings make; those left out take their defaults.
///
/// # Errors
/// If there is no such setting, with the nearest valid name, or a value is not of the setting's kind.
pub fn parse_settings<E: Serialize + DeserializeOwned + Default>(
    method: &str,
    settings: &Value,
) -> Result<E, MethodError> {
    let bad = |reason: String| MethodError::BadSetting { method: method.to_owned(), reason };
    let defaults = serde_json::to_value(E::default()).map_err(|e| bad(e.to_string()))?;
    let Value::Object(mut merged) = defaults else { return Err(bad("its settings are no table".to_owned())) };
    match settings {
        Value::Null => {}
        Value::Object(given) => {
            for (key, value) in given {
                if !merged.contains_key(key) {
                    let known: Vec<&str> = merged.keys().map(String::as_str).collect();
                    let mend = match nearest(key, &known) {
                        Some(near) => format!("did you mean `{near}`? (settings: {})", known.join(", ")),
                        None => "it has no settings".to_owned(),
                    };
                    return Err(MethodError::UnknownSetting { method: method.to_owned(), key: key.clone(), mend });
                }
                merged.insert(key.clone(), value.clone());
                serde_json::from_value::<E>(Value::Object(merged.clone()))
                    .map_err(|e| bad(format!("setting `{key}`: {}", with_nearest(&e.to_string()))))?;
            }
        }
        _ => return Err(bad("settings must be a table of names and values".to_owned())),
    }
    serde_json::from_value(Value::Object(merged)).map_err(|e| bad(e.to_string()))
}

/// What serde says of a value of the wrong kind, in words that are not Rust's: "invalid type: string "x", expected u32" becomes
/// "string "x", where a whole number is needed".
fn in_plain_words(message: &str) -> String {
    const KINDS: [(&str, &str); 13] = [
        ("a nonzero u32", "a whole number of at least 1"),
        ("a nonzero u16", "a whole number of at least 1"),
        ("u16", "a whole number"),
        ("usize", "a whole number"),
        ("u64", "a whole number"),
        ("u32", "a whole number"),
        ("u8", "a whole number"),
        ("f64", "a number"),
        ("f32", "a number"),
        ("a boolean", "true or false"),
        ("a string", "a name"),
        ("string or map", "a name"),
        ("a sequence", "a list"),
    ];
    let told = message.strip_prefix("invalid type: ").or_else(|| message.strip_prefix("invalid value: "));
    match told.and_then(|told| told.rsplit_once(", expected ")) {
        Some((given, kind)) => {
            let kind = KINDS.iter().find(|(serde, _)| *serde == kind).map_or(kind, |(_, plain)| plain);
            format!("{given}, where {kind} is needed")
        }
        None => message.to_owned(),
    }
}

/// serde's message in plain words, and with the nearest valid name where it is about an unknown one: "unknown field `spb`,
/// expected one of `spp`, …".
pub fn with_nearest(message: &str) -> String {
    let quoted: Vec<&str> = message.split('`').skip(1).step_by(2).collect();
    match quoted.split_first() {
        Some((given, valid)) if message.starts_with("unknown ") => match nearest(given, valid) {
            Some(near) => format!("{message}; did you mean `{near}`?"),
            None => message.to_owned(),
        },
        _ => in_plain_words(message),
    }
}

/// The name most like `name`, if there is any name.
pub fn nearest<'n>(name: &str, names: &[&'n str]) -> Option<&'n str> {
    let similarity = |other: &str| strsim::jaro_winkler(&name.to_lowercase(), &other.to_lowercase());
    names.iter().copied().max_by(|a, b| similarity(a).total_cmp(&similarity(b)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values_of_the_wrong_kind_are_told_of_in_plain_words() {
        let number = serde_json::from_value::<u32>(Value::from("x")).unwrap_err().to_string();
        assert!(in_plain_words(&number).starts_with("string \"x\", where a whole number is needed"), "{number}");
        let negative = serde_json::from_value::<u32>(Value::from(-1)).unwrap_err().to_string();
        assert_eq!(in_plain_words(&negative), "integer `-1`, where a whole number is needed");
        assert_eq!(in_plain_words("order 9 is above 8"), "order 9 is above 8");
    }
}
