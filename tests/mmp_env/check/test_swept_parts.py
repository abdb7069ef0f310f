"""The checker's swept volumes: quick tests of balls and boxes leave out nothing that is near."""

import numpy as np

from mmp_env.check.model import CellModel
from mmp_env.check.reading import read_cell
from mmp_env.check.schedule import _motions
from mmp_env.check.swept_parts import SweptParts, _overlapping
from tests.support.small_jobs import planned


def test_balls_overlap_if_their_distance_is_less_than_their_radii():
    rng = np.random.default_rng(0)
    a, b = (rng.uniform(-1, 1, (20, count, 3)) for count in (4, 7))
    reach, reach_b = rng.uniform(0, 0.5, (20, 4)), rng.uniform(0, 0.5, (20, 7))
    apart = np.linalg.norm(a[:, :, None] - b[:, None], axis=3)
    np.testing.assert_array_equal(_overlapping(a, reach, b, reach_b), apart < reach[:, :, None] + reach_b[:, None])
    touching = _overlapping(a, np.zeros((20, 4)), b[:, :1], apart[:, :1, 0] * (1 + 1e-12))
    assert touching[:, 0].all()


def test_windows_whose_boxes_are_apart_have_the_clearance():
    data = planned()
    cell = read_cell(data["cell"])
    motions = _motions(data, {arm.name: arm.dof for arm in cell.arms})
    volumes = SweptParts(CellModel(cell), motions)
    found = {True: 0, False: 0}
    for other in ("arm1", "arm2", "arm3"):
        ones, others = (
            [(arm, k, min(k + 40, len(motions[arm].controls) - 1), None) for k in range(0, 160, 40)]
            for arm in ("arm0", other)
        )
        for enough in (0.002, 0.1, 0.4):
            near = volumes.near(ones, others, enough)
            for i, one in enumerate(ones):
                for j, two in enumerate(others):
                    found[bool(near[i, j])] += 1
                    assert near[i, j] or volumes.clearance(one, two, enough) == enough
    assert min(found.values()) > 0
