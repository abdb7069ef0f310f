"""Episodes, schema `mmp-episode/1`: plans in a row, each from the end of the one before it."""

from __future__ import annotations

from dataclasses import dataclass
from os import PathLike
from pathlib import Path
from typing import Any

import msgspec

from mmp_env.brief import brief
from mmp_env.errors import MmpError
from mmp_env.files.cell_file import name_or_stem
from mmp_env.files.file_kinds import EPISODE, read_for
from mmp_env.files.plan_file import plan_from_dict, plan_to_dict
from mmp_env.files.reading import Location, decode_file
from mmp_env.files.writing import json_text, write_text
from mmp_env.model.plan import Plan
from mmp_env.wording import counted, in_seconds

EPISODE_SCHEMA = "mmp-episode/1"


class EpisodeData(msgspec.Struct, forbid_unknown_fields=True, kw_only=True):
    schema: str
    plans: list[Any]
    name: str | None = None


@dataclass(frozen=True, kw_only=True, eq=False)
class Episode:
    """Plans of the same arms in a row. Their cells may differ in obstacles and held objects.

    Attributes:
        name: name of the episode.
        plans: the plans, at least one.
    """

    name: str
    plans: tuple[Plan, ...]

    @brief
    def __repr__(self) -> str:
        return f"{self.name}: {counted(len(self.plans), 'plan')}, {in_seconds(self.makespan_s)}"

    @property
    def makespan_s(self) -> float:
        """Duration of all plans [s]."""
        return sum(plan.makespan_s for plan in self.plans)


def episode_to_dict(episode: Episode) -> dict[str, Any]:
    """Returns the episode in the form of `mmp-episode/1`, in dicts, lists and scalars."""
    return {
        "schema": EPISODE_SCHEMA,
        "name": episode.name,
        "plans": [plan_to_dict(plan) for plan in episode.plans],
    }


def episode_from_dict(data: Any, where: str | Location = "episode", *, name: str = "episode") -> Episode:
    """Returns the episode in a file's `data`. The checker, not this function, tests that its plans are right.

    Args:
        where: begin of the messages, such as the name of the file.
        name: name of the episode if the data has none.

    Raises:
        MmpError: for malformed data, with field and value.
    """
    place, decoded = decode_file(data, EPISODE_SCHEMA, EpisodeData, where)
    name = name_or_stem(decoded.name, name, place / "name")
    if not decoded.plans:
        raise MmpError(f"{place / 'plans'} is empty; an episode needs at least one plan")
    plans = tuple(plan_from_dict(plan, place / "plans" / k) for k, plan in enumerate(decoded.plans))
    return Episode(name=name, plans=plans)


def plans_from_dict(data: Any, where: str | Location, *, name: str = "episode") -> Plan | Episode:
    """Returns the episode or the plan in a file's `data`, by its schema. Raises `MmpError` like their readers."""
    in_a_row = isinstance(data, dict) and data.get("schema") == EPISODE_SCHEMA
    return episode_from_dict(data, where, name=name) if in_a_row else plan_from_dict(data, where)


def save_episode(episode: Episode, path: str | PathLike[str]) -> None:
    """Writes an episode file, the whole file or nothing. Raises `MmpError` if it cannot be written."""
    write_text(path, json_text(episode_to_dict(episode)))


def load_episode(path: str | PathLike[str]) -> Episode:
    """Reads an episode file, see `episode_from_dict`. Raises `MmpError` with file, field and value."""
    return episode_from_dict(read_for("load_episode", path, EPISODE), str(path), name=Path(path).stem)
