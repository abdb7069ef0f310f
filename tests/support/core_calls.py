"""A valid call of every function of the native core.

The program `python -m support.core_calls NAME` makes the call of one function with each wrong value of each argument.
It prints a JSON line with the arguments before each call, and one with the exception's name and text after it. A crash
ends the lines early.
"""

from __future__ import annotations

import json
import sys
import warnings
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np
from support.core_objects import (
    BALL,
    BALLS,
    CELL,
    CLOCK,
    FIRST,
    MARGINS,
    MOTION,
    OTHER,
    POSES,
    ROWS,
    SIX_AXES,
    SIX_OFFSETS,
    STEPS,
    THREE,
    THREE_ROWS,
    UPRIGHT_CELL,
    arm_at,
    composite,
    groups,
    hull,
    hull_obstacle,
    obstacle,
    one_arm,
    pool,
    search,
    two_arms,
    unmade,
)
from support.wrong_arguments import WRONG

from mmp_env import core


@dataclass(frozen=True, kw_only=True)
class Call:
    """A function to call. `arguments`: name -> (a valid value, the kind of argument, which names wrong values)."""

    of: Callable[..., Any]
    arguments: dict[str, tuple[Any, str]]

    @property
    def valid(self) -> dict[str, Any]:
        return {name: value for name, (value, _) in self.arguments.items()}


def call(of: Callable[..., Any], **arguments: tuple[Any, str]) -> Call:
    return Call(of=of, arguments=arguments)


def in_cell(of: Callable[..., Any], **arguments: tuple[Any, str]) -> Call:
    return call(of, cell=(CELL, "cell"), **arguments)


LEVELS = {"levels": (MARGINS, "levels")}
WINDOW = {"start": (0.0, "window start"), "end": (1.0, "window end")}
ARM = {"arm": (0, "arm")}
SEED = {"seed": (1, "seed")}
TIMED = {"clock": (CLOCK, "clock")}
OF_CELL = {
    "add_arm": {name: (value, name) for name, value in arm_at(0.0).items()}
    | {"tool": (arm_at(0.0)["tool"], "pose")}
    | {name: (arm_at(0.0)[name], "limits") for name in ("lower", "upper")},
    "add_obstacle": {name: (value, name) for name, value in obstacle().items()},
    "add_hull": {
        "arm": (0, "arm of one"),
        "link": (2, "any link"),
        "vertices": (hull()["vertices"], "vertices"),
        "radius": (0.01, "not negative"),
        "protrusion": (0.2, "protrusion"),
    },
    "add_hull_obstacle": {
        "vertices": (hull_obstacle()["vertices"], "vertices"),
        "planes": (hull_obstacle()["planes"], "planes"),
        "radius": (0.0, "not negative"),
    },
}
TWO_ROWS = ([ROWS, ROWS], "some rows of each")
TWO_GOALS = ([ROWS[-1:], ROWS[-1:]], "rows of each goal")
TWO_STEPS = ([STEPS, STEPS], "steps of each")

CALLS = {
    "SingleArmSettings.__init__": call(
        core.SingleArmSettings,
        max_iterations=(10, "count"),
        improve_iterations=(0, "count"),
        shortcuts=(1, "count"),
        goal_bias=(0.1, "share"),
        neighbours=(6, "count"),
    ),
    "RepulsionSettings.__init__": call(
        core.RepulsionSettings,
        k_rep=(1.0, "not negative"),
        d0=(0.1, "positive"),
        centre_distance=(False, "flag"),
        alpha=(0.01, "number"),
        max_iterations=(3, "count"),
        normalised=(False, "flag"),
        normalised_step=(0.1, "not negative"),
        max_step=(0.1, "not negative"),
        comfort=(0.1, "number"),
    ),
    "CompositeSettings.__init__": call(core.CompositeSettings, range=(2.0, "sampling"), step=(0.05, "sampling")),
    "ShortcutSettings.__init__": call(
        core.ShortcutSettings, attempts=(10, "count"), min_saving=(0.01, "positive share")
    ),
    "cpu_level": call(core.cpu_level),
    "Clock.__init__": call(core.Clock, seconds=(1.0, "seconds")),
    "Clock.cancel": call(lambda: core.Clock(1.0).cancel()),
    "Clock.reserve": call(core.Clock(1.0).reserve, seconds=(1.0, "seconds")),
    "Levels.__init__": call(
        core.Levels,
        margin=(0.002, "number"),
        proof=(0.0015, "number"),
        obstacles=(0.0, "number"),
        own=(0.0, "number"),
        upright=(0.0, "number"),
    ),
    "Cell.__init__": call(core.Cell),
    "Cell.add_arm": call(lambda **given: core.Cell().add_arm(**given), **OF_CELL["add_arm"]),
    "Cell.add_obstacle": call(lambda **given: core.Cell().add_obstacle(**given), **OF_CELL["add_obstacle"]),
    "Cell.add_hull": call(lambda **given: one_arm().add_hull(**given), **OF_CELL["add_hull"]),
    "Cell.add_hull_obstacle": call(
        lambda **given: one_arm().add_hull_obstacle(**given), **OF_CELL["add_hull_obstacle"]
    ),
    "Cell.let_touch": call(
        lambda **given: two_arms(frozen=False).let_touch(**given),
        obstacle=(0, "arm of one"),
        arm=(0, "arm"),
        link=(1, "moving link"),
    ),
    "Cell.freeze": call(lambda: two_arms(frozen=False).freeze()),
    "spheres": in_cell(core.spheres, **ARM, q=(ROWS, "rows")),
    "sphere_table": in_cell(core.sphere_table, **ARM),
    "deepest_balls": call(core.deepest_balls, **BALLS),
    "points_in_balls": call(core.points_in_balls, **BALLS, depth=(np.zeros(4), "limits of four")),
    "plane_depths": call(
        core.plane_depths, points=BALLS["points"], planes=(np.array([[0.0, 0.0, 1.0, 0.5]]), "half-spaces")
    ),
    "small_cover": call(
        core.small_cover,
        samples=(np.array([0, 1, 1], dtype=np.int32), "numbers of samples"),
        candidates=(np.array([0, 0, 1], dtype=np.int32), "numbers of candidates"),
        sample_count=(2, "few"),
        candidate_count=(2, "few"),
        chosen=(np.array([1], dtype=np.int32), "chosen"),
        draws=(np.array([0.2, 0.7, 1.0]), "shares"),
    ),
    "solve_six_hinges": call(
        core.solve_six_hinges,
        axes=(SIX_AXES, "six axes"),
        offsets=(SIX_OFFSETS, "six offsets"),
        poses=(POSES, "poses"),
        spherical=(False, "flag"),
        miss=(0.05, "not negative"),
    ),
    "refine_tool_pose": call(
        core.refine_tool_pose,
        **THREE,
        rows=(3, "task rows"),
        q=(THREE_ROWS, "rows of three"),
        poses=(POSES, "poses"),
        steps=(10, "count"),
        farthest=(10.0, "not negative"),
    ),
    "self_motions": call(
        core.self_motions,
        axes=(np.eye(3)[[2, 1, 1, 1]].copy(), "matrix of three"),
        offsets=(np.array([[0, 0, 0.1], [0, 0, 0.1], [0, 0, 0.4], [0, 0, 0.4], [0, 0, 0.3]]), "chain offsets"),
        slides=(np.zeros(4, dtype=bool), "flags of three"),
        tool=(np.eye(3), "matrix of three"),
        rows=(3, "task rows of three"),
        q=(np.array([[0.1, 0.2, 0.3, 0.4]]), "rows of three"),
        pose=(POSES[0], "one pose"),
        lower=(np.full(4, -3.0), "limits of four"),
        upper=(np.full(4, 3.0), "limits of four"),
        step=(0.1, "curve step"),
    ),
    "with_turns": call(
        core.with_turns,
        q=(THREE_ROWS, "rows of three"),
        lower=(np.full(3, -6.0), "limits of three"),
        upper=(np.full(3, 6.0), "turns"),
        hinges=(np.ones(3, dtype=bool), "flags of three"),
        near=(np.zeros(3), "limits of three"),
        limit=(10, "positive count"),
    ),
    "hull_distances": call(
        core.hull_distances,
        a=(hull()["vertices"], "vertices"),
        b=(hull_obstacle()["vertices"], "vertices"),
        poses=(np.tile(np.eye(4)[:3].ravel(), (3, 4, 1)), "poses of hulls"),
        radius_a=(0.01, "not negative"),
        radius_b=(0.0, "not negative"),
    ),
    "tool_points": in_cell(core.tool_points, **ARM, q=(ROWS, "rows")),
    "static_clearance": in_cell(core.static_clearance, **ARM, q=(ROWS, "rows"), precise=(True, "flag")),
    "pair_clearance": in_cell(
        core.pair_clearance, a=(0, "arm"), qa=(ROWS, "rows"), b=(1, "arm"), qb=(ROWS, "rows"), precise=(True, "flag")
    ),
    "swept_clearance": in_cell(
        core.swept_clearance,
        **ARM,
        q=(ROWS, "rows of a line"),
        **{name: (value, name) for name, value in obstacle().items()},
        stray=(0.0, "not negative"),
    ),
    "cell_clearance": in_cell(core.cell_clearance, q=([ROWS, ROWS], "rows of each"), obstacles=(True, "flag")),
    "nearest_bodies": in_cell(core.nearest_bodies, q=([FIRST, FIRST], "q of each")),
    "keep_upright": call(
        lambda **given: core.keep_upright(one_arm(), **given),
        arm=(0, "arm of one"),
        axis=(np.array([0.0, 0.0, 1.0]), "axis"),
        within=(0.2, "upright angle"),
    ),
    "tool_axes": call(core.tool_axes, cell=(UPRIGHT_CELL, "upright cell"), arm=(0, "arm of one"), q=(ROWS, "rows")),
    "project_upright": call(
        core.project_upright, cell=(UPRIGHT_CELL, "upright cell"), arm=(0, "arm of one"), q=(ROWS, "rows")
    ),
    "edges_free": in_cell(core.edges_free, **ARM, q_from=(ROWS, "rows"), q_to=(ROWS, "rows"), **LEVELS),
    "certify": in_cell(core.certify, q=TWO_ROWS, required=(MARGINS, "required"), share=(0.5, "share"), **TIMED),
    "Motion.__init__": in_cell(core.Motion, **ARM, q=(ROWS, "some rows")),
    "Motion.may_be_near": call(MOTION.may_be_near, other=(OTHER, "any motion"), distance=(0.01, "number")),
    "conflict_instants": in_cell(
        core.conflict_instants,
        motions=([MOTION, OTHER], "motions"),
        pairs=(np.array([[0, 1]], dtype=np.int32), "pairs"),
        **LEVELS,
        bases=(True, "flag"),
    ),
    "swept_conflicts": call(
        core.swept_conflicts,
        first=(MOTION, "any motion"),
        second=(OTHER, "any motion"),
        distance=(0.01, "number"),
    ),
    "Constraint.ball": call(core.Constraint.ball, center=(FIRST, "center"), radius=(0.1, "not negative"), **WINDOW),
    "Constraint.standing": in_cell(core.Constraint.standing, **ARM, q=(FIRST, "q"), shrink=(0.0, "number"), **WINDOW),
    "Constraint.moving": call(
        core.Constraint.moving, motion=(MOTION, "any motion"), start=(0.0, "whole step"), end=(1.0, "whole step")
    ),
    "Constraint.sphere": call(
        core.Constraint.sphere,
        center=(np.zeros(3), "point"),
        radius=(0.1, "not negative"),
        first_link=(1, "link"),
        **WINDOW,
    ),
    "safe_intervals": in_cell(
        core.safe_intervals,
        **ARM,
        q=(FIRST, "q"),
        constraints=([BALL], "constraints"),
        **LEVELS,
        others=([OTHER], "others"),
    ),
    "SingleArm.__init__": in_cell(
        core.SingleArm,
        **ARM,
        start=(FIRST, "q"),
        goals=(ROWS[-1:], "some rows"),
        max_step=(STEPS, "steps"),
        **LEVELS,
        **SEED,
        eta=(0.8, "sampling"),
    ),
    "SingleArm.plan": call(
        lambda **given: search().plan(**given),
        constraints=([BALL], "constraints"),
        **SEED,
        **TIMED,
        settings=(core.SingleArmSettings(max_iterations=10), "single-arm settings"),
        others=([OTHER], "others"),
        experience=(ROWS, "experience"),
    ),
    "repulsive_force": in_cell(
        core.repulsive_force,
        motion=(MOTION, "motion"),
        others=([OTHER], "others"),
        settings=(core.RepulsionSettings(), "repulsion settings"),
    ),
    "modify_motion": in_cell(
        core.modify_motion,
        motion=(MOTION, "motion"),
        others=([OTHER], "others"),
        constraints=([BALL], "constraints"),
        max_step_rad=(STEPS, "steps"),
        **LEVELS,
        constraint_margin=(0.002, "number"),
        settings=(core.RepulsionSettings(max_iterations=3), "repulsion settings"),
        **TIMED,
        trace=(True, "flag"),
    ),
    "breaks_constraint": in_cell(
        core.breaks_constraint,
        motion=(MOTION, "motion"),
        constraints=([BALL], "constraints"),
        margin=(0.002, "number"),
    ),
    "CompositeSearch.__init__": in_cell(
        core.CompositeSearch,
        start=(np.zeros(4), "all joints"),
        goals=(np.ones((2, 4)), "rows of all joints"),
        samples=(MARGINS, "levels"),
        edges=(MARGINS, "levels"),
        **SEED,
        settings=(core.CompositeSettings(), "composite settings"),
        arms=([0, 1], "arms"),
    ),
    "CompositeSearch.grow": call(lambda **given: composite().grow(**given), iterations=(10, "count"), **TIMED),
    "GroupSearch.__init__": in_cell(
        core.GroupSearch,
        start=(np.zeros(4), "all joints"),
        goal=(np.ones(4), "all joints"),
        samples=(MARGINS, "levels"),
        edges=(MARGINS, "levels"),
        **SEED,
        settings=(core.CompositeSettings(), "composite settings"),
        most=(2, "positive count"),
    ),
    "GroupSearch.grow": call(lambda **given: groups().grow(**given), iterations=(10, "count"), **TIMED),
    "shortcut": in_cell(
        core.shortcut,
        q=TWO_ROWS,
        max_step=TWO_STEPS,
        goals=TWO_GOALS,
        **LEVELS,
        groups=([0, 0], "groups"),
        settings=(core.ShortcutSettings(attempts=10), "shortcut settings"),
        **SEED,
        **TIMED,
    ),
    "replan": in_cell(
        core.replan, q=TWO_ROWS, max_step=TWO_STEPS, goals=TWO_GOALS, **LEVELS, attempts=(3, "count"), **SEED, **TIMED
    ),
    "remove_waits": in_cell(core.remove_waits, q=TWO_ROWS, max_velocity=TWO_STEPS, distance=(0.01, "number"), **TIMED),
    "PathRecombination.__init__": in_cell(core.PathRecombination, max_step=TWO_STEPS, **LEVELS),
    "PathRecombination.add": call(lambda **given: pool().add(**given), q=([ROWS, ROWS], "path of each")),
    "PathRecombination.has": call(lambda **given: pool().has(**given), path_ids=([0, 1], "any path ids")),
    "PathRecombination.shortest": call(lambda: pool().shortest()),
    "PathRecombination.path": call(lambda **given: pool().path(**given), **ARM, path_id=(0, "path id")),
    "PathRecombination.infeasible_pairs": call(
        lambda **given: pool().infeasible_pairs(**given), path_ids=([0, 1], "path ids"), **TIMED
    ),
    "PathRecombination.recombine": call(lambda **given: pool().recombine(**given), limit=(100.0, "limit"), **TIMED),
    "search_tree": call(
        lambda **given: core.search_tree(**given),
        arm=(search(), "search"),
        others=([OTHER], "others"),
        **SEED,
        **TIMED,
        iterations=(10, "count"),
    ),
}


def outcome(of: Callable[[], Any]) -> str:
    """Returns `returned`, or the exception's name and text."""
    try:
        of()
    except Exception as exception:
        return f"{type(exception).__name__}: {exception}".splitlines()[0]
    return "returned"


def of_unmade_object(name: str, chosen: Call) -> list[tuple[str, Callable[[], Any]]]:
    """Returns calls of a method, or of the properties, of an object that was never initialised."""
    owner, _, method = name.rpartition(".")
    if not owner or owner == "Constraint":
        return []
    kind = getattr(core, owner)
    if method != "__init__":
        return [("self", partial(getattr(kind, method), unmade(kind), **chosen.valid))]
    return [
        (key, partial(getattr, unmade(kind), key)) for key, value in vars(kind).items() if isinstance(value, property)
    ]


def main() -> None:
    """Prints the outcome of the valid call, and of each call with one wrong argument."""
    warnings.simplefilter("ignore")  # nanobind warns about objects that were never initialised
    chosen = CALLS[sys.argv[1]]
    tries = [("valid", lambda: chosen.of(**chosen.valid))]
    for name, (_, kind) in chosen.arguments.items():
        for value in WRONG[kind]:
            tries.append((f"{name} = {value!r}", partial(chosen.of, **(chosen.valid | {name: value}))))
    tries += of_unmade_object(sys.argv[1], chosen)
    for what, of in tries:
        print(json.dumps({"try": what}), flush=True)
        print(json.dumps({"outcome": outcome(of)}), flush=True)


if __name__ == "__main__":
    main()
