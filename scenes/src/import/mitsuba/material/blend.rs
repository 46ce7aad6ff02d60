//! Materials that are made of others side by side.

use super::{Behind, Description, Value, black};
use crate::error::SceneError;
use crate::import::mitsuba::bsdf::{Setting, describe};
use crate::import::mitsuba::context::Context;
use crate::import::mitsuba::plugin::{Plugin, finite_list};
use crate::import::mitsuba::spectrum::Quantity;
use crate::import::mitsuba::texture::{self, Texture};
use crate::import::translation::Place;

/// Materials side by side: `blendbsdf` with its `weight`, `mixturebsdf` of older files with its `weights`.
pub fn blend<'a>(plugin: &Plugin<'a>, setting: Setting, context: &mut Context<'a>) -> Result<Description, SceneError> {
    let place = plugin.place();
    let mut parts = Vec::new();
    for part in plugin.tagged("bsdf") {
        parts.push(describe(part, setting, context)?.for_mix(context));
    }
    let amounts: Vec<Texture> = if plugin.kind() == "blendbsdf" {
        vec![texture::number(plugin, "weight", Quantity::Reflectance, 0.5, context)?]
    } else {
        shares(plugin, parts.len(), context)?.into_iter().map(Texture::grey).collect()
    };
    if parts.len() != amounts.len() + 1 {
        let message = format!("`{}` has {} materials for {} weights", plugin.kind(), parts.len(), amounts.len());
        return Err(place.error(message, "a `blendbsdf` has two materials, a `mixturebsdf` a weight for each"));
    }
    let transmits = parts.iter().any(|part| part.transmits);
    let fronts = parts.iter().enumerate().map(|(i, part)| {
        let name = context.fresh_name(&format!("{}_part{}", setting.name, i + 1));
        part.write_side(&name, None, setting.turned, context);
        name
    });
    let fronts: Vec<String> = fronts.collect();
    let behind = if parts.iter().all(|part| matches!(part.behind, Behind::Same)) {
        Behind::Same
    } else if transmits {
        let text = "what is black from behind scatters on both sides in a blend that light goes through";
        context.approximate(place, text);
        Behind::Same
    } else if parts.iter().all(|part| matches!(part.behind, Behind::Black)) {
        Behind::Black
    } else {
        let backs = parts.iter().zip(&fronts).enumerate().map(|(i, (part, front))| match &part.behind {
            Behind::Same | Behind::Mirrored => front.clone(),
            Behind::Black => black(place, context),
            Behind::Other(back) => {
                let name = context.fresh_name(&format!("{}_back{}", setting.name, i + 1));
                back.write_side(&name, None, setting.turned, context);
                name
            }
        });
        let backs = backs.collect();
        Behind::Other(Box::new(mixed(backs, &amounts, (place, setting), context)))
    };
    Ok(Description { behind, transmits, ..mixed(fronts, &amounts, (place, setting), context) })
}

/// A mix of a mix of these materials: each amount is the share of the last part in what is gathered so far.
fn mixed(
    mut parts: Vec<String>,
    amounts: &[Texture],
    (place, setting): (&Place, Setting),
    context: &mut Context,
) -> Description {
    let mix = |whole: String, part: String, amount: &Texture| {
        let mix = Description::new("mix", place).with("first", Value::Word(whole)).with("second", Value::Word(part));
        mix.with("amount", amount.clone())
    };
    let (last, mut whole) = (parts.pop().expect("a blend has two parts or more"), parts.remove(0));
    for (i, (part, amount)) in parts.into_iter().zip(amounts).enumerate() {
        let name = context.fresh_name(&format!("{}_mix{}", setting.name, i + 1));
        mix(whole, part, amount).write_side(&name, None, setting.turned, context);
        whole = name;
    }
    mix(whole, last, amounts.last().expect("a blend has an amount"))
}

/// Of a `mixturebsdf`, the share of each part but the first in it and those before it.
fn shares<'a>(plugin: &Plugin<'a>, parts: usize, context: &mut Context<'a>) -> Result<Vec<f64>, SceneError> {
    let text = plugin.text("weights")?.unwrap_or("");
    let weights = finite_list(text, "weights", plugin.place())?;
    let total: f64 = weights.iter().sum();
    if weights.len() != parts || parts < 2 || weights.iter().any(|&weight| weight < 0.0) || total <= 0.0 {
        let message = format!("the `weights` of a `mixturebsdf` of {parts} materials are `{text}`");
        return Err(plugin.place().error(message, "give a weight of 0 or more for each of two materials or more"));
    }
    if (total - 1.0).abs() > 1e-9 {
        context.approximate(plugin.place(), "the weights of a `mixturebsdf` are scaled to 1 in all");
    }
    let mut so_far = weights[0];
    Ok(weights[1..]
        .iter()
        .map(|&weight| {
            so_far += weight;
            if so_far > 0.0 { weight / so_far } else { 0.5 }
        })
        .collect())
}
