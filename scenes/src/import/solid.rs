//! Bodies that light passes through: which side of their surface is outside.

use std::collections::HashMap;

use glam::DVec3;

use crate::builder::MeshData;

/// What [`orient_outwards`] found.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Orientation {
    /// Triangles that were turned over.
    pub turned: usize,
    /// Whether every part is closed: each edge shared by exactly two triangles.
    pub closed: bool,
}

/// Turns triangles over so that the fronts of each closed part look outwards. Parts that are not closed are left as they
/// are.
///
/// Vertices at equal positions count as one. Outside is the side that makes a part's volume positive. A part within
/// another, whose triangles agree with one another, is left as it is: it may be the wall of a hollow.
pub fn orient_outwards(mesh: &mut MeshData) -> Orientation {
    let mut result = Orientation { turned: 0, closed: true };
    let parts = parts(mesh);
    for part in &parts {
        let within = |other: &Part| other.low.cmplt(part.low).all() && part.high.cmplt(other.high).all();
        let wall_of_hollow = part.agree && parts.iter().any(within);
        result.closed &= part.closed;
        if !part.closed || wall_of_hollow {
            continue;
        }
        for &(t, turned) in &part.triangles {
            if turned != (part.volume < 0.0) {
                mesh.triangles[t].swap(1, 2);
                result.turned += 1;
            }
        }
    }
    result
}

/// Triangles connected by edges.
struct Part {
    /// Each with whether it must be turned to agree with the first.
    triangles: Vec<(usize, bool)>,
    /// Whether each edge is shared by two triangles, and they can be made to agree.
    closed: bool,
    /// Whether none must be turned.
    agree: bool,
    /// Six times the volume after turning; its sign says whether the first looks outwards.
    volume: f64,
    low: DVec3,
    high: DVec3,
}

fn parts(mesh: &MeshData) -> Vec<Part> {
    let welded = weld(&mesh.positions);
    let corners: Vec<[u32; 3]> = mesh.triangles.iter().map(|t| t.map(|i| welded[i as usize])).collect();
    let mut sharing: Sharing = HashMap::new();
    for (t, &[a, b, c]) in corners.iter().enumerate() {
        for (i, j) in [(a, b), (b, c), (c, a)] {
            sharing.entry([i.min(j), i.max(j)]).or_default().push(t as u32);
        }
    }
    let mut state: Vec<Option<bool>> = vec![None; corners.len()];
    let mut parts = Vec::new();
    for start in 0..corners.len() {
        if state[start].is_none() {
            let (members, closed) = walk_part(start, &corners, &sharing, &mut state);
            let triangles: Vec<_> = members.into_iter().map(|t| (t, state[t] == Some(true))).collect();
            parts.push(Part::of(mesh, triangles, closed));
        }
    }
    parts
}

impl Part {
    fn of(mesh: &MeshData, triangles: Vec<(usize, bool)>, closed: bool) -> Self {
        let at = |i: u32| mesh.positions[i as usize];
        let points = || triangles.iter().flat_map(|&(t, _)| mesh.triangles[t].map(at));
        let low = points().fold(DVec3::INFINITY, DVec3::min);
        let high = points().fold(DVec3::NEG_INFINITY, DVec3::max);
        let signed = |&(t, turned): &(usize, bool)| {
            let [a, b, c] = mesh.triangles[t].map(|i| at(i) - low);
            a.dot(b.cross(c)) * if turned { -1.0 } else { 1.0 }
        };
        let volume = triangles.iter().map(signed).sum();
        let agree = triangles.iter().all(|&(_, turned)| !turned);
        Part { triangles, closed, agree, volume, low, high }
    }
}

/// The triangles at each edge.
type Sharing = HashMap<[u32; 2], Vec<u32>>;

/// The connected triangles from `start`, each marked whether it must be turned to agree with `start`; and whether they
/// are closed and can agree.
fn walk_part(start: usize, corners: &[[u32; 3]], sharing: &Sharing, state: &mut [Option<bool>]) -> (Vec<usize>, bool) {
    let mut part = vec![start];
    let mut closed = true;
    state[start] = Some(false);
    let mut next = 0;
    while let Some(&t) = part.get(next) {
        next += 1;
        let [a, b, c] = corners[t];
        for (i, j) in [(a, b), (b, c), (c, a)] {
            let sharers = &sharing[&[i.min(j), i.max(j)]];
            closed &= sharers.len() == 2 && i != j;
            for other in sharers.iter().map(|&other| other as usize).filter(|&other| other != t) {
                // Neighbours agree when they run along their common edge in opposite directions.
                let turned = (state[t] == Some(true)) != runs_along(corners[other], i, j);
                match state[other] {
                    None => {
                        state[other] = Some(turned);
                        part.push(other);
                    }
                    Some(known) => closed &= known == turned,
                }
            }
        }
    }
    (part, closed)
}

fn runs_along([a, b, c]: [u32; 3], i: u32, j: u32) -> bool {
    [(a, b), (b, c), (c, a)].contains(&(i, j))
}

/// For each position the first index that has it.
fn weld(positions: &[DVec3]) -> Vec<u32> {
    let mut first = HashMap::with_capacity(positions.len());
    // Adding 0 makes −0 equal to 0 in bits.
    let key = |p: &DVec3| (*p + DVec3::ZERO).to_array().map(f64::to_bits);
    positions.iter().enumerate().map(|(i, p)| *first.entry(key(p)).or_insert(i as u32)).collect()
}

/// Removes the triangles of a transmitting body that lie in an opaque surface, and returns how many.
///
/// A glass box that stands on a floor has its bottom in the floor's plane. Two surfaces in one plane are met in an
/// order that rounding decides; without the glass one they are in optical contact, and every path meets the same floor.
pub fn remove_contacts(body: &mut MeshData, opaque: &[&MeshData]) -> usize {
    let mut planes: HashMap<[i64; 4], Vec<[DVec3; 3]>> = HashMap::new();
    let extent = extent(opaque.iter().copied().chain([&*body]));
    for mesh in opaque {
        for triangle in &mesh.triangles {
            let corners = triangle.map(|i| mesh.positions[i as usize]);
            if let Some(plane) = plane(corners, extent) {
                planes.entry(plane).or_default().push(corners);
            }
        }
    }
    let before = body.triangles.len();
    let positions = &body.positions;
    body.triangles.retain(|triangle| {
        let corners = triangle.map(|i| positions[i as usize]);
        let Some(candidates) = plane(corners, extent).and_then(|plane| planes.get(&plane)) else { return true };
        !samples(corners).iter().all(|&p| candidates.iter().any(|&t| contains(t, p, 1e-6 * extent)))
    });
    before - body.triangles.len()
}

fn extent<'a>(meshes: impl Iterator<Item = &'a MeshData>) -> f64 {
    let largest = |mesh: &MeshData| mesh.positions.iter().map(|p| p.abs().max_element()).fold(0.0, f64::max);
    meshes.map(largest).fold(f64::MIN_POSITIVE, f64::max)
}

/// The plane of a triangle on a fine grid, the same for both sides; `None` without area.
fn plane([a, b, c]: [DVec3; 3], extent: f64) -> Option<[i64; 4]> {
    let mut n = (b - a).cross(c - a).try_normalize()?;
    let largest = if n.x.abs() > 0.5 {
        n.x
    } else if n.y.abs() > 0.5 {
        n.y
    } else {
        n.z
    };
    n *= largest.signum();
    let grid = |x: f64| (x * 1e5).round() as i64;
    Some([grid(n.x), grid(n.y), grid(n.z), grid(n.dot(a) / extent)])
}

/// Corners, edge middles and centroid: what stands for all of a triangle's points.
fn samples([a, b, c]: [DVec3; 3]) -> [DVec3; 7] {
    [a, b, c, (a + b) * 0.5, (b + c) * 0.5, (c + a) * 0.5, (a + b + c) / 3.0]
}

/// Whether a point of the triangle's plane lies in it, to a tolerance \[m\].
fn contains([a, b, c]: [DVec3; 3], p: DVec3, tolerance: f64) -> bool {
    let n = (b - a).cross(c - a).normalize_or_zero();
    let beyond = |from: DVec3, to: DVec3| n.cross(to - from).normalize_or_zero().dot(p - from) >= -tolerance;
    beyond(a, b) && beyond(b, c) && beyond(c, a)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn cube(turn: &[usize]) -> MeshData {
        let positions = (0..8).map(|i| DVec3::new((i & 1) as f64, (i >> 1 & 1) as f64, (i >> 2) as f64)).collect();
        let faces = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
        let mut triangles: Vec<[u32; 3]> =
            faces.iter().flat_map(|f| [[f[0], f[1], f[2]], [f[0], f[2], f[3]]]).collect();
        turn.iter().for_each(|&t| triangles[t].swap(0, 1));
        MeshData { positions, triangles, ..MeshData::default() }
    }

    fn outwards(mesh: &MeshData) -> bool {
        mesh.triangles.iter().all(|t| {
            let [a, b, c] = t.map(|i| mesh.positions[i as usize]);
            (b - a).cross(c - a).dot((a + b + c) / 3.0 - DVec3::splat(0.5)) > 0.0
        })
    }

    #[test]
    fn fronts_look_outwards() {
        for turn in [&[][..], &[0, 1], &[3], &[0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11], &[1, 2, 4, 5, 6, 7, 8, 9, 10, 11]]
        {
            let mut mesh = cube(turn);
            assert_eq!(orient_outwards(&mut mesh), Orientation { turned: turn.len(), closed: true });
            assert!(outwards(&mesh), "{turn:?}");
        }
    }

    #[test]
    fn the_wall_of_a_hollow_stays_as_it_is() {
        let mut mesh = cube(&[]);
        let hollow = cube(&[0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11]);
        mesh.positions.extend(hollow.positions.iter().map(|p| *p * 0.5 + 0.25));
        mesh.triangles.extend(hollow.triangles.iter().map(|t| t.map(|i| i + 8)));
        assert_eq!(orient_outwards(&mut mesh), Orientation { turned: 0, closed: true });
    }

    #[test]
    fn open_parts_stay_as_they_are() {
        let mut mesh = cube(&[5]);
        mesh.triangles.pop();
        let before = mesh.triangles.clone();
        assert_eq!(orient_outwards(&mut mesh), Orientation { turned: 0, closed: false });
        assert_eq!(mesh.triangles, before);
    }

    #[test]
    fn faces_in_an_opaque_surface_go() {
        let floor = |size: f64| MeshData {
            positions: [(-1.0, -1.0), (2.0, -1.0), (2.0, 2.0), (-1.0, 2.0)]
                .map(|(x, y)| DVec3::new(x, y, 0.0) * size)
                .to_vec(),
            triangles: vec![[0, 1, 2], [0, 2, 3]],
            ..MeshData::default()
        };
        let mut mesh = cube(&[]);
        assert_eq!(remove_contacts(&mut mesh, &[&floor(1.0)]), 2);
        assert_eq!(remove_contacts(&mut mesh, &[&floor(1.0)]), 0);
        assert_eq!(remove_contacts(&mut cube(&[]), &[&floor(0.3)]), 0, "the floor is too small to be a contact");
    }
}
