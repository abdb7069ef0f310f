"""Tells which geoms of a model may touch each other, by the rules of MuJoCo."""

from __future__ import annotations

from typing import Any

import numpy as np
from jaxtyping import Bool, Int

from mmp_env.mujoco_import import mujoco


def colliding_geoms(model: Any) -> Bool[np.ndarray, "g g"]:
    """Returns which pairs of geoms collide: contact types and affinities, excluded bodies, parents, explicit pairs."""
    kind, affinity = model.geom_contype, model.geom_conaffinity
    one_way = (kind[:, None] & affinity[None, :]) != 0
    out = (one_way | one_way.T) & _bodies_collide(model)[np.ix_(model.geom_bodyid, model.geom_bodyid)]
    for first, second in zip(model.pair_geom1, model.pair_geom2, strict=True):  # stronger than every other rule
        out[first, second] = out[second, first] = True
    return out


def _bodies_collide(model: Any) -> Bool[np.ndarray, "b b"]:
    welded: Int[np.ndarray, "b"] = model.body_weldid
    out = welded[:, None] != welded[None, :]
    if not model.opt.disableflags & int(mujoco.mjtDisableBit.mjDSBL_FILTERPARENT):
        above = welded[model.body_parentid[welded]]
        # MuJoCo does not filter children of the world, so that they touch the floor.
        child = (above[:, None] == welded[None, :]) & (welded[:, None] != 0) & (welded[None, :] != 0)
        out &= ~(child | child.T)
    for signature in model.exclude_signature.tolist():
        first, second = signature >> 16, signature & 0xFFFF
        out[first, second] = out[second, first] = False
    return out
