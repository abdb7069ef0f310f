"""Faults to plant in a robot folder, each of them really wrong, for the attack on its contract test."""

from __future__ import annotations

import re
from collections.abc import Callable
from typing import Any

import numpy as np
from attack_covers import beyond_spheres, is_inside, surface_points

from mmp_env.importing.pieces import Piece

Files = dict[str, Any]
"""Contents of a robot folder: `robot`, `spheres` and `hulls` as JSON values, and the text `mjcf`."""
_UNCOVERED_M = 1e-6
_POINTS = 4000
_TRIES = 200


def change_sphere(change: Callable[[list[Any], int, np.random.Generator], None]) -> Callable[..., bool]:
    """Returns a fault that changes a random sphere so that a point of the surface becomes uncovered."""

    def fault(files: Files, random: np.random.Generator) -> bool:
        for _ in range(_TRIES):
            by_link = files["spheres"][str(random.choice(sorted(files["robot"]["protrusion_mm"])))]
            link = str(random.choice(sorted(by_link)))
            before = by_link[link]
            rows = [list(row) for row in before]
            change(rows, int(random.integers(len(rows))), random)
            if rows and leaves_gap(files["hulls"][link], np.array(rows), random):
                by_link[link] = rows
                return True
        return False

    return fault


def leaves_gap(hulls: list[Any], rows: np.ndarray, random: np.random.Generator) -> bool:
    """Returns whether a sampled point of the surface lies outside all spheres."""
    pieces = [Piece(vertices=np.array(hull["vertices"]), radius=hull["radius"]) for hull in hulls]
    for k, piece in enumerate(pieces):
        points = surface_points(piece, _POINTS, random)
        open_ = beyond_spheres(points, rows[:, :3], rows[:, 3]) > _UNCOVERED_M
        for other in pieces[:k] + pieces[k + 1 :]:
            thick = Piece(vertices=other.vertices, radius=other.radius)
            open_ &= ~is_inside(points, thick)
        if open_.any():
            return True
    return False


def shrink(rows: list[Any], k: int, random: np.random.Generator) -> None:
    """Makes the radius of a sphere smaller by 0.1 mm."""
    rows[k][3] -= 1e-4


def move(rows: list[Any], k: int, random: np.random.Generator) -> None:
    """Moves a sphere by 2 mm."""
    step = random.normal(size=3)
    rows[k][:3] = (np.array(rows[k][:3]) + 0.002 * step / np.linalg.norm(step)).tolist()


def drop(rows: list[Any], k: int, random: np.random.Generator) -> None:
    """Removes a sphere."""
    del rows[k]


def grow_sphere(files: Files, random: np.random.Generator) -> bool:
    """Lets a sphere protrude by more than 5 mm."""
    if "fine" not in files["robot"]["protrusion_mm"]:
        return False
    rows = any_value(files["spheres"]["fine"], random)
    rows[int(random.integers(len(rows)))][3] += 0.006
    return True


def bad_sphere(files: Files, random: np.random.Generator) -> bool:
    """Turns a radius negative."""
    rows = any_value(files["spheres"]["28"], random)
    rows[int(random.integers(len(rows)))][3] *= -1
    return True


def any_value(values: dict[str, Any], random: np.random.Generator) -> Any:
    """Returns a random value that is not empty."""
    return values[str(random.choice([key for key, value in sorted(values.items()) if value]))]


def move_vertex(files: Files, random: np.random.Generator) -> bool:
    """Pulls a vertex of a hull in by 0.5 mm, or lets it out."""
    hull = any_value(files["hulls"], random)[0]
    vertices = np.array(hull["vertices"])
    k = int(random.integers(len(vertices)))
    away = vertices[k] - vertices.mean(axis=0)
    size = np.linalg.norm(away)
    away = away / size if size > 0 else np.array([1.0, 0, 0])
    hull["vertices"][k] = (vertices[k] + float(random.choice([-5e-4, 5e-4])) * away).tolist()
    return True


def thin_hull(files: Files, random: np.random.Generator) -> bool:
    """Makes the radius of a hull smaller by 0.05 mm."""
    for link in sorted(files["hulls"]):
        for hull in files["hulls"][link]:
            if hull["radius"] > 1e-4:
                hull["radius"] -= 5e-5
                return True
    return False


def drop_hull(files: Files, random: np.random.Generator) -> bool:
    """Removes a hull."""
    any_value(files["hulls"], random).pop()
    return True


def grow_hull(files: Files, random: np.random.Generator) -> bool:
    """Makes a hull larger by 2 %."""
    hull = any_value(files["hulls"], random)[0]
    vertices = np.array(hull["vertices"])
    middle = vertices.mean(axis=0)
    hull["vertices"] = (middle + 1.02 * (vertices - middle)).tolist()
    hull["radius"] *= 1.02
    return True


def tested_pair(files: Files, random: np.random.Generator) -> list[str] | None:
    """Returns a pair of links that is tested, or None."""
    pairs = files["robot"].get("self_pairs_tested", [])
    ignored = {frozenset(p) for pairs_ in files["robot"]["self_collision_ignore"].values() for p in pairs_}
    pairs = [pair for pair in pairs if frozenset(pair) not in ignored]
    return pairs[int(random.integers(len(pairs)))] if pairs else None


def leave_out(reason: str | None, *, in_mjcf: bool) -> Callable[[Files, np.random.Generator], bool]:
    """Returns a fault that leaves out a pair that can touch, with a reason that does not hold, or without one."""

    def fault(files: Files, random: np.random.Generator) -> bool:
        pair = tested_pair(files, random)
        if pair is None:
            return False
        robot = files["robot"]
        for pairs in robot["self_collision_ignore"].values():
            pairs.append(pair)
        if reason is not None:
            robot["self_pairs_ignored"].append({"a": pair[0], "b": pair[1], "reason": reason})
        if in_mjcf:
            exclude = f'<exclude body1="{pair[0]}" body2="{pair[1]}"/></contact>'
            files["mjcf"] = files["mjcf"].replace("</contact>", exclude)
        return True

    return fault


def change_reason(files: Files, random: np.random.Generator) -> bool:
    """Gives an ignored pair another reason."""
    if not (pairs := files["robot"].get("self_pairs_ignored")):
        return False
    pair = pairs[int(random.integers(len(pairs)))]
    pair["reason"] = str(random.choice(sorted({"adjacent", "always", "never"} - {pair["reason"]})))
    return True


def lose_reason(files: Files, random: np.random.Generator) -> bool:
    """Removes the reason of an ignored pair."""
    if not (pairs := files["robot"].get("self_pairs_ignored")):
        return False
    del pairs[int(random.integers(len(pairs)))]
    return True


def test_neighbours(files: Files, random: np.random.Generator) -> bool:
    """Tests neighbours, which always touch."""
    robot = files["robot"]
    pair = next((p for p in robot.get("self_pairs_ignored", []) if p["reason"] == "adjacent"), None)
    if pair is None:
        return False
    robot["self_pairs_ignored"].remove(pair)
    for pairs in robot["self_collision_ignore"].values():
        pairs.remove([pair["a"], pair["b"]])
    return True


def rename(where: str) -> Callable[[Files, np.random.Generator], bool]:
    """Returns a fault that renames a link in one file."""

    def fault(files: Files, random: np.random.Generator) -> bool:
        links = files["robot"]["links"]
        k = int(random.integers(len(links)))
        if where == "robot":
            links[k] += "_"
            return True
        table = files["hulls"] if where == "hulls" else files["spheres"]["fine"]
        if not table.get(links[k]):
            return False
        table[links[k] + "_"] = table.pop(links[k])
        return True

    return fault


def change_joint(change: Callable[[dict[str, Any]], None]) -> Callable[[Files, np.random.Generator], bool]:
    """Returns a fault in a random joint of robot.json."""

    def fault(files: Files, random: np.random.Generator) -> bool:
        joints = files["robot"]["joints"]
        change(joints[int(random.integers(len(joints)))])
        return True

    return fault


def swap_limits(joint: dict[str, Any]) -> None:
    """Swaps the limits."""
    joint["lower"], joint["upper"] = joint["upper"], joint["lower"]


def move_origin(joint: dict[str, Any]) -> None:
    """Moves the joint by 0.5 mm."""
    joint["origin"]["xyz"][1] += 5e-4


def flip_axis(joint: dict[str, Any]) -> None:
    """Turns the axis around."""
    joint["axis"] = [-x for x in joint["axis"]]


def change_robot(key: str, change: Callable[[dict[str, Any]], None]) -> Callable[[Files, np.random.Generator], bool]:
    """Returns a fault in a value of robot.json, for robots that have the value."""

    def fault(files: Files, random: np.random.Generator) -> bool:
        if key not in files["robot"]:
            return False
        change(files["robot"])
        return True

    return fault


def move_flange(robot: dict[str, Any]) -> None:
    """Moves the flange by 0.5 mm."""
    robot["flange"]["xyz"][2] += 5e-4


def narrow_draw(robot: dict[str, Any]) -> None:
    """Draws the first joint from a tenth of its range, so that pairs seem never to touch."""
    low, high = robot["draw_limits"][0]
    robot["draw_limits"][0] = [low, low + 0.1 * (high - low)]


def understate(robot: dict[str, Any]) -> None:
    """Says that the spheres of a set protrude by 1 mm less than they do."""
    robot["protrusion_mm"][max(robot["protrusion_mm"])] -= 1.0


def far_home(robot: dict[str, Any]) -> None:
    """Puts `home` outside of the limits."""
    robot["home"][0] = robot["joints"][0]["upper"] + 0.1


def change_mjcf(pattern: str, change: Callable[[str], str]) -> Callable[[Files, np.random.Generator], bool]:
    """Returns a fault in a random place of the MJCF that matches a pattern."""

    def fault(files: Files, random: np.random.Generator) -> bool:
        found = list(re.finditer(pattern, files["mjcf"]))
        if not found:
            return False
        place = found[int(random.integers(len(found)))]
        text = files["mjcf"]
        files["mjcf"] = text[: place.start()] + change(place.group()) + text[place.end() :]
        return True

    return fault


def larger_first(text: str) -> str:
    """Adds 1 mm to the first number in a text."""
    return re.sub(r"-?\d[\d.e-]*", lambda number: f"{float(number.group()) + 1e-3:.9g}", text, count=1)


def lose_last_number(text: str) -> str:
    """Replaces the last number in quotes by 0.5."""
    return text[:-1].rpartition(" ")[0] + ' 0.5"'


FAULTS: dict[str, Callable[[Files, np.random.Generator], bool]] = {
    "sphere removed": change_sphere(drop),
    "sphere shrunk by 0.1 mm": change_sphere(shrink),
    "sphere moved": change_sphere(move),
    "sphere grown": grow_sphere,
    "radius negative": bad_sphere,
    "hull vertex moved": move_vertex,
    "hull thinner": thin_hull,
    "hull dropped": drop_hull,
    "hull grown": grow_hull,
    "pair left out": leave_out(None, in_mjcf=False),
    "pair left out everywhere": leave_out("never", in_mjcf=True),
    "pair said to overlap always": leave_out("always", in_mjcf=True),
    "reason changed": change_reason,
    "reason lost": lose_reason,
    "neighbours tested": test_neighbours,
    "link renamed in robot.json": rename("robot"),
    "link renamed in hulls.json": rename("hulls"),
    "link renamed in spheres.json": rename("spheres"),
    "limits swapped": change_joint(swap_limits),
    "limit widened": change_joint(lambda joint: joint.update(upper=joint["upper"] + 0.05)),
    "velocity zero": change_joint(lambda joint: joint.update(velocity=0.0)),
    "origin moved": change_joint(move_origin),
    "axis flipped": change_joint(flip_axis),
    "flange moved": change_robot("flange", move_flange),
    "draw limits narrowed": change_robot("draw_limits", narrow_draw),
    "protrusion understated": change_robot("protrusion_mm", understate),
    "home outside": change_robot("home", far_home),
    "set lost": lambda files, random: files["spheres"].pop("28") is not None,
    "MJCF geom moved": change_mjcf(r'<geom type="(sphere|capsule|box|cylinder)"[^>]*pos="[^"]*"', larger_first),
    "MJCF mesh changed": change_mjcf(
        r'<mesh name="[^"]*" vertex="[^"]*"', lambda t: t[:-1].rpartition(" ")[0] + ' 0.5"'
    ),
    "MJCF geom lost": change_mjcf(r"<geom type=[^>]*/>", lambda text: ""),
    "MJCF geom without contact": change_mjcf(r"<geom type=", lambda text: '<geom contype="0" conaffinity="0" type='),
    "MJCF range changed": change_mjcf(r'range="[^"]*"', larger_first),
    "MJCF exclude lost": change_mjcf(r"<exclude [^>]*/>", lambda text: ""),
    "MJCF servo lost": change_mjcf(r"<position [^>]*/>", lambda text: ""),
}
"""Kind of fault -> function that plants one and returns whether it could."""
