mod leaving;

use super::*;
use crate::builder::{GroupId, MeshData, SceneBuilder};
use crate::interaction::Interaction;
use crate::material::MaterialId;
use crate::needs::Skip;
use crate::scene::Scene;
use crate::test_support::{Random, add_room, built, bumpy_ball, grey_builder};
use glam::{DMat3, dvec3};
use sampling::{vec2, vec3};

/// Shapes of every kind, in the open group or in the scene; `round` are those that only similarities leave what they are.
fn add_shapes(builder: &mut SceneBuilder, material: MaterialId, round: bool, map: Option<DAffine3>) {
    let mut ball = bumpy_ball(8);
    ball.normals = ball.positions.iter().map(|p| p.as_vec3().normalize()).collect();
    ball.uvs = ball.positions.iter().map(|p| vec2(p.x as f32, (p.y + 0.3 * p.z) as f32)).collect();
    let mut shapes = vec![builder.mesh(ball, material)];
    let small = MeshData {
        positions: vec![dvec3(1.2, 0.0, 0.0), dvec3(1.6, 0.1, 0.0), dvec3(1.5, 0.4, 0.3)],
        triangles: vec![[0, 1, 2]],
        ..MeshData::default()
    };
    shapes.push(builder.mesh(small, material));
    shapes.push(builder.quad(dvec3(-2.0, -1.2, -2.0), dvec3(0.0, 0.0, 4.0), dvec3(4.0, 0.2, 0.0), material));
    shapes.push(builder.disk(dvec3(0.0, 2.0, 0.0), dvec3(1.0, 0.2, 0.0), dvec3(0.0, 0.1, 0.5), material));
    if round {
        shapes.push(builder.sphere(dvec3(-1.7, 0.2, 0.1), 0.4, material));
        shapes.push(builder.cylinder(dvec3(1.8, -0.5, 0.0), dvec3(1.9, 0.9, 0.2), 0.3, material));
    }
    if let Some(map) = map {
        shapes.into_iter().for_each(|shape| builder.transform(shape, map));
    }
}

/// A turn, a stretch and a shear, mirrored or not.
fn random_map(random: &mut Random, similarity: bool) -> DAffine3 {
    let turn = |random: &mut Random| {
        DMat3::from_axis_angle(random.direction().as_dvec3().normalize(), f64::from(random.next_1d()) * 6.0)
    };
    let mut amount = |low: f64, high: f64| low + (high - low) * f64::from(random.next_1d());
    let mirror = if amount(0.0, 1.0) < 0.5 { -1.0 } else { 1.0 };
    let stretch = match similarity {
        true => DMat3::from_diagonal(dvec3(mirror, 1.0, 1.0)) * amount(0.3, 2.0),
        false => {
            let mut shear = DMat3::from_diagonal(dvec3(mirror * amount(0.2, 2.0), amount(0.2, 2.0), amount(0.2, 2.0)));
            shear.y_axis.x = amount(-0.5, 0.5);
            shear.z_axis.y = amount(-0.5, 0.5);
            shear
        }
    };
    let place = dvec3(amount(-4.0, 4.0), amount(-4.0, 4.0), amount(-4.0, 4.0));
    DAffine3::from_mat3_translation(turn(random) * stretch * turn(random), place)
}

/// The same scene with instances, and with copies of everything.
fn both(random: &mut Random, count: usize, similarity: bool, skip: Skip) -> [Scene; 2] {
    let maps: Vec<DAffine3> = (0..count).map(|_| random_map(random, similarity)).collect();
    let inner: Vec<DAffine3> = (0..2).map(|_| random_map(random, similarity)).collect();
    let floor = |builder: &mut SceneBuilder, grey| {
        builder.quad(dvec3(-9.0, -6.0, -9.0), dvec3(0.0, 0.0, 18.0), dvec3(18.0, 0.0, 0.0), grey);
    };
    let (mut placed, grey) = grey_builder("placed");
    floor(&mut placed, grey);
    let group = placed.begin_group("things");
    add_shapes(&mut placed, grey, similarity, None);
    placed.end_group();
    let pair = placed.begin_group("pair");
    inner.iter().for_each(|map| placed.instance(group, *map));
    placed.end_group();
    for (index, map) in maps.iter().enumerate() {
        placed.instance([group, pair][index % 2], *map);
    }
    let (mut copied, grey) = grey_builder("copied");
    floor(&mut copied, grey);
    for (index, map) in maps.iter().enumerate() {
        match index % 2 {
            0 => add_shapes(&mut copied, grey, similarity, Some(*map)),
            _ => inner.iter().for_each(|inner| add_shapes(&mut copied, grey, similarity, Some(*map * *inner))),
        }
    }
    [built(placed, skip), built(copied, skip)]
}

/// Whether points of two scenes are alike; a copy's surface has a number of its own. Smooth normals are, where they need not be mapped
/// before they are interpolated; elsewhere Mitsuba's values are in the tests of its scenes.
fn alike(scenes: [&Scene; 2], a: &Interaction, b: &Interaction, similarity: bool) -> bool {
    let near = |a: Vec3, b: Vec3, scale: f32| (a - b).length() <= 2e-5 * scale;
    (a.t - b.t).abs() <= 2e-5 * a.t.max(1.0)
        && near(a.point.p, b.point.p, 10.0)
        && near(a.point.ng, b.point.ng, 5.0)
        && (!similarity || near(a.ns(), b.ns(), 5.0))
        && scenes[0].material_of(a) == scenes[1].material_of(b)
}

#[test]
fn instances_are_met_where_copies_are() {
    let mut random = Random::new(1);
    for (count, similarity, skip) in
        [(1, true, Skip::Unneeded), (9, true, Skip::Nothing), (2, false, Skip::Unneeded), (30, false, Skip::Unneeded)]
    {
        let [placed, copied] = both(&mut random, count, similarity, skip);
        let counts = placed.counts();
        assert_eq!(counts.placed_triangles, copied.counts().triangles as u64);
        assert!(counts.triangles <= 300 && counts.instances == count + count / 2, "{counts:?}");
        let mut portable = placed.clone();
        portable.set_kernel(Kernel::PORTABLE);
        let place = |hit: &Option<Interaction>| hit.as_ref().map(|it| (it.t, it.point.p));
        let (mut met, mut differing) = (0, 0);
        const RAYS: usize = 60_000;
        for _ in 0..RAYS {
            let mut ray = Ray::new(random.direction() * 9.0 * random.next_1d(), random.direction());
            let hits = [&placed, &copied].map(|scene| scene.intersect(&ray));
            assert_eq!(placed.occluded(&ray), hits[0].is_some());
            assert_eq!(place(&portable.intersect(&ray)), place(&hits[0]), "{ray:?}");
            let same = match &hits {
                [None, None] => true,
                [Some(a), Some(b)] => alike([&placed, &copied], a, b, similarity),
                _ => false,
            };
            met += usize::from(hits[0].is_some());
            differing += usize::from(!same);
            ray.t_max = 3.0 * random.next_1d();
            assert_eq!(placed.occluded(&ray), placed.intersect(&ray).is_some(), "{ray:?}");
            assert_eq!(placed.occluded(&ray), portable.occluded(&ray), "{ray:?}");
        }
        // Only rays past an edge may differ, where rounding decides.
        assert!(met > RAYS / 5 && differing <= RAYS / 5000, "{met} met, {differing} differ");
    }
}

/// Every kind of reading: by texture coordinates, by place, along tangents, through a mask.
#[test]
fn what_varies_over_an_instance_varies_as_over_a_copy() {
    use crate::description::{Origin, read};
    let materials = "[camera]\nposition = [0, 0, 9]\ntarget = [0, 0, 0]\n\
        [materials.squares]\ntype = \"lambert\"\nalbedo = { checkerboard = [0.2, 0.8], uv_scale = 3 }\n\
        bump_map = { noise = { size = 0.3, high = 0.1 } }\n\
        [materials.brushed]\ntype = \"rough_conductor\"\nmetal = \"gold\"\nalpha_x = 0.1\nalpha_y = 0.4\n\
        [materials.ramp]\ntype = \"lambert\"\nalbedo = { ramp = { base = 0.5, slope = 0.05, axis = [0, 0, 1] } }\n\
        [materials.lace]\ntype = \"lambert\"\nalbedo = { noise = { size = 0.5 } }\n\
        opacity = { checkerboard = [0, 1], uv_scale = 4 }\n\
        [materials.tiles]\ntype = \"lambert\"\nalbedo = 0.5\nnormal_map = { checkerboard = [[0.5, 0.5, 1], [0.7, 0.4, 0.9]] }\n";
    let shapes = [
        "type = \"sphere\"\ncenter = [0, 0, 0]\nradius = 1\nmaterial = \"squares\"",
        "type = \"quad\"\norigin = [1, 0, 0]\nedge_u = [1, 0.5, 0]\nedge_v = [0, 1, 0.4]\nmaterial = \"tiles\"",
        "type = \"disk\"\ncenter = [-1, 1.5, 0]\nedge_u = [1, 0, 0]\nedge_v = [0, 0.6, 1]\nmaterial = \"lace\"",
        "type = \"cylinder\"\nfrom = [2, -1, 0]\nto = [2, 1, 0]\nradius = 0.4\nmaterial = \"brushed\"",
        "type = \"quad\"\norigin = [-3, -1, -1]\nedge_u = [0, 0, 2]\nedge_v = [1, 1, 0]\nmaterial = \"ramp\"",
        "type = \"mesh\"\nvertices = [[0, -2, 0], [2, -2, 0], [0, -2, 2]]\nfaces = [[0, 1, 2]]\n\
         uvs = [[0, 0], [2, 0], [0, 3]]\nmaterial = \"squares\"",
    ];
    let map =
        "[{ scale = [0.8, 0.8, -0.8] }, { rotate = { axis = [1, 2, 3], angle = 40 } }, { translate = [0.3, 0.2, 0] }]";
    let list = |header: &str, end: &str| shapes.map(|shape| format!("[[{header}]]\n{shape}\n{end}")).concat();
    let placed = format!(
        "{materials}[[groups]]\nname = \"all\"\n{}[[shapes]]\ntype = \"instance\"\ngroup = \"all\"\ntransform = {map}\n",
        list("groups.shapes", "")
    );
    let copied = format!("{materials}{}", list("shapes", &format!("transform = {map}\n")));
    let [placed, copied] = [placed, copied].map(|text| {
        let origin = Origin { scene: "test", file: "test.toml", folder: None, attachments: &[] };
        built(read(&text, origin, None).unwrap_or_else(|error| panic!("{error}")), Skip::Unneeded)
    });
    assert!(placed.counts().instances == 1 && placed.needs.masks && placed.needs.tangents);
    let mut random = Random::new(5);
    let (mut met, mut differing) = (0, 0);
    for _ in 0..60_000 {
        let target = random.direction() * 2.5 * random.next_1d();
        let o = random.direction() * 8.0;
        let ray = Ray::new(o, (target - o).normalize());
        let [a, b] = [&placed, &copied].map(|scene| scene.intersect(&ray));
        let frames = |a: &Interaction, b: &Interaction| {
            let axes = (a.frame.x - b.frame.x).length() + (a.frame.y - b.frame.y).length();
            let tangents = !a.bsdf.is_anisotropic() || axes < 1e-3;
            tangents && format!("{:?}", a.bsdf.lobes()) == format!("{:?}", b.bsdf.lobes())
        };
        let values = |a: &Interaction, b: &Interaction| {
            let (wo, wi) = (-ray.d, (-ray.d + vec3(0.2, 0.1, 0.3)).normalize());
            let mode = sampling::bsdf::TransportMode::Radiance;
            let [x, y] = [a, b].map(|it| it.eval(wo, wi, mode).mean());
            (x - y).abs() <= 2e-3 * x.max(y) + 1e-5
        };
        let same = match (&a, &b) {
            (None, None) => true,
            (Some(a), Some(b)) => alike([&placed, &copied], a, b, true) && frames(a, b) && values(a, b),
            _ => false,
        };
        met += usize::from(a.is_some());
        differing += usize::from(!same);
    }
    // Rounding decides at the edges of squares.
    assert!(met > 20_000 && differing < 60, "{met} met, {differing} differ");
}

/// A closed box around everything, as an instance.
#[test]
fn an_instance_may_hold_the_camera() {
    let (mut builder, grey) = grey_builder("room");
    let group = builder.begin_group("room");
    add_room(&mut builder, dvec3(-1.0, -1.0, -1.0), dvec3(1.0, 1.3, 0.7), grey);
    builder.end_group();
    builder.instance(group, DAffine3::from_scale(dvec3(7.0, -5.0, 6.0)));
    let scene = built(builder, Skip::Unneeded);
    let mut random = Random::new(6);
    for _ in 0..100_000 {
        let ray = Ray::new(random.direction() * 3.0, random.direction());
        let hit = scene.intersect(&ray).expect("the room is closed");
        assert!(hit.point.ng.dot(ray.d) < 0.0, "fronts look inside, mirrored or not");
    }
}

/// Every surface of an instance on a line, as probes of bodies ask for them.
#[test]
fn all_crossings_of_instances_are_found() {
    use crate::subsurface::Body;
    use sampling::math::Spectrum;
    use sampling::subsurface::Subsurface;
    let mut random = Random::new(7);
    let (one, other) = (random_map(&mut random, true), random_map(&mut random, true));
    let build = |placed: bool| {
        let (mut builder, grey) = grey_builder("wax");
        let wax = Subsurface::new(Spectrum::splat(0.5), Spectrum::splat(0.1), 1.4).unwrap();
        let wax = builder.material(Body::new("wax", wax));
        let add = |builder: &mut SceneBuilder| {
            let center = dvec3(2.0, 0.0, 0.0);
            [builder.mesh(bumpy_ball(6), wax), builder.sphere(center, 0.7, wax), builder.sphere(-center, 0.5, grey)]
        };
        if placed {
            let group = builder.begin_group("wax");
            add(&mut builder);
            builder.end_group();
            [one, other].iter().for_each(|map| builder.instance(group, *map));
        } else {
            for map in [one, other] {
                add(&mut builder).into_iter().for_each(|shape| builder.transform(shape, map));
            }
        }
        add(&mut builder);
        built(builder, Skip::Unneeded)
    };
    let scenes = [build(true), build(false)];
    let (mut crossings, mut differing) = (0, 0);
    for _ in 0..3000 {
        let ray = Ray::new(random.direction() * 9.0, random.direction());
        let through = random.direction() * 4.0 * random.next_1d();
        let ray = Ray { d: (through - ray.o).normalize(), ..ray };
        let [Some(in_placed), Some(in_copied)] = [0, 1].map(|index| scenes[index].intersect(&ray)) else { continue };
        if scenes[1].body_of(&in_copied).is_none() || scenes[0].body_of(&in_placed).is_none() {
            continue;
        }
        let hits = [in_placed, in_copied];
        let axis = random.direction();
        let [placed, copied] = [0, 1].map(|index| {
            let mut points = Vec::new();
            scenes[index].crossings(&hits[index], through, axis, &mut points);
            points
        });
        crossings += copied.len();
        let same = placed.len() == copied.len()
            && placed.iter().zip(&copied).all(|(a, b)| (a.point.p - b.point.p).length() < 1e-4);
        differing += usize::from(!same);
    }
    assert!(crossings > 1000 && differing <= 3, "{crossings} crossings, {differing} lines differ");
}

/// A hundred thousand instances of a mesh of ten thousand triangles: a thousand million triangles.
#[test]
fn a_forest_takes_little_memory() {
    let (mut builder, grey) = grey_builder("forest");
    let group: GroupId = builder.begin_group("tree");
    builder.mesh(bumpy_ball(50), grey);
    builder.end_group();
    const SIDE: usize = 317;
    for i in 0..SIDE * SIDE {
        let at = dvec3((i % SIDE) as f64 * 3.0, 0.0, (i / SIDE) as f64 * 3.0);
        let turn = DAffine3::from_rotation_y(i as f64);
        builder.instance(group, DAffine3::from_translation(at) * turn);
    }
    let scene = built(builder, Skip::Unneeded);
    let counts = scene.counts();
    assert!(counts.instances > 100_000 && counts.placed_triangles > 900_000_000, "{counts:?}");
    let accel = &scene.accel;
    let bytes =
        accel.instances.len() * size_of::<Instance>() + accel.nodes.len() * size_of::<super::super::tree::Node>();
    let each = bytes / accel.instances.len();
    assert!(each <= 320, "{each} bytes an instance");
    let mut random = Random::new(8);
    let center = vec3(1.5 * SIDE as f32, 40.0, 1.5 * SIDE as f32);
    let mut met = 0;
    for _ in 0..20_000 {
        let ray = Ray::new(center, random.direction());
        let Some(hit) = scene.intersect(&ray) else { continue };
        met += 1;
        assert!(hit.point.ng.dot(ray.d) < 0.0 && scene.occluded(&ray));
        let in_cell = hit.point.p - (hit.point.p / 3.0).round() * 3.0;
        assert!(in_cell.length() < 1.3);
        assert!(!scene.occluded(&Ray { t_max: 0.999, d: hit.point.p - ray.o, ..ray }));
    }
    assert!(met > 3000, "{met}");
}

#[test]
fn a_hit_is_no_larger_than_without_instances() {
    assert_eq!(size_of::<Option<Hit>>(), 40);
}
