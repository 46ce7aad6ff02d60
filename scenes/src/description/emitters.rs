//! `[[emitters]]` of scene files: those that are not surfaces.

use glam::DMat3;
use sampling::math::Spectrum;

use super::reader::{Table, Value};
use super::textures::{Textures, choice};
use super::{Origin, kind, tables, transform};
use crate::builder::{ChoiceRule, EnvironmentImage, Falloff, Mapping, PointRule, SceneBuilder, Spot};
use crate::error::SceneError;
use crate::texture::Encoding;

/// Reads the emitters:
///
/// - `point { position, intensity }`: metres, W/sr;
/// - `spot { position, target, intensity, cutoff, beam, falloff = "linear" }`: it is dark beyond `cutoff` and has all its
///   intensity within `beam`, both in degrees from the axis; `falloff` is one of [`Falloff::NAMES`];
/// - `directional { direction, irradiance }`: the direction of flight, and the irradiance of a surface across it in W/m²;
/// - `constant { radiance }`: the same from everywhere, in W/(m²·sr);
/// - `environment { image, mapping = "equirectangular", scale = 1, transform = [] }`: an image of radiance; `mapping` is one of
///   [`Mapping::NAMES`], and the rotation of `transform`, which may mirror, turns the environment. Images of bytes are sRGB,
///   the others linear.
///
/// Each may have a `label`, the light group that it belongs to. There is one `constant` or one `environment` at most. `emitter_choice` of the root is one of [`ChoiceRule::NAMES`], and `emitter_points` one of [`PointRule::NAMES`].
pub(super) fn read(root: &Table, origin: &Origin, builder: &mut SceneBuilder) -> Result<(), SceneError> {
    let mut surroundings: Option<&str> = None;
    for table in &tables(root, "emitters")? {
        let kind = kind(table, &["point", "spot", "directional", "constant", "environment"])?;
        if let ("constant" | "environment", Some(first)) = (kind, surroundings) {
            let (message, mend) = match first == kind {
                true => (format!("there are two emitters of type `{kind}`"), "keep one: add up their radiances"),
                false => (
                    "there are an emitter of type `constant` and one of type `environment`".to_owned(),
                    "keep one: add the constant radiance to the image",
                ),
            };
            return Err(table.error(message, mend));
        }
        let label = table.get("label").map(|label| label.label().map(str::to_owned)).transpose()?;
        match kind {
            "point" => read_point(table, builder)?,
            "spot" => read_spot(table, builder)?,
            "directional" => read_directional(table, builder)?,
            "constant" => {
                table.allow_only(&["type", "label", "radiance"])?;
                builder.environment(emitted(&table.need("radiance", "[1, 1, 1]")?)?);
                surroundings = Some(kind);
            }
            _ => {
                read_environment(table, origin, builder)?;
                surroundings = Some(kind);
            }
        }
        if let Some(label) = label {
            builder.label_emitter(&label);
        }
    }
    if let Some(place) = choice(root, "emitter_choice", &ChoiceRule::NAMES)? {
        builder.emitter_choice(ChoiceRule::ALL[place]);
    }
    if let Some(place) = choice(root, "emitter_points", &PointRule::NAMES)? {
        builder.emitter_points(PointRule::ALL[place]);
    }
    Ok(())
}

fn read_point(table: &Table, builder: &mut SceneBuilder) -> Result<(), SceneError> {
    table.allow_only(&["type", "label", "position", "intensity"])?;
    let position = table.need("position", "[0, 1, 0]")?.vec3()?;
    let intensity = emitted(&table.need("intensity", "[1, 1, 1]")?)?;
    builder.point_emitter(position, intensity);
    Ok(())
}

fn read_spot(table: &Table, builder: &mut SceneBuilder) -> Result<(), SceneError> {
    table.allow_only(&["type", "label", "position", "target", "intensity", "cutoff", "beam", "falloff"])?;
    let position = table.need("position", "[0, 1, 0]")?.vec3()?;
    let target_value = table.need("target", "[0, 0, 0]")?;
    let target = target_value.vec3()?;
    if (target - position).try_normalize().is_none() {
        return Err(target_value.error("it must differ from the spot's `position`"));
    }
    let intensity = emitted(&table.need("intensity", "[1, 1, 1]")?)?;
    let cutoff_range = "the angle from the axis beyond which a spot is dark lies between 0.001 and 180 degrees";
    let cutoff = table.need("cutoff", "30")?.number_in(0.001..=180.0, cutoff_range)?;
    let beam_value = table.need("beam", "20")?;
    let beam = beam_value.number()?;
    if !(0.0..=cutoff).contains(&beam) {
        let range =
            format!("the angle within which a spot has all its intensity lies between 0 and its `cutoff`, {cutoff}");
        return Err(beam_value.error(range));
    }
    let falloff = choice(table, "falloff", &Falloff::NAMES)?.map_or(Falloff::default(), |place| Falloff::ALL[place]);
    let (cutoff, beam) = (cutoff.to_radians(), beam.to_radians());
    builder.spot(Spot { position, target, intensity, cutoff, beam, falloff });
    Ok(())
}

fn read_directional(table: &Table, builder: &mut SceneBuilder) -> Result<(), SceneError> {
    table.allow_only(&["type", "label", "direction", "irradiance"])?;
    let direction = table.need("direction", "[0, -1, 0]")?.direction()?;
    let irradiance = emitted(&table.need("irradiance", "[1, 1, 1]")?)?;
    builder.directional_emitter(direction, irradiance);
    Ok(())
}

fn read_environment(table: &Table, origin: &Origin, builder: &mut SceneBuilder) -> Result<(), SceneError> {
    table.allow_only(&["type", "label", "image", "mapping", "scale", "transform"])?;
    let file = table.need("image", "\"sky.exr\"")?;
    let image = Textures::new(origin.folder, origin.attachments).file(&file, None, Encoding::Srgb)?;
    let mapping = choice(table, "mapping", &Mapping::NAMES)?.map_or(Mapping::default(), |place| Mapping::ALL[place]);
    let scale = table.get("scale").map_or(Ok(Spectrum::ONE), |scale| emitted(&scale))?;
    let rotation = match table.get("transform") {
        None => DMat3::IDENTITY,
        Some(value) => {
            let rotation = transform::read(&value)?.matrix3;
            if !EnvironmentImage::is_rotation(&rotation) {
                return Err(value.error("an environment can be turned and mirrored, but not scaled; leave scales out"));
            }
            rotation
        }
    };
    let environment = EnvironmentImage { image, mapping, scale, rotation };
    if let Some((message, mend)) = environment.fault() {
        return Err(file.error(format!("{message}; {mend}")));
    }
    builder.environment_image(environment);
    Ok(())
}

/// What an emitter emits: not negative, and not all zero.
fn emitted(value: &Value) -> Result<Spectrum, SceneError> {
    let colour = value.colour_in(0.0..=f32::MAX, "light cannot be negative; give 0 or more in every channel")?;
    if colour.is_zero() {
        return Err(value.error("an emitter must emit; give a channel above 0, or leave the emitter out"));
    }
    Ok(colour)
}
