//! MTL material libraries: what a file states, before anything is made of it.

use std::collections::BTreeMap;
use std::path::Path;

use super::source::{Statement, number, split, statements};
use crate::error::SceneError;

/// What a material of an MTL file states; `None` where it says nothing.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Statements {
    /// `newmtl`: the name.
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
    /// `d`, or 1 − `Tr`: opacity.
    pub opacity: Option<f64>,
    /// `illum`: the illumination model.
    pub illumination: Option<i64>,
    /// `map_Kd`: the image of the diffuse reflectance, without the statement's options.
    pub diffuse_map: Option<String>,
    /// Statements that are not read: keyword and rest.
    pub ignored: BTreeMap<String, String>,
}

/// Reads an MTL text; a bad number is an error that names its line.
pub fn parse(path: &Path, text: &str) -> Result<Vec<Statements>, SceneError> {
    let mut materials: Vec<Statements> = Vec::new();
    for Statement { line, text, .. } in statements(text) {
        let at_line = |error: SceneError| error.in_file(path).at_line(line);
        let (keyword, rest) = split(&text);
        if keyword == "newmtl" {
            if rest.is_empty() {
                return Err(at_line(SceneError::invalid("`newmtl` names no material", "add a name")));
            }
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
        // `d` wins over `Tr`, which some programs write as the opacity.
        "Tr" => {
            let opacity = 1.0 - scalar(keyword, rest)?;
            material.opacity.get_or_insert(opacity);
        }
        "map_Kd" => {
            let (options, file) = file_of(rest);
            material.diffuse_map = Some(file.to_string());
            if !options.is_empty() {
                material.ignored.insert("map_Kd".to_string(), options.to_string());
            }
        }
        "illum" => material.illumination = Some(scalar(keyword, rest)? as i64),
        // The ambient colour has no meaning where light is transported.
        "Ka" => {}
        other => _ = material.ignored.insert(other.to_string(), rest.to_string()),
    }
    Ok(())
}

/// A map's options, which begin with `-` and hold words that are switches or numbers, and its file, which may hold spaces.
fn file_of(rest: &str) -> (&str, &str) {
    let mut at = 0;
    for word in rest.split_inclusive(char::is_whitespace) {
        let text = word.trim();
        let option = text.starts_with('-') || text.parse::<f64>().is_ok() || matches!(text, "on" | "off" | "");
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
        let text = "newmtl a b\n\tKd 0.5 # grey\n Ks .1 .2 .3\nKe 17 12 4\nTf 1 1 1\nNs 10\nNi 1.5\nTr 0.25\nillum 7\nmap_Kd -s 1 1 1 x y.png\nKa 1 1 1\nnewmtl c\nd 0.5\nTr 0.9\n";
        let materials = parse(Path::new("a.mtl"), text).unwrap();
        let a = &materials[0];
        assert_eq!((a.name.as_str(), a.line, a.diffuse, a.specular), ("a b", 1, Some([0.5; 3]), Some([0.1, 0.2, 0.3])));
        assert_eq!((a.emission, a.filter, a.exponent), (Some([17.0, 12.0, 4.0]), Some([1.0; 3]), Some(10.0)));
        assert_eq!((a.index, a.opacity, a.illumination), (Some(1.5), Some(0.75), Some(7)));
        assert_eq!((a.ignored["map_Kd"].as_str(), a.diffuse_map.as_deref()), ("-s 1 1 1", Some("x y.png")));
        assert_eq!(materials[1].opacity, Some(0.5));
    }

    #[test]
    fn errors_name_file_line_and_mend() {
        let cases = [
            ("Kd 1 1 1", "a.mtl:1: `Kd` comes before any material; begin each material with `newmtl NAME`"),
            ("newmtl", "a.mtl:1: `newmtl` names no material; add a name"),
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
