"""The convex pieces of a link's collision geoms. Meshes are checked, and decomposed if they are far from convex.

A mesh that is open or inverted has no inside, so that it cannot be decomposed: its convex hull stands for it.
"""

from __future__ import annotations

import numpy as np

from mmp_env.errors import MmpError
from mmp_env.importing.chain import Chain
from mmp_env.importing.chain_links import Link
from mmp_env.importing.pieces import Piece, geom_pieces, mesh_piece
from mmp_env.meshes.decomposition import decomposed, is_far_from_convex, mesh_fault


def link_pieces(chain: Chain, link: Link) -> tuple[Piece, ...]:
    """Returns the pieces of all collision geoms of a link, in its frame. Raises `MmpError`, see `pieces_and_notes`."""
    return pieces_and_notes(chain, link)[0]


def pieces_and_notes(chain: Chain, link: Link) -> tuple[tuple[Piece, ...], list[str]]:
    """Returns the pieces of all collision geoms of a link, in its frame, and a note on each mesh that has a fault.

    Args:
        chain: The arm.
        link: One of its links.

    Raises:
        MmpError: if a mesh has no volume.
    """
    model, data = chain.source.model, chain.data
    out: list[Piece] = []
    notes: list[str] = []
    for geom in link.geoms:
        found = geom_pieces(model, data, int(geom), chain.base @ link.frame)
        if isinstance(found, Piece):
            out.append(found)
            continue
        mesh = int(model.geom_dataid[geom])
        label = f"mesh '{model.mesh(mesh).name}' of link '{link.name}'"
        first = int(model.mesh_faceadr[mesh])
        faces = np.array(model.mesh_face[first : first + int(model.mesh_facenum[mesh])])
        try:
            fault = mesh_fault(found, faces)
            far = is_far_from_convex(found, faces)
            out += [mesh_piece(part) for part in (decomposed(found, faces) if far and not fault else [found])]
        except MmpError as error:
            raise MmpError(f"{chain.source.path}: {label} {error}") from None
        if fault:
            notes.append(f"{label} {fault}. Its convex hull stands for it" + (", which is far from it" if far else ""))
    return tuple(out), notes
