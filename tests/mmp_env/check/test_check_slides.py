"""The checker's bounds on the motion of arms with slides, against dense samples of MuJoCo's kinematics."""

import numpy as np
import pytest
from support.rail_arms import gantry_mjcf, small_rail_mjcf
from support.small_arms import mjcf

from mmp_env.check.items import MotionSteps
from mmp_env.check.model import CellModel
from mmp_env.check.pairs import ChordDeviation
from mmp_env.check.reading import read_cell
from mmp_env.importing.robot_folder import ImportOptions, add_robot

TELESCOPE = mjcf(joint2='type="slide" range="-0.1 0.4"')
"""An arm whose slide is between two hinges."""
ARMS = {"rail": small_rail_mjcf(), "gantry": gantry_mjcf(), "telescope": TELESCOPE}


@pytest.fixture(scope="module", params=ARMS)
def model(tmp_path_factory, request):
    """Returns the checker's model of one arm with slides."""
    folder = tmp_path_factory.mktemp("slides")
    (folder / "arm.xml").write_text(ARMS[request.param])
    add_robot(folder / "arm.xml", folder, ImportOptions(name="arm"), cache=None, progress=lambda line: None)
    arm = {"name": "arm", "robot": str(folder / "arm"), "position": [0.1, 0.2, 0.3], "quaternion": [0.9, 0.1, 0.3, 0.2]}
    return CellModel(read_cell({"arms": [arm | {"tool": None}], "spheres": "28"}))


def limits(model):
    return model.cell.of_robots("lower"), model.cell.of_robots("upper")


def test_slides_come_from_the_mjcf(model):
    assert model.slides.any()
    assert (model.slides == model.cell.slides).all()


def test_no_ball_comes_farther_from_a_hinge_than_its_reach(model):
    rng, (lower, upper) = np.random.default_rng(1), limits(model)
    for body in range(2, model.mujoco.nbody):
        point, radius = rng.uniform(-0.2, 0.2, 3), 0.1
        reach = model.reaches(body, point[None], np.array([radius]))
        assert (reach[model.slides & model.moves(body)] == 1.0).all()
        for q in rng.uniform(lower, upper, (200, len(lower))):
            data = model.place(q)
            center = data.xpos[body] + data.xmat[body].reshape(3, 3) @ point
            for k in np.flatnonzero(model.moves(body) & ~model.slides):
                joint = data.joint(f"arm/joint{k + 1}")
                assert np.linalg.norm(np.cross(joint.xaxis, center - joint.xanchor)) + radius <= reach[k] + 1e-9


def test_a_point_deviates_from_its_chord_by_at_most_the_bound(model):
    rng, (lower, upper) = np.random.default_rng(2), limits(model)
    shares = np.linspace(0.0, 1.0, 41)
    for _ in range(60):
        first, second = sorted(rng.choice(np.arange(2, model.mujoco.nbody), 2, replace=False).tolist())
        point = rng.uniform(-0.2, 0.2, 3)
        start, end = rng.uniform(lower, upper, (2, len(lower)))
        poses = model.poses(shares, start + shares[:, None] * (end - start))
        world = poses.positions[:, second] + poses.rotations[:, second] @ point
        inside = np.einsum("mji,mj->mi", poses.rotations[:, first], world - poses.positions[:, first])
        reach = model.reaches(second, point[None], np.zeros(1))[None]
        move = np.abs(end - start)[None]
        step = MotionSteps(start=np.array([0]), end=np.array([1]), move=move, bend=np.zeros_like(move))
        none = np.zeros(reach.shape, dtype=bool)
        for path, common in ((world, none), (inside, model.moves(first)[None])):
            chord = path[0] + shares[:, None] * (path[-1] - path[0])
            bound = ChordDeviation(model, np.array([0]), reach, common).all(step)[0, 0]
            assert np.linalg.norm(path - chord, axis=1).max() <= bound + 1e-12
