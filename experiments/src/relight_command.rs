//! `neumann relight`: another brightness for some of the lights, without rendering again.
//!
//! Light is linear in what is emitted: an image is the sum of the images that each light group makes alone, and so is every
//! order of it.

use crate::cli::{RelightArgs, print};
use crate::error::{Error, Status, unknown};
use crate::export::exr::{ImageLayer, LayeredImage, read_layers, write_layers};
use crate::output;
use std::collections::BTreeMap;

/// By what to multiply a light group.
#[derive(Clone, Debug, PartialEq)]
pub struct Dimmer {
    /// The group.
    pub group: String,
    /// Factors of red, green and blue.
    pub factor: [f32; 3],
}

/// A dimmer as it is typed: `key=2` or `key=1,0.5,0.2`.
///
/// # Errors
/// If it is none.
pub fn dimmer(text: &str) -> Result<Dimmer, String> {
    let mend = "write GROUP=FACTOR, for example key=2 or key=1,0.5,0.2";
    let (group, factors) = text.rsplit_once('=').ok_or(mend)?;
    let numbers: Result<Vec<f32>, _> = factors.split(',').map(|number| number.trim().parse()).collect();
    let factor = match numbers.as_deref() {
        Ok(&[all]) => [all; 3],
        Ok(&[red, green, blue]) => [red, green, blue],
        _ => return Err(mend.to_owned()),
    };
    match factor.iter().all(|f| f.is_finite() && *f >= 0.0) {
        true => Ok(Dimmer { group: group.to_owned(), factor }),
        false => Err("no light is negative or infinite; give factors of 0 or more".to_owned()),
    }
}

/// Writes the image of dimmed groups.
///
/// # Errors
/// If the image has no groups, or not one of those that are named, or cannot be read or written.
pub fn relight(args: &RelightArgs) -> Result<Status, Error> {
    let image = read_layers(&args.image)?;
    let file = |message: String| Error::File { file: args.image.clone(), line: None, message };
    let groups = groups_of(&image);
    if groups.is_empty() {
        return Err(file("it has no layers of light groups; render it with --layers orders,groups".to_owned()));
    }
    let names: Vec<&str> = groups.keys().map(String::as_str).collect();
    let mut factors: BTreeMap<&str, [f32; 3]> = BTreeMap::new();
    for Dimmer { group, factor } in &args.groups {
        if !groups.contains_key(group) {
            return Err(file(unknown("light group", group, &names)));
        }
        if factors.insert(group, *factor).is_some() {
            return Err(Error::usage(format!("the light group `{group}` is given two factors; keep one")));
        }
    }
    output::check_file(&args.output)?;
    write_layers(&args.output, &relit(&image, &groups, &factors))?;
    let told = |(name, f): (&&str, &[f32; 3])| format!("{name} x {} {} {}", f[0], f[1], f[2]);
    let told: Vec<String> = factors.iter().map(told).collect();
    print(&format!("{}: {}\n", args.output.display(), told.join(", ")))?;
    Ok(Status::Done)
}

/// The groups of an image and, of each, the names of the layers of the series that it has.
fn groups_of(image: &LayeredImage) -> BTreeMap<String, Vec<String>> {
    let series = |name: &str| name == "tail" || name.strip_prefix("order").is_some_and(is_number);
    let mut groups: BTreeMap<String, Vec<String>> = BTreeMap::new();
    for name in image.layers.iter().filter_map(|layer| layer.name.strip_prefix("group_")) {
        if let Some((group, layer)) = name.rsplit_once('_').filter(|(_, layer)| series(layer)) {
            groups.entry(group.to_owned()).or_default().push(layer.to_owned());
        }
    }
    groups
}

fn is_number(text: &str) -> bool {
    !text.is_empty() && text.bytes().all(|byte| byte.is_ascii_digit())
}

/// The image under dimmed groups: each layer of the series and of the groups, and the beauty. What groups do not tell, such as
/// strategies and variances, is left out.
fn relit(
    image: &LayeredImage,
    groups: &BTreeMap<String, Vec<String>>,
    factors: &BTreeMap<&str, [f32; 3]>,
) -> LayeredImage {
    let black = || vec![[0.0_f64; 3]; image.width * image.height];
    let mut sums: BTreeMap<String, Vec<[f64; 3]>> = BTreeMap::from([(String::new(), black())]);
    for (group, layers) in groups {
        let factor = factors.get(group.as_str()).copied().unwrap_or([1.0; 3]);
        for name in layers {
            let Some(layer) = image.layer(&format!("group_{group}_{name}")) else { continue };
            let targets = [String::new(), name.clone(), format!("group_{group}"), format!("group_{group}_{name}")];
            for target in targets {
                let sum = sums.entry(target).or_insert_with(black);
                for (sum, pixel) in sum.iter_mut().zip(&layer.pixels) {
                    (0..3).for_each(|c| sum[c] += f64::from(factor[c]) * f64::from(pixel[c]));
                }
            }
        }
    }
    let plain = |pixels: Vec<[f64; 3]>| pixels.into_iter().map(|p| p.map(|x| x as f32)).collect();
    let layers = sums.into_iter().map(|(name, pixels)| ImageLayer { name, pixels: plain(pixels) }).collect();
    let dimmed: Vec<String> = factors.iter().map(|(name, f)| format!("{name}={},{},{}", f[0], f[1], f[2])).collect();
    // What says how long it took and how many samples it had is no text, and no longer said.
    let mut attributes = image.attributes.clone();
    attributes.retain(|name, _| name.starts_with("neumann:"));
    attributes.insert("neumann:relit".to_owned(), dimmed.join(" "));
    LayeredImage { width: image.width, height: image.height, layers, other_channels: Vec::new(), attributes }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn dimmers_are_read() {
        assert_eq!(dimmer("key=2"), Ok(Dimmer { group: "key".into(), factor: [2.0; 3] }));
        assert_eq!(dimmer("a=b=1, 0.5,0"), Ok(Dimmer { group: "a=b".into(), factor: [1.0, 0.5, 0.0] }));
        for bad in ["key", "key=", "key=1,2", "key=-1", "key=inf", "key=x"] {
            assert!(dimmer(bad).is_err(), "{bad}");
        }
    }

    #[test]
    fn groups_are_added_up_under_their_factors() {
        let layer = |name: &str, value: f32| ImageLayer { name: name.into(), pixels: vec![[value, 2.0 * value, 0.0]] };
        let layers = vec![
            layer("", 10.0),
            layer("group_key", 7.0),
            layer("group_key_order00", 3.0),
            layer("group_key_order01", 4.0),
            layer("group_key_order01_var", 9.0),
            layer("group_rim_light", 3.0),
            layer("group_rim_light_order01", 3.0),
        ];
        let image =
            LayeredImage { width: 1, height: 1, layers, other_channels: Vec::new(), attributes: BTreeMap::new() };
        let groups = groups_of(&image);
        assert_eq!(groups.keys().collect::<Vec<_>>(), ["key", "rim_light"]);
        let relit = relit(&image, &groups, &BTreeMap::from([("key", [2.0, 0.5, 1.0])]));
        let value = |name: &str| relit.layer(name).unwrap().pixels[0];
        assert_eq!(value(""), [17.0, 13.0, 0.0]);
        assert_eq!(value("order00"), [6.0, 3.0, 0.0]);
        assert_eq!(value("order01"), [11.0, 10.0, 0.0]);
        assert_eq!(value("group_key"), [14.0, 7.0, 0.0]);
        assert_eq!(value("group_rim_light_order01"), [3.0, 6.0, 0.0]);
        assert!(relit.layer("group_key_order01_var").is_none());
    }
}
