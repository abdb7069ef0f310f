"""Where two arms touch: the deepest pair of spheres on their moving links."""

from __future__ import annotations

from collections.abc import Hashable
from dataclasses import dataclass
from weakref import WeakKeyDictionary

import numpy as np
from jaxtyping import Float

from mmp_env import core
from mmp_planners.planning_context import Path, PlanningContext


@dataclass(frozen=True, kw_only=True, eq=False)
class Contact:
    """Arms at an instant [steps]: the least distance of their surfaces [m], the point halfway between, and the links.

    `gap` is negative in contact. Links are those of the two spheres, the base is link 0.
    """

    instant: float
    gap: float
    point: Float[np.ndarray, "3"]
    links: tuple[int, int]


_ANSWERS: WeakKeyDictionary[PlanningContext, tuple[Hashable, tuple[Contact, ...]]] = WeakKeyDictionary()
"""The last question of each run with its answer: both arms, and several constraint kinds, ask the same in a row."""


def contacts(
    context: PlanningContext, a: int, path_a: Path, b: int, path_b: Path, instants: tuple[float, ...]
) -> tuple[Contact, ...]:
    """The contact of arms `a` and `b` at each of the instants; bases do not count, no path reaches another's."""
    question = (a, path_a, b, path_b, instants)
    asked, answer = _ANSWERS.get(context, (None, ()))
    if asked != question:
        answer = _contacts(context, a, path_a, b, path_b, instants)
        _ANSWERS[context] = question, answer
    return answer


def _contacts(
    context: PlanningContext, a: int, path_a: Path, b: int, path_b: Path, instants: tuple[float, ...]
) -> tuple[Contact, ...]:
    centers_a, radii_a, links_a = _moving_spheres(context, a, path_a, instants)
    centers_b, radii_b, links_b = _moving_spheres(context, b, path_b, instants)
    apart = centers_b[:, None, :, :] - centers_a[:, :, None, :]
    distance = np.linalg.norm(apart, axis=3)
    gaps = distance - radii_a[:, None] - radii_b[None, :]
    out = []
    for n, instant in enumerate(instants):
        s, t = np.unravel_index(int(np.argmin(gaps[n])), gaps[n].shape)
        gap = float(gaps[n, s, t])
        towards = apart[n, s, t] / max(float(distance[n, s, t]), 1e-9)
        point = centers_a[n, s] + (radii_a[s] + gap / 2) * towards
        out.append(Contact(instant=instant, gap=gap, point=point, links=(int(links_a[s]), int(links_b[t]))))
    return tuple(out)


def _moving_spheres(
    context: PlanningContext, arm: int, path: Path, instants: tuple[float, ...]
) -> tuple[Float[np.ndarray, "n s 3"], Float[np.ndarray, "s"], np.ndarray]:
    """Centres [m], radii [m] and links of the spheres that are not the base's."""
    q = np.array([path.at(k) for k in instants])
    centers, radii = context.model.spheres(context.names[arm], q)
    links = core.sphere_table(context.core, arm)[:, 0].astype(int)
    moving = links > 0
    return centers[:, moving], radii[moving], links[moving]
