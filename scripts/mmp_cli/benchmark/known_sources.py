"""The sources in the settings of a benchmark, and what another start adds to them: sources, and instances of a file."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import zip_longest
from pathlib import Path
from typing import Any, NamedTuple

from mmp_env.errors import MmpError


class KnownSource(NamedTuple):
    """A source in settings.json; `digest`, `names` and `hashes` are those of `sources.Instances`.

    Settings of earlier versions have no digests, names or hashes; they are empty then.
    """

    source: str
    digest: str
    names: list[str]
    hashes: list[str]


COLUMNS = {"sources": "source", "digests": "digest", "names": "names", "hashes": "hashes"}
"""Key of settings.json that has a value for each source -> the field of `KnownSource`."""


def known_sources(settings: Mapping[str, Any]) -> list[KnownSource]:
    """Returns the sources of checked settings."""
    columns = [settings.get(key) or [] for key in COLUMNS]
    rows = zip_longest(*columns)
    return [KnownSource(source, digest or "", names or [], hashes or []) for source, digest, names, hashes in rows]


def columns_of(sources: Sequence[KnownSource]) -> dict[str, list[Any]]:
    """Returns the values of settings.json."""
    return {key: [getattr(source, field) for source in sources] for key, field in COLUMNS.items()}


def changed_sources(there: Sequence[KnownSource], here: Sequence[KnownSource]) -> list[str]:
    """Returns the sources of this start that have another content than those of the same name in the folder."""
    names = {old.source for old in there}
    out = []
    for source in here:
        at = _place(source, there)
        if source.source in names and (at is None or there[at].source != source.source):
            out.append(source.source)
    return out


def grown_sources(there: Sequence[KnownSource], here: Sequence[KnownSource], folder: Path) -> list[KnownSource]:
    """Returns the sources of a folder with new ones, and with files that have got further instances.

    Raises:
        MmpError: if instances of two sources have the same name.
    """
    out, new = list(there), []
    for source in here:
        at = _place(source, there)
        if at is None:
            new.append(len(out))
            out.append(source)
        elif len(source.hashes) > len(there[at].hashes):
            new.append(at)
            out[at] = source
    for k in new:
        others = [name for i, other in enumerate(out) if i != k for name in other.names]
        if twice := _shared(out[k].names, others):
            raise MmpError(
                f"{folder} already has instances '{twice}' of another cell or file than {out[k].source}; give the "
                "cell or the instances other names, or another folder (--out)"
            )
    return out


def _place(source: KnownSource, there: Sequence[KnownSource]) -> int | None:
    """Returns which source of a folder has the same instances, or the first of them, or further ones."""
    for k, old in enumerate(there):
        if old.digest == source.digest and old.names in (source.names, []):
            return k
    for k, old in enumerate(there):
        common = min(len(old.hashes), len(source.hashes))
        if common and old.hashes[:common] == source.hashes[:common]:
            return k
    return None


def _shared(names: Sequence[str], others: Sequence[str]) -> str | None:
    """Returns the first name that is among others too; one that ends with a slash stands for all that begin so."""
    whole, begins = set(others), tuple(other for other in others if other.endswith("/"))
    for name in names:
        if name in whole or name.startswith(begins) or (name.endswith("/") and any(o.startswith(name) for o in others)):
            return name
    return None
