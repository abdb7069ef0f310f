"""The clearance of a moving arm from a body: below that of all samples in between, and not far below."""

from dataclasses import replace

import numpy as np
import pytest
from reference import clearance, distance, toys

from mmp_env.errors import MmpError
from mmp_env.model.arm import Obstacle
from mmp_env.model.cell import Cell

SOLIDS = {
    "box": {"size": np.array([0.3, 0.2, 0.1])},
    "sphere": {"radius": 0.15},
    "cylinder": {"radius": 0.1, "length": 0.4},
    "capsule": {"radius": 0.1, "length": 0.3},
}


def solid(shape, rng):
    turn = rng.normal(size=4)
    place = rng.uniform([-0.6, -0.6, 0.1], [0.6, 0.6, 0.9])
    return Obstacle(name="body", shape=shape, position=place, quaternion=turn / np.linalg.norm(turn), **SOLIDS[shape])


def from_samples(cell, arm, body, rows):
    """Returns the clearance [m] of an arm from a body at each of some configurations."""
    out = []
    for q in rows:
        cloud = clearance.cloud(cell, arm, q).moving
        out.append(float((distance.to_obstacle(cloud.centers, body) - cloud.radii).min()))
    return np.array(out)


@pytest.mark.parametrize("shape", SOLIDS)
@pytest.mark.parametrize("robot", ["ur5e", "panda"])
def test_bounds_hold_between_the_rows_and_are_close(robot, shape):
    rng = np.random.default_rng(5)
    cell: Cell = toys.random_cell(rng, (robot,), "28")
    arm = cell.arms[0]
    ends = toys.random_configurations(rng, arm, 2)
    q = ends[0] + np.linspace(0.0, 0.1, 8)[:, None] * (ends[1] - ends[0])
    for _ in range(5):
        body = solid(shape, rng)
        bounds = cell.collision.swept_clearance(arm.name, q, body)
        for k, bound in enumerate(bounds):
            found = from_samples(cell, arm, body, q[k] + np.linspace(0, 1, 7)[:, None] * (q[k + 1] - q[k]))
            assert found.min() >= bound - 1e-9
            first, last = (clearance.cloud(cell, arm, q[i]).moving.centers for i in (k, k + 1))
            assert found.min() - bound <= 0.01 + np.linalg.norm(last - first, axis=1).max()


def test_a_row_that_stays_gives_the_clearance_itself_and_stray_lowers_it():
    rng = np.random.default_rng(6)
    cell = toys.random_cell(rng, ("ur5e",), "28")
    arm, body = cell.arms[0], solid("box", rng)
    q = toys.random_configurations(rng, arm, 1)
    still = cell.collision.swept_clearance(arm.name, np.repeat(q, 2, axis=0), body)
    assert still == pytest.approx(from_samples(cell, arm, body, q), abs=1e-9)
    strayed = cell.collision.swept_clearance(arm.name, np.repeat(q, 2, axis=0), body, stray=0.01)
    near = from_samples(cell, arm, body, q + 0.01 * rng.choice([-1, 1], size=(20, arm.dof)))
    assert strayed[0] <= near.min()
    assert strayed[0] < still[0] - 1e-4


def test_meshes_and_single_rows_are_refused():
    rng = np.random.default_rng(7)
    cell = toys.random_cell(rng, ("ur5e",), "28")
    arm, body = cell.arms[0], solid("box", rng)
    q = toys.random_configurations(rng, arm, 2)
    mesh = replace(body, shape="mesh", size=None, pieces=(np.eye(4)[:, :3],))
    for rows, given in ((q, mesh), (q[:1], body)):
        with pytest.raises(MmpError, match="two configurations or more, and any body but a mesh"):
            cell.collision.swept_clearance(arm.name, rows, given)
