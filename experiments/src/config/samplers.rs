//! The samplers of an experiment: one name, or a list of them.

use sampling::sampler::SamplerKind;
use serde::de::value::{SeqAccessDeserializer, StrDeserializer};
use serde::de::{Error, SeqAccess, Visitor};
use serde::{Deserialize, Deserializer, Serialize, Serializer};
use std::fmt;

/// The samplers that every method is run with. In a file, `"sobol"` or `["independent", "sobol"]`; others are compared with the first.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Samplers(pub Vec<SamplerKind>);

impl Default for Samplers {
    fn default() -> Self {
        Self(vec![SamplerKind::default()])
    }
}

impl Samplers {
    /// Whether there are any, and all of them different.
    ///
    /// # Errors
    /// If not so, with the mend.
    pub fn check(&self) -> Result<(), String> {
        if self.0.is_empty() {
            return Err("no samplers; name at least one, such as sampler = \"independent\"".to_owned());
        }
        match (1..self.0.len()).find(|&i| self.0[..i].contains(&self.0[i])) {
            Some(i) => Err(format!("{} is listed twice; leave one out", self.0[i])),
            None => Ok(()),
        }
    }
}

impl Serialize for Samplers {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        match self.0.as_slice() {
            [one] => one.serialize(serializer),
            list => list.serialize(serializer),
        }
    }
}

impl<'de> Deserialize<'de> for Samplers {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_any(OneOrMore)
    }
}

struct OneOrMore;

impl<'de> Visitor<'de> for OneOrMore {
    type Value = Samplers;

    fn expecting(&self, f: &mut fmt::Formatter) -> fmt::Result {
        f.write_str("a sampler's name or a list of names")
    }

    fn visit_str<E: Error>(self, name: &str) -> Result<Samplers, E> {
        Ok(Samplers(vec![SamplerKind::deserialize(StrDeserializer::new(name))?]))
    }

    fn visit_seq<A: SeqAccess<'de>>(self, names: A) -> Result<Samplers, A::Error> {
        Ok(Samplers(Vec::deserialize(SeqAccessDeserializer::new(names))?))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[derive(Debug, PartialEq, Serialize, Deserialize)]
    struct File {
        sampler: Samplers,
    }

    #[test]
    fn one_name_and_lists_are_read_and_written() {
        use SamplerKind::{Independent, Sobol};
        for (text, samplers) in [("\"sobol\"", vec![Sobol]), ("[\"independent\", \"sobol\"]", vec![Independent, Sobol])]
        {
            let file: File = toml::from_str(&format!("sampler = {text}")).unwrap();
            assert_eq!(file.sampler.0, samplers);
            assert_eq!(toml::from_str::<File>(&toml::to_string(&file).unwrap()).unwrap(), file);
        }
    }

    #[test]
    fn faults_are_named() {
        for text in ["\"sobel\"", "[\"sobol\", \"sobel\"]"] {
            let message = toml::from_str::<File>(&format!("sampler = {text}")).unwrap_err().message().to_owned();
            assert!(integrators::with_nearest(&message).contains("did you mean `sobol`"), "{message}");
        }
        assert!(toml::from_str::<File>("sampler = 3").unwrap_err().message().contains("list of names"));
        assert!(Samplers(vec![]).check().is_err() && Samplers(vec![SamplerKind::Sobol; 2]).check().is_err());
    }
}
