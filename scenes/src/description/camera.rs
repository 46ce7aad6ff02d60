//! `[camera]`: where it stands, what it sees, and how large its image is.

use super::reader::{Table, Value};
use super::{MAX_SIDE, check_size, kind};
use crate::camera::{CameraSettings, Crop, Projection, Receiver};
use crate::error::SceneError;
use crate::suggest::{did_you_mean, nearest};
use glam::{DVec2, DVec3};
use sampling::filter::Filter;

/// The keys of all cameras.
const COMMON: [&str; 9] = ["type", "position", "target", "up", "width", "height", "filter", "mirrored", "crop"];

/// Every type of camera with its own keys.
const TYPES: [(&str, &[&str]); 5] = [
    ("pinhole", &["fov", "shift"]),
    ("thin_lens", &["fov", "lens_radius", "focus_distance", "shift"]),
    ("orthographic", &["extent", "shift"]),
    ("equirectangular", &[]),
    ("irradiance", &["rectangle", "disk", "sphere"]),
];

/// The farthest that a window is shifted \[widths or heights\].
const MAX_SHIFT: f64 = 100.0;

/// Reads a camera, and notes what of it does not go with the `size` that replaces the file's, which is given then.
pub(super) fn read(table: &Table, size: Option<(u32, u32)>) -> Result<(CameraSettings, Option<String>), SceneError> {
    let projection = projection(table)?;
    let position = table.need("position", "[0, 0, 3]")?.vec3()?;
    let target = table.need("target", "[0, 0, 0]")?;
    let Some(view) = (target.vec3()? - position).try_normalize() else {
        return Err(target.error("it must differ from the camera's `position`"));
    };
    let up = match table.get("up") {
        Some(up) => up.direction()?,
        None => DVec3::Y,
    };
    if up.cross(view).length() < 1e-6 {
        let message = format!("the camera looks along its `up`, [{}, {}, {}]", up.x, up.y, up.z);
        let across = if view.y.abs() < 0.9 { "[0, 1, 0]" } else { "[0, 0, 1]" };
        return Err(table.error(message, format!("give an `up` across the view, such as `up = {across}`")));
    }
    // A meter has one pixel unless told otherwise.
    let usual = if matches!(projection, Projection::Irradiance(_)) { 1 } else { 256 };
    let own = (side(table, "width", usual)?, side(table, "height", usual)?);
    let (width, height) = size.unwrap_or(own);
    check_size(width, height).map_err(|error| match error {
        SceneError::Invalid { message, mend, .. } => table.error(message, mend),
        other => other,
    })?;
    let crop = table.get("crop").map(|value| crop(&value, own)).transpose()?;
    let fits = own == (width, height);
    let note = (crop.is_some() && !fits).then(|| {
        format!("the crop is of an image of {}x{} pixels, and was left out at {width}x{height}", own.0, own.1)
    });
    let settings = CameraSettings {
        position,
        target: target.vec3()?,
        up,
        projection,
        width,
        height,
        filter: filter(table, &projection)?,
        mirrored: table.get("mirrored").map(|value| value.boolean()).transpose()?.unwrap_or(false),
        shift: table.get("shift").map(|value| shift(&value)).transpose()?.unwrap_or(DVec2::ZERO),
        crop: crop.filter(|_| fits),
    };
    Ok((settings, note))
}

/// What a camera sees, by its type; keys that its type has not are refused.
fn projection(table: &Table) -> Result<Projection, SceneError> {
    let names = TYPES.map(|(name, _)| name);
    let name = if table.get("type").is_some() { kind(table, &names)? } else { names[0] };
    check_keys(table, name)?;
    Ok(match name {
        "thin_lens" => Projection::ThinLens {
            fov: fov(table)?,
            lens_radius: length(&table.need("lens_radius", "0.01")?)?,
            focus_distance: table.get("focus_distance").map(|value| length(&value)).transpose()?,
        },
        "orthographic" => Projection::Orthographic { extent: length(&table.need("extent", "2.0")?)? },
        "equirectangular" => Projection::Equirectangular,
        "irradiance" => Projection::Irradiance(receiver(table)?),
        _ => Projection::Pinhole { fov: fov(table)? },
    })
}

/// Where an irradiance meter receives light: at a point unless told otherwise.
fn receiver(table: &Table) -> Result<Receiver, SceneError> {
    let given = ["rectangle", "disk", "sphere"].map(|key| table.get(key));
    if let [_, second, ..] = given.iter().flatten().collect::<Vec<_>>()[..] {
        return Err(second.error("an irradiance meter is one of `rectangle`, `disk` and `sphere`"));
    }
    let [rectangle, disk, sphere] = given;
    Ok(match (rectangle, disk, sphere) {
        (Some(value), ..) => {
            let sides = value.array()?;
            let [a, b] = sides.as_slice() else { return Err(value.error("give its two sides, such as `[1, 0.5]`")) };
            Receiver::Rectangle([length(a)?, length(b)?])
        }
        (_, Some(value), _) => Receiver::Disk(length(&value)?),
        (_, _, Some(value)) => Receiver::Sphere(length(&value)?),
        _ => Receiver::Point,
    })
}

/// Refuses keys that a camera of this type has not; of those that another has, or nearly, it says so.
fn check_keys(table: &Table, name: &str) -> Result<(), SceneError> {
    let special: &[&str] = TYPES.iter().find(|(other, _)| *other == name).map_or(&[], |(_, keys)| keys);
    let own: Vec<&str> = COMMON.iter().chain(special).copied().collect();
    let all: Vec<&str> = COMMON.into_iter().chain(TYPES.iter().flat_map(|(_, keys)| *keys).copied()).collect();
    for (key, value) in table.entries() {
        let Some(meant) = nearest(key, &all).filter(|meant| !own.contains(meant) && !own.contains(&key)) else {
            continue;
        };
        let types: Vec<String> =
            TYPES.iter().filter(|(_, keys)| keys.contains(&meant)).map(|(name, _)| format!("`{name}`")).collect();
        let types = types.join(" or ");
        let asked = if meant == key { String::new() } else { format!("did you mean `{meant}`? ") };
        let instead: Vec<String> = special.iter().map(|key| format!("`{key}`")).collect();
        let instead = if instead.is_empty() { "no key of its own".to_owned() } else { instead.join(", ") };
        return Err(value.error(format!(
            "{asked}only a camera of type {types} has `{meant}`, and this is of type `{name}`, which has {instead}"
        )));
    }
    table.allow_only(&own)
}

fn fov(table: &Table) -> Result<f64, SceneError> {
    match table.get("fov") {
        Some(fov) => fov.number_in(0.001..=179.0, "a field of view lies between 0.001 and 179 degrees"),
        None => Ok(40.0),
    }
}

/// A length whose square is a number of `f32`.
fn length(value: &Value) -> Result<f64, SceneError> {
    value.number_in(1e-12..=1e12, "it is a length between 1e-12 and 1e12 m, above 0")
}

fn filter(table: &Table, projection: &Projection) -> Result<Filter, SceneError> {
    let Some(value) = table.get("filter") else { return Ok(Filter::default()) };
    let filter = value.text()?.parse().map_err(|_| {
        let names: Vec<String> = Filter::ALL.iter().map(Filter::to_string).collect();
        let names: Vec<&str> = names.iter().map(String::as_str).collect();
        value.error(did_you_mean(value.text().unwrap_or_default(), &names))
    })?;
    if matches!(projection, Projection::Irradiance(_)) && filter != Filter::Box {
        return Err(value.error("an irradiance meter has the filter `box`: beyond its image there are no directions"));
    }
    Ok(filter)
}

fn shift(value: &Value) -> Result<DVec2, SceneError> {
    let xy = value.numbers(2, "how far to the right and up, in widths and heights of the image")?;
    if xy.iter().any(|x| x.abs() > MAX_SHIFT) {
        return Err(value.error(format!("a window is shifted by at most {MAX_SHIFT} times its size")));
    }
    Ok(DVec2::new(xy[0], xy[1]))
}

/// The rectangle of pixels of an image of this size.
fn crop(value: &Value, (width, height): (u32, u32)) -> Result<Crop, SceneError> {
    let what = "it must be the column and row of the first pixel (from 0, at the top left), width and height: 4 whole \
                numbers in [ ]";
    let items = if value.is_array() { value.array()? } else { Vec::new() };
    let [x, y, columns, rows] = items.as_slice() else { return Err(value.error(what)) };
    let pixels = |item: &Value| item.whole()?.try_into().map_err(|_| item.error("it is a number of pixels, 0 or more"));
    let crop = Crop { x: pixels(x)?, y: pixels(y)?, width: pixels(columns)?, height: pixels(rows)? };
    match crop.fault(width, height) {
        Some(fault) => Err(value.error(fault)),
        None => Ok(crop),
    }
}

fn side(table: &Table, key: &str, usual: u32) -> Result<u32, SceneError> {
    let Some(value) = table.get(key) else { return Ok(usual) };
    let pixels = value.whole()?;
    if (1..=i64::from(MAX_SIDE)).contains(&pixels) {
        return Ok(pixels as u32);
    }
    Err(value.error(format!("an image side lies between 1 and {MAX_SIDE} pixels")))
}
