//! MTL material libraries: what a file states, before anything is made of it.

use std::collections::BTreeMap;
use std::path::Path;

use super::source::{Statement, number, split, statements};
use crate::error::SceneError;

/// What a material of an MTL file states; `None` where it says nothing.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Statements {
    /// `newmtl`: the name; empty where it has none.
    pub name: String,
    /// Line of the `newmtl`.
    pub line: usize,
    /// `Kd`: diffuse reflectance.
    pub diffuse: Option<[f64; 3]>,
    /// `Ks`: specular reflectance.
    pub specular: Option<[f64; 3]>,
    /// `Ke`: emitted radiance \[W/(m²·sr)\].
    pub emission: Option<[f64; 3]>,
    /// `Tf`: transmission filter.
    pub filter: Option<[f64; 3]>,
    /// `Ns`: exponent of the highlight.
    pub exponent: Option<f64>,
    /// `Ni`: index of refraction.
    pub index: Option<f64>,
    /// `d`: opacity.
    pub opacity: Option<f64>,
    /// `Tr`: transparency.
    pub transparency: Option<f64>,
    /// `illum`: the illumination model.
    pub illumination: Option<i64>,
    /// `map_Kd`: the image of the diffuse reflectance.
    pub diffuse_map: Option<Map>,
    /// `map_Ke`: the image of the emitted radiance.
    pub emission_map: Option<Map>,
    /// `map_d`: the image of the opacity.
    pub opacity_map: Option<Map>,
    /// `map_Bump` or `bump`: the image of heights.
    pub bump_map: Option<Map>,
    /// `norm`: the image of normals.
    pub normal_map: Option<Map>,
    /// Statements that are not read: keyword and rest.
    pub ignored: BTreeMap<String, String>,
}

/// An image that a statement names.
#[derive(Clone, Debug, PartialEq)]
pub struct Map {
    /// The file.
    pub file: String,
    /// `-s`: how often it is repeated per unit of u and of v.
    pub scale: [f64; 2],
    /// `-o`: added after scaling.
    pub offset: [f64; 2],
    /// `-clamp on`: it is not repeated.
    pub clamped: bool,
    /// `-bm`: what heights are multiplied by.
    pub multiplier: f64,
    /// `-imfchan`: the channel that numbers are read from.
    pub channel: Option<char>,
    /// Options that are not read.
    pub ignored: String,
}

/// Reads an MTL text; a bad number is an error that names its line.
pub fn parse(path: &Path, text: &str) -> Result<Vec<Statements>, SceneError> {
    let mut materials: Vec<Statements> = Vec::new();
    for Statement { line, text, .. } in statements(text) {
        let at_line = |error: SceneError| error.in_file(path).at_line(line);
        let (keyword, rest) = split(&text);
        if keyword == "newmtl" {
            materials.push(Statements { name: rest.to_string(), line, ..Statements::default() });
            continue;
        }
        let Some(material) = materials.last_mut() else {
            let message = format!("`{keyword}` comes before any material");
            return Err(at_line(SceneError::invalid(message, "begin each material with `newmtl NAME`")));
        };
        read_statement(material, keyword, rest).map_err(at_line)?;
    }
    Ok(materials)
}

fn read_statement(material: &mut Statements, keyword: &str, rest: &str) -> Result<(), SceneError> {
    match keyword {
        "Kd" | "Ks" | "Ke" | "Tf" => {
            if rest.starts_with("spectral") || rest.starts_with("xyz") {
                material.ignored.insert(keyword.to_string(), rest.to_string());
                return Ok(());
            }
            let value = Some(colour(keyword, rest)?);
            match keyword {
                "Kd" => material.diffuse = value,
                "Ks" => material.specular = value,
                "Ke" => material.emission = value,
                _ => material.filter = value,
            }
        }
        "Ns" => material.exponent = Some(scalar(keyword, rest)?),
        "Ni" => material.index = Some(scalar(keyword, rest)?),
        "d" => material.opacity = Some(scalar(keyword, rest.trim_start_matches("-halo"))?),
        "Tr" => material.transparency = Some(scalar(keyword, rest)?),
        "map_Kd" => material.diffuse_map = Some(Map::read(rest)),
        "map_Ke" => material.emission_map = Some(Map::read(rest)),
        "map_d" => material.opacity_map = Some(Map::read(rest)),
        "map_Bump" | "map_bump" | "bump" => material.bump_map = Some(Map::read(rest)),
        "norm" | "map_Kn" => material.normal_map = Some(Map::read(rest)),
        "illum" => material.illumination = Some(scalar(keyword, rest)? as i64),
        other => _ = material.ignored.insert(other.to_string(), rest.to_string()),
    }
    Ok(())
}

impl Map {
    /// Reads the options and the file behind a keyword.
    fn read(rest: &str) -> Self {
        let (options, file) = file_of(rest);
        let mut map = Self {
            file: file.to_string(),
            scale: [1.0; 2],
            offset: [0.0; 2],
            clamped: false,
            multiplier: 1.0,
            channel: None,
            ignored: String::new(),
        };
        let mut words = options.split_whitespace().peekable();
        while let Some(option) = words.next() {
            let mut values = Vec::new();
            while let Some(value) = words.next_if(|word| !is_option(word)) {
                values.push(value);
            }
            map.set(option, &values).unwrap_or_else(|| map.ignored += &format!(" {option} {}", values.join(" ")));
        }
        map.ignored = map.ignored.trim().to_string();
        map
    }

    /// Sets an option; `None` if it is not read.
    fn set(&mut self, option: &str, values: &[&str]) -> Option<()> {
        let number = |i: usize| values.get(i)?.parse::<f64>().ok().filter(|x| x.is_finite());
        let pair = |otherwise: f64| Some([number(0)?, if values.len() > 1 { number(1)? } else { otherwise }]);
        match option {
            "-s" => self.scale = pair(1.0).filter(|scale| !scale.contains(&0.0))?,
            "-o" => self.offset = pair(0.0)?,
            "-bm" => self.multiplier = number(0)?,
            "-clamp" => self.clamped = *values.first()? == "on",
            "-imfchan" => self.channel = values.first()?.chars().next(),
            _ => return None,
        }
        Some(())
    }
}

/// Whether a word begins an option: a minus that no number follows.
fn is_option(word: &str) -> bool {
    word.starts_with('-') && word.parse::<f64>().is_err()
}

/// A map's options, which begin with `-` and hold words that are switches or numbers, and its file, which may hold spaces.
fn file_of(rest: &str) -> (&str, &str) {
    let mut at = 0;
    for word in rest.split_inclusive(char::is_whitespace) {
        let text = word.trim();
        let channel = matches!(text, "r" | "g" | "b" | "m" | "l" | "z");
        let option =
            text.starts_with('-') || text.parse::<f64>().is_ok() || matches!(text, "on" | "off" | "") || channel;
        if !option || !rest.starts_with('-') {
            break;
        }
        at += word.len();
    }
    (rest[..at].trim(), rest[at..].trim())
}

/// One number for grey, or three.
fn colour(keyword: &str, rest: &str) -> Result<[f64; 3], SceneError> {
    let numbers = rest.split_whitespace().map(|word| number(word, keyword)).collect::<Result<Vec<_>, _>>()?;
    let colour = match numbers[..] {
        [grey] => [grey; 3],
        [r, g, b] => [r, g, b],
        _ => return Err(SceneError::invalid(format!("`{keyword} {rest}` is no colour"), "give one number or three")),
    };
    if colour.iter().any(|&channel| channel < 0.0) {
        return Err(SceneError::invalid(format!("`{keyword} {rest}` is negative"), "give 0 or more in every channel"));
    }
    Ok(colour)
}

fn scalar(keyword: &str, rest: &str) -> Result<f64, SceneError> {
    number(rest.split_whitespace().next().unwrap_or(""), keyword)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn reads_what_is_stated() {
        let text = "newmtl a b\n\tKd 0.5 # grey\n Ks .1 .2 .3\nKe 17 12 4\nTf 1 1 1\nNs 10\nNi 1.5\nTr 0.25\nillum 7\nmap_Kd -s 1 1 1 x y.png\nKa 1 1 1\nnewmtl c\nd 0.5\nTr 0.9\nbump -bm 0.2 -imfchan r -s 2 3 -mm 0 1 -o -1 -clamp on h.png\nmap_d m.png\nnorm n.png\nmap_Ke e.png\n";
        let materials = parse(Path::new("a.mtl"), text).unwrap();
        let a = &materials[0];
        assert_eq!((a.name.as_str(), a.line, a.diffuse, a.specular), ("a b", 1, Some([0.5; 3]), Some([0.1, 0.2, 0.3])));
        assert_eq!((a.emission, a.filter, a.exponent), (Some([17.0, 12.0, 4.0]), Some([1.0; 3]), Some(10.0)));
        assert_eq!((a.index, a.transparency, a.illumination), (Some(1.5), Some(0.25), Some(7)));
        let map = a.diffuse_map.as_ref().unwrap();
        assert_eq!(
            (map.file.as_str(), map.scale, map.offset, map.ignored.as_str()),
            ("x y.png", [1.0; 2], [0.0; 2], "")
        );
        let b = &materials[1];
        assert_eq!((b.opacity, b.transparency), (Some(0.5), Some(0.9)));
        let heights = Map {
            file: "h.png".to_string(),
            scale: [2.0, 3.0],
            offset: [-1.0, 0.0],
            clamped: true,
            multiplier: 0.2,
            channel: Some('r'),
            ignored: "-mm 0 1".to_string(),
        };
        assert_eq!(b.bump_map.as_ref(), Some(&heights));
        let file = |map: &Option<Map>| map.as_ref().unwrap().file.clone();
        assert_eq!([file(&b.opacity_map), file(&b.normal_map), file(&b.emission_map)], ["m.png", "n.png", "e.png"]);
    }

    #[test]
    fn errors_name_file_line_and_mend() {
        let cases = [
            ("Kd 1 1 1", "a.mtl:1: `Kd` comes before any material; begin each material with `newmtl NAME`"),
            ("newmtl a\nKd 1 1", "a.mtl:2: `Kd 1 1` is no colour; give one number or three"),
            ("newmtl a\nKd nan", "a.mtl:2: a Kd holds `nan`; give a finite number"),
            ("newmtl a\nKe -1 0 0", "a.mtl:2: `Ke -1 0 0` is negative; give 0 or more in every channel"),
            ("newmtl a\nNs", "a.mtl:2: a Ns holds ``; give a number"),
        ];
        for (text, expected) in cases {
            let message = parse(Path::new("a.mtl"), text).unwrap_err().to_string();
            assert!(message.starts_with(expected), "{text}: {message}");
        }
    }
}
