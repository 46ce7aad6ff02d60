//! The image sizes of an experiment: one, or a list of them.

use serde::{Deserialize, Serialize};
use toml::Value;

/// Image sizes `[width, height]` in which every scene is rendered. In a file, `[256, 256]` or `[[64, 64], [256, 256]]`.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(try_from = "Value", into = "Value")]
pub struct Sizes(pub Vec<[u32; 2]>);

impl Sizes {
    /// Whether there are any, all of them different and none empty.
    ///
    /// # Errors
    /// If not so, with the mend.
    pub fn check(&self) -> Result<(), String> {
        if self.0.is_empty() {
            return Err("no sizes; name at least one, such as size = [256, 256]".to_owned());
        }
        if self.0.iter().any(|size| size.contains(&0)) {
            return Err("width and height must be at least 1, such as size = [256, 256]".to_owned());
        }
        match (1..self.0.len()).find(|&i| self.0[..i].contains(&self.0[i])) {
            Some(i) => Err(format!("{:?} is listed twice; leave one out", self.0[i])),
            None => Ok(()),
        }
    }
}

impl TryFrom<Value> for Sizes {
    type Error = String;

    fn try_from(value: Value) -> Result<Self, String> {
        let expected = || "a size is [width, height], such as [256, 256]; several are a list of these".to_owned();
        let number = |value: &Value| value.as_integer().and_then(|n| u32::try_from(n).ok());
        let pair = |value: &Value| match value.as_array().map(Vec::as_slice) {
            Some([width, height]) => Some([number(width)?, number(height)?]),
            _ => None,
        };
        if let Some(size) = pair(&value) {
            return Ok(Self(vec![size]));
        }
        let list = value.as_array().ok_or_else(expected)?;
        list.iter().map(pair).collect::<Option<_>>().map(Self).ok_or_else(expected)
    }
}

impl From<Sizes> for Value {
    fn from(sizes: Sizes) -> Value {
        let pair = |size: &[u32; 2]| Value::from(size.map(i64::from).to_vec());
        match sizes.0.as_slice() {
            [one] => pair(one),
            list => Value::Array(list.iter().map(pair).collect()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[derive(Debug, PartialEq, Serialize, Deserialize)]
    struct File {
        size: Sizes,
    }

    #[test]
    fn one_size_and_lists_are_read_and_written() {
        for (text, sizes) in [("[4, 2]", vec![[4, 2]]), ("[[4, 2], [8, 8]]", vec![[4, 2], [8, 8]])] {
            let file: File = toml::from_str(&format!("size = {text}")).unwrap();
            assert_eq!(file.size.0, sizes);
            assert_eq!(toml::from_str::<File>(&toml::to_string(&file).unwrap()).unwrap(), file);
        }
    }

    #[test]
    fn faults_are_named() {
        for text in ["3", "[4]", "[4, -2]", "[[4, 2], 3]", "\"64x64\""] {
            let message = toml::from_str::<File>(&format!("size = {text}")).unwrap_err().message().to_owned();
            assert!(message.contains("[width, height]"), "{message}");
        }
        for sizes in [vec![], vec![[4, 0]], vec![[4, 4]; 2]] {
            assert!(Sizes(sizes).check().is_err());
        }
    }
}
