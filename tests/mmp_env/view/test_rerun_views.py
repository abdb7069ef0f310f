"""Nodes, repulsion and the plan in a recording, against the core and the planner's events."""

import numpy as np
import pytest
from reference import repulsion as reference_repulsion
from support import two_arms
from support.recordings import Rows, array

from mmp_env import core, events
from mmp_env.events import ForceField
from mmp_env.view.rerun import RerunWatcher
from mmp_env.view.rerun.plan_view import frame_times
from mmp_env.view.rerun.repulsion_steps import sphere_forces
from mmp_planners import make

PROBLEM = two_arms.passing(1.0)
CELL = PROBLEM.cell
ARMS = CELL.arm_names
POSITIONS, COLORS, STRIPS = "Points3D:positions", "Points3D:colors", "LineStrips3D:strips"
RED = 0xEB0028FF


@pytest.fixture(scope="module")
def search(tmp_path_factory):
    """Returns the rows of a recording of a search with repulsion, the emitted events, and the plan."""
    path, emitted = tmp_path_factory.mktemp("rerun") / "search.rrd", []
    with RerunWatcher(PROBLEM, path) as watcher:

        class Both:
            wants_iterates = True

            def __call__(self, event):
                emitted.append(event)
                watcher(event)

        result = make("apf-ecbs").plan(PROBLEM, seed=0, watch=Both())
        watcher.show_plan(result.plan)
    return Rows(path), emitted, result.plan


def emitted_of(emitted, kind):
    return [event for event in emitted if isinstance(event, kind)]


def test_each_expanded_node_has_its_tool_paths_at_its_time(search):
    rows, emitted, _ = search
    created = {event.node: event for event in emitted_of(emitted, events.NodeCreated)}
    expanded = emitted_of(emitted, events.NodeExpanded)
    assert expanded
    for arm in ARMS:
        strips = rows.at(f"/node/paths/{arm}", STRIPS, "expansion")
        assert sorted(strips) == list(range(len(expanded) + 2))
        for moment, event in enumerate(expanded, 1):
            expected = CELL.collision.tool_points(arm, created[event.node].paths[arm])
            np.testing.assert_allclose(array(strips[moment][0]), expected, atol=1e-5)


def test_the_text_of_a_node_has_cost_bound_conflicts_and_constraint(search):
    rows, emitted, _ = search
    created = {event.node: event for event in emitted_of(emitted, events.NodeCreated)}
    words = rows.at("/node/words", "TextDocument:text", "expansion")
    for moment, event in enumerate(emitted_of(emitted, events.NodeExpanded), 1):
        node, (text,) = created[event.node], words[moment]
        assert f"node {event.node}" in text
        assert f"cost {node.cost_rad:.2f} rad, lower bound {node.lower_bound_rad:.2f} rad" in text
        assert f"conflicts: {node.conflicts}" in text
        assert node.constraint is None or node.constraint in text
    assert "The root" in words[0][0]
    assert "The solution" in words[max(words)][0]


def test_conflicts_are_points_between_arms_that_meet_and_the_solution_has_none(search):
    rows, emitted, _ = search
    created = {event.node: event for event in emitted_of(emitted, events.NodeCreated)}
    points = rows.at("/node/conflicts", POSITIONS, "expansion")
    for moment, event in enumerate(emitted_of(emitted, events.NodeExpanded), 1):
        assert points[moment]
        assert (created[event.node].conflicts > 0) == bool(points[moment])
    assert points[max(points)] == []


def test_the_clouds_of_a_node_have_the_spheres_of_the_core_and_red_where_they_touch(search):
    rows, emitted, _ = search
    clouds = {arm: rows.at(f"/node/spheres/{arm}", POSITIONS, "expansion") for arm in ARMS}
    colors = {arm: rows.at(f"/node/spheres/{arm}", COLORS, "expansion") for arm in ARMS}
    radii = {arm: array(rows.static(f"/node/spheres/{arm}", "Points3D:radii")) for arm in ARMS}
    left, right = ARMS
    for arm in ARMS:
        np.testing.assert_allclose(radii[arm], CELL.collision.spheres(arm, PROBLEM.start[arm][None])[1], rtol=1e-6)
    for moment in range(len(emitted_of(emitted, events.NodeExpanded)) + 2):
        a, b = array(clouds[left][moment]), array(clouds[right][moment])
        gaps = np.linalg.norm(a[:, None] - b[None], axis=2) - radii[left][:, None] - radii[right]
        for arm, nearest in ((left, gaps.min(axis=1)), (right, gaps.min(axis=0))):
            red = np.array(colors[arm][moment]) == RED
            sure = np.abs(nearest - PROBLEM.conflict_distances.arms) > 1e-5
            np.testing.assert_array_equal(red[sure], (nearest < PROBLEM.conflict_distances.arms)[sure])
    assert RED in colors[left][1], "the first node that is branched has arms in contact"


def test_progress_is_that_of_the_events(search):
    rows, emitted, _ = search
    created = {event.node: event for event in emitted_of(emitted, events.NodeCreated)}
    expanded = emitted_of(emitted, events.NodeExpanded)
    curves = {
        "cost": [created[event.node].cost_rad for event in expanded],
        "lower_bound": [created[event.node].lower_bound_rad for event in expanded],
        "conflicts": [event.conflicts for event in expanded],
        "open_nodes": [event.open_nodes for event in expanded],
    }
    for name, values in curves.items():
        found = rows.at(f"/search/{name}", "Scalars:scalars", "expansion")
        assert [found[moment][0] for moment in range(1, len(values) + 1)] == pytest.approx(values)


def test_repulsion_has_a_row_for_each_iterate_with_the_spheres_of_the_core(search):
    rows, emitted, _ = search
    repelled = emitted_of(emitted, events.Repelled)
    clouds = rows.at("/repulsion/arm", POSITIONS, "repulsion")
    paths = rows.at("/repulsion/path/now", STRIPS, "repulsion")
    words = rows.at("/repulsion_words", "TextDocument:text", "repulsion")
    number = 0
    for event in repelled:
        instant = None
        for k, path in enumerate([event.before, *event.iterates]):
            tool = CELL.collision.tool_points(event.arm, path)
            np.testing.assert_allclose(array(paths[number][0]), tool, atol=1e-5)
            centers = CELL.collision.spheres(event.arm, path)[0]
            off = np.abs(centers - array(clouds[number])[None]).max(axis=(1, 2))
            instant = int(np.argmin(off)) if instant is None else instant
            assert off[instant] < 1e-5
            assert f"iteration {k} of {event.iterations}" in words[number][0] or k == 0
            number += 1
        number += 1  # a gap between two paths
    assert sorted(clouds) == sorted(words)
    assert max(clouds) == number - 2


def test_arrows_begin_on_the_arm(search):
    rows, _, _ = search
    origins = rows.at("/repulsion/forces", "Arrows3D:origins", "repulsion")
    vectors = rows.at("/repulsion/forces", "Arrows3D:vectors", "repulsion")
    clouds = rows.at("/repulsion/arm", POSITIONS, "repulsion")
    assert any(vectors.values())
    largest = max(np.linalg.norm(array(v), axis=1).max() for v in vectors.values() if v)
    assert largest == pytest.approx(0.3, rel=1e-5)
    radii = CELL.collision.spheres(ARMS[0], PROBLEM.start[ARMS[0]][None])[1]
    for number, begin in origins.items():
        for point in array(begin).reshape(-1, 3):
            away = np.linalg.norm(array(clouds[number]) - point, axis=1) - radii
            assert np.abs(away).min() < 1e-5


@pytest.mark.parametrize("centres", [False, True])
def test_the_forces_shown_are_those_that_the_core_descends(centres):
    """Their torques by the reference implementation's Jacobian equal the joint forces of the core."""
    first, second = ARMS
    paths = {arm: np.linspace(PROBLEM.start[arm], PROBLEM.goal[arm], 15) for arm in ARMS}
    field = ForceField(k_rep=0.05, d0=0.2, centres=centres)
    motions = [CELL.collision.motion(arm, paths[arm]) for arm in ARMS]
    settings = core.RepulsionSettings(k_rep=field.k_rep, d0=field.d0, centre_distance=centres)
    found = core.repulsive_force(CELL.collision.core, motions[0], motions[1:], settings)
    assert found.any()
    for k in range(1, 14):
        q, others = paths[first][k], {second: paths[second][k]}
        torque = joint_torques(q, sphere_forces(CELL, first, q[None], others, field), first)
        expected = reference_repulsion.state_force(
            CELL, first, q, others, k_rep=field.k_rep, d0=field.d0, distance="centre" if centres else "surface"
        )
        np.testing.assert_allclose(torque, expected, rtol=1e-6, atol=1e-9)
        np.testing.assert_allclose(torque, found[k], rtol=1e-3, atol=1e-3 * np.abs(found).max())


def joint_torques(q, shown, arm):
    """Returns J^T F summed over spheres, with J by finite differences."""
    centers, forces = shown[0][0], shown[1][0]
    out, small = np.zeros(len(q)), 1e-6
    for joint in range(len(q)):
        ends = np.array([q, q])
        ends[:, joint] += [small, -small]
        high, low = CELL.collision.spheres(arm, ends)[0]
        out[joint] = ((high - low) / (2 * small) * forces).sum()
    assert centers.shape == forces.shape
    return out


def test_the_plan_has_the_spheres_of_the_core_at_each_frame(search):
    rows, _, plan = search
    times = frame_times(plan)
    q = plan.sampled(times)
    for arm in ARMS:
        found = rows.at(f"/plan/spheres/{arm}", POSITIONS, "plan time")
        np.testing.assert_allclose(sorted(found), times, atol=1e-8)
        expected = CELL.collision.spheres(arm, q[arm])[0]
        np.testing.assert_allclose(array([found[time] for time in sorted(found)]), expected, atol=1e-5)


def test_the_bodies_of_the_cell_move_along_the_plan(search):
    rows, _, plan = search
    from mmp_env.mujoco_import import mujoco
    from mmp_env.sim.scene import compile_scene

    model = compile_scene(CELL)
    data = mujoco.MjData(model)
    frames = {}
    for body in ("left/wrist3", "right/forearm"):
        places = rows.at(f"/cell/{body}", "Transform3D:translation", "plan time")
        turns = rows.at(f"/cell/{body}", "Transform3D:quaternion", "plan time")
        frames[body] = places, turns
        assert len(places) == len(frame_times(plan))
    for k, time in enumerate(sorted(frames["left/wrist3"][0])):
        data.qpos[:] = np.concatenate([plan.sampled(frame_times(plan))[arm][k] for arm in ARMS])
        mujoco.mj_kinematics(model, data)
        for body, (places, turns) in frames.items():
            np.testing.assert_allclose(places[time][0], data.body(body).xpos, atol=1e-6)
            np.testing.assert_allclose(turns[time][0], data.body(body).xquat[[1, 2, 3, 0]], atol=1e-6)


def test_every_geom_of_the_cell_is_there(search):
    rows, _, _ = search
    from mmp_env.sim.scene import compile_scene

    model = compile_scene(CELL)
    sizes = {"cylinders": "Cylinders3D:radii", "ellipsoids": "Ellipsoids3D:half_sizes", "boxes": "Boxes3D:half_sizes"}
    sizes |= {"capsules": "Capsules3D:radii", "spheres": "Ellipsoids3D:half_sizes"}
    shapes = [path for path in rows.entities if path.startswith(("/cell/", "/stage/")) and path.count("/") != 3]
    shown = sum(len(rows.static(path, sizes[path.rsplit("/", 1)[1]])) for path in shapes)
    assert shown == model.ngeom - 1, "all but the floor"


def test_clearances_over_time_are_those_of_the_core(search):
    rows, _, plan = search
    q = plan.sampled(frame_times(plan))
    expected = CELL.collision.pair_clearance(ARMS[0], q[ARMS[0]], ARMS[1], q[ARMS[1]])
    for arm in ARMS:
        found = rows.at(f"/plan/clearance/{arm}", "Scalars:scalars", "plan time")
        np.testing.assert_allclose([found[time][0] for time in sorted(found)], expected)


def test_joints_stay_between_their_limits_of_one(search):
    rows, _, plan = search
    for arm in ARMS:
        robot = CELL.arm(arm).robot
        position = rows.at(f"/plan/joints/{arm}/position", "Scalars:scalars", "plan time")
        times = sorted(position)
        q = np.array([plan.at(time)[arm] for time in times])
        expected = -1 + 2 * (q - robot.lower) / (robot.upper - robot.lower)
        np.testing.assert_allclose([position[time] for time in times], expected, atol=1e-6)
        velocity = rows.at(f"/plan/joints/{arm}/velocity", "Scalars:scalars", "plan time")
        assert np.abs(list(velocity.values())).max() <= 1 + 1e-9
        limits = rows.at(f"/plan/joints/{arm}/velocity/limits", "Scalars:scalars", "plan time")
        assert list(limits.values()) == [[1.0, -1.0]] * 2
