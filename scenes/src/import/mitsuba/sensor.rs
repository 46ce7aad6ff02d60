//! Sensors and their films.
//!
//! A sensor looks along +z of its own frame, and its image has +y above and +x to the left: so the image of a frame that turns as
//! a right hand does, such as every `lookat`, is seen as the world is, and of one that turns as a left hand does, mirrored.

use glam::{DMat3, DMat4, DVec3};

use super::context::Context;
use super::plugin::Plugin;
use super::xml::Element;
use crate::error::SceneError;
use crate::import::translation::{Lines, NoteKind, Place, number, numbers, quoted};

/// What a film says.
struct Film {
    width: u32,
    height: u32,
    /// First column and row, width, height.
    crop: Option<[u32; 4]>,
    filter: &'static str,
    place: Place,
}

/// The table `[camera]` of the first sensor.
pub fn write<'a>(element: &'a Element, context: &mut Context<'a>) -> Result<Lines, SceneError> {
    let plugin = Plugin::new(element, context)?;
    if plugin.kind() == "radiancemeter" {
        return super::meter::radiance(&plugin, context);
    }
    let place = plugin.place();
    let film = film(&plugin, context)?;
    let to_world = plugin.transform("to_world", context)?;
    let (kind, mut keys) = match plugin.kind() {
        "perspective" | "perspective_pinhole" => ("pinhole", vec![("fov", number(fov(&plugin, &film)?))]),
        "thinlens" => {
            let radius = plugin.float("aperture_radius")?;
            match radius {
                Some(radius) if radius > 0.0 => {
                    ("thin_lens", vec![("fov", number(fov(&plugin, &film)?)), ("lens_radius", number(radius))])
                }
                _ => ("pinhole", vec![("fov", number(fov(&plugin, &film)?))]),
            }
        }
        "orthographic" => {
            // The film is 2 wide and as high as its shape asks for, in the sensor's own frame.
            let scale = to_world.transform_vector3(DVec3::X).length();
            let (width, height) = (f64::from(film.width), f64::from(film.height));
            ("orthographic", vec![("extent", number(2.0 * scale * width.min(height) / width))])
        }
        kind => {
            let message = format!("a sensor `{kind}` is not supported");
            let mend =
                "use `perspective`, `thinlens`, `orthographic` or `radiancemeter`, or `irradiancemeter` in a shape";
            return Err(place.error(message, mend));
        }
    };
    if kind == "thin_lens" {
        // Without one the lens is focussed on what is very far; here on the target, so it is always said.
        keys.push(("focus_distance", number(plugin.float_or("focus_distance", 10_000.0)?)));
    }
    let (position, ahead, up, mirrored) = frame(&to_world, kind == "orthographic", place, context);
    let mut lines = Lines::default();
    lines.table(place, "[camera]");
    if kind != "pinhole" {
        lines.key(place, "type", quoted(kind));
    }
    let at = plugin.part("to_world").map_or(place, |part| &part.place);
    lines.key(at, "position", numbers(&position.to_array()));
    lines.key(at, "target", numbers(&(position + ahead).to_array()));
    lines.key(at, "up", numbers(&up.to_array()));
    if mirrored {
        lines.key(at, "mirrored", "true");
    }
    for (key, value) in keys {
        lines.key(plugin.part(key).map_or(place, |part| &part.place), key, value);
    }
    if let Some(shift) = shift(&plugin)? {
        lines.key(place, "shift", numbers(&shift));
    }
    lines.key(&film.place, "width", film.width);
    lines.key(&film.place, "height", film.height);
    lines.key(&film.place, "filter", quoted(film.filter));
    if let Some([x, y, width, height]) = film.crop {
        lines.key(&film.place, "crop", format!("[{x}, {y}, {width}, {height}]"));
    }
    plugin.skip(&["near_clip", "far_clip", "focus_distance", "shutter_open", "shutter_close", "srf", "id"]);
    for sampler in plugin.tagged("sampler") {
        context.note(NoteKind::Ignored, &sampler.place, "a `sampler`: samples are asked for when a scene is rendered");
    }
    context.mapped(element, &format!("a `{kind}` camera"));
    plugin.finish(context);
    Ok(lines)
}

/// The camera of a scene without a sensor, from the lowest and the highest coordinates of its shapes.
pub fn missing(bounds: (DVec3, DVec3), place: &Place, context: &mut Context) -> Lines {
    let at = default_position(bounds);
    let text =
        format!("the file has no sensor: one was placed at ({:.4}, {:.4}, {:.4}), as in Mitsuba", at.x, at.y, at.z);
    context.note(NoteKind::Added, place, text);
    table(bounds, place)
}

/// Field of view of a sensor that a file does not have \[degrees\].
const DEFAULT_FOV: f64 = 45.0;

/// Where Mitsuba puts it: before the least z of the bounds, so far off that the field of view holds the longest side of these.
fn default_position((low, high): (DVec3, DVec3)) -> DVec3 {
    let distance = (high - low).max_element() / (2.0 * (0.5 * DEFAULT_FOV.to_radians()).tan());
    ((low + high) / 2.0).with_z(low.z - distance)
}

/// Its table `[camera]`.
pub fn table(bounds: (DVec3, DVec3), place: &Place) -> Lines {
    let (position, film) = (default_position(bounds), usual_film(place));
    let mut lines = Lines::default();
    lines.table(place, "[camera]");
    lines.key(place, "position", numbers(&position.to_array()));
    lines.key(place, "target", numbers(&(position + DVec3::Z).to_array()));
    lines.key(place, "up", numbers(&DVec3::Y.to_array()));
    let shorter = f64::from(film.height) / f64::from(film.width);
    let half = (0.5 * DEFAULT_FOV.to_radians()).tan() * shorter;
    lines.key(place, "fov", number((2.0 * half.atan()).to_degrees()));
    lines.key(place, "width", film.width);
    lines.key(place, "height", film.height);
    lines.key(place, "filter", quoted(film.filter));
    lines
}

/// Position, view, up, and whether the image is mirrored. To `parallel` rays it is nothing how long the view's axis is.
fn frame(to_world: &DMat4, parallel: bool, place: &Place, context: &mut Context) -> (DVec3, DVec3, DVec3, bool) {
    let axes = DMat3::from_mat4(*to_world);
    let along = if parallel { axes.z_axis.normalize() * axes.x_axis.length() } else { axes.z_axis };
    let shape = DMat4::from_mat3(DMat3::from_cols(axes.x_axis, axes.y_axis, along));
    // The matrices of exporters have four digits.
    if !super::transform::is_similarity(&shape, 1e-3) {
        context.approximate(place, "the transform of a sensor stretches or shears it, which is left out");
    }
    (to_world.w_axis.truncate(), axes.z_axis.normalize(), axes.y_axis.normalize(), axes.determinant() < 0.0)
}

/// The field of view along the shorter side \[degrees\].
fn fov(plugin: &Plugin, film: &Film) -> Result<f64, SceneError> {
    let (width, height) = (f64::from(film.width), f64::from(film.height));
    let diagonal = width.hypot(height);
    let (half, along) = match (plugin.float("fov")?, plugin.text("focal_length")?) {
        (None, focal) => {
            // Of a film of 36 by 24 mm, along its diagonal.
            let focal = focal.unwrap_or("50mm");
            let millimetres =
                super::plugin::finite(focal.trim().trim_end_matches("mm"), "focal_length", plugin.place())?;
            ((0.5 * 36.0f64.hypot(24.0)) / millimetres, diagonal)
        }
        (Some(fov), _) => {
            let along = match plugin.text("fov_axis")?.unwrap_or("x") {
                "x" => width,
                "y" => height,
                "diagonal" => diagonal,
                "smaller" => width.min(height),
                "larger" => width.max(height),
                other => {
                    let mend = "write `x`, `y`, `diagonal`, `smaller` or `larger`";
                    return Err(plugin.place().error(format!("the `fov_axis` is `{other}`"), mend));
                }
            };
            if !(fov > 0.0 && fov < 180.0) {
                let message = format!("the field of view is {fov} degrees");
                return Err(plugin.place().error(message, "give one above 0 and below 180"));
            }
            ((0.5 * fov.to_radians()).tan(), along)
        }
    };
    let shorter = width.min(height);
    // What is said along the shorter side is kept to the digit.
    match plugin.float("fov")? {
        Some(fov) if along == shorter => Ok(fov),
        _ => Ok((2.0 * (half * shorter / along).atan()).to_degrees()),
    }
}

/// How far the window of the film is moved to the right and up, in widths and heights of the image.
fn shift(plugin: &Plugin) -> Result<Option<[f64; 2]>, SceneError> {
    let (x, y) = (plugin.float_or("principal_point_offset_x", 0.0)?, plugin.float_or("principal_point_offset_y", 0.0)?);
    if x == 0.0 && y == 0.0 {
        return Ok(None);
    }
    // Mitsuba measures in widths and heights of the whole film, whatever the crop, downwards.
    Ok(Some([x, -y]))
}

fn usual_film(place: &Place) -> Film {
    Film { width: 768, height: 576, crop: None, filter: "gaussian_full", place: place.clone() }
}

fn film<'a>(sensor: &Plugin<'a>, context: &mut Context<'a>) -> Result<Film, SceneError> {
    let Some(element) = sensor.tagged("film").first().copied() else { return Ok(usual_film(sensor.place())) };
    let plugin = Plugin::new(element, context)?;
    let mut film = usual_film(plugin.place());
    let side = |name: &str, otherwise: u32, least: u32| match plugin.integer(name)? {
        None => Ok(otherwise),
        Some(pixels) => u32::try_from(pixels).ok().filter(|&pixels| pixels >= least).ok_or_else(|| {
            plugin.place().error(format!("the film's `{name}` is {pixels}"), format!("give {least} or more"))
        }),
    };
    (film.width, film.height) = (side("width", film.width, 1)?, side("height", film.height, 1)?);
    let (x, y) = (side("crop_offset_x", 0, 0)?, side("crop_offset_y", 0, 0)?);
    let (width, height) =
        (side("crop_width", film.width.saturating_sub(x), 1)?, side("crop_height", film.height.saturating_sub(y), 1)?);
    let whole = [0, 0, film.width, film.height];
    let inside = x.checked_add(width).is_some_and(|end| end <= film.width)
        && y.checked_add(height).is_some_and(|end| end <= film.height);
    if !inside || width == 0 || height == 0 {
        let message = format!("the crop of {width}x{height} pixels at {x}, {y} is not within the film");
        return Err(plugin.place().error(message, format!("keep it within {}x{} pixels", film.width, film.height)));
    }
    film.crop = Some([x, y, width, height]).filter(|crop| *crop != whole);
    if let Some(filter) = plugin.tagged("rfilter").first() {
        film.filter = filter_of(filter, context)?;
    }
    context.note(NoteKind::Mapped, plugin.place(), format!("`film {}` becomes the size of the image", plugin.kind()));
    plugin.skip(&[
        "file_format",
        "pixel_format",
        "component_format",
        "sample_border",
        "banner",
        "compensate",
        "high_quality_edges",
        "id",
    ]);
    plugin.finish(context);
    Ok(film)
}

/// Our filter that is a reconstruction filter of theirs.
fn filter_of<'a>(element: &'a Element, context: &mut Context<'a>) -> Result<&'static str, SceneError> {
    let plugin = Plugin::new(element, context)?;
    let (filter, difference) = match plugin.kind() {
        "box" => ("box", None),
        "tent" => match plugin.float_or("radius", 1.0)? {
            1.0 => ("triangle", None),
            _ => ("triangle", Some("a `tent` filter of another radius than 1 has that")),
        },
        "gaussian" if plugin.float_or("stddev", 0.5)? == 0.5 => ("gaussian_full", None),
        "gaussian" => ("gaussian_full", Some("a `gaussian` filter of another `stddev` than 0.5 has that")),
        "mitchell" => match (plugin.float_or("A", 1.0 / 3.0)?, plugin.float_or("B", 1.0 / 3.0)?) {
            (a, b) if (a - 1.0 / 3.0).abs() < 1e-3 && (b - 1.0 / 3.0).abs() < 1e-3 => ("mitchell", None),
            _ => ("mitchell", Some("a `mitchell` filter of other parameters than 1/3 has those")),
        },
        "catmullrom" => ("mitchell", Some("the filter `catmullrom` is taken as `mitchell`")),
        "lanczos" => ("mitchell", Some("the filter `lanczos` is taken as `mitchell`")),
        _ => ("gaussian_full", Some("a filter that is not known is taken as `gaussian`")),
    };
    if let Some(difference) = difference {
        context.approximate(plugin.place(), difference);
    }
    plugin.finish(context);
    Ok(filter)
}
