//! Triangles in pairs that share an edge.

use crate::shape::Triangle;
use rayon::prelude::*;
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

/// Two triangles that make a pair; the second is [`u32::MAX`] if there is one only.
pub(super) type Couple = [u32; 2];

impl Pair {
    /// The pair of a couple.
    pub fn of([one, two]: Couple, triangles: &[Triangle]) -> Self {
        let first = triangles[one as usize].0;
        let shared = triangles.get(two as usize).and_then(|second| {
            let (mine, other) = shared_edge(&triangles[one as usize], second)?;
            Some((second.0, mine, other))
        });
        let Some((second, mine, other)) = shared else {
            let [a, b, c] = first;
            return Pair { corners: [a, b, c, c], members: [Member { id: one, rotation: 0 }, NOBODY] };
        };
        let rotation = (mine + 1) % 3;
        let [a, b, c] = [rotation, mine + 2, mine].map(|v| first[v % 3]);
        let members = [(one, rotation), (two, other)].map(|(id, rotation)| Member { id, rotation: rotation as u8 });
        Pair { corners: [a, b, c, second[(other + 2) % 3]], members }
    }
}

/// Couples the triangles of a list: each with the next one if they share an edge, as meshes list the halves of quads; and of those
/// that are left neighbours whose common box is no larger than both of theirs, by their longest edges first.
pub(super) fn pair_up(triangles: &[Triangle], list: &[u32]) -> Vec<Couple> {
    // Counted first, so that no more is allocated than it takes.
    let mut couples = Vec::with_capacity(partners(triangles, list).count());
    couples.extend(partners(triangles, list));
    let is_single = |couple: &Couple| couple[1] == u32::MAX;
    let singles: Vec<u32> = couples.iter().filter(|couple| is_single(couple)).map(|couple| couple[0]).collect();
    let matches = match_edges(triangles, &singles);
    if matches.is_empty() {
        return couples;
    }
    let mut partner = matches.iter().copied().chain(matches.iter().map(|&[one, two]| [two, one])).collect::<Vec<_>>();
    partner.par_sort_unstable();
    let found = |id: u32| partner.binary_search_by_key(&id, |couple| couple[0]).ok().map(|at| partner[at][1]);
    couples.retain_mut(|couple| {
        if !is_single(couple) {
            return true;
        }
        couple[1] = found(couple[0]).unwrap_or(u32::MAX);
        couple[0] < couple[1]
    });
    couples
}

/// The triangles of a list, each with the next one if they share an edge.
fn partners(triangles: &[Triangle], list: &[u32]) -> impl Iterator<Item = Couple> {
    let mut next = 0;
    std::iter::from_fn(move || {
        let id = *list.get(next)?;
        let second = list.get(next + 1).copied();
        let second = second.filter(|&id2| shared_edge(&triangles[id as usize], &triangles[id2 as usize]).is_some());
        next += if second.is_some() { 2 } else { 1 };
        Some([id, second.unwrap_or(u32::MAX)])
    })
}

/// Couples triangles that share an edge, none twice.
fn match_edges(triangles: &[Triangle], singles: &[u32]) -> Vec<Couple> {
    let mut edges: Vec<(u64, u32)> =
        singles.par_iter().flat_map_iter(|&id| edge_keys(&triangles[id as usize]).map(|key| (key, id))).collect();
    edges.par_sort_unstable();
    // At an edge of more than two triangles each is offered its neighbour in the list only.
    let mut offers: Vec<(u32, Couple)> = edges
        .par_windows(2)
        .filter(|two| two[0].0 == two[1].0)
        .filter_map(|two| offer(triangles, [two[0].1, two[1].1]))
        .collect();
    drop(edges);
    offers.par_sort_unstable_by(|a, b| b.cmp(a));
    let mut taken = vec![false; singles.len()];
    let place = |id: u32| singles.binary_search(&id).unwrap_or(0);
    offers
        .into_iter()
        .map(|(_, couple)| couple)
        .filter(|couple| {
            let places = couple.map(place);
            let free = places.iter().all(|&at| !taken[at]);
            places.iter().filter(|_| free).for_each(|&at| taken[at] = true);
            free
        })
        .collect()
}

/// A couple with the squared length of its edge, as bits, whose order is that of the lengths; None if it makes no good pair.
fn offer(triangles: &[Triangle], couple: Couple) -> Option<(u32, Couple)> {
    let [first, second] = couple.map(|id| &triangles[id as usize]);
    let (mine, _) = shared_edge(first, second)?;
    let area = |corners: &[Vec3]| {
        let (low, high) = corners.iter().fold((Vec3::INFINITY, Vec3::NEG_INFINITY), |(l, h), &p| (l.min(p), h.max(p)));
        let size = high - low;
        size.x * (size.y + size.z) + size.y * size.z
    };
    let both = [first.0, second.0];
    let worth = area(both.as_flattened()) <= area(&first.0) + area(&second.0);
    worth.then(|| (first.0[mine].distance_squared(first.0[(mine + 1) % 3]).to_bits(), couple))
}

/// A number for each edge, the same in whichever direction it runs; others hardly ever have it.
fn edge_keys(triangle: &Triangle) -> [u64; 3] {
    // Scattered by the finisher of SplitMix64: a sum of numbers that grow with coordinates would be that of many edges.
    let scatter = |key: u64| {
        let key = (key ^ key >> 30).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        let key = (key ^ key >> 27).wrapping_mul(0x94d0_49bb_1331_11eb);
        key ^ key >> 31
    };
    // The sum takes the sign from zeros, which are equal.
    let mix = |key: u64, x: f32| scatter(key.rotate_left(32) ^ u64::from((x + 0.0).to_bits()));
    let keys = triangle.0.map(|p| p.to_array().into_iter().fold(1, mix));
    std::array::from_fn(|e| keys[e].wrapping_add(keys[(e + 1) % 3]))
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

    fn pairs(triangles: &[Triangle]) -> Vec<Pair> {
        let list: Vec<u32> = (0..triangles.len() as u32).collect();
        pair_up(triangles, &list).into_iter().map(|couple| Pair::of(couple, triangles)).collect()
    }

    #[test]
    fn all_ways_to_share_an_edge_are_found() {
        let [a, b, c, d] = [vec3(0., 0., 0.), vec3(1., 0., 0.), vec3(1., 1., 0.), vec3(0., 1., 0.)];
        for first in 0..3 {
            for second in 0..3 {
                let mut triangles = [Triangle([a, b, c]), Triangle([a, c, d])];
                triangles[0].0.rotate_left(first);
                triangles[1].0.rotate_left(second);
                let pairs = pairs(&triangles);
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
        assert_eq!(pairs(&wound_otherwise).len(), 2);
        let pairs = pairs(&[Triangle([a, b, c])]);
        assert_eq!(pairs[0].corners[3], pairs[0].corners[2]);
    }

    #[test]
    fn a_grid_in_any_order_is_paired_along_its_diagonals() {
        let side = 20;
        let corner = |x: usize, y: usize| vec3(x as f32, y as f32, 0.0);
        let mut triangles = Vec::new();
        for (x, y) in (0..side * side).map(|cell| (cell % side, cell / side)) {
            let [a, b, c, d] = [corner(x, y), corner(x + 1, y), corner(x + 1, y + 1), corner(x, y + 1)];
            triangles.extend([Triangle([a, b, c]), Triangle([a, c, d])]);
        }
        let count = triangles.len();
        // 7 and 800 have no factor in common.
        let shuffled: Vec<Triangle> = (0..count).map(|i| triangles[i * 7 % count]).collect();
        let pairs = pairs(&shuffled);
        assert_eq!(pairs.len(), count / 2);
        let mut seen = vec![false; count];
        for pair in pairs {
            assert_eq!(pair.corners[0].distance_squared(pair.corners[2]), 2.0);
            for Member { id, .. } in pair.members {
                assert!(!std::mem::replace(&mut seen[id as usize], true));
            }
        }
    }
}
