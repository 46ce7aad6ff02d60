use super::*;

const PURPOSES: [Purpose; 11] = [
    Purpose::Film,
    Purpose::Lens,
    Purpose::EmitterChoice,
    Purpose::EmitterPosition,
    Purpose::EmitterDirection,
    Purpose::Lobe,
    Purpose::Direction,
    Purpose::Roulette,
    Purpose::NextEmitter,
    Purpose::NextPosition,
    Purpose::NextCamera,
];

fn key() -> StreamKey {
    StreamKey::new(0, "path", Role::Estimate, 0)
}

/// χ² of pairs on a 16 × 16 grid as a standard normal; |z| > 6 has probability 2e-9 by chance.
fn chi_square_z(pairs: impl Iterator<Item = (f32, f32)>) -> f64 {
    let mut cells = [0_u32; 256];
    let mut n = 0;
    for (x, y) in pairs {
        assert!((0.0..1.0).contains(&x) && (0.0..1.0).contains(&y));
        cells[(x * 16.0) as usize * 16 + (y * 16.0) as usize] += 1;
        n += 1;
    }
    let expected = f64::from(n) / 256.0;
    let chi2: f64 = cells.iter().map(|&c| (f64::from(c) - expected).powi(2) / expected).sum();
    (chi2 - 255.0) / (2.0 * 255.0_f64).sqrt()
}

#[test]
fn the_numbers_are_these() {
    // Pinned: a change here changes every result, and belongs under "Results affected" in the change log.
    let mut s = Sampler::new(SamplerKind::Independent, key(), 4);
    s.start_sample(123, 2);
    s.start_vertex(Subpath::Light, 3);
    let independent = (s.get_1d(Purpose::Lobe), s.get_2d(Purpose::Direction));
    let mut s = Sampler::new(SamplerKind::Stratified, key(), 4);
    s.start_sample(123, 2);
    s.start_vertex(Subpath::Light, 3);
    let stratified = (s.get_1d(Purpose::Lobe), s.get_2d(Purpose::Direction));
    assert_eq!(independent, (0.457_161_3, vec2(0.715_239_6, 0.226_931_75)));
    assert_eq!(stratified, (0.864_290_36, vec2(0.357_619_8, 0.613_465_9)));
}

#[test]
fn draws_are_addressed_and_not_counted() {
    for &kind in SamplerKind::ALL {
        let mut s = Sampler::new(kind, key(), 16);
        s.start_sample(5, 7);
        let forward: Vec<Vec2> = PURPOSES.iter().map(|&p| s.get_2d(p)).collect();
        s.start_sample(6, 1);
        s.start_sample(5, 7);
        let mut backward: Vec<Vec2> = PURPOSES.iter().rev().map(|&p| s.get_2d(p)).collect();
        backward.reverse();
        assert_eq!(forward, backward);
    }
}

#[test]
fn one_is_never_reached() {
    for n in [1, 2, 3, 7, 64, 1000, 16_777_215] {
        for i in [0, n / 2, n - 1] {
            let x = in_cell(i, n, 1.0_f32.next_down());
            assert!((0.0..1.0).contains(&x), "cell {i} of {n}: {x}");
        }
    }
}

#[test]
fn keys_differ_in_each_of_their_parts() {
    let base = key();
    let others = [
        StreamKey::new(1, "path", Role::Estimate, 0),
        StreamKey::new(0, "path2", Role::Estimate, 0),
        StreamKey::new(0, "pat", Role::Estimate, 0),
        StreamKey::new(0, "", Role::Estimate, 0),
        StreamKey::new(0, "path", Role::Pilot, 0),
        StreamKey::new(0, "path", Role::Reference, 0),
        StreamKey::new(0, "path", Role::Estimate, 1),
        StreamKey::new(0, "path", Role::Estimate, u32::MAX),
    ];
    for other in others {
        assert_ne!(base, other);
        let (mut a, mut b) =
            (Sampler::new(SamplerKind::Independent, base, 1), Sampler::new(SamplerKind::Independent, other, 1));
        let z = chi_square_z((0..1 << 16).map(|pixel| {
            a.start_sample(pixel, 0);
            b.start_sample(pixel, 0);
            (a.get_1d(Purpose::Film), b.get_1d(Purpose::Film))
        }));
        assert!(z.abs() < 6.0, "{other:?}: z = {z}");
    }
}

#[test]
fn addresses_are_independent_of_one_another() {
    // Every pair of purposes at a vertex, and each purpose at neighbouring vertices, samples, pixels and subpaths.
    let draw = |pixel: u64, sample: u32, subpath, vertex, purpose| {
        let mut s = Sampler::new(SamplerKind::Independent, key(), 1 << 20);
        s.start_sample(pixel, sample);
        s.start_vertex(subpath, vertex);
        s.get_1d(purpose)
    };
    let check = |name: &str, pair: &dyn Fn(u32) -> (f32, f32)| {
        let z = chi_square_z((0..1 << 15).map(pair));
        assert!(z.abs() < 6.0, "{name}: z = {z}");
    };
    for (i, &p) in PURPOSES.iter().enumerate() {
        for &q in &PURPOSES[..i] {
            check(&format!("{p:?} and {q:?}"), &|s| {
                (draw(9, s, Subpath::Camera, 1, p), draw(9, s, Subpath::Camera, 1, q))
            });
        }
        let here = |s| draw(9, s, Subpath::Camera, 1, p);
        check("the next vertex", &|s| (here(s), draw(9, s, Subpath::Camera, 2, p)));
        check("the other subpath", &|s| (here(s), draw(9, s, Subpath::Light, 1, p)));
        check("the next sample", &|s| (here(s), here(s + 1)));
        check("the next pixel", &|s| (here(s), draw(10, s, Subpath::Camera, 1, p)));
    }
}

#[test]
fn the_two_numbers_of_a_point_are_independent() {
    for &kind in SamplerKind::ALL {
        let mut s = Sampler::new(kind, key(), 1);
        let z = chi_square_z((0..1 << 16).map(|pixel| {
            s.start_sample(pixel, 0);
            s.get_2d(Purpose::Direction).into()
        }));
        assert!(z.abs() < 6.0, "{kind}: z = {z}");
    }
}

#[test]
fn every_stratum_holds_one_sample() {
    for n in [1_u32, 2, 3, 4, 6, 12, 13, 16, 64, 100] {
        let mut s = Sampler::new(SamplerKind::Stratified, key(), n);
        let strata = Strata::new(n);
        assert_eq!(strata.nx * strata.ny, n);
        for round in 0..2 {
            let (mut line, mut square) = (vec![0; n as usize], vec![0; n as usize]);
            for sample in round * n..(round + 1) * n {
                s.start_sample(77, sample);
                s.start_vertex(Subpath::Camera, 2);
                line[(s.get_1d(Purpose::Lobe) * n as f32) as usize] += 1;
                let u = s.get_2d(Purpose::Direction);
                square[((u.y * strata.ny as f32) as u32 * strata.nx + (u.x * strata.nx as f32) as u32) as usize] += 1;
            }
            assert!(line.iter().chain(&square).all(|&count| count == 1), "{n} samples: {line:?} {square:?}");
        }
    }
}

#[test]
fn cells_are_as_square_as_divisors_allow() {
    for (n, cells) in [(1, (1, 1)), (16, (4, 4)), (12, (4, 3)), (13, (13, 1)), (32, (8, 4))] {
        let strata = Strata::new(n);
        assert_eq!((strata.nx, strata.ny), cells);
    }
}

#[test]
fn strata_are_paired_by_chance_across_addresses_and_uniform_over_pixels() {
    let mut s = Sampler::new(SamplerKind::Stratified, key(), 16);
    let z = chi_square_z((0..1 << 16).map(|i| {
        s.start_sample(i / 16, (i % 16) as u32);
        (s.get_1d(Purpose::Lobe), s.get_1d(Purpose::Roulette))
    }));
    // Each number is perfectly spread within a pixel, so fewer than 255 degrees of freedom are left to chance.
    assert!(z < 6.0, "z = {z}");
    let z = chi_square_z((0..1 << 16).map(|pixel| {
        s.start_sample(pixel, 3);
        (s.get_1d(Purpose::Lobe), s.get_1d(Purpose::Roulette))
    }));
    assert!(z.abs() < 6.0, "z = {z}");
}

#[test]
fn permutations_are_permutations() {
    for length in [1, 2, 3, 5, 8, 100, 257] {
        for seed in [0, 1, 0xdead_beef, u32::MAX] {
            let mut seen = vec![false; length as usize];
            (0..length).for_each(|i| seen[permute(i, length, seed) as usize] = true);
            assert!(seen.iter().all(|&s| s), "length {length}, seed {seed}");
        }
    }
}

#[test]
fn names_read_back() {
    for &kind in SamplerKind::ALL {
        assert_eq!(kind.to_string().parse(), Ok(kind));
    }
    assert!("sobol".parse::<SamplerKind>().is_err());
}
