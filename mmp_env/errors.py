"""Errors that say what was wrong, what is allowed and what comes nearest to what was asked for."""

from __future__ import annotations

import difflib
from collections.abc import Callable, Iterable, Sequence
from typing import Any

HOW_TO_ADD = "docs/how-to/add-a-robot.md explains how to add another"
"""Last words of the messages about unknown robots and tools."""
_MISSPELLED = 0.8
"""Least likeness (`difflib` ratio) of a name and what is probably a misspelling of it."""


class MmpError(ValueError):
    """Misuse: a bad file, name, option or value. The message is one sentence for the user; `mmp` exits with 2."""


class UnretimedPlanWarning(UserWarning):
    """A plan was executed that changes velocity at once at its corners, as no motor can; `mmp_env.retime` helps."""


def in_words(error: BaseException) -> str:
    """Returns the exception's type and text on one line; the text alone of an `MmpError`, which is a sentence.

    If reading the text raises as well, it says so.
    """
    try:
        text = " ".join(str(error).split())
    except BaseException:  # of a stranger's class: its text may do anything
        return f"{type(error).__name__}, whose text cannot be read"
    if isinstance(error, MmpError):
        return text
    return f"{type(error).__name__}: {text}".rstrip(": ")


def nearest(name: str, known: Sequence[str]) -> str | None:
    """Returns the name in `known` that is most like `name`, in capitals or not, or None where none is."""
    by_folded = {other.casefold(): other for other in known}
    close = difflib.get_close_matches(name.casefold(), by_folded, n=1, cutoff=0.4)
    return by_folded[close[0]] if close else None


def misspelled(name: str, known: Sequence[str]) -> str | None:
    """Returns the name in `known` that `name` probably misspells, or None.

    The names of products differ by their numbers: an `fr3` is no misspelled `fr5`, and a `ur3e` no `ur5e`.
    """
    asked = name.lower()
    same_number = [other for other in known if _digits(other) == _digits(asked)]
    close = difflib.get_close_matches(asked, same_number, n=1, cutoff=_MISSPELLED)
    return close[0] if close else None


class UnknownNameError(MmpError):
    """A name that is not registered; the message lists the names that are, and the one that was probably meant.

    `suggest` finds that one; the message ends with `advice`.
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
        return _restored, (type(self), str(self)), vars(self)  # worker processes hand their errors on


class UnknownArgumentError(UnknownNameError, TypeError):
    """A keyword that a function does not have; the message names the one that was probably meant."""


class InvalidInstanceError(MmpError):
    """A start or goal that is out of limits or in collision: the instance is `invalid`, no planner can solve it."""


def _restored(error: type[UnknownNameError], message: str) -> UnknownNameError:
    return error.__new__(error, message)


def _digits(name: str) -> list[str]:
    return [character for character in name if character.isdigit()]
