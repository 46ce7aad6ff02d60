//! Faults that a renderer's programmer really makes, each with the test that must notice it.
//!
//! They exist only in a build with `--cfg mutate` (see `sampling::fault`), where this runs every named test with its fault
//! injected and expects it to fail, and without any fault and expects it to pass:
//!
//! ```text
//! RUSTFLAGS="--cfg mutate" CARGO_TARGET_DIR=target/mutate cargo test faults
//! ```

use std::collections::BTreeSet;
use std::process::Command;

/// Name of the fault, and the test that kills it.
const FAULTS: &[(&str, &str)] = &[
    ("lambert_without_pi", "bsdf_laws::weights_are_value_times_cosine_over_density"),
    ("half_vector_jacobian_missing", "bsdf_laws::by_chance::samples_have_their_density_and_their_value"),
    ("radiance_without_eta_squared", "bsdf_laws::radiance_is_scaled_by_the_square_of_the_index"),
    ("streams_shared_between_replicates", "determinism::seeds_instances_roles_and_replicates_draw_different_numbers"),
    ("streams_shared_between_roles", "determinism::seeds_instances_roles_and_replicates_draw_different_numbers"),
    ("emitter_shines_from_its_back", "meshes::emitters_on_meshes_shine_as_quads_do"),
    ("emitter_cosine_dropped", "orders::furnace"),
    ("area_density_not_converted", "orders::furnace"),
    ("emission_read_at_turned_coordinates", "shapes::emission_maps_in_a_room"),
    ("power_weights_wrong", "irradiance::two_points"),
    ("environment_density_of_a_hemisphere", "scattering::once_by_a_ball_in_a_uniform_environment"),
    ("next_event_density_by_power", "mis_weights::weights_sum_to_one_whatever_emits"),
    ("environment_density_without_sine", "irradiance::environment_image"),
    ("lens_area_left_out", "cameras::in_a_furnace_every_camera_sees_what_is_known"),
    ("lens_does_not_focus", "cameras::edges_are_blurred_by_the_circle_of_confusion"),
    ("solid_angle_of_latitude_left_out", "cameras::in_a_furnace_every_camera_sees_what_is_known"),
    ("parallel_rays_taken_for_diverging", "mis_weights::weights_sum_to_one_under_every_camera"),
    ("importance_with_cos_cubed", "splats::border_pixels_get_their_share"),
    ("adjoint_factor_missing", "shading_normals::coarse_spheres_with_smooth_normals"),
    ("adjoint_factor_missing", "relief::methods_agree_on_strong_relief"),
    ("next_event_cosine_dropped", "irradiance::polygon"),
    ("order_off_by_one", "orders::furnace"),
    ("emission_counted_twice", "orders::furnace"),
    ("heuristics_differ_between_sides", "orders::furnace"),
    ("roulette_not_compensated", "roulette::roulette_moves_no_mean"),
    ("roulette_in_one_density_only", "mis_weights::weights_of_all_strategies_sum_to_one"),
    ("delta_taken_for_connectable", "mis_weights::weights_of_all_strategies_sum_to_one"),
    ("emitter_hits_left_out_of_the_sum", "orders::furnace"),
    ("connection_cosine_dropped", "orders::furnace"),
    ("light_paths_miscounted", "orders::furnace"),
    ("last_column_left_out", "splats::border_pixels_get_their_share"),
    ("variance_with_n_for_n_minus_1", "statistics::variances_and_covariances_are_those_of_the_replicates"),
    ("probe_cosine_dropped", "subsurface::balls_give_back_what_comes_within_their_diameter"),
    ("other_crossings_forgotten", "subsurface::balls_give_back_what_comes_within_their_diameter"),
    ("light_subpaths_counted_once", "mis_weights::weights_of_all_strategies_sum_to_one"),
    ("connection_roulette_not_compensated", "variants::connections_of_bidirectional_path_tracing"),
    ("choice_not_compensated", "variants::connections_of_bidirectional_path_tracing"),
    ("shares_of_lobes_forgotten", "parts::path_classes_add_up_and_are_the_same_for_all_methods"),
    ("merges_left_out_of_the_sum", "mis_weights::merges::weights_sum_to_one_where_vertices_are_merged"),
    ("covariance_dropped", "statistics::variances_and_covariances_are_those_of_the_replicates"),
];

/// Whether a test of this binary passes with a fault injected, or with none; `None` if there is no such test.
fn passes(test: &str, fault: Option<&str>) -> Option<bool> {
    let mut command = Command::new(std::env::current_exe().unwrap());
    command.args(["--exact", test]).env_remove("NEUMANN_FAULT");
    if let Some(fault) = fault {
        command.env("NEUMANN_FAULT", fault);
    }
    let output = command.output().unwrap();
    String::from_utf8_lossy(&output.stdout).contains("running 1 test").then(|| output.status.success())
}

#[test]
fn every_fault_is_killed_by_its_test() {
    if !cfg!(mutate) {
        println!("skipped: this build has no faults in it; build with --cfg mutate");
        return;
    }
    let tests: BTreeSet<&str> = FAULTS.iter().map(|(_, test)| *test).collect();
    let mut wrong = Vec::new();
    for test in &tests {
        match passes(test, None) {
            Some(true) => {}
            Some(false) => wrong.push(format!("{test} fails without any fault")),
            None => wrong.push(format!("there is no test {test}")),
        }
    }
    for (fault, test) in FAULTS {
        let killed = passes(test, Some(fault)) == Some(false);
        println!("{fault}: {} {test}", if killed { "killed by" } else { "SURVIVES" });
        if !killed {
            wrong.push(format!("{fault} survives {test}"));
        }
    }
    assert!(wrong.is_empty(), "of {} faults:\n{}", FAULTS.len(), wrong.join("\n"));
}
