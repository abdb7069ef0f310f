"""Films and pictures of a plan show all of its arms, large, and objects in a colour of their own."""

import dataclasses

import numpy as np
import pytest
from support.straight_plans import elsewhere, everyone, straight

from mmp_env import draw_problem, find_cell
from mmp_env.sim.arm_colors import arm_color
from mmp_env.sim.rendering import Camera
from mmp_env.sim.scene import compile_scene
from mmp_env.sim.scene_appearance import CAMERA, frame, outline
from mmp_env.sim.simulation import Simulation
from mmp_env.view.offscreen_renderer import plan_outline
from mmp_env.view.tree_drawing.colors import contrast
from mmp_tasks.grasping import solid_box


def sides(cell, points):
    """Returns left, right, bottom and top of a picture of 640 x 480 that shows the points."""
    camera = compile_scene(cell).camera(CAMERA)
    data = Simulation(cell).data.camera(CAMERA)
    return frame(points, np.array(camera.pos), data.xmat.reshape(3, 3), 4 / 3), data


def in_picture(cell, points, plan):
    """Returns the points in the picture of a plan, 0 to 1 from left and from below."""
    (left, right, bottom, top), data = sides(cell, plan_outline(plan))
    x, y, back = ((points - data.xpos) @ data.xmat.reshape(3, 3)).T
    return (x / -back - left) / (right - left), (y / -back - bottom) / (top - bottom)


@pytest.mark.parametrize("name", ["mixed-4", "ring-2", "ring-8"])
def test_the_arms_are_in_the_picture_from_start_to_goal_and_fill_it(name):
    cell = find_cell(name)
    plan = straight(cell, everyone(cell, "tucked"), elsewhere(cell))
    spheres = [
        cell.collision.spheres(arm, plan.sampled(np.linspace(0, plan.makespan_s, 25))[arm])[0].reshape(-1, 3)
        for arm in cell.arm_names
    ]
    across, up = in_picture(cell, np.concatenate(spheres), plan)
    assert min(across.min(), up.min()) >= 0
    assert max(across.max(), up.max()) <= 1
    assert max(np.ptp(across), np.ptp(up)) > 0.85
    whole, _ = sides(cell, outline(cell))
    near, _ = sides(cell, plan_outline(plan))
    assert near[1] - near[0] < 0.8 * (whole[1] - whole[0])


def test_arms_that_a_plan_does_not_move_are_in_its_picture():
    cell = find_cell("ring-4")
    plan = straight(cell, everyone(cell, "tucked"), elsewhere(cell), moved=["arm0"])
    still = [cell.collision.spheres(arm, plan.problem.start[arm][None])[0][0] for arm in cell.arm_names]
    for share in in_picture(cell, np.concatenate(still), plan):
        assert (share >= 0).all()
        assert (share <= 1).all()


def test_things_near_the_arms_are_in_the_picture_and_far_ones_are_not():
    def around(x):
        ring = find_cell("ring-2")
        box = solid_box("box", np.array([x, 0.0, 0.05]), (0.1, 0.1, 0.1), 0.0)
        cell = dataclasses.replace(ring, obstacles=(*ring.obstacles, box))
        return plan_outline(straight(cell, everyone(cell, "tucked"), elsewhere(cell)))

    assert len(around(0.0)) == len(around(9.0)) + 8


def test_objects_have_a_colour_that_no_arm_and_no_table_has():
    cell = find_cell("mixed-4")
    problems = [draw_problem(cell, task, seed=0) for task in ("pick", "place", "packing")]
    colors = {"arms": [arm_color(k) for k in range(8)], "held": [], "standing": [], "table": [], "others": []}
    for model in (compile_scene(problem.cell) for problem in problems):
        for geom in map(model.geom, range(model.ngeom)):
            owner, _, name = geom.name.rpartition("/")
            kind = name if name in ("held", "table") else "standing" if name.startswith("object-") else "others"
            if owner == "obstacle" or kind == "held":
                colors[kind].append(tuple(np.round(geom.rgba[:3], 3).tolist()))
    (color,) = {*colors["held"], *colors["standing"]}
    assert colors["held"]
    assert colors["standing"]
    (table,) = set(colors["table"])
    assert min(np.abs(np.array(color) - other).sum() for other in (*colors["arms"], *colors["others"])) > 0.3
    for other in (color, *colors["others"]):
        assert contrast(in_hex(other), in_hex(table)) > 2.5


def in_hex(rgba):
    return "#" + bytes(round(255 * part) for part in rgba[:3]).hex()


def test_a_camera_without_points_shows_all_that_the_arms_can_reach():
    cell = find_cell("ring-2")
    simulation = Simulation(cell)
    camera = Camera(simulation, 640, 480)
    np.testing.assert_allclose(camera._frame, sides(cell, outline(cell))[0])
    camera.close()
