"""Errors that say what was wrong, what is allowed, and the nearest match."""

from __future__ import annotations

import difflib
from collections.abc import Callable, Iterable, Sequence
from typing import Any

HOW_TO_ADD = {
    "robot": "docs/how-to/add-a-robot.md explains how to add another",
    "tool": "docs/how-to/add-a-tool.md explains how to add another",
}
"""End of the messages about unknown robots and tools."""
NO_MEMORY = "there is not enough memory"
_MISSPELLED = 0.8
"""Least similarity (`difflib` ratio) of a name and a probable misspelling of it."""


class MmpError(ValueError):
    """Misuse: a bad file, name, option or value. The message is one sentence for the user; `mmp` then exits with 2."""


class UnprovedPlanError(MmpError):
    """A plan cannot be proved clear of conflicts as it is, so it is not retimed."""


class MovedBodyWarning(UserWarning):
    """A held joint or a free body of a MuJoCo model is elsewhere than in the cell that was made from the model."""


class UnretimedPlanWarning(UserWarning):
    """An executed plan is not retimed: its velocity jumps at corners, which no motor can follow. See `retime`."""


def in_words(error: BaseException) -> str:
    """Returns the exception's type and text on one line; the text alone of an `MmpError`, which is a sentence.

    If reading the text raises as well, it says so.
    """
    try:
        text = " ".join(str(error).split())
    except BaseException:  # the class of another package may do anything
        return f"{type(error).__name__}, whose text cannot be read"
    if isinstance(error, MmpError):
        return text
    return f"{type(error).__name__}: {text}".rstrip(": ")


def is_out_of_memory(error: BaseException) -> bool:
    """Returns True also for the errors of MuJoCo and Pillow, which have no class for it.

    They are not imported: that is slow.
    """
    if isinstance(error, MemoryError):
        return True
    if isinstance(error, OSError):  # Pillow says this if zlib gets no memory
        return "codec configuration error" in str(error)
    return type(error).__name__ in ("FatalError", "ValueError") and "could not allocate" in str(error).lower()


def nearest(name: str, known: Sequence[str]) -> str | None:
    """Returns the name in `known` that is most similar to `name`, regardless of case, or None."""
    by_folded = {other.casefold(): other for other in known}
    close = difflib.get_close_matches(name.casefold(), by_folded, n=1, cutoff=0.4)
    return by_folded[close[0]] if close else None


def misspelled(name: str, known: Sequence[str]) -> str | None:
    """Returns the name in `known` that `name` probably misspells, or None.

    Names of products differ by their numbers: `fr3` is not a misspelled `fr5`, nor `ur3e` a `ur5e`.
    """
    asked = name.lower()
    same_number = [other for other in known if _digits(other) == _digits(asked)]
    close = difflib.get_close_matches(asked, same_number, n=1, cutoff=_MISSPELLED)
    return close[0] if close else None


class UnknownNameError(MmpError):
    """An unknown name. The message lists the known names, and the one that was probably meant.

    Args:
        kind: what the name names, for the message.
        name: the unknown name.
        known: all known names.
        suggest: finds the name that was probably meant.
        advice: end of the message.
    """

    def __init__(
        self,
        kind: str,
        name: object,
        known: Iterable[str],
        *,
        suggest: Callable[[str, Sequence[str]], str | None] = nearest,
        advice: str = "",
    ) -> None:
        names = sorted(known)
        meant = suggest(str(name), names)
        hint = f" Did you mean '{meant}'?" if meant else ""
        end = f". {advice}" if advice else ""
        super().__init__(f"unknown {kind} '{name}'.{hint} Known: {', '.join(names) or 'none'}{end}")
        self.kind, self.name, self.known = kind, name, names

    def __reduce__(self) -> tuple[Any, ...]:
        return _restored, (type(self), str(self)), vars(self)  # errors of worker processes are pickled


class UnknownArgumentError(UnknownNameError, TypeError):
    """A keyword that a function does not have; the message names the one that was probably meant."""


class InvalidInstanceError(MmpError):
    """A start or goal is out of limits, in collision, or closer than a margin: no planner can solve the instance."""


def _restored(error: type[UnknownNameError], message: str) -> UnknownNameError:
    return error.__new__(error, message)


def _digits(name: str) -> list[str]:
    return [character for character in name if character.isdigit()]
