//! Settings given as lists: a method is run with each of their values, and with each combination where several settings have lists.

use super::MethodEntry;
use toml::Value;

/// More methods than this are no experiment that anyone waits for.
pub const MOST_METHODS: usize = 256;

impl MethodEntry {
    /// The entries that this one stands for: with every combination of the values of settings that are lists.
    ///
    /// # Errors
    /// If a list is empty, or there are too many combinations.
    pub fn swept(&self) -> Result<Vec<MethodEntry>, String> {
        let mut entries = vec![self.clone()];
        for (key, value) in &self.settings {
            let Value::Array(values) = value else { continue };
            if values.is_empty() {
                return Err(format!("setting `{key}` is an empty list; give it a value, or several to try each"));
            }
            if entries.len() * values.len() > MOST_METHODS {
                return Err(format!("its lists of settings have more than {MOST_METHODS} combinations; shorten them"));
            }
            let with = |entry: &MethodEntry, value: &Value| {
                let mut entry = entry.clone();
                entry.settings.insert(key.clone(), value.clone());
                entry.label = entry.label.map(|label| format!("{label} {key}={}", plain(value)));
                entry
            };
            entries = entries.iter().flat_map(|entry| values.iter().map(move |value| with(entry, value))).collect();
        }
        Ok(entries)
    }
}

/// A value without quotes.
fn plain(value: &Value) -> String {
    value.as_str().map_or_else(|| value.to_string(), str::to_owned)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn swept(settings: &str, label: Option<&str>) -> Result<Vec<(Option<String>, String)>, String> {
        let settings = toml::from_str(settings).unwrap();
        let entry = MethodEntry { name: "bdpt".to_owned(), label: label.map(str::to_owned), settings };
        Ok(entry.swept()?.into_iter().map(|e| (e.label, e.settings.to_string().replace('\n', ";"))).collect())
    }

    #[test]
    fn lists_are_tried_value_by_value_in_every_combination() {
        let all = swept("mis = [\"balance\", \"power\"]\nlight_paths = [1, 2]\nroulette = \"none\"", None).unwrap();
        assert_eq!(all.len(), 4);
        assert!(all.iter().all(|(label, text)| label.is_none() && text.contains("roulette = \"none\"")));
        assert!(all.iter().any(|(_, text)| text.contains("light_paths = 2") && text.contains("mis = \"power\"")));
        assert_eq!(swept("mis = \"power\"", None).unwrap().len(), 1);
    }

    #[test]
    fn labels_say_which_value_is_whose() {
        let labels: Vec<_> = swept("mis = [\"balance\", \"power\"]", Some("mine")).unwrap();
        assert_eq!(labels[1].0.as_deref(), Some("mine mis=power"));
    }

    #[test]
    fn empty_and_endless_lists_are_refused() {
        assert!(swept("mis = []", None).unwrap_err().contains("`mis`"));
        let long = (0..20).map(|i| i.to_string()).collect::<Vec<_>>().join(",");
        assert!(swept(&format!("a = [{long}]\nb = [{long}]"), None).unwrap_err().contains("256"));
    }
}
