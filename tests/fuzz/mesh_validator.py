"""Nonsense in mesh files: vertices that are not finite, and triangles with a vertex that there is not.

A file whose form is another one than that of the samples is not judged.
"""

from __future__ import annotations

import itertools
import math
import struct
from collections.abc import Iterable
from xml.etree import ElementTree

from fuzz import mesh_samples

_UINT32, _PLY_VERTEX, _PLY_FACE = 5125, struct.Struct("<3f"), struct.Struct("<B3i")
_COLLADA = "{http://www.collada.org/2005/11/COLLADASchema}"


def mesh_nonsense(suffix: str, content: bytes) -> list[str]:
    """Returns why no program may accept a mesh file."""
    try:
        vertices, indices, count = FORMATS[suffix](content)
    except (ValueError, TypeError, LookupError, AttributeError, struct.error, ElementTree.ParseError):
        return []
    out = [f"vertex {number}" for number in vertices if not math.isfinite(number)]
    return out + [f"a triangle with vertex {index} of {count}" for index in indices if not 0 <= index < count]


def parsed(text: str) -> float:
    """Returns the number that a text is, or NaN."""
    try:
        return float(text)
    except ValueError:
        return math.nan


_Mesh = tuple[Iterable[float], Iterable[int], int]
"""Coordinates of the vertices, indices of the triangles, and the number of vertices."""


def _obj(content: bytes) -> _Mesh:
    rows = [row.split() for row in content.decode("utf-8", "replace").splitlines()]
    vertices = [row for row in rows if row[:1] == ["v"]]
    words = [word for row in rows if row[:1] == ["f"] for word in row[1:]]
    indices = [int(word) - 1 for word in words if word.isdecimal()]
    return [parsed(word) for row in vertices for word in row[1:4]], indices, len(vertices)


def _off(content: bytes) -> _Mesh:
    rows = [row.split() for row in content.decode("ascii").splitlines()]
    if rows[0] != ["OFF"]:
        raise ValueError("not the form of the samples")
    return _in_rows(rows[2:], int(rows[1][0]), int(rows[1][1]))


def _ply(content: bytes) -> _Mesh:
    head, _, body = content.partition(b"end_header\n")
    words = head.decode("ascii").split()
    count, faces = (int(words[words.index(name) + 1]) for name in ("vertex", "face"))
    if head.decode() == mesh_samples.ply_header("ascii", count, faces).removesuffix("end_header\n"):
        return _in_rows([row.split() for row in body.decode("ascii").splitlines()], count, faces)
    if head.decode() != mesh_samples.ply_header("binary_little_endian", count, faces).removesuffix("end_header\n"):
        raise ValueError("not the form of the samples")
    end = count * _PLY_VERTEX.size
    corners = [_PLY_FACE.unpack_from(body, end + k * _PLY_FACE.size) for k in range(faces)]
    if any(corner[0] != 3 for corner in corners):
        raise ValueError("not the form of the samples")
    vertices = itertools.chain.from_iterable(_PLY_VERTEX.iter_unpack(body[:end]))
    return vertices, [index for corner in corners for index in corner[1:]], count


def _in_rows(rows: list[list[str]], count: int, faces: int) -> _Mesh:
    corners = [row[1 : int(row[0]) + 1] for row in rows[count : count + faces]]
    vertices = [parsed(word) for row in rows[:count] for word in row[:3]]
    return vertices, [int(word) for corner in corners for word in corner], count


def _glb(content: bytes) -> _Mesh:
    document, binary = mesh_samples.parts_of_glb(content)
    (mesh,) = document["meshes"]
    (drawn,) = mesh["primitives"]
    indices, places = (document["accessors"][k] for k in (drawn["indices"], drawn["attributes"]["POSITION"]))
    if (indices["componentType"], indices["type"], places["type"]) != (_UINT32, "SCALAR", "VEC3"):
        raise ValueError("not the form of the samples")
    start, far = (document["bufferViews"][each["bufferView"]]["byteOffset"] for each in (indices, places))
    numbers = struct.unpack_from(f"<{indices['count']}I", binary, start)
    return struct.unpack_from(f"<{3 * places['count']}f", binary, far), numbers, places["count"]


def _dae(content: bytes) -> _Mesh:
    root = ElementTree.fromstring(content)
    vertices, indices = (root.findtext(f".//{_COLLADA}{tag}", "").split() for tag in ("float_array", "p"))
    return [parsed(word) for word in vertices], [int(word) for word in indices], len(vertices) // 3


FORMATS = {".obj": _obj, ".off": _off, ".ply": _ply, ".glb": _glb, ".dae": _dae}
"""Suffix -> function that returns the mesh of a file."""
