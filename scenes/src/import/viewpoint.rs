//! A camera for a file that has none.

use glam::DVec3;
use rayon::prelude::*;

use super::translation::{self, Lines, NoteKind, Notes, Place};
use crate::builder::{CameraSettings, MeshData, SceneBuilder};
use crate::camera::Projection;
use sampling::math::Spectrum;

/// Field of view of the chosen camera \[degrees\].
const FOV: f64 = 40.0;
/// Field of view from inside a closed room \[degrees\].
const FOV_INSIDE: f64 = 75.0;
/// Rays along each side of the grid that tries a view.
const GRID: usize = 7;
/// Rays that look for light from inside a closed room.
const DIRECTIONS: usize = 256;
/// π (3 − √5) \[radians\].
const GOLDEN_ANGLE: f64 = 2.399_963_229_728_653;
/// The sides from which the scene may be looked at, in order of preference, each with the `up` of the view.
const SIDES: [(DVec3, DVec3); 6] = [
    (DVec3::Z, DVec3::Y),
    (DVec3::NEG_Z, DVec3::Y),
    (DVec3::X, DVec3::Y),
    (DVec3::NEG_X, DVec3::Y),
    (DVec3::Y, DVec3::NEG_Z),
    (DVec3::NEG_Y, DVec3::Z),
];

/// Gives a scene of these meshes a camera, and an environment of radiance 1 if nothing emits; notes say so.
pub fn furnish(
    builder: &mut SceneBuilder,
    meshes: &[&MeshData],
    emits: bool,
    size: Option<(u32, u32)>,
    notes: &mut Notes,
    place: &Place,
) {
    if !emits {
        builder.environment(Spectrum::ONE);
    }
    let camera = choose(meshes, emits, size.unwrap_or((256, 256)));
    tell(&camera, emits, notes, place);
    builder.camera(camera);
}

/// Says that a camera was chosen, and an environment if nothing emits.
pub fn tell(camera: &CameraSettings, emits: bool, notes: &mut Notes, place: &Place) {
    if !emits {
        tell_light(notes, place);
    }
    tell_camera(camera, notes, place);
}

/// Says that the scene was given an environment.
pub fn tell_light(notes: &mut Notes, place: &Place) {
    notes.add(NoteKind::Added, place, "nothing in the file emits: it is lit by an environment of radiance 1");
}

/// That environment, as a scene file has it.
pub fn light(place: &Place) -> Lines {
    let mut lines = Lines::default();
    lines.table(place, "[[emitters]]");
    lines.key(place, "type", translation::quoted("constant"));
    lines.key(place, "radiance", "1.0");
    lines
}

/// Says that a camera was chosen.
pub fn tell_camera(camera: &CameraSettings, notes: &mut Notes, place: &Place) {
    let at = camera.position;
    let text = format!("the file has no camera: one was placed at ({:.4}, {:.4}, {:.4})", at.x, at.y, at.z);
    notes.add(NoteKind::Added, place, text);
}

/// A camera that was chosen, as a scene file has it.
pub fn table(camera: &CameraSettings, place: &Place) -> Lines {
    let Projection::Pinhole { fov } = camera.projection else { unreachable!("what is chosen is a pinhole") };
    let mut lines = Lines::default();
    lines.table(place, "[camera]");
    for (key, vector) in [("position", camera.position), ("target", camera.target), ("up", camera.up)] {
        lines.key(place, key, translation::numbers(&vector.to_array()));
    }
    lines.key(place, "fov", translation::number(fov));
    lines
}

/// Chooses a camera that shows the meshes. The rule:
///
/// 1. The camera stands outside the bounds, in front of the middle of one side, just so far off that a field of view of
///    40° holds that side; y is up.
/// 2. The sides are tried in the order +z, −z, +x, −x, +y, −y, by a grid of rays at that side. The first is taken from
///    which a tenth of the rays meets something and fewer than four fifths meet a wall, which is a surface within 2 %
///    of the bounds' size behind that side: so an open box is looked into through its open side.
/// 3. If there is none, and most rays at the first side meet the back of its wall or something emits, it may be a closed room: the
///    camera stands within, near the +z side, and looks along −z with 75°, if light is met from there, by rays in all directions: the
///    front of something where anything emits, and otherwise the environment, through a window.
/// 4. Otherwise it is a solid block, seen from +z.
pub fn choose(meshes: &[&MeshData], emits: bool, size: (u32, u32)) -> CameraSettings {
    let bounds = Bounds::of(meshes);
    let shows = |(side, up): &(DVec3, DVec3)| {
        let seen = try_view(meshes, &bounds, *side, *up);
        seen.hits >= 0.1 && seen.walls < 0.8
    };
    if let Some((side, up)) = SIDES.into_iter().find(shows) {
        return outside(&bounds, side, up, size);
    }
    let (side, up) = SIDES[0];
    let front = try_view(meshes, &bounds, side, up);
    if front.walls >= 0.8 && (emits || front.backs > 0.5) {
        let within = inside(&bounds, size);
        if is_lit(meshes, within.position, emits) {
            return within;
        }
    }
    outside(&bounds, side, up, size)
}

/// What the rays of a view meet, as fractions of their number.
struct Seen {
    hits: f64,
    walls: f64,
    /// Hits on the back of a wall.
    backs: f64,
}

struct Bounds {
    low: DVec3,
    high: DVec3,
}

impl Bounds {
    fn of(meshes: &[&MeshData]) -> Self {
        let nothing = || Bounds { low: DVec3::INFINITY, high: DVec3::NEG_INFINITY };
        let join = |a: Self, b: Self| Bounds { low: a.low.min(b.low), high: a.high.max(b.high) };
        let of = |mesh: &&MeshData| {
            let corners = mesh.triangles.par_iter().flatten_iter().map(|&i| mesh.positions[i as usize]);
            corners.fold(nothing, |all, p| join(all, Bounds { low: p, high: p })).reduce(nothing, join)
        };
        meshes.iter().map(of).fold(nothing(), join)
    }

    fn middle(&self) -> DVec3 {
        (self.low + self.high) * 0.5
    }

    /// Half the size along an axis-aligned direction.
    fn half(&self, direction: DVec3) -> f64 {
        ((self.high - self.low) * 0.5).dot(direction.abs())
    }

    fn size(&self) -> f64 {
        (self.high - self.low).max_element()
    }
}

/// The camera in front of a side.
fn outside(bounds: &Bounds, side: DVec3, up: DVec3, (width, height): (u32, u32)) -> CameraSettings {
    // The field of view spans the shorter side of the image: the longer one sees more.
    let shorter = f64::from(width.min(height));
    let (wide, high) = (f64::from(width) / shorter, f64::from(height) / shorter);
    let half = (bounds.half(side.cross(up)) / wide).max(bounds.half(up) / high).max(1e-3 * bounds.size());
    let distance = bounds.half(side) + 1.02 * half / (FOV * 0.5).to_radians().tan();
    let position = bounds.middle() + side * distance;
    CameraSettings { up, ..CameraSettings::pinhole(position, bounds.middle(), FOV, (width, height)) }
}

fn inside(bounds: &Bounds, size: (u32, u32)) -> CameraSettings {
    let middle = bounds.middle();
    let position = middle + DVec3::Z * 0.95 * bounds.half(DVec3::Z);
    CameraSettings::pinhole(position, middle, FOV_INSIDE, size)
}

/// Whether a ray from a point meets a front, which may emit, or nothing, where only the environment does.
fn is_lit(meshes: &[&MeshData], origin: DVec3, emits: bool) -> bool {
    let lit = |ray: usize| {
        // A spiral of directions over the sphere, by the golden angle.
        let z = 1.0 - (2 * ray + 1) as f64 / DIRECTIONS as f64;
        let (sin, cos) = (ray as f64 * GOLDEN_ANGLE).sin_cos();
        let d = DVec3::new((1.0 - z * z).sqrt() * cos, (1.0 - z * z).sqrt() * sin, z);
        let corners =
            meshes.iter().flat_map(|mesh| mesh.triangles.iter().map(|t| t.map(|i| mesh.positions[i as usize])));
        let mut met = corners.filter_map(|corners| meeting(origin, d, corners));
        // Where the environment alone shines, whatever is met is in its way.
        if emits {
            met.min_by(|a, b| a.0.total_cmp(&b.0)).is_some_and(|(_, front)| front)
        } else {
            met.next().is_none()
        }
    };
    (0..DIRECTIONS).into_par_iter().any(lit)
}

fn try_view(meshes: &[&MeshData], bounds: &Bounds, side: DVec3, up: DVec3) -> Seen {
    // A thin scene seen from its flat side has nothing behind its front.
    let thin = bounds.half(side) <= 0.02 * bounds.size();
    let wall = if thin { f64::NEG_INFINITY } else { 0.02 * bounds.size() };
    let mut seen = Seen { hits: 0.0, walls: 0.0, backs: 0.0 };
    for (hit, front) in View::new(bounds, side, up).first_hits(meshes).into_iter().flatten() {
        let share = 1.0 / (GRID * GRID) as f64;
        seen.hits += share;
        let behind = bounds.half(side) - (hit - bounds.middle()).dot(side);
        if behind < wall {
            seen.walls += share;
            seen.backs += if front { 0.0 } else { share };
        }
    }
    seen
}

/// A grid of rays from one point at a side of the bounds, which all of them lie before.
struct View {
    origin: DVec3,
    /// To the right, up, and into the view.
    axes: [DVec3; 3],
    /// How far the rays of each column go to the right, and those of each row up, for each unit into the view.
    slopes: [[f64; GRID]; 2],
}

/// Where a ray meets a triangle: its parameter, and whether it is the front.
type Meeting = (f64, bool);

impl View {
    fn new(bounds: &Bounds, side: DVec3, up: DVec3) -> Self {
        let right = side.cross(up);
        let origin = outside(bounds, side, up, (1, 1)).position;
        let distance = (origin - bounds.middle()).dot(side) - bounds.half(side);
        // Cell middles, but a little off, so that no ray runs along an edge or a diagonal.
        let slopes = |axis: DVec3, offset: f64| {
            std::array::from_fn(|i| ((i as f64 + offset) * (2.0 / GRID as f64) - 1.0) * bounds.half(axis) / distance)
        };
        View { origin, axes: [right, up, -side], slopes: [slopes(right, 0.47), slopes(up, 0.53)] }
    }

    fn direction(&self, ray: usize) -> DVec3 {
        let [right, up, into] = self.axes;
        into + right * self.slopes[0][ray % GRID] + up * self.slopes[1][ray / GRID]
    }

    /// For each ray the nearest point met, and whether its front was.
    fn first_hits(&self, meshes: &[&MeshData]) -> Vec<Option<(DVec3, bool)>> {
        let nothing = || [(f64::INFINITY, false); GRID * GRID];
        let nearer = |a: Meeting, b: Meeting| if b.0 < a.0 || (b.0 == a.0 && b.1) { b } else { a };
        let mut all = nothing();
        for mesh in meshes {
            let found = mesh.triangles.par_chunks(1 << 12).map(|triangles| {
                let mut nearest = nothing();
                for triangle in triangles {
                    self.meet(triangle.map(|i| mesh.positions[i as usize]), |ray, meeting| {
                        nearest[ray] = nearer(nearest[ray], meeting);
                    });
                }
                nearest
            });
            let found = found.reduce(nothing, |a, b| std::array::from_fn(|ray| nearer(a[ray], b[ray])));
            all.iter_mut().zip(found).for_each(|(all, found)| *all = nearer(*all, found));
        }
        let point =
            |(ray, (t, front)): (usize, Meeting)| t.is_finite().then(|| (self.origin + self.direction(ray) * t, front));
        all.into_iter().enumerate().map(point).collect()
    }

    /// Calls `visit` with the rays that meet a triangle.
    fn meet(&self, corners: [DVec3; 3], mut visit: impl FnMut(usize, Meeting)) {
        // Seen from the origin a triangle spans no more than its corners do.
        let places = corners.map(|p| self.axes.map(|axis| (p - self.origin).dot(axis)));
        let [columns, rows] = [0, 1].map(|axis| {
            let slopes = places.map(|place| place[axis] / place[2]);
            let low = slopes[0].min(slopes[1]).min(slopes[2]) - 1e-9;
            let high = slopes[0].max(slopes[1]).max(slopes[2]) + 1e-9;
            self.slopes[axis].partition_point(|&s| s < low)..self.slopes[axis].partition_point(|&s| s <= high)
        });
        for ray in rows.flat_map(|row| columns.clone().map(move |column| row * GRID + column)) {
            let d = self.direction(ray);
            if let Some(meeting) = meeting(self.origin, d, corners) {
                visit(ray, meeting);
            }
        }
    }
}

/// Where a ray meets a triangle, if it does (Möller & Trumbore 1997).
fn meeting(origin: DVec3, d: DVec3, [a, b, c]: [DVec3; 3]) -> Option<Meeting> {
    let (u, v) = (b - a, c - a);
    let across = d.cross(v);
    let determinant = u.dot(across);
    let from = origin - a;
    let beta = from.dot(across) / determinant;
    let along = from.cross(u);
    let gamma = d.dot(along) / determinant;
    let t = v.dot(along) / determinant;
    // Written so that NaN, of a triangle without area, is a miss.
    let met = beta >= 0.0 && gamma >= 0.0 && beta + gamma <= 1.0 && t > 0.0;
    met.then_some((t, determinant > 0.0))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A box of ±1 with its fronts inside, without the sides that are left out (−z, +z, −y, +y, −x, +x).
    fn room(without: &[usize]) -> MeshData {
        let positions =
            (0..8).map(|i| DVec3::new((i & 1) as f64, (i >> 1 & 1) as f64, (i >> 2) as f64) * 2.0 - 1.0).collect();
        let faces = [[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]];
        let kept = faces.iter().enumerate().filter(|(i, _)| !without.contains(i)).map(|(_, f)| f);
        let triangles = kept.flat_map(|f| [[f[0], f[1], f[2]], [f[0], f[2], f[3]]]).collect();
        MeshData { positions, triangles, ..MeshData::default() }
    }

    fn direction(mesh: &MeshData, emits: bool) -> (DVec3, bool) {
        let camera = choose(&[mesh], emits, (256, 256));
        let within = camera.position.abs().max_element() < 1.0;
        ((camera.target - camera.position).normalize().round(), within)
    }

    #[test]
    fn an_open_box_is_looked_into() {
        for (open, expected) in
            [(1, DVec3::NEG_Z), (0, DVec3::Z), (5, DVec3::NEG_X), (4, DVec3::X), (3, DVec3::NEG_Y), (2, DVec3::Y)]
        {
            let (view, within) = direction(&room(&[open]), true);
            assert!(view == expected && !within, "open side {open}: looks along {view}");
        }
    }

    #[test]
    fn a_closed_room_is_seen_from_within_and_a_block_from_outside() {
        assert_eq!(direction(&room(&[]), true), (DVec3::NEG_Z, true));
        let mut block = room(&[]);
        block.triangles.iter_mut().for_each(|t| t.swap(0, 1));
        assert_eq!(direction(&block, false), (DVec3::NEG_Z, false));
    }

    /// Nothing would be seen from within: no light comes in, and what a block emits it emits outwards.
    #[test]
    fn what_is_dark_within_is_seen_from_outside() {
        assert_eq!(direction(&room(&[]), false), (DVec3::NEG_Z, false));
        let mut block = room(&[]);
        block.triangles.iter_mut().for_each(|t| t.swap(0, 1));
        assert_eq!(direction(&block, true), (DVec3::NEG_Z, false));
        // Some of the left side is a window, too small to look in through.
        let mut window = room(&[4]);
        window.positions.extend([DVec3::new(-1.0, 1.0, 0.7), DVec3::new(-1.0, -1.0, 0.7)]);
        window.triangles.extend([[0, 2, 8], [0, 8, 9]]);
        assert_eq!(direction(&window, false), (DVec3::NEG_Z, true));
    }

    #[test]
    fn flat_things_are_seen_from_their_flat_side() {
        assert_eq!(direction(&room(&[0, 2, 3, 4, 5]), false), (DVec3::NEG_Z, false));
        assert_eq!(direction(&room(&[0, 1, 3, 4, 5]), false), (DVec3::NEG_Y, false));
    }

    #[test]
    fn the_whole_side_is_in_the_picture() {
        let camera = choose(&[&room(&[1])], true, (512, 256));
        let distance = camera.position.z - 1.0;
        assert!(distance * (FOV * 0.5).to_radians().tan() >= 1.0);
    }

    #[test]
    fn every_ray_finds_its_nearest_triangle() {
        // Triangles in disorder, of all sizes.
        let number = |i: usize| (i as f64 * 0.754_877_666).fract() - 0.5;
        let corner = |i: usize| {
            let size = if (i / 3).is_multiple_of(7) { 1.0 } else { 0.05 };
            let middle = DVec3::new(number(i / 3), number(i / 3 * 31 + 1), 0.3 * number(i / 3 * 77 + 5));
            middle + size * DVec3::new(number(i * 5), number(i * 13), number(i * 17))
        };
        let positions: Vec<DVec3> = (0..900).map(corner).collect();
        let triangles = (0..300).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect();
        let mesh = MeshData { positions, triangles, ..MeshData::default() };
        let bounds = Bounds::of(&[&mesh]);
        for (side, up) in SIDES {
            let view = View::new(&bounds, side, up);
            let found = view.first_hits(&[&mesh]);
            assert!(found.iter().flatten().count() > 10);
            for (ray, hit) in found.into_iter().enumerate() {
                let d = view.direction(ray);
                let meets = |t: &[u32; 3]| {
                    let [a, b, c] = t.map(|i| mesh.positions[i as usize] - view.origin);
                    // The ray passes all edges on one side.
                    let sides = [(a, b), (b, c), (c, a)].map(|(p, q)| p.cross(q).dot(d));
                    let inside = sides.iter().all(|s| *s > 0.0) || sides.iter().all(|s| *s < 0.0);
                    let normal = (b - a).cross(c - a);
                    inside.then(|| (a.dot(normal) / d.dot(normal), d.dot(normal) < 0.0))
                };
                let expected = mesh.triangles.iter().filter_map(meets).min_by(|a, b| a.0.total_cmp(&b.0));
                assert_eq!(hit.is_some(), expected.is_some());
                if let (Some((p, front)), Some((t, expected))) = (hit, expected) {
                    assert!(p.distance(view.origin + d * t) < 1e-9 && front == expected);
                }
            }
        }
    }
}
