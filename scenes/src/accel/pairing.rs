//! Triangles in pairs that share an edge, as quads and most meshes list them.

use crate::shape::Triangle;
use sampling::Vec3;

/// Two triangles (a, b, c) and (a, c, d), wound the same way; or one, with d = c.
#[derive(Clone, Copy, Debug)]
pub(super) struct Pair {
    /// The corners a, b, c, d.
    pub corners: [Vec3; 4],
    /// The two triangles; the second has no id if there is one only.
    pub members: [Member; 2],
}

/// A triangle of a pair.
#[derive(Clone, Copy, Debug)]
pub(super) struct Member {
    /// Which one.
    pub id: u32,
    /// Its first corner is its vertex of this number.
    pub rotation: u8,
}

const NOBODY: Member = Member { id: u32::MAX, rotation: 0 };

impl Pair {
    /// The lowest and the highest coordinates.
    pub fn extent(&self) -> (Vec3, Vec3) {
        let [a, b, c, d] = self.corners;
        (a.min(b).min(c.min(d)), a.max(b).max(c.max(d)))
    }
}

/// Pairs each triangle with the next one if they share an edge.
pub(super) fn pair_up(triangles: &[Triangle]) -> Vec<Pair> {
    // Counted first, so that no more is allocated than it takes.
    let mut pairs = Vec::with_capacity(partners(triangles).count());
    pairs.extend(partners(triangles).map(|(id, shared)| match shared {
        Some((mine, other)) => {
            let (first, second) = (triangles[id].0, triangles[id + 1].0);
            let rotation = (mine + 1) % 3;
            let [a, b, c] = [rotation, mine + 2, mine].map(|v| first[v % 3]);
            Pair {
                corners: [a, b, c, second[(other + 2) % 3]],
                members: [
                    Member { id: id as u32, rotation: rotation as u8 },
                    Member { id: id as u32 + 1, rotation: other as u8 },
                ],
            }
        }
        None => {
            let [a, b, c] = triangles[id].0;
            Pair { corners: [a, b, c, c], members: [Member { id: id as u32, rotation: 0 }, NOBODY] }
        }
    }));
    pairs
}

/// The first triangle of each pair, with the edges that it shares with the next one; None for one that stays single.
fn partners(triangles: &[Triangle]) -> impl Iterator<Item = (usize, Option<(usize, usize)>)> {
    let mut next = 0;
    std::iter::from_fn(move || {
        let id = next;
        let first = triangles.get(id)?;
        let shared = triangles.get(id + 1).and_then(|second| shared_edge(first, second));
        next += if shared.is_some() { 2 } else { 1 };
        Some((id, shared))
    })
}

/// The edges (each by its first vertex) along which two triangles of the same winding meet.
fn shared_edge(first: &Triangle, second: &Triangle) -> Option<(usize, usize)> {
    let edge = |triangle: &Triangle, e: usize| (triangle.0[e], triangle.0[(e + 1) % 3]);
    (0..3).flat_map(|mine| (0..3).map(move |other| (mine, other))).find(|&(mine, other)| {
        let ((from, to), (start, end)) = (edge(first, mine), edge(second, other));
        from == end && to == start
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use sampling::vec3;

    #[test]
    fn all_ways_to_share_an_edge_are_found() {
        let [a, b, c, d] = [vec3(0., 0., 0.), vec3(1., 0., 0.), vec3(1., 1., 0.), vec3(0., 1., 0.)];
        for first in 0..3 {
            for second in 0..3 {
                let mut triangles = [Triangle([a, b, c]), Triangle([a, c, d])];
                triangles[0].0.rotate_left(first);
                triangles[1].0.rotate_left(second);
                let pairs = pair_up(&triangles);
                assert_eq!(pairs.len(), 1);
                assert_eq!(pairs[0].corners, [a, b, c, d]);
                let [one, two] = pairs[0].members.map(|member| member.rotation as usize);
                assert_eq!(triangles[0].0[one], a);
                assert_eq!(triangles[1].0[two], a);
            }
        }
    }

    #[test]
    fn triangles_that_only_touch_stay_single() {
        let [a, b, c, d] = [vec3(0., 0., 0.), vec3(1., 0., 0.), vec3(1., 1., 0.), vec3(0., 1., 0.)];
        let wound_otherwise = [Triangle([a, b, c]), Triangle([a, d, c])];
        assert_eq!(pair_up(&wound_otherwise).len(), 2);
        let pairs = pair_up(&[Triangle([a, b, c])]);
        assert_eq!(pairs[0].corners[3], pairs[0].corners[2]);
    }
}
