"""The convex pieces of a link's collision geoms. Meshes are checked, and decomposed if they are far from convex."""

from __future__ import annotations

import numpy as np

from mmp_env.errors import MmpError
from mmp_env.importing.chain import Chain
from mmp_env.importing.chain_links import Link
from mmp_env.importing.pieces import Piece, geom_pieces, mesh_piece
from mmp_env.meshes.decomposition import check_mesh, decomposed, is_far_from_convex


def link_pieces(chain: Chain, link: Link, *, decompose: bool = True) -> tuple[Piece, ...]:
    """Returns the pieces of all collision geoms of a link, in its frame.

    Args:
        chain: The arm.
        link: One of its links.
        decompose: Whether a mesh that is far from convex becomes several pieces, instead of its hull.

    Raises:
        MmpError: if a mesh has no volume, is not closed, or is turned inside out.
    """
    model, data = chain.source.model, chain.data
    out: list[Piece] = []
    for geom in link.geoms:
        found = geom_pieces(model, data, int(geom), chain.base @ link.frame)
        if isinstance(found, Piece):
            out.append(found)
            continue
        mesh = int(model.geom_dataid[geom])
        name = model.mesh(mesh).name
        first = int(model.mesh_faceadr[mesh])
        faces = np.array(model.mesh_face[first : first + int(model.mesh_facenum[mesh])])
        try:
            check_mesh(found, faces)
            parts = decomposed(found, faces) if decompose and is_far_from_convex(found, faces) else [found]
            out += [mesh_piece(part) for part in parts]
        except MmpError as error:
            raise MmpError(f"{chain.source.path}: mesh '{name}' of link '{link.name}' {error}") from None
    return tuple(out)
