//! Faults that a renderer's programmer really makes, each with the test that must notice it.
//!
//! They exist only in a build with `--cfg mutate` (see `sampling::fault`), where this runs every named test with its fault
//! injected and expects it to fail, and without any fault and expects it to pass, and prints who killed what and the share killed in
//! every module:
//!
//! ```text
//! RUSTFLAGS="--cfg mutate" CARGO_TARGET_DIR=target/mutate cargo test --test tests -- --nocapture faults
//! ```

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;
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
    ("factor_of_another_strategy", "mis_weights::learnt::weights_sum_to_one_with_any_factors"),
    ("controls_without_their_mean", "mis_weights::learnt::weights_sum_to_one_with_any_controls"),
    ("factors_of_the_samples_pixel", "mis_weights::learnt::weights_sum_to_one_with_any_factors"),
    ("merges_left_out_of_the_sum", "mis_weights::merges::weights_sum_to_one_where_vertices_are_merged"),
    ("covariance_dropped", "statistics::variances_and_covariances_are_those_of_the_replicates"),
    ("masking_dropped", "bsdf_laws::no_light_is_gained"),
    ("fresnel_missing_from_density", "bsdf_laws::weights_are_value_times_cosine_over_density"),
    ("density_of_one_lobe", "bsdf_laws::weights_are_value_times_cosine_over_density"),
    ("reciprocity_broken", "bsdf_laws::scattering_is_reciprocal"),
    ("filter_weight_dropped", "splats::filters_weight_camera_samples_and_splats_alike"),
    ("number_used_twice", "irradiance::polygon"),
    ("vertices_share_their_numbers", "agreement::cornell_box"),
    ("penumbra_forgotten", "irradiance::spot"),
    ("cone_density_of_a_sphere", "distant_emitters::spot_in_a_room"),
    ("image_upside_down", "textures::an_image_over_a_sphere"),
    ("normals_by_the_matrix", "instances::instances_show_what_copies_show"),
    ("tree_density_of_the_sibling", "distant_emitters::a_crowd_whatever_the_choice"),
    ("points_on_edges", "stress::shapes::rays_go_on_within_from_the_edges_of_a_room"),
    ("edges_without_their_bound", "stress::shapes::rays_go_on_within_from_edges_whose_corners_are_far_away"),
    ("faces_without_their_bound", "stress::shapes::rays_go_on_within_from_the_edges_of_a_room"),
    ("what_is_behind_shades", "shapes::rays_that_leave_a_ball_of_triangles_meet_it_inwards_only"),
    ("start_not_moved", "shapes::rays_that_leave_a_surface_do_not_meet_it_again"),
    ("segment_meets_its_end", "orders::furnace"),
    ("disc_of_another_radius", "distant_emitters::parallel_light_in_a_room"),
    ("density_of_both_sides", "emitters::two_sided_emitter"),
    ("screens_cast_whole_shadows", "textures::screens_in_a_room"),
    ("kernel_without_pi", "merging::in_the_cornell_box_it_is_bdpt"),
    ("radius_does_not_fall", "merging::the_bias_is_the_kernels_and_falls_at_its_rate"),
    ("state_that_stays_not_counted", "metropolis::in_a_sphere_of_known_light_replicates_short_and_long_have_the_truth"),
    ("every_mutation_accepted", "metropolis::cornell_box"),
    ("hidden_taken_for_seen", "radiosity::in_the_cornell_box_the_error_falls_with_the_elements"),
    ("camera_connections_left_out_of_the_sum", "mis_weights::weights_of_all_strategies_sum_to_one"),
    ("camera_connections_that_are_not_made_counted", "mis_weights::weights_of_all_strategies_sum_to_one"),
    ("guide_left_out_of_weights", "guided::diffuse_rooms"),
    ("samples_of_a_pixel_taken_for_all", "adaptive::samples_are_many_where_they_are_wanted_and_few_elsewhere"),
    ("splats_of_fewer_samples_taken_for_all", "adaptive::samples_are_many_where_they_are_wanted_and_few_elsewhere"),
    ("odds_taken_for_even", "emitters::gloss_among_every_kind"),
    ("odds_unknown_to_what_is_met", "emitters::gloss_among_every_kind"),
    ("samples_of_a_source_taken_for_all", "coherent::diffuse_rooms"),
    ("own_samples_at_places_of_their_own", "coherent::edges_have_the_means_of_their_sides"),
    ("share_of_a_run_forgotten", "composite::any_runs_have_the_means_of_one_method"),
    ("orders_of_other_runs_counted", "composite::runs_in_regions_have_the_means_of_one_method_in_every_built_in_scene"),
    ("noise_of_the_reference_ignored", "coverage::synthetic::intervals_of_errors_cover_the_truth"),
    ("normal_quantile_for_students", "coverage::synthetic::intervals_of_means_cover_the_truth"),
    ("relative_error_over_the_mean", "coverage::synthetic::errors_of_known_values"),
    ("signs_of_errors_kept", "coverage::synthetic::errors_of_known_values"),
    ("choice_among_triangles_forgotten", "emitters::few_triangles_beside_the_floor"),
    ("mirrored_meshes_inside_out", "meshes::emitters_on_meshes_shine_as_quads_do"),
    ("light_paths_of_a_crop_alone", "crops::a_crop_has_the_bits_of_the_whole_image"),
    ("sums_in_single_precision", "stress::materials::a_million_samples_of_one_value"),
    ("sky_left_out_of_subpaths", "environment::methods_agree_under_a_sky"),
    ("walks_end_in_silence", "orders::furnace"),
    ("streams_shared_between_methods", "determinism::seeds_instances_roles_and_replicates_draw_different_numbers"),
    ("splats_ignore_the_filter", "splats::filters_weight_camera_samples_and_splats_alike"),
    ("sampled_normals_turned_over", "meshes::emitters_on_meshes_shine_as_quads_do"),
    ("invalid_not_counted", "cli::evidence::what_is_not_finite_is_counted_kept_and_told"),
    ("many_tests_taken_for_one", "cli::evidence::a_scene_is_verified_in_words_and_in_json"),
];

/// The module of every fault that the sources hold, a file or a folder of a crate.
fn modules() -> BTreeMap<String, String> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let mut found = BTreeMap::new();
    for part in ["sampling", "scenes", "integrators", "experiments"] {
        let source = root.join(part).join("src");
        visit(&source, &mut |path, text| {
            let inner = path.strip_prefix(&source).unwrap().with_extension("");
            let module = inner.components().next().unwrap().as_os_str().to_string_lossy().into_owned();
            for rest in text.split("fault!(").skip(1).filter(|_| module != "fault") {
                let name = rest.trim_start().split('"').nth(1).unwrap().to_owned();
                found.insert(name, format!("{part}::{module}"));
            }
        });
    }
    found
}

fn visit(folder: &Path, see: &mut impl FnMut(&Path, &str)) {
    for entry in std::fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.is_dir() {
            visit(&path, see);
        } else if path.extension().is_some_and(|ending| ending == "rs") {
            see(&path, &std::fs::read_to_string(&path).unwrap());
        }
    }
}

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
    let modules = modules();
    let mut shares: BTreeMap<&str, (usize, usize)> = BTreeMap::new();
    for (fault, test) in FAULTS {
        let killed = passes(test, Some(fault)) == Some(false);
        println!("{fault}: {} {test}", if killed { "killed by" } else { "SURVIVES" });
        if !killed {
            wrong.push(format!("{fault} survives {test}"));
        }
        let (dead, all) = shares.entry(&modules[*fault]).or_default();
        (*dead, *all) = (*dead + usize::from(killed), *all + 1);
    }
    for (module, (dead, all)) in shares {
        println!("{module:<26} {dead:>2} of {all:>2} killed");
    }
    assert!(wrong.is_empty(), "of {} faults:\n{}", FAULTS.len(), wrong.join("\n"));
}

#[test]
fn every_fault_of_the_sources_has_a_test() {
    let listed: BTreeSet<&str> = FAULTS.iter().map(|(fault, _)| *fault).collect();
    let modules = modules();
    let written: BTreeSet<&str> = modules.keys().map(String::as_str).collect();
    assert_eq!(listed, written);
    assert!(listed.len() >= 60, "{}", listed.len());
}
