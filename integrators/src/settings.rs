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
                    .map_err(|e| bad(format!("setting `{key}`: {e}")))?;
            }
        }
        _ => return Err(bad("settings must be a table of names and values".to_owned())),
    }
    serde_json::from_value(Value::Object(merged)).map_err(|e| bad(e.to_string()))
}

/// The name most like `name`, if there is any name.
pub fn nearest<'n>(name: &str, names: &[&'n str]) -> Option<&'n str> {
    let similarity = |other: &str| strsim::jaro_winkler(&name.to_lowercase(), &other.to_lowercase());
    names.iter().copied().max_by(|a, b| similarity(a).total_cmp(&similarity(b)))
}
