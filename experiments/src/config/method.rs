//! One method of an experiment: a table, or a name alone.

use serde::de::value::MapAccessDeserializer;
use serde::de::{Error, MapAccess, Visitor};
use serde::{Deserialize, Deserializer, Serialize, Serializer};
use std::fmt;

/// One method of an experiment.
///
/// What is derived reads and writes the table, by functions of the type itself; those of the traits, below, read a name alone as well.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, remote = "Self")]
pub struct MethodEntry {
    /// Registered name.
    pub name: String,
    /// What the results call it; its name, with the settings where a name occurs twice, if left out.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub label: Option<String>,
    /// The settings that differ from the defaults; a list of values stands for a method with each of them.
    #[serde(default, skip_serializing_if = "toml::Table::is_empty")]
    pub settings: toml::Table,
}

impl Serialize for MethodEntry {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        Self::serialize(self, serializer)
    }
}

impl<'de> Deserialize<'de> for MethodEntry {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_any(NameOrTable)
    }
}

struct NameOrTable;

impl<'de> Visitor<'de> for NameOrTable {
    type Value = MethodEntry;

    fn expecting(&self, formatter: &mut fmt::Formatter) -> fmt::Result {
        formatter.write_str("a method's name, or a table of name, label and settings")
    }

    fn visit_str<E: Error>(self, name: &str) -> Result<MethodEntry, E> {
        Ok(MethodEntry { name: name.to_owned(), label: None, settings: toml::Table::new() })
    }

    fn visit_map<A: MapAccess<'de>>(self, table: A) -> Result<MethodEntry, A::Error> {
        MethodEntry::deserialize(MapAccessDeserializer::new(table))
    }
}
