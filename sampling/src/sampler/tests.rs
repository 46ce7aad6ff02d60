use super::strata::in_cell;
use super::*;

pub(super) const PURPOSES: [Purpose; 20] = [
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
    Purpose::ProbeChannel,
    Purpose::ProbePosition,
    Purpose::ProbeChoice,
    Purpose::NextEventChoice,
    Purpose::ConnectionChoice,
    Purpose::ConnectionRoulette,
    Purpose::Order,
    Purpose::Strategy,
    Purpose::Mutation,
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
    let numbers = |kind| {
        let mut s = Sampler::new(kind, key(), 4, (64, 2));
        s.start_sample(123, 2);
        s.start_vertex(Subpath::Light, 3);
        let light = (s.get_1d(Purpose::Lobe), s.get_2d(Purpose::Direction));
        s.start_vertex(Subpath::Camera, 0);
        (light, s.get_2d(Purpose::Film))
    };
    let expected = |kind| match kind {
        SamplerKind::Independent => ((0.457_161_3, vec2(0.715_239_6, 0.226_931_75)), vec2(0.985_015_15, 0.513_177_6)),
        SamplerKind::Stratified => ((0.864_290_36, vec2(0.357_619_8, 0.613_465_9)), vec2(0.492_507_58, 0.756_588_8)),
        SamplerKind::MultiJittered => {
            ((0.864_290_36, vec2(0.428_809_88, 0.806_732_95)), vec2(0.746_253_8, 0.878_294_4))
        }
        SamplerKind::Halton => ((0.550_006_2, vec2(0.891_845_64, 0.958_389_04)), vec2(0.223_068_48, 0.359_746_75)),
        SamplerKind::Sobol => ((0.889_525_8, vec2(0.662_630_44, 0.692_479)), vec2(0.219_190_48, 0.754_191_34)),
        SamplerKind::Zsobol => ((0.889_525_8, vec2(0.662_630_44, 0.692_479)), vec2(0.548_890_65, 0.353_412_03)),
    };
    for &kind in SamplerKind::ALL {
        assert_eq!(numbers(kind), expected(kind), "{kind}");
    }
}

#[test]
fn draws_are_addressed_and_not_counted() {
    for &kind in SamplerKind::ALL {
        let mut s = Sampler::new(kind, key(), 16, (64, 1));
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
        let (mut a, mut b) = (
            Sampler::new(SamplerKind::Independent, base, 1, (64, 1)),
            Sampler::new(SamplerKind::Independent, other, 1, (64, 1)),
        );
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
        let mut s = Sampler::new(SamplerKind::Independent, key(), 1 << 20, (64, 1));
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

/// Over replicates, which is what makes estimates unbiased: the two numbers of a point, two addresses, two samples of a pixel, two
/// pixels. Samples of one replicate depend on one another; those of one sample of many replicates may not.
#[test]
fn randomisations_of_replicates_are_uniform_and_independent() {
    let samplers = |kind| {
        (0..1 << 15).map(move |replicate| {
            let key = StreamKey::new(5, "path", Role::Estimate, replicate);
            Sampler::new(kind, key, 16, (8, 8))
        })
    };
    for &kind in SamplerKind::ALL {
        let check = |what: &str, pair: &dyn Fn(&mut Sampler) -> (f32, f32)| {
            let z = chi_square_z(samplers(kind).map(|mut sampler| pair(&mut sampler)));
            assert!(z.abs() < 6.0, "{kind}: {what}: z = {z}");
        };
        let at = |s: &mut Sampler, pixel, sample, subpath, purpose| {
            s.start_sample(pixel, sample);
            s.start_vertex(subpath, 0);
            s.get_1d(purpose)
        };
        use {Purpose::*, Subpath::*};
        for (subpath, purpose) in [(Camera, Film), (Light, EmitterPosition)] {
            for sample in [0, 5, 21] {
                check("a point", &|s| {
                    s.start_sample(9, sample);
                    s.start_vertex(subpath, 0);
                    s.get_2d(purpose).into()
                });
            }
        }
        check("two addresses", &|s| (at(s, 9, 5, Camera, Lobe), at(s, 9, 5, Camera, Roulette)));
        check("two ends", &|s| (at(s, 9, 5, Camera, Lobe), at(s, 9, 5, Light, Lobe)));
        let next = |replicate: u32| {
            let mut s = Sampler::new(kind, StreamKey::new(5, "path", Role::Estimate, replicate), 16, (8, 8));
            at(&mut s, 9, 5, Camera, Film)
        };
        let z = chi_square_z((0..1 << 15).map(|replicate| (next(replicate), next(replicate + 1))));
        assert!(z.abs() < 6.0, "{kind}: neighbouring replicates: z = {z}");
    }
}

/// Whether points, as many as a power of two, have one in each elementary interval of that volume.
fn is_net(points: &[Vec2]) -> bool {
    let k = points.len().trailing_zeros();
    (0..=k).all(|a| {
        let (columns, rows) = (1 << a, 1 << (k - a));
        let mut cells = vec![0; points.len()];
        points.iter().for_each(|u| cells[(u.x * columns as f32) as usize * rows + (u.y * rows as f32) as usize] += 1);
        cells.iter().all(|&count| count == 1)
    })
}

#[test]
fn sobols_points_are_nets_in_a_pixel_and_of_light_walks_in_the_image() {
    let points = |kind, subpath, pixels: std::ops::Range<u64>, purpose| -> Vec<Vec2> {
        let mut s = Sampler::new(kind, key(), 16, (8, 8));
        let places = pixels.flat_map(|pixel| (0..16).map(move |sample| (pixel, sample)));
        let draw = |(pixel, sample)| {
            s.start_sample(pixel, sample);
            s.start_vertex(subpath, 3);
            s.get_2d(purpose)
        };
        places.map(draw).collect()
    };
    for kind in [SamplerKind::Sobol, SamplerKind::Zsobol] {
        assert!(is_net(&points(kind, Subpath::Camera, 5..6, Purpose::Direction)), "{kind}");
        assert!(is_net(&points(kind, Subpath::Light, 0..64, Purpose::Direction)), "{kind}");
    }
    assert!(is_net(&points(SamplerKind::Zsobol, Subpath::Camera, 0..64, Purpose::Direction)));
    assert!(!is_net(&points(SamplerKind::Sobol, Subpath::Camera, 0..64, Purpose::Direction)));
    assert!(!is_net(&points(SamplerKind::Stratified, Subpath::Camera, 5..6, Purpose::Direction)));
}

/// Further rounds are sequences of their own: of light walks through the image, and of pixels where the screen's sequence ends.
#[test]
fn further_rounds_repeat_no_numbers() {
    let number = |kind, subpath, sample| {
        let mut s = Sampler::new(kind, key(), 16, (8, 8));
        s.start_sample(3, sample);
        s.start_vertex(subpath, 3);
        s.get_2d(Purpose::Direction)
    };
    use {SamplerKind::*, Subpath::*};
    for sample in 0..16 {
        for kind in [Sobol, Zsobol] {
            let rounds = [0, 16, 32].map(|first| number(kind, Light, first + sample));
            assert!(rounds[0] != rounds[1] && rounds[1] != rounds[2] && rounds[0] != rounds[2], "{kind} {sample}");
        }
        assert_ne!(number(Zsobol, Camera, sample), number(Sobol, Camera, sample), "{sample}");
        assert_eq!(number(Zsobol, Camera, 16 + sample), number(Sobol, Camera, 16 + sample), "{sample}");
    }
}

/// The place on the film and the choice of an emitter, as next-event estimation in a pixel needs them, are spread together.
#[test]
fn sobols_points_are_spread_over_film_and_emitters_together() {
    for kind in [SamplerKind::Sobol, SamplerKind::Zsobol] {
        let mut s = Sampler::new(kind, key(), 64, (8, 8));
        let mut cells = [0; 32];
        for sample in 0..64 {
            s.start_sample(9, sample);
            let film = s.get_2d(Purpose::Film);
            s.start_vertex(Subpath::Camera, 1);
            let emitter = s.get_1d(Purpose::NextEmitter);
            cells[(emitter * 4.0) as usize * 8 + (film.y * 2.0) as usize * 4 + (film.x * 4.0) as usize] += 1;
        }
        assert_eq!(cells, [2; 32], "{kind}");
    }
}

/// What is sampled of emitters for vertices 1 and 2 comes from the same dimensions of one point, and is independent all the same.
#[test]
fn emitters_at_the_first_two_vertices_are_sampled_apart() {
    for purpose in [Purpose::NextPosition, Purpose::NextEmitter] {
        let z = chi_square_z((0..1 << 16).map(|replicate| {
            let key = StreamKey::new(1, "apart", Role::Estimate, replicate);
            let mut s = Sampler::new(SamplerKind::Sobol, key, 16, (64, 1));
            s.start_sample(3, 5);
            let mut number = |vertex| {
                s.start_vertex(Subpath::Camera, vertex);
                if purpose == Purpose::NextEmitter { s.get_1d(purpose) } else { s.get_2d(purpose).x }
            };
            (number(1), number(2))
        }));
        assert!(z.abs() < 6.0, "{purpose:?}: z = {z}");
    }
}

#[test]
fn multi_jitter_is_stratified_on_the_grid_and_in_each_coordinate() {
    for n in [1_u32, 4, 12, 13, 64] {
        let mut s = Sampler::new(SamplerKind::MultiJittered, key(), n, (64, 1));
        let strata = Strata::new(n);
        let [mut columns, mut rows, mut cells] = [(); 3].map(|()| vec![0; n as usize]);
        for sample in 0..n {
            s.start_sample(3, sample);
            let u = s.get_2d(Purpose::Direction);
            columns[(u.x * n as f32) as usize] += 1;
            rows[(u.y * n as f32) as usize] += 1;
            cells[((u.y * strata.ny as f32) as u32 * strata.nx + (u.x * strata.nx as f32) as u32) as usize] += 1;
        }
        assert!(
            columns.iter().chain(&rows).chain(&cells).all(|&count| count == 1),
            "{n}: {columns:?} {rows:?} {cells:?}"
        );
    }
}

#[test]
fn every_stratum_holds_one_sample() {
    for n in [1_u32, 2, 3, 4, 6, 12, 13, 16, 64, 100] {
        let mut s = Sampler::new(SamplerKind::Stratified, key(), n, (64, 1));
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
    let mut s = Sampler::new(SamplerKind::Stratified, key(), 16, (64, 1));
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
    for length in [1, 2, 3, 5, 8, 100, 257, 5000, 70_000] {
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
    assert!("sobel".parse::<SamplerKind>().is_err());
}
