//! Cameras with their films and filters, and how far the series goes.
//!
//! A camera's transform leads from the world to its own frame, where it looks along +z with +x to the right and +y above: the
//! frame of a left hand. So the image of a frame that turns as a right hand does, such as every `LookAt`, is mirrored.

use glam::{DMat3, DMat4, DVec3};

use super::context::Context;
use super::parameters::Parameters;
use super::transform::scale_of;
use crate::error::SceneError;
use crate::import::mitsuba::HIGHEST_ORDER;
use crate::import::mitsuba::transform::is_similarity;
use crate::import::translation::{Lines, NoteKind, Place, number, numbers, quoted};

/// What stands before `WorldBegin`.
pub struct Options {
    /// The camera, and the map from the world to its frame.
    pub camera: Option<(Parameters, DMat4)>,
    /// The film.
    pub film: Option<Parameters>,
    /// The filter.
    pub filter: Option<Parameters>,
    /// What estimates the series.
    pub integrator: Option<Parameters>,
}

/// What a film says.
struct Film {
    width: u32,
    height: u32,
    /// First column and row, width, height.
    crop: Option<[u32; 4]>,
    place: Place,
}

/// The table `[camera]`.
pub fn write(options: &Options, root: &Place, context: &mut Context) -> Result<Lines, SceneError> {
    let Some((camera, to_camera)) = &options.camera else {
        return Err(root.error("the scene has no camera", "add `Camera \"perspective\"` before `WorldBegin`"));
    };
    let place = &camera.place;
    let film = film(options, place, context)?;
    let from_camera = to_camera.inverse();
    // The matrices of exporters have four digits.
    if !is_similarity(&from_camera, 1e-3) {
        context.approximate(place, "the transform of a camera stretches or shears it, which is left out");
    }
    let axes = DMat3::from_mat4(from_camera);
    let scale = scale_of(&from_camera);
    let mut mirrored = axes.determinant() > 0.0;
    let mut ahead = axes.z_axis.normalize();
    let window = window(camera, &film, context)?;
    let mut keys = Vec::new();
    let kind = match camera.kind.as_str() {
        "perspective" | "realistic" => {
            if camera.kind == "realistic" {
                context.approximate(place, "a `realistic` camera is taken as `perspective`: its lenses are left out");
            }
            let fov = match camera.float("halffov")? {
                Some(half) => 2.0 * half,
                None => camera.float_or("fov", 90.0)?,
            };
            if !(fov > 0.0 && fov < 180.0) {
                let message = format!("the field of view is {fov} degrees");
                return Err(camera.place_of("fov").error(message, "give one above 0 and below 180"));
            }
            let half = window.half;
            // What is said along the shorter side is kept to the digit.
            let fov = if half == 1.0 { fov } else { 2.0 * ((0.5 * fov.to_radians()).tan() * half).atan().to_degrees() };
            keys.push(("fov", number(fov)));
            lens(camera, scale, &mut keys)?
        }
        "orthographic" => {
            if camera.float_or("lensradius", 0.0)? > 0.0 {
                context.approximate(place, "an `orthographic` camera has no lens");
            }
            keys.push(("extent", number(2.0 * scale * window.half)));
            "orthographic"
        }
        "spherical" | "environment" => {
            if camera.kind == "spherical" && camera.text("mapping")? != Some("equirectangular") {
                context.approximate(place, "a `spherical` camera is `equirectangular` here: its pixels lie otherwise");
            }
            // Its middle is −x, and what is on the right there is −z.
            ahead = -axes.x_axis.normalize();
            mirrored = axes.determinant() < 0.0;
            "equirectangular"
        }
        kind => {
            let kind = super::lexer::shown(kind);
            return Err(
                place.error(format!("a camera `{kind}` is not supported"), "use `perspective` or `orthographic`")
            );
        }
    };
    let position = from_camera.w_axis.truncate();
    let mut lines = Lines::default();
    lines.table(place, "[camera]");
    if kind != "pinhole" {
        lines.key(place, "type", quoted(kind));
    }
    lines.key(place, "position", numbers(&position.to_array()));
    // As far away as the position is: a point nearby would lose its digits.
    let reach = 1.0f64.max(position.length());
    lines.key(place, "target", numbers(&(position + ahead * reach).to_array()));
    lines.key(place, "up", numbers(&up(&axes, ahead).to_array()));
    if mirrored {
        lines.key(place, "mirrored", "true");
    }
    for (key, value) in keys {
        lines.key(place, key, value);
    }
    if window.shift != [0.0; 2] && kind != "equirectangular" {
        lines.key(place, "shift", numbers(&window.shift));
    }
    lines.key(&film.place, "width", film.width);
    lines.key(&film.place, "height", film.height);
    lines.key(&film.place, "filter", quoted(filter(options, context)?));
    if let Some([x, y, width, height]) = film.crop {
        lines.key(&film.place, "crop", format!("[{x}, {y}, {width}, {height}]"));
    }
    camera.skip(&["shutteropen", "shutterclose", "lensradius", "focaldistance", "hither", "yon"]);
    context.mapped(camera, &format!("a `{kind}` camera"));
    camera.finish(context);
    Ok(lines)
}

fn up(axes: &DMat3, ahead: DVec3) -> DVec3 {
    (axes.y_axis - ahead * axes.y_axis.dot(ahead)).normalize()
}

/// The lens of a camera, if it has one, in the world's lengths.
fn lens(camera: &Parameters, scale: f64, keys: &mut Vec<(&'static str, String)>) -> Result<&'static str, SceneError> {
    let radius = camera.float_or("lensradius", 0.0)?;
    if radius <= 0.0 {
        return Ok("pinhole");
    }
    let distance = camera.positive("focaldistance", 1e6)?;
    keys.push(("lens_radius", number(radius * scale)));
    keys.push(("focus_distance", number(distance * scale)));
    Ok("thin_lens")
}

/// The part of the plane of the image that the film covers.
struct Window {
    /// Half its shorter side, where the field of view is as wide as 1.
    half: f64,
    /// How far it is moved to the right and up, in its own widths and heights.
    shift: [f64; 2],
}

fn window(camera: &Parameters, film: &Film, context: &mut Context) -> Result<Window, SceneError> {
    let (width, height) = (f64::from(film.width), f64::from(film.height));
    let own = width / height;
    let aspect = camera.positive("frameaspectratio", own)?;
    if (aspect / own - 1.0).abs() > 1e-6 {
        let place = camera.place_of("frameaspectratio");
        context.approximate(place, "a `frameaspectratio` other than the film's is left out: pixels are square");
    }
    let Some(list) = camera.numbers("screenwindow")? else { return Ok(Window { half: 1.0, shift: [0.0; 2] }) };
    let place = camera.place_of("screenwindow");
    let &[left, right, bottom, top] = list else {
        return Err(place.error("the `screenwindow` has not four numbers", "give x and y from and to"));
    };
    if left >= right || bottom >= top {
        return Err(place.error("the `screenwindow` is empty", "let both numbers of a pair grow"));
    }
    let (across, along) = (right - left, top - bottom);
    if (across / along / own - 1.0).abs() > 1e-3 {
        context
            .approximate(place, "a `screenwindow` of another shape than the film is brought to it: pixels are square");
    }
    let half = 0.5 * if own >= 1.0 { along } else { across };
    let whole = if own >= 1.0 { [along * own, along] } else { [across, across / own] };
    Ok(Window { half, shift: [0.5 * (left + right) / whole[0], 0.5 * (bottom + top) / whole[1]] })
}

fn film(options: &Options, camera: &Place, context: &mut Context) -> Result<Film, SceneError> {
    let Some(parameters) = &options.film else {
        return Ok(Film { width: 1280, height: 720, crop: None, place: camera.clone() });
    };
    let side = |name: &str, otherwise: u32| match parameters.integer(name)? {
        None => Ok(otherwise),
        Some(pixels) => u32::try_from(pixels).ok().filter(|&pixels| pixels >= 1).ok_or_else(|| {
            parameters.place_of(name).error(format!("the film's `{name}` is {pixels}"), "give 1 or more")
        }),
    };
    let (width, height) = (side("xresolution", 1280)?, side("yresolution", 720)?);
    let mut bounds = [0, width, 0, height];
    if let Some(list) = parameters.numbers("cropwindow")? {
        let &[x0, x1, y0, y1] = list else {
            return Err(parameters.place_of("cropwindow").error("the `cropwindow` has not four numbers", "give four"));
        };
        let pixel = |share: f64, pixels: u32| (share.clamp(0.0, 1.0) * f64::from(pixels)).ceil() as u32;
        bounds =
            [pixel(x0.min(x1), width), pixel(x0.max(x1), width), pixel(y0.min(y1), height), pixel(y0.max(y1), height)];
    }
    if let Some(list) = parameters.numbers("pixelbounds")? {
        let &[x0, x1, y0, y1] = list else {
            return Err(parameters
                .place_of("pixelbounds")
                .error("the `pixelbounds` have not four numbers", "give four"));
        };
        let inside = |x: f64, pixels: u32| x.clamp(0.0, f64::from(pixels)) as u32;
        bounds = [inside(x0, width), inside(x1, width), inside(y0, height), inside(y1, height)];
    }
    let [x0, x1, y0, y1] = bounds;
    if x0 >= x1 || y0 >= y1 {
        return Err(parameters
            .place
            .error("the film's crop holds no pixel", format!("keep it within {width}x{height}")));
    }
    let crop = Some([x0, y0, x1 - x0, y1 - y0]).filter(|crop| *crop != [0, 0, width, height]);
    parameters.skip(&["filename", "diagonal", "savefp16", "iso", "sensor", "whitebalance", "scale"]);
    context.mapped(parameters, "the size of the image");
    parameters.finish(context);
    Ok(Film { width, height, crop, place: parameters.place.clone() })
}

/// Our filter that is theirs.
fn filter(options: &Options, context: &mut Context) -> Result<&'static str, SceneError> {
    let Some(filter) = &options.filter else { return Ok("gaussian") };
    let (kind, usual, radius): (_, &[(&str, f64)], f64) = match filter.kind.as_str() {
        "box" => ("box", &[], 0.5),
        "triangle" => ("triangle", &[], 1.0),
        "gaussian" => ("gaussian", &[("sigma", 0.5)], 1.5),
        "mitchell" => ("mitchell", &[("B", 1.0 / 3.0), ("C", 1.0 / 3.0)], 2.0),
        "sinc" => ("mitchell", &[], f64::NAN),
        _ => ("gaussian", &[], f64::NAN),
    };
    // A `triangle` is 2 wide unless told otherwise.
    let otherwise = if kind == "triangle" { 2.0 } else { radius };
    let radii = [filter.float_or("xradius", otherwise)?, filter.float_or("yradius", otherwise)?];
    let mut same = radii == [radius; 2];
    for (name, value) in usual {
        same &= (filter.float_or(name, *value)? - value).abs() < 1e-3;
    }
    if !same {
        let text = format!("{} has other parameters than our `{kind}`, which it becomes", filter.title());
        context.approximate(&filter.place, text);
    }
    // v3 tells the width of its Gaussian otherwise.
    filter.skip(&["tau", "alpha"]);
    filter.finish(context);
    Ok(kind)
}

/// How far the series goes: `maxdepth` is the highest order.
pub fn series(options: &Options, root: &Place, head: &mut Lines, context: &mut Context) -> Result<(), SceneError> {
    let integrator = options.integrator.as_ref();
    let usual = if integrator.is_some_and(|integrator| integrator.kind == "directlighting") { 1 } else { 5 };
    let depth = integrator.map(|integrator| integrator.integer("maxdepth")).transpose()?.flatten().unwrap_or(usual);
    let at = integrator.map_or(root, |integrator| integrator.place_of("maxdepth"));
    if (0..=HIGHEST_ORDER).contains(&depth) {
        head.key(at, "max_order", depth);
        if let Some(interface) = context.interface.clone() {
            let text = "light that passes an `interface` has an order more, where pbrt's `maxdepth` does not count it";
            context.approximate(&interface, text);
        }
    } else {
        head.key(at, "tail", "true");
        context.approximate(at, format!("a `maxdepth` of {depth} is rendered as a series without end"));
    }
    if let Some(integrator) = integrator {
        let text = format!("{}: methods are chosen when a scene is rendered", integrator.title());
        context.note(NoteKind::Ignored, &integrator.place, text);
    }
    Ok(())
}
