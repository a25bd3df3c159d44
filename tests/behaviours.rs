//! Which test covers which of the manual's 278 behavioural rules, and what is left out, and why.
//!
//! The rules are those of `meca500_behaviours.md`, by their numbers. A rule with several parts may
//! name several tests. The tests stand in `tests/sim_*.rs` and beside the virtual robot's sources.
#![cfg(feature = "sim")]

use std::collections::BTreeSet;
use std::fs;
use std::path::Path;

use Cover::{Absent, Approximated, Bus, Caller, Statement, Tests, Text};

/// How a rule is covered.
#[derive(Debug)]
enum Cover {
    /// By these tests.
    Tests(&'static [&'static str]),
    /// Left out: seen on the text ports only, which come later.
    Text,
    /// Left out: a matter of the bus below the images.
    Bus,
    /// Left out: tells the PLC what to do or not to rely on; nothing of the robot's can be checked.
    Caller,
    /// Left out: says that the Meca500 does not have it.
    Absent,
    /// Left out: a remark without a behaviour.
    Statement,
    /// Not simulated: the virtual encoder of joint 6 never loses its turns.
    Approximated,
}

const RULES: &[(u16, Cover)] = &[
    (1, Text),
    (2, Text),
    (3, Text),
    (4, Text),
    (5, Text),
    (6, Text),
    (7, Text),
    (8, Text),
    (9, Text),
    (10, Text),
    (11, Text),
    (12, Text),
    (13, Text),
    (14, Text),
    (15, Text),
    (16, Text),
    (17, Text),
    (18, Text),
    (19, Text),
    (20, Tests(&["refusals_have_the_codes_of_the_manual"])),
    (21, Tests(&["use_variables_on_ethercat_follows_the_reading"])),
    (22, Text),
    (23, Text),
    (24, Text),
    (25, Text),
    (26, Text),
    (27, Text),
    (28, Tests(&["queued_commands_run_first_in_first_out"])),
    (
        29,
        Tests(&[
            "start_program_is_immediate_or_queued",
            "time_scaling_acts_at_once_during_a_move_and_a_delay_and_keeps_the_path",
        ]),
    ),
    (30, Tests(&["settings_take_effect_in_their_turn"])),
    (31, Tests(&["settings_take_effect_in_their_turn"])),
    (
        32,
        Tests(&[
            "deactivation_sets_motion_settings_back_and_discards_checkpoints",
            "reboot_needs_a_deactivated_robot_and_forgets_all_but_persistent_settings",
        ]),
    ),
    (33, Tests(&["reboot_needs_a_deactivated_robot_and_forgets_all_but_persistent_settings"])),
    (34, Tests(&["deactivation_sets_motion_settings_back_and_discards_checkpoints"])),
    (35, Text),
    (
        36,
        Tests(&[
            "refusals_have_the_codes_of_the_manual",
            "an_error_clears_the_queue_and_refuses_until_reset_and_resume",
        ]),
    ),
    (
        37,
        Tests(&[
            "recovery_mode_moves_an_unhomed_robot_slowly",
            "refusals_have_the_codes_of_the_manual",
        ]),
    ),
    (38, Tests(&["an_error_clears_the_queue_and_refuses_until_reset_and_resume"])),
    (
        39,
        Tests(&[
            "queue_parameters_are_reported_with_their_defaults",
            "a_gripper_opens_closes_and_reports",
        ]),
    ),
    (40, Tests(&["queue_parameters_are_reported_with_their_defaults"])),
    (41, Tests(&["queue_parameters_are_reported_with_their_defaults"])),
    (42, Tests(&["the_images_follow_the_byte_order_of_the_settings"])),
    (43, Tests(&["no_length_of_images_breaks_the_robot"])),
    (44, Tests(&["the_images_follow_the_byte_order_of_the_settings"])),
    (45, Text),
    (46, Caller),
    (47, Caller),
    (
        48,
        Tests(&[
            "pause_keeps_the_trajectory_and_resume_takes_it_up",
            "simulation_changes_only_while_deactivated_and_without_a_stop",
        ]),
    ),
    (49, Tests(&["a_robot_activates_homes_and_moves"])),
    (
        50,
        Tests(&[
            "a_held_activate_bit_acts_again_as_a_level_and_not_as_an_edge",
            "resume_acts_on_its_rising_edge_only",
        ]),
    ),
    (51, Bus),
    (52, Tests(&["monitoring_only_shows_and_does_not_obey"])),
    (53, Tests(&["busy_is_set_only_while_activating_homing_and_deactivating"])),
    (54, Tests(&["deactivate_wins_over_activate"])),
    (
        55,
        Tests(&[
            "busy_is_set_only_while_activating_homing_and_deactivating",
            "home_is_ignored_when_not_needed_but_answered",
        ]),
    ),
    (56, Tests(&["an_error_clears_the_queue_and_refuses_until_reset_and_resume"])),
    (57, Tests(&["simulation_changes_only_while_deactivated_and_without_a_stop"])),
    (58, Tests(&["recovery_mode_moves_an_unhomed_robot_slowly"])),
    (59, Tests(&["disable_ethercat_leaves_the_bus_and_only_on_ethercat"])),
    (60, Tests(&["busy_is_set_only_while_activating_homing_and_deactivating"])),
    (61, Tests(&["busy_is_set_only_while_activating_homing_and_deactivating"])),
    (62, Tests(&["busy_is_set_only_while_activating_homing_and_deactivating"])),
    (63, Tests(&["planning_errors_have_the_codes_of_the_manual"])),
    (64, Tests(&["a_stream_is_accepted_at_one_command_a_cycle"])),
    (65, Tests(&["nothing_is_looked_at_while_set_point_is_0"])),
    (
        66,
        Tests(&[
            "the_same_move_id_sends_a_command_once",
            "a_velocity_lasts_while_set_point_is_1_and_changes_at_once",
        ]),
    ),
    (67, Caller),
    (68, Caller),
    (
        69,
        Tests(&[
            "the_same_move_id_sends_a_command_once",
            "the_first_command_is_triggered_as_the_reading_says",
        ]),
    ),
    (70, Tests(&["the_first_command_is_triggered_as_the_reading_says"])),
    (71, Tests(&["time_scaling_acts_at_once_during_a_move_and_a_delay_and_keeps_the_path"])),
    (72, Tests(&["a_stream_is_accepted_at_one_command_a_cycle"])),
    (73, Caller),
    (74, Caller),
    (
        75,
        Tests(&[
            "pause_keeps_the_trajectory_and_resume_takes_it_up",
            "clear_empties_the_queue_discards_checkpoints_and_needs_resume",
        ]),
    ),
    (76, Tests(&["a_velocity_lasts_while_set_point_is_1_and_changes_at_once"])),
    (77, Tests(&["a_velocity_lasts_while_set_point_is_1_and_changes_at_once"])),
    (78, Tests(&["a_velocity_lasts_while_set_point_is_1_and_changes_at_once"])),
    (
        79,
        Tests(&[
            "set_point_0_stops_at_once_or_after_the_timeout",
            "pause_and_clear_stop_a_velocity_motion",
            "a_velocity_lasts_while_set_point_is_1_and_changes_at_once",
        ]),
    ),
    (80, Caller),
    (81, Tests(&["a_move_with_move_id_0_floods_the_queue"])),
    (82, Tests(&["no_movement_is_acknowledged_as_the_reading_says"])),
    (83, Tests(&["extra_arguments_are_ignored"])),
    (84, Tests(&["a_gripper_opens_closes_and_reports"])),
    (85, Tests(&["refusals_have_the_codes_of_the_manual"])),
    (86, Tests(&["reboot_needs_a_deactivated_robot_and_forgets_all_but_persistent_settings"])),
    (87, Tests(&["homing_survives_deactivation_but_not_command_1002"])),
    (88, Tests(&["a_full_queue_ignores_commands_and_answers_as_the_reading_says"])),
    (89, Tests(&["compiled_commands_take_space_as_the_reading_says"])),
    (90, Tests(&["eob_waits_for_a_delay_and_eom_does_not"])),
    (91, Caller),
    (92, Text),
    (93, Text),
    (94, Tests(&["eob_waits_for_a_delay_and_eom_does_not"])),
    (95, Tests(&["blending_rounds_corners_between_moves_of_one_kind"])),
    (96, Tests(&["a_checkpoint_is_reached_when_the_motion_before_it_is_done"])),
    (
        97,
        Tests(&[
            "a_checkpoint_is_reached_when_the_motion_before_it_is_done",
            "a_checkpoint_between_blended_moves_is_reached_along_the_blending",
        ]),
    ),
    (
        98,
        Tests(&[
            "clear_empties_the_queue_discards_checkpoints_and_needs_resume",
            "deactivation_sets_motion_settings_back_and_discards_checkpoints",
            "an_error_clears_the_queue_and_refuses_until_reset_and_resume",
            "p_stop2_in_clear_mode_clears_and_refuses_until_resumed",
        ]),
    ),
    (99, Tests(&["the_last_checkpoint_reached_and_discarded_stay_until_another_is"])),
    (
        100,
        Tests(&[
            "a_pause_begins_within_five_milliseconds",
            "pause_keeps_the_trajectory_and_resume_takes_it_up",
        ]),
    ),
    (101, Text),
    (102, Tests(&["pause_keeps_the_trajectory_and_resume_takes_it_up"])),
    (103, Tests(&["clear_empties_the_queue_discards_checkpoints_and_needs_resume"])),
    (104, Tests(&["clear_empties_the_queue_discards_checkpoints_and_needs_resume"])),
    (
        105,
        Tests(&[
            "clear_empties_the_queue_discards_checkpoints_and_needs_resume",
            "deactivation_sets_motion_settings_back_and_discards_checkpoints",
            "p_stop2_in_clear_mode_clears_and_refuses_until_resumed",
        ]),
    ),
    (
        106,
        Tests(&[
            "resume_acts_on_its_rising_edge_only",
            "pause_keeps_the_trajectory_and_resume_takes_it_up",
        ]),
    ),
    (
        107,
        Tests(&[
            "p_stop2_in_clear_mode_clears_and_refuses_until_resumed",
            "a_work_zone_breach_follows_its_severity",
            "an_imminent_collision_follows_its_severity",
        ]),
    ),
    (
        108,
        Tests(&[
            "pause_keeps_the_trajectory_and_resume_takes_it_up",
            "torque_limits_follow_severity_and_detection",
            "p_stop2_in_pause_mode_keeps_the_queue_and_takes_commands",
        ]),
    ),
    (
        109,
        Tests(&[
            "pause_keeps_the_trajectory_and_resume_takes_it_up",
            "deactivation_sets_motion_settings_back_and_discards_checkpoints",
        ]),
    ),
    (
        110,
        Tests(&[
            "clear_empties_the_queue_discards_checkpoints_and_needs_resume",
            "an_error_clears_the_queue_and_refuses_until_reset_and_resume",
        ]),
    ),
    (111, Tests(&["commands_sent_while_paused_are_added_at_the_end"])),
    (112, Tests(&["an_error_while_paused_clears_the_motion"])),
    (113, Tests(&["pause_and_clear_need_a_robot_ready_for_motion"])),
    (114, Text),
    (
        115,
        Tests(&[
            "planning_errors_have_the_codes_of_the_manual",
            "torque_limits_follow_severity_and_detection",
        ]),
    ),
    (
        116,
        Tests(&[
            "an_error_clears_the_queue_and_refuses_until_reset_and_resume",
            "what_any_state_allows_is_taken_or_refused_in_error_mode",
        ]),
    ),
    (117, Tests(&["an_error_clears_the_queue_and_refuses_until_reset_and_resume"])),
    (118, Text),
    (
        119,
        Tests(&[
            "an_error_while_deactivated_is_reported_and_needs_no_reset",
            "activation_fails_with_a_stop_with_joints_outside_and_with_an_old_tool",
        ]),
    ),
    (120, Tests(&["an_error_before_the_robot_is_ready_follows_the_reading"])),
    (121, Tests(&["some_errors_cannot_be_reset"])),
    (122, Tests(&["some_errors_cannot_be_reset"])),
    (123, Tests(&["a_blocked_joint_ends_in_an_error_of_motion", "an_overheated_gripper_lets_go"])),
    (124, Text),
    (125, Tests(&["p_stop2_in_clear_mode_clears_and_refuses_until_resumed"])),
    (126, Tests(&["p_stop2_in_clear_mode_clears_and_refuses_until_resumed"])),
    (
        127,
        Tests(&[
            "p_stop2_in_clear_mode_clears_and_refuses_until_resumed",
            "p_stop2_in_pause_mode_keeps_the_queue_and_takes_commands",
        ]),
    ),
    (128, Tests(&["p_stop2_in_clear_mode_clears_and_refuses_until_resumed"])),
    (
        129,
        Tests(&[
            "p_stop2_in_clear_mode_clears_and_refuses_until_resumed",
            "p_stop2_in_pause_mode_keeps_the_queue_and_takes_commands",
        ]),
    ),
    (130, Text),
    (131, Statement),
    (132, Tests(&["e_stop_on_revision_3_shuts_down"])),
    (133, Tests(&["e_stop_on_revision_4_stops_cuts_power_and_deactivates"])),
    (134, Tests(&["e_stop_on_revision_4_stops_cuts_power_and_deactivates"])),
    (
        135,
        Tests(&[
            "e_stop_on_revision_4_stops_cuts_power_and_deactivates",
            "after_an_e_stop_a_gripper_is_homed_again_alone",
        ]),
    ),
    (136, Tests(&["losing_the_connection_follows_the_reading"])),
    (137, Text),
    (138, Text),
    (139, Text),
    (140, Text),
    (141, Bus),
    (142, Tests(&["reboot_needs_a_deactivated_robot_and_forgets_all_but_persistent_settings"])),
    (143, Tests(&["a_redundancy_mismatch_of_a_second_needs_a_reboot"])),
    (
        144,
        Tests(&[
            "e_stop_on_revision_3_shuts_down",
            "e_stop_on_revision_4_stops_cuts_power_and_deactivates",
        ]),
    ),
    (
        145,
        Tests(&[
            "p_stop2_in_clear_mode_clears_and_refuses_until_resumed",
            "losing_the_connection_follows_the_reading",
        ]),
    ),
    (146, Absent),
    (147, Text),
    (
        148,
        Tests(&[
            "brakes_follow_activation_and_obey_only_when_allowed_and_deactivated",
            "activating_an_activated_robot_changes_nothing",
        ]),
    ),
    (149, Tests(&["homing_survives_deactivation_but_not_command_1002"])),
    (150, Tests(&["activation_fails_with_a_stop_with_joints_outside_and_with_an_old_tool"])),
    (151, Tests(&["activation_fails_with_a_stop_with_joints_outside_and_with_an_old_tool"])),
    (
        152,
        Tests(&[
            "brakes_follow_activation_and_obey_only_when_allowed_and_deactivated",
            "only_an_activated_robot_is_deactivated",
        ]),
    ),
    (153, Tests(&["homing_lasts_three_seconds_and_turns_every_joint_out_and_back"])),
    (154, Tests(&["homing_fails_outside_user_limits_outside_the_work_zone_and_when_blocked"])),
    (155, Tests(&["homing_fails_outside_user_limits_outside_the_work_zone_and_when_blocked"])),
    (156, Tests(&["homing_survives_deactivation_but_not_command_1002"])),
    (157, Tests(&["a_gripper_needs_homing_after_reactivation_and_only_it_moves"])),
    (158, Tests(&["home_is_ignored_when_not_needed_but_answered"])),
    (159, Tests(&["a_gripper_opens_closes_and_reports"])),
    (160, Tests(&["before_homing_positions_are_less_accurate_or_zero"])),
    (161, Tests(&["reboot_needs_a_deactivated_robot_and_forgets_all_but_persistent_settings"])),
    (162, Approximated),
    (
        163,
        Tests(&[
            "recovery_mode_ignores_user_limits_and_the_work_zone",
            "recovery_mode_allows_motion_in_self_collision",
            "recovery_mode_allows_motion_with_a_torque_overload",
        ]),
    ),
    (164, Tests(&["recovery_mode_moves_an_unhomed_robot_slowly"])),
    (165, Tests(&["recovery_mode_moves_an_unhomed_robot_slowly"])),
    (166, Tests(&["recovery_mode_limits_an_unhomed_gripper"])),
    (167, Tests(&["recovery_mode_may_be_set_in_any_state"])),
    (168, Tests(&["simulation_changes_only_while_deactivated_and_without_a_stop"])),
    (169, Tests(&["simulation_changes_only_while_deactivated_and_without_a_stop"])),
    (170, Text),
    (171, Tests(&["fast_simulation_executes_as_quickly_as_possible"])),
    (
        172,
        Tests(&[
            "simulation_changes_only_while_deactivated_and_without_a_stop",
            "fast_simulation_executes_as_quickly_as_possible",
        ]),
    ),
    (173, Text),
    (174, Tests(&["simulation_changes_only_while_deactivated_and_without_a_stop"])),
    (175, Tests(&["brakes_follow_activation_and_obey_only_when_allowed_and_deactivated"])),
    (176, Tests(&["brakes_follow_activation_and_obey_only_when_allowed_and_deactivated"])),
    (177, Tests(&["brakes_follow_activation_and_obey_only_when_allowed_and_deactivated"])),
    (178, Statement),
    (179, Tests(&["host_time_sets_the_clock_and_not_the_timestamp"])),
    (180, Tests(&["reboot_needs_a_deactivated_robot_and_forgets_all_but_persistent_settings"])),
    (181, Tests(&["host_time_sets_the_clock_and_not_the_timestamp"])),
    (182, Tests(&["timestamps_are_monotonic_over_a_reboot_but_for_its_reference"])),
    (183, Tests(&["slots_are_independent"])),
    (184, Tests(&["a_change_takes_one_cycle_or_two_and_the_slot_says_what_it_shows"])),
    (185, Tests(&["automatic_slots_go_through_all_types_and_count_rotations"])),
    (186, Tests(&["automatic_slots_go_through_all_types_and_count_rotations"])),
    (187, Tests(&["queue_parameters_are_reported_with_their_defaults"])),
    (188, Tests(&["identity_types_say_who_the_robot_is"])),
    (189, Tests(&["queue_parameters_are_reported_with_their_defaults"])),
    (
        190,
        Tests(&[
            "a_gripper_opens_closes_and_reports",
            "valves_open_close_and_close_on_deactivation",
        ]),
    ),
    (191, Tests(&["user_limits_apply_only_when_enabled"])),
    (192, Tests(&["variables_are_set_by_their_id_and_read_as_dynamic_types"])),
    (
        193,
        Tests(&[
            "variables_may_be_created_set_read_and_deleted_in_any_state",
            "variables_survive_a_reboot",
            "what_any_state_allows_is_taken_or_refused_in_error_mode",
        ]),
    ),
    (194, Text),
    (195, Tests(&["cyclic_ids_are_unique_and_in_range"])),
    (196, Text),
    (197, Tests(&["variables_are_set_by_their_id_and_read_as_dynamic_types"])),
    (198, Tests(&["use_variables_takes_the_values_in_place_of_the_ids"])),
    (199, Tests(&["use_variables_takes_the_values_in_place_of_the_ids"])),
    (200, Tests(&["use_variables_on_ethercat_follows_the_reading"])),
    (201, Text),
    (202, Text),
    (203, Text),
    (204, Tests(&["disable_ethercat_leaves_the_bus_and_only_on_ethercat"])),
    (205, Tests(&["disable_ethercat_leaves_the_bus_and_only_on_ethercat"])),
    (206, Bus),
    (207, Bus),
    (208, Bus),
    (209, Bus),
    (210, Bus),
    (211, Bus),
    (212, Bus),
    (213, Bus),
    (214, Bus),
    (215, Tests(&["joints_start_and_stop_together"])),
    (216, Tests(&["planning_errors_have_the_codes_of_the_manual"])),
    (217, Tests(&["a_linear_move_keeps_the_line_and_its_velocity"])),
    (218, Tests(&["planning_errors_have_the_codes_of_the_manual"])),
    (219, Tests(&["move_pose_takes_the_desired_posture_and_all_eight_exist"])),
    (
        220,
        Tests(&[
            "many_turns_are_the_same_orientation",
            "alpha_is_zero_where_beta_is_a_right_angle",
        ]),
    ),
    (221, Tests(&["set_auto_conf_0_takes_the_configuration_at_its_place"])),
    (222, Tests(&["set_auto_conf_0_takes_the_configuration_at_its_place"])),
    (223, Tests(&["set_auto_conf_0_takes_the_configuration_at_its_place"])),
    (224, Tests(&["set_auto_conf_0_takes_the_configuration_at_its_place"])),
    (225, Tests(&["planning_errors_have_the_codes_of_the_manual"])),
    (
        226,
        Tests(&[
            "a_wrist_singularity_is_crossed_when_the_posture_is_free",
            "a_shoulder_singularity_is_crossed_only_when_the_posture_is_free",
            "a_line_may_end_at_a_singularity",
        ]),
    ),
    (227, Tests(&["the_turn_of_joint_6_is_reported_and_bounded"])),
    (
        228,
        Tests(&[
            "blending_rounds_corners_between_moves_of_one_kind",
            "moves_of_two_kinds_never_blend_and_acceleration_settings_stop_the_robot",
        ]),
    ),
    (229, Tests(&["moves_of_two_kinds_never_blend_and_acceleration_settings_stop_the_robot"])),
    (
        230,
        Tests(&[
            "joint_velocity_sets_the_pace_and_its_limit_caps_it",
            "the_joint_velocity_limit_limits_or_scales",
        ]),
    ),
    (231, Tests(&["velocities_of_the_manual_example", "percentages_above_100_need_a_revision_4"])),
    (232, Tests(&["a_linear_move_keeps_the_line_and_its_velocity"])),
    (233, Tests(&["time_based_moves_keep_their_duration_or_follow_the_severity"])),
    (
        234,
        Tests(&[
            "time_based_moves_keep_their_duration_or_follow_the_severity",
            "planning_errors_have_the_codes_of_the_manual",
        ]),
    ),
    (235, Tests(&["eob_waits_for_a_delay_and_eom_does_not"])),
    (236, Tests(&["payload_is_queued_and_reported_and_changes_the_torque"])),
    (237, Tests(&["calibration_is_configured_while_deactivated"])),
    (
        238,
        Tests(&[
            "a_new_velocity_command_replaces_the_one_before_and_restarts_the_timeout",
            "a_velocity_command_with_a_move_id_follows_the_reading",
        ]),
    ),
    (239, Tests(&["set_point_0_stops_at_once_or_after_the_timeout"])),
    (240, Tests(&["checkpoints_and_the_gripper_pass_a_velocity_motion_and_moves_wait"])),
    (
        241,
        Tests(&[
            "a_joint_limit_stops_without_an_error",
            "a_linear_velocity_moves_the_tool_and_stops_at_the_edge_of_reach",
        ]),
    ),
    (242, Tests(&["a_tool_velocity_is_reduced_so_that_no_joint_exceeds_its_limit"])),
    (
        243,
        Tests(&[
            "time_scaling_scales_moves_and_delays",
            "time_scaling_scales_the_velocity_timeout_and_keeps_the_way",
            "time_scaling_acts_at_once_during_a_move_and_a_delay_and_keeps_the_path",
            "time_scaling_is_allowed_in_any_state",
            "what_any_state_allows_is_taken_or_refused_in_error_mode",
        ]),
    ),
    (244, Text),
    (245, Tests(&["torque_limits_need_homing"])),
    (
        246,
        Tests(&[
            "torque_limits_follow_severity_and_detection",
            "detection_1_ignores_accelerations",
        ]),
    ),
    (247, Tests(&["torque_limits_follow_severity_and_detection"])),
    (248, Tests(&["torque_limits_follow_severity_and_detection"])),
    (
        249,
        Tests(&[
            "refusals_have_the_codes_of_the_manual",
            "a_work_zone_breach_follows_its_severity",
        ]),
    ),
    (
        250,
        Tests(&[
            "a_work_zone_breach_follows_its_severity",
            "the_tool_sphere_widens_what_must_stay_inside",
        ]),
    ),
    (
        251,
        Tests(&[
            "a_work_zone_breach_follows_its_severity",
            "an_imminent_collision_follows_its_severity",
        ]),
    ),
    (252, Tests(&["work_zone_commands_need_good_corners_and_restore_the_factory"])),
    (
        253,
        Tests(&[
            "queue_parameters_are_reported_with_their_defaults",
            "the_tool_sphere_widens_what_must_stay_inside",
        ]),
    ),
    (254, Tests(&["a_large_tool_sphere_always_meets_the_yoke"])),
    (
        255,
        Tests(&[
            "a_work_zone_breach_follows_its_severity",
            "an_imminent_collision_follows_its_severity",
        ]),
    ),
    (
        256,
        Tests(&[
            "a_work_zone_breach_follows_its_severity",
            "the_tool_sphere_widens_what_must_stay_inside",
            "an_imminent_collision_follows_its_severity",
        ]),
    ),
    (257, Statement),
    (
        258,
        Tests(&[
            "user_limits_apply_only_when_enabled",
            "user_limits_stay_within_the_model_and_leave_25_degrees",
        ]),
    ),
    (259, Tests(&["user_limits_apply_only_when_enabled"])),
    (
        260,
        Tests(&[
            "user_limits_apply_only_when_enabled",
            "the_turn_of_joint_6_is_reported_and_bounded",
        ]),
    ),
    (261, Tests(&["a_gripper_command_runs_in_parallel_from_the_deceleration_on"])),
    (
        262,
        Tests(&[
            "gripper_commands_keep_joint_moves_blending_and_stop_linear_ones",
            "valves_do_not_stop_the_robot",
        ]),
    ),
    (263, Caller),
    (
        264,
        Tests(&[
            "a_gripper_opens_closes_and_reports",
            "finger_velocity_above_100_needs_full_force",
        ]),
    ),
    (
        265,
        Tests(&[
            "a_part_between_the_fingers_is_held",
            "the_range_redefines_open_and_close_but_not_move_gripper",
        ]),
    ),
    (266, Tests(&["refusals_have_the_codes_of_the_manual"])),
    (267, Tests(&["the_range_redefines_open_and_close_but_not_move_gripper"])),
    (268, Tests(&["a_gripper_opens_closes_and_reports", "a_part_between_the_fingers_is_held"])),
    (269, Tests(&["valves_open_close_and_close_on_deactivation"])),
    (270, Text),
    (
        271,
        Tests(&[
            "missing_and_invalid_programs_have_their_codes",
            "a_program_runs_once_and_is_reported_while_it_runs",
        ]),
    ),
    (272, Tests(&["a_program_runs_once_and_is_reported_while_it_runs"])),
    (273, Tests(&["a_program_runs_once_and_is_reported_while_it_runs"])),
    (
        274,
        Tests(&[
            "the_start_button_repeats_program_1_when_it_shall_loop_and_start_program_does_not",
            "missing_and_invalid_programs_have_their_codes",
        ]),
    ),
    (275, Tests(&["missing_and_invalid_programs_have_their_codes"])),
    (276, Text),
    (277, Text),
    (278, Text),
];

#[test]
fn every_rule_is_listed_once_in_order() {
    let numbers: Vec<u16> = RULES.iter().map(|(number, _)| *number).collect();
    assert_eq!(numbers, (1..=278).collect::<Vec<_>>());
}

#[test]
fn every_named_test_exists() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let mut sources = String::new();
    for folder in ["tests", "src/sim"] {
        collect(&root.join(folder), &mut sources);
    }
    let named: BTreeSet<&str> = RULES
        .iter()
        .filter_map(|(_, cover)| if let Tests(names) = cover { Some(*names) } else { None })
        .flatten()
        .copied()
        .collect();
    for name in &named {
        assert!(is_test(&sources, name), "no test is called {name}");
    }
    assert!(named.len() > 80);
    assert!(!is_test(&sources, "is_test"), "a helper is no test");
}

/// Whether a function of this name stands below `#[test]`, other attributes between them allowed.
fn is_test(sources: &str, name: &str) -> bool {
    let head = format!("fn {name}(");
    let mut marked = false;
    for line in sources.lines().map(str::trim) {
        if line.starts_with(&head) {
            return marked;
        }
        marked = line == "#[test]" || marked && line.starts_with("#[");
    }
    false
}

#[test]
fn most_rules_that_the_images_show_are_covered() {
    let covered =
        RULES.iter().filter(|(_, cover)| matches!(cover, Tests(names) if !names.is_empty()));
    let text = RULES.iter().filter(|(_, cover)| matches!(cover, Text | Bus)).count();
    assert!(covered.count() * 100 >= (RULES.len() - text) * 90);
}

fn collect(folder: &Path, sources: &mut String) {
    for entry in fs::read_dir(folder).expect("the folder is there") {
        let path = entry.expect("a readable entry").path();
        if path.is_dir() {
            collect(&path, sources);
        } else if path.extension().is_some_and(|extension| extension == "rs") {
            sources.push_str(&fs::read_to_string(&path).expect("a readable source"));
        }
    }
}
