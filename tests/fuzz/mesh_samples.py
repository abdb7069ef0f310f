"""Small good mesh files of each format that trimesh reads: a box, and the parts of a file in glTF."""

from __future__ import annotations

import json
import struct
from typing import Any

import numpy as np
from support import small_arms

FIXTURES = ("box.obj", "box.off", "box.ply", "bytes.ply", "box.glb")
"""Files of a box that are obstacles of a cell."""
_SIZE = (0.1, 0.08, 0.06)
_GLTF = struct.Struct("<4sII")
_CHUNK = struct.Struct("<I4s")
_PLY = """ply
format {kind} 1.0
element vertex {vertices}
property float x
property float y
property float z
element face {faces}
property list uchar int vertex_indices
end_header
"""
_COLLADA = """<?xml version="1.0" encoding="utf-8"?>
<COLLADA xmlns="http://www.collada.org/2005/11/COLLADASchema" version="1.4.1">
  <asset><unit name="meter" meter="1"/><up_axis>Z_UP</up_axis></asset>
  <library_geometries><geometry id="box"><mesh>
    <source id="places"><float_array id="numbers" count="{numbers}">{vertices}</float_array>
      <technique_common><accessor source="#numbers" count="{count}" stride="3">
        <param name="X" type="float"/><param name="Y" type="float"/><param name="Z" type="float"/>
      </accessor></technique_common></source>
    <vertices id="corners"><input semantic="POSITION" source="#places"/></vertices>
    <triangles count="{triangles}"><input semantic="VERTEX" source="#corners" offset="0"/><p>{faces}</p></triangles>
  </mesh></geometry></library_geometries>
  <library_visual_scenes><visual_scene id="all"><node><instance_geometry url="#box"/></node></visual_scene>
  </library_visual_scenes>
  <scene><instance_visual_scene url="#all"/></scene>
</COLLADA>
"""


def boxes() -> dict[str, bytes]:
    """Returns name -> content of a file of a box in each format. The files `bytes.ply` and `box.glb` are binary."""
    vertices, faces = small_arms.box_mesh(_SIZE)
    return {
        "box.obj": (_rows(vertices, "v ") + _rows(faces + 1, "f ")).encode(),
        "box.off": (f"OFF\n{len(vertices)} {len(faces)} 0\n" + _rows(vertices) + _rows(faces, "3 ")).encode(),
        "box.ply": (ply_header("ascii", len(vertices), len(faces)) + _rows(vertices) + _rows(faces, "3 ")).encode(),
        "bytes.ply": _binary_ply(vertices, faces),
        "box.glb": _glb(vertices, faces),
        "box.dae": _COLLADA.format(
            numbers=vertices.size,
            count=len(vertices),
            triangles=len(faces),
            vertices=" ".join(map(str, vertices.ravel())),
            faces=" ".join(map(str, faces.ravel())),
        ).encode(),
    }


def ply_header(kind: str, vertices: int, faces: int) -> str:
    """Returns the header of a PLY file with these numbers of vertices and triangles."""
    return _PLY.format(kind=kind, vertices=vertices, faces=faces)


def parts_of_glb(content: bytes) -> tuple[Any, bytes]:
    """Returns the document and the binary part of a file in glTF. Raises `ValueError` or `struct.error`."""
    _, _, size = _GLTF.unpack_from(content)
    length, kind = _CHUNK.unpack_from(content, _GLTF.size)
    start = _GLTF.size + _CHUNK.size
    length_of_rest, kind_of_rest = _CHUNK.unpack_from(content, start + length)
    rest = start + length + _CHUNK.size
    if (kind, kind_of_rest) != (b"JSON", b"BIN\0") or size != len(content) or rest + length_of_rest != size:
        raise ValueError("the parts are other ones")
    return json.loads(content[start : start + length]), content[rest:]


def glb_of_parts(document: Any, binary: bytes) -> bytes:
    """Returns the file in glTF of a document and a binary part."""
    text = json.dumps(document).encode()
    text += b" " * (-len(text) % 4)
    chunks = _CHUNK.pack(len(text), b"JSON") + text + _CHUNK.pack(len(binary), b"BIN\0") + binary
    return _GLTF.pack(b"glTF", 2, _GLTF.size + len(chunks)) + chunks


def _glb(vertices: np.ndarray, faces: np.ndarray) -> bytes:
    numbers, places = faces.astype("<u4").tobytes(), vertices.astype("<f4").tobytes()
    low, high = vertices.min(axis=0).tolist(), vertices.max(axis=0).tolist()
    document = {
        "asset": {"version": "2.0"},
        "scene": 0,
        "scenes": [{"nodes": [0]}],
        "nodes": [{"name": "box", "mesh": 0, "translation": [0.0, 0.0, 0.1]}],
        "meshes": [{"name": "box", "primitives": [{"attributes": {"POSITION": 1}, "indices": 0, "mode": 4}]}],
        "accessors": [
            {"bufferView": 0, "componentType": 5125, "count": faces.size, "type": "SCALAR"},
            {"bufferView": 1, "componentType": 5126, "count": len(vertices), "type": "VEC3", "min": low, "max": high},
        ],
        "bufferViews": [
            {"buffer": 0, "byteOffset": 0, "byteLength": len(numbers)},
            {"buffer": 0, "byteOffset": len(numbers), "byteLength": len(places)},
        ],
        "buffers": [{"byteLength": len(numbers) + len(places)}],
    }
    return glb_of_parts(document, numbers + places)


def _binary_ply(vertices: np.ndarray, faces: np.ndarray) -> bytes:
    rows = b"".join(struct.pack("<B3i", 3, *face) for face in faces.tolist())
    return (
        ply_header("binary_little_endian", len(vertices), len(faces)).encode() + vertices.astype("<f4").tobytes() + rows
    )


def _rows(numbers: np.ndarray, before: str = "") -> str:
    return "".join(f"{before}{' '.join(map(str, row))}\n" for row in numbers.tolist())
