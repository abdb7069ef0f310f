"""The units that the settings of a folder stand for, whichever starts have enlarged them."""

from __future__ import annotations

from mmp_cli.benchmark.job import Key
from mmp_cli.benchmark.settings import Settings
from mmp_cli.benchmark.sources import DRAWN_COUNT


class KnownUnits:
    """The units of a folder, from its settings alone: no source is read.

    Settings of earlier versions do not have the names of instances. Any instance may be one of theirs.
    """

    def __init__(self, settings: Settings) -> None:
        names = settings.names or [[]]
        listed = [[name for name in of_source if not name.endswith("/")] for of_source in names]
        self._labels = {planner.label for planner in settings.planners}
        self._seed, self._is_named = settings.seed, all(names)
        self._listed = {name for of_source in listed for name in of_source[: settings.count]}
        self._drawn = {name for of_source in names for name in of_source if name.endswith("/")}
        count = DRAWN_COUNT if settings.count is None else settings.count
        self._drawn_seeds = range(settings.seed, settings.seed + count)

    def has(self, key: Key) -> bool:
        """Returns whether this instance, label and seed are those of a unit."""
        instance, label, seed = key
        if label not in self._labels:
            return False
        if not self._is_named:
            return True
        if instance in self._listed:
            return seed == self._seed
        return seed in self._drawn_seeds and any(instance == f"{begin}{seed}" for begin in self._drawn)
