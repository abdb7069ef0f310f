"""Bounds that an arm keeps at every instant: the angle between a tool axis and the world's z axis."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, TypeAlias

import numpy as np
from jaxtyping import Float
from numpy.typing import ArrayLike

from mmp_env.argument_checks import as_numbers, number, refused
from mmp_env.errors import MmpError, UnknownNameError
from mmp_env.model.read_only import ReadOnly
from mmp_env.model.robot import frozen_array

LEAST_WITHIN_RAD, MOST_WITHIN_RAD = 1e-3, math.pi / 2
"""Smallest and largest bound [rad] of an angle."""
_ALLOWED = f"a number of radians from {LEAST_WITHIN_RAD:g} to {MOST_WITHIN_RAD:.6f}, a right angle"
_FORM = '{"upright": {"axis": [0, 0, 1], "within": 0.2}}'


@dataclass(frozen=True, kw_only=True, eq=False)
class Upright(ReadOnly):
    """Bounds the angle between a tool axis and the world's z axis.

    Attributes:
        axis: direction [3] in the tool frame, or in the flange's without a tool, of any length above 0.
        within: largest angle [rad], from 0.001 to a right angle.

    Raises:
        MmpError: for an axis that is not three finite numbers or is zero, and another bound.
    """

    axis: ArrayLike
    within: float

    def __post_init__(self) -> None:
        numbers = as_numbers(self.axis)
        if numbers is None or numbers.shape != (3,) or not np.isfinite(numbers).all() or not numbers.any():
            raise refused("the axis of an upright tool", self.axis, "3 finite numbers that are not all zero")
        object.__setattr__(self, "axis", frozen_array(numbers))
        bound = number("the bound of an upright tool", self.within, _ALLOWED)
        if not LEAST_WITHIN_RAD <= bound <= MOST_WITHIN_RAD:
            raise refused("the bound of an upright tool", self.within, _ALLOWED)
        object.__setattr__(self, "within", bound)

    @property
    def direction(self) -> Float[np.ndarray, "3"]:
        """The axis as a unit vector [3]."""
        axis = np.asarray(self.axis)
        scaled = axis / np.abs(axis).max()  # squares of tiny numbers would vanish
        return frozen_array(scaled / np.linalg.norm(scaled))

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Upright) and self.to_data() == other.to_data()

    def __hash__(self) -> int:
        return hash((tuple(np.asarray(self.axis).tolist()), self.within))

    def to_data(self) -> dict[str, Any]:
        """Returns the form of JSON: `{"upright": {"axis": [0, 0, 1], "within": 0.2}}`."""
        return {"upright": {"axis": np.asarray(self.axis).tolist(), "within": self.within}}


GivenKeep: TypeAlias = Mapping[str, Upright | Mapping[str, Any]]
"""Arm name -> a bound, as an object or in the form of JSON."""


def as_keep(given: Any, arms: Sequence[str], where: str = "keep") -> dict[str, Upright]:
    """Returns the bounds in the order of the arms.

    Args:
        given: arm name -> bound, an `Upright` or in the form of JSON; arms without a bound may be missing.
        arms: names of the arms of the cell.
        where: begin of the messages.

    Raises:
        MmpError: for anything else, or the name of no arm.
    """
    if not isinstance(given, Mapping):
        raise refused(where, given, f"an object of arm name -> {_FORM}")
    for name in given:
        if name not in arms:
            raise MmpError(f"{where}: {UnknownNameError('arm', str(name), arms)}")
    return {name: _as_upright(given[name], f"{where} of arm '{name}'") for name in arms if name in given}


def keep_to_data(keep: Mapping[str, Upright]) -> dict[str, Any]:
    """Returns the form of JSON of bounds."""
    return {name: bound.to_data() for name, bound in keep.items()}


def _as_upright(given: Any, where: str) -> Upright:
    if isinstance(given, Upright):
        return given
    fields = given.get("upright") if isinstance(given, Mapping) and set(given) == {"upright"} else None
    if not isinstance(fields, Mapping) or set(fields) != {"axis", "within"}:
        raise refused(where, given, _FORM)
    try:
        return Upright(axis=fields["axis"], within=fields["within"])
    except MmpError as error:
        raise MmpError(f"{where}: {error}") from None
