"""Geoms in a recording: meshes of imported robots have their faces."""

import mujoco
import numpy as np
import pytest

from mmp_env import ring_cell
from mmp_env.view.rerun.geoms import CellGeoms

TEXT = """
<mujoco>
  <asset><mesh name="m" vertex="0 0 0  0.2 0 0  0 0.3 0  0 0 0.4" inertia="convex"/></asset>
  <worldbody><body name="arm/link" pos="1 0 0"><joint/>
    <geom type="mesh" mesh="m" pos="0.1 0 0" quat="0.8 0 0.6 0" rgba="1 0 0 1"/>
    <geom type="mesh" mesh="m" pos="0 0 1" rgba="0 1 0 1"/>
  </body></worldbody>
</mujoco>
"""


class Stream:
    """Keeps what is logged."""

    def __init__(self):
        self.logged = {}

    def log(self, path, archetype, *, static):
        self.logged[path] = archetype


def test_meshes_are_drawn_by_their_faces_in_the_frame_of_their_body():
    pytest.importorskip("rerun")
    stream = Stream()
    CellGeoms(stream, ring_cell(2), mujoco.MjModel.from_xml_string(TEXT))
    (mesh,) = stream.logged.values()
    assert list(stream.logged) == ["/cell/arm/link/meshes"]
    points = np.array(mesh.vertex_positions.as_arrow_array().to_pylist())
    assert len(points) == 2 * 4 * 3
    corners = np.array([[0, 0, 0], [0.2, 0, 0], [0, 0.3, 0], [0, 0, 0.4]])
    turn = np.empty(9)
    mujoco.mju_quat2Mat(turn, np.array([0.8, 0, 0.6, 0]))
    placed = [corners @ turn.reshape(3, 3).T + np.array([0.1, 0, 0]), corners + np.array([0, 0, 1])]
    for part, expected in zip((points[:12], points[12:]), placed, strict=True):
        distances = np.linalg.norm(part[:, None] - expected, axis=-1)
        assert distances.min(axis=1).max() < 1e-6
        assert distances.min(axis=0).max() < 1e-6


def test_spaces_in_the_name_of_a_body_are_escaped():
    pytest.importorskip("rerun")
    stream = Stream()
    CellGeoms(stream, ring_cell(2), mujoco.MjModel.from_xml_string(TEXT.replace("arm/link", "obstacle/base geom 0")))
    assert list(stream.logged) == [r"/cell/obstacle/base\ geom\ 0/meshes"]
