"""Rules for the names of cells, arms, obstacles, robots, tools and instances."""

NAMES = "1 to 100 printable characters without '/'"
"""Rule for names, which stand in paths such as `<cell>/<instance>` and `<arm>/joint1`, and in files."""
_LONGEST_NAME, _LONGEST_INSTANCE_NAME = 100, 250


def is_name(text: str) -> bool:
    """Returns whether the text may name a cell, an arm, an obstacle or an instance, see `NAMES`."""
    return 0 < len(text) <= _LONGEST_NAME and text.isprintable() and "/" not in text


INSTANCE_NAMES = f"names joined by '/', each {NAMES}; {_LONGEST_INSTANCE_NAME} characters at most"
"""Rule for the names of problems, such as `<cell>/<instance>`."""


def is_instance_name(text: str) -> bool:
    """Returns whether the text may name a problem, see `INSTANCE_NAMES`; it may be empty."""
    return not text or (len(text) <= _LONGEST_INSTANCE_NAME and all(map(is_name, text.split("/"))))
