"""Violations of every kind that `attack_checker.py` plants in valid plans."""

from __future__ import annotations

import math
from dataclasses import dataclass

import planted_contacts as contacts
import planted_numbers as numbers
from attacked_plan import Plant
from planted_numbers import break_rows, break_times


@dataclass(frozen=True)
class Kind:
    """Plants a violation in a document and returns whether it is one; `rule` is the rule that it breaks."""

    plant: Plant
    rule: str


KINDS = {
    "arms_touch_between_samples": Kind(contacts.swing("arms", 0.6), "arm-arm"),
    "obstacle_touched_between_samples": Kind(contacts.swing("obstacles", 1.5), "arm-obstacle"),
    "self_touched_between_samples": Kind(contacts.swing("self", 3.0), "self"),
    "margin_of_arms_raised": Kind(contacts.raise_margin("arms"), "arm-arm"),
    "margin_of_obstacles_raised": Kind(contacts.raise_margin("obstacles"), "arm-obstacle"),
    "margin_of_self_raised": Kind(contacts.raise_margin("self"), "self"),
    "base_moved": Kind(contacts.move_base, "arm-arm"),
    "obstacle_added": Kind(contacts.add_obstacle, "arm-obstacle"),
    "moving_obstacle_added": Kind(contacts.add_moving_obstacle, "arm-obstacle"),
    "held_object_touches_arm": Kind(contacts.grow_held("arms"), "arm-arm"),
    "held_object_touches_obstacle": Kind(contacts.grow_held("obstacles"), "arm-obstacle"),
    "tool_axis_tilted": Kind(contacts.tilt, "upright"),
    "tool_axis_tilted_between_samples": Kind(contacts.tilt_between_samples, "upright"),
    "joint_limit_left": Kind(numbers.leave_limits, "limits"),
    "velocity_limit": Kind(numbers.lower_limit("max_velocity"), "speed"),
    "velocity_of_robot": Kind(numbers.hurry, "speed"),
    "acceleration_limit": Kind(numbers.lower_limit("max_acceleration"), "acceleration"),
    "jerk_limit": Kind(numbers.lower_limit("max_jerk"), "jerk"),
    "velocity_misstated": Kind(numbers.misstate("velocities"), "rates"),
    "acceleration_misstated": Kind(numbers.misstate("accelerations"), "rates"),
    "turned_for_hours": Kind(numbers.turn_for_hours, "length"),
    "start_changed": Kind(numbers.change_end("start"), "start"),
    "goal_changed": Kind(numbers.change_end("goal"), "goal"),
    "time_repeated": Kind(break_times(lambda t, k: [*t[:k], t[k - 1], *t[k + 1 :]]), "times"),
    "time_goes_back": Kind(break_times(lambda t, k: [*t[:k], t[k - 1] - 1e-6, *t[k + 1 :]]), "times"),
    "time_not_finite": Kind(break_times(lambda t, k: [*t[:k], (math.nan, math.inf)[k % 2], *t[k + 1 :]]), "finite"),
    "time_lost": Kind(break_times(lambda t, k: [*t[:k], *t[k + 1 :]]), "shape"),
    "begin_late": Kind(break_times(lambda t, _: [at + 1e-6 for at in t]), "times"),
    "carried_hulls_shrunk": Kind(numbers.shrink_carried("hulls.json"), "schema"),
    "carried_spheres_shrunk": Kind(numbers.shrink_carried("spheres.json"), "schema"),
    "carried_limit_raised": Kind(numbers.raise_carried, "schema"),
    "arm_lost": Kind(numbers.lose_arm, "schema"),
    "field_unknown": Kind(numbers.add_field, "schema"),
    "number_as_text": Kind(numbers.write_number_as_text, "schema"),
    "row_lost": Kind(break_rows(lambda q, k: q[:k] + q[k + 1 :]), "shape"),
    "number_lost": Kind(break_rows(lambda q, k: [*q[:k], q[k][:-1], *q[k + 1 :]]), "shape"),
    "number_not_finite": Kind(break_rows(lambda q, k: [*q[:k], [math.nan, *q[k][1:]], *q[k + 1 :]]), "finite"),
}
"""Name -> kind of violation."""
