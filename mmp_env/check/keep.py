"""Bounds on tool axes as the checker reads them, `keep` of a problem."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass
from typing import Any

import numpy as np
from jaxtyping import Float

from mmp_env.check.fields import UnreadableError, known, member, numbers, shown


@dataclass(frozen=True, kw_only=True, eq=False)
class CheckedUpright:
    """A unit vector `axis` [3] in the tool's frame stays `within` [rad] of the world's z axis."""

    axis: Float[np.ndarray, "3"]
    within: float


def read_keep(data: Any, arms: Collection[str]) -> dict[str, CheckedUpright]:
    """Returns arm name -> bound; none for a plan without `keep`. Raises `UnreadableError`."""
    if data is None:
        return {}
    known(data, arms, "keep")
    return {arm: _upright(bound, f"keep of arm '{arm}'") for arm, bound in data.items()}


def _upright(data: Any, where: str) -> CheckedUpright:
    known(data, ("upright",), where)
    bound = member(data, "upright", where)
    known(bound, ("axis", "within"), where)
    axis = numbers(member(bound, "axis", where), (3,), f"axis of {where}")
    length = float(np.linalg.norm(axis))
    if not 1e-6 < length < np.inf:
        raise UnreadableError(f"the axis of {where} is {shown(bound['axis'])}; it must be a direction")
    within = float(numbers(member(bound, "within", where), (), f"within of {where}"))
    if not 0 < within <= np.pi / 2:
        raise UnreadableError(f"within of {where} is {within:g}; it must be above 0 and at most a right angle [rad]")
    return CheckedUpright(axis=axis / length, within=within)
