"""The shapes and fine covers of all links; links of equal pieces share both, so each cover is fitted once."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from mmp_env.importing.cover_fit import Cover, CoverError, FitEffort, fit_cover
from mmp_env.importing.link_shape import LinkShape
from mmp_env.importing.pieces import Piece


def link_shapes(pieces: Sequence[tuple[Piece, ...]]) -> list[LinkShape | None]:
    """Returns the shape of each link, None for a link without pieces. Links of equal pieces share one shape."""
    made: dict[tuple[tuple[bytes, float], ...], LinkShape] = {}
    out = []
    for own in pieces:
        key = tuple((piece.vertices.tobytes(), piece.radius) for piece in own)
        if own and key not in made:
            made[key] = LinkShape(own)
        out.append(made.get(key))
    return out


def fine_covers(
    names: Sequence[str],
    shapes: Sequence[LinkShape | None],
    progress: Callable[[str], None],
    allowed: float,
    effort: FitEffort,
) -> list[Cover | None]:
    """Returns a proved cover of each link, whose spheres protrude by at most `allowed` [m].

    Raises:
        CoverError: if gaps remain, or a surface is too large for a proof.
    """
    made: dict[LinkShape, Cover] = {}
    for name, shape in zip(names, shapes, strict=True):
        if shape is None or shape in made:
            continue
        try:
            cover = made[shape] = fit_cover(shape, allowed, effort=effort)
        except CoverError as error:
            raise CoverError(f"link '{name}': {error}") from None
        progress(f"{name}: {len(cover.radii)} spheres, {cover.protrusion * 1e3:.1f} mm of protrusion, cover proved")
    return [made[shape] if shape is not None else None for shape in shapes]
