use super::*;
use crate::method::Methods;
use scenes::{LoadOptions, Skip};

fn scene() -> Scene {
    scenes::load("cornell_box", &LoadOptions { size: Some((6, 5)), skip: Skip::Unneeded }).unwrap()
}

fn render<'a>(scene: &'a Scene, method: &'a dyn Integrator, max_order: usize) -> Render<'a> {
    let settings = RenderSettings {
        orders: Orders::up_to(max_order),
        tail: true,
        samples_per_replicate: 2,
        seed: 3,
        sampler: SamplerKind::Sobol,
        instance: "saved".to_owned(),
        role: Role::Estimate,
    };
    Render::new(scene, method, settings).unwrap()
}

/// All of a measurement but its times; what is printed of a number tells it from every other one.
fn told(render: Render) -> String {
    format!("{:?}", Measurement { replicate_seconds: Vec::new(), ..render.finish() })
}

fn saved(render: &Render) -> Vec<u8> {
    let mut bytes = Vec::new();
    render.save(&mut bytes).unwrap();
    bytes
}

#[test]
fn a_render_that_goes_on_later_has_the_bits_of_one_that_never_stopped() {
    const ALL: u32 = 21;
    let scene = scene();
    let method = Methods::standard().build("bdpt", &serde_json::json!({})).unwrap();
    let mut long = render(&scene, &*method, 3);
    let states: Vec<Vec<u8>> = (0..ALL)
        .map(|_| {
            let state = saved(&long);
            long.run_replicate(&|_| {});
            state
        })
        .collect();
    let expected = told(long);
    for (replicates, state) in states.iter().enumerate() {
        let mut later = render(&scene, &*method, 3);
        later.resume(&mut state.as_slice()).unwrap();
        assert_eq!(later.replicates() as usize, replicates);
        assert_eq!(saved(&later), *state);
        (later.replicates()..ALL).for_each(|_| later.run_replicate(&|_| {}));
        assert!(told(later) == expected, "after {replicates} replicates");
    }
}

#[test]
fn a_damaged_state_or_one_of_another_image_changes_nothing() {
    let scene = scene();
    let method = Methods::standard().build("path", &serde_json::json!({})).unwrap();
    let [mut render, mut other] = [2, 3].map(|max_order| render(&scene, &*method, max_order));
    (0..9).for_each(|_| render.run_replicate(&|_| {}));
    other.run_replicate(&|_| {});
    let state = saved(&render);
    for damaged in [&state[..state.len() - 1], &state[1..], &saved(&other)] {
        assert!(render.resume(&mut &damaged[..]).is_err());
        assert!(saved(&render) == state);
    }
}
