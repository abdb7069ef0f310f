"""Makes a cell of a whole compiled MuJoCo model."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from jaxtyping import Float
from numpy.typing import ArrayLike

from mmp_env.argument_checks import as_numbers, given
from mmp_env.errors import MmpError
from mmp_env.importing.finite import require_finite_model
from mmp_env.importing.scene.arm_chain import PlacedArm, place_chain
from mmp_env.importing.scene.constraints import refuse_constraints, refuse_shapes
from mmp_env.importing.scene.contact_filter import colliding_geoms
from mmp_env.importing.scene.model_arms import find_arms
from mmp_env.importing.scene.scene_obstacles import pose_quaternion, scene_obstacles, unmoved_geoms
from mmp_env.importing.scene.scene_robot import scene_robot
from mmp_env.importing.scene.standing_contacts import contacts_to_allow
from mmp_env.model.arm import Arm
from mmp_env.model.cell import Cell
from mmp_env.model.model_joints import ModelJoints
from mmp_env.model.names import NAMES, is_name
from mmp_env.model.robot import EXACT, frozen_array
from mmp_env.mujoco_import import mujoco
from mmp_env.sim.model_tree import ModelTree


def cell_from_mujoco(
    model: Any,
    arms: Mapping[str, str | Sequence[str]] | None = None,
    *,
    qpos: ArrayLike | None = None,
    name: str | None = None,
) -> Cell:
    """Returns the cell of a compiled MuJoCo model: its arms, and all that no arm moves as obstacles.

    Joints of no arm are held at their value, and free bodies stand still. Fingers belong to the last link of their
    arm. Only geoms count that collide with an arm in MuJoCo.

    Args:
        model: A `mujoco.MjModel`.
        arms: Arm name -> the names of its joints from the base on, or a prefix of their names. None takes all serial
            chains of hinge and slide joints that are at least half as long as the longest one.
        qpos: Configuration of the model that gives the values of the held joints and the poses of free bodies, such as
            `data.qpos`; None: `model.qpos0`.
        name: Name of the cell; None: that of the model.

    Raises:
        MmpError: for anything that a cell cannot represent, such as height fields, flexible bodies or closed loops.
    """
    require_finite_model("the model", given("model", model, mujoco.MjModel, "a mujoco.MjModel"))
    tree, values = ModelTree(model), _configuration(model, qpos)
    found = find_arms(tree, arms)
    refuse_constraints(tree, found)
    collides = colliding_geoms(model)
    refuse_shapes(tree, collides.any(axis=1))
    placed = [place_chain(tree, arm, values, collides) for arm in found]
    cell_arms = tuple(_arm(each) for each in placed)
    data = mujoco.MjData(model)
    data.qpos[:] = values
    mujoco.mj_kinematics(model, data)
    moved = [int(geom) for each in placed for link in each.chain.links for geom in link.geoms]
    allowed = contacts_to_allow(tree, placed, values, unmoved_geoms(moved, collides), collides)
    around = np.mean([arm.position for arm in cell_arms], axis=0)
    return Cell(
        name=_name(name, placed[0].chain.source.title),
        arms=cell_arms,
        obstacles=scene_obstacles(tree, data, allowed, around),
        spheres=EXACT,
        joints=ModelJoints(
            names={arm.name: tuple(tree.joint_name(j) for j in arm.joints) for arm in found},
            addresses={arm.name: tuple(int(model.jnt_qposadr[j]) for j in arm.joints) for arm in found},
            qpos=frozen_array(values),
        ),
    )


def _arm(placed: PlacedArm) -> Arm:
    return Arm(
        name=placed.arm.name,
        robot=scene_robot(placed.chain),
        tool=None,
        position=frozen_array(placed.chain.base[:3, 3]),
        quaternion=pose_quaternion(placed.chain.base),
    )


def _name(asked: str | None, title: str) -> str:
    if asked is not None:
        if not (isinstance(asked, str) and is_name(asked)):
            raise MmpError(f"name is {asked!r}; the name of a cell must be {NAMES}")
        return asked
    name = "".join(c if c.isprintable() and c != "/" else "_" for c in title)[:80]
    return name if is_name(name) else "scene"


def _configuration(model: Any, qpos: ArrayLike | None) -> Float[np.ndarray, "nq"]:
    values = np.array(model.qpos0) if qpos is None else as_numbers(qpos)
    if values is None or values.shape != (model.nq,) or not np.isfinite(values).all():
        raise MmpError(f"qpos must be {model.nq} finite numbers, the configuration of the whole model, like data.qpos")
    return values
