"""Pictures of the cells of a report and of chosen instances, in the page and as files."""

from __future__ import annotations

from argparse import Namespace
from base64 import b64encode
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from jaxtyping import UInt8

from mmp_cli.benchmark.sources import Instances, read_sources
from mmp_cli.reporting.instance_choice import choose
from mmp_cli.reporting.sections import Section
from mmp_cli.reporting.settings import Settings, may_be_read, without_place
from mmp_env.errors import MmpError
from mmp_env.gym.instances import DEFAULT_TASK
from mmp_env.opengl import offscreen_backend
from mmp_env.wording import counted

WIDTH, HEIGHT = 400, 300


@dataclass(frozen=True, kw_only=True)
class ReportPicture:
    """A picture: the name of its file without suffix, its content `png`, and `inline`, a URL for the page."""

    name: str
    caption: str
    png: bytes
    inline: str
    width: int = WIDTH
    height: int = HEIGHT


@dataclass(frozen=True, kw_only=True)
class PictureSet:
    """Pictures by section; `lacking` has a sentence for each missing one."""

    pictures: Mapping[str, tuple[ReportPicture, ...]] = field(default_factory=dict)
    lacking: tuple[str, ...] = ()


def render_pictures(
    held: Sequence[Section], names: Sequence[str], settings: Settings | None, folder: Path
) -> PictureSet:
    """Renders pictures of each section whose cell is available; `names` are parts of the file names."""
    if settings is None:
        return PictureSet(lacking=("No pictures: without settings.json the cells are not known.",))
    try:
        offscreen_backend()
        sources, lacking = _open(settings, folder)
        taken = {
            section.name: tuple(_taken(section, name, sources[section.name]))
            for section, name in zip(held, names, strict=True)
            if section.name in sources
        }
    except MmpError as error:
        return PictureSet(lacking=(f"No pictures: {str(error).removeprefix('no picture can be made: ').rstrip('.')}.",))
    return PictureSet(pictures=taken, lacking=tuple(lacking))


def _open(settings: Settings, folder: Path) -> tuple[dict[str, Instances], list[str]]:
    """Returns the sources by the title of their cell, and sentences on those that are not available."""
    out: dict[str, Instances] = {}
    lacking = []
    for k, name in enumerate(settings.sources):
        asked = {"sources": [name], "source": name, "instance": None, "start": None, "goal": None}
        own = {key: getattr(settings, key) for key in ("count", "seed", "robot", "margin")}
        own["task"] = None if settings.task == DEFAULT_TASK else settings.task  # a file takes none
        if not may_be_read(name, folder):
            where = "it is neither in the current folder nor beside the results"
            lacking.append(f"No pictures of {without_place(name)}: {where}.")
            continue
        try:
            (source,) = read_sources(Namespace(**asked | own))
        except MmpError:  # its message may quote a foreign file
            lacking.append(f"No pictures of {without_place(name)}: it cannot be read here as a cell or instances.")
            continue
        if k < len(settings.digests) and source.digest != settings.digests[k]:
            lacking.append(f"No pictures of {without_place(name)}: it is not what it was when the benchmark was run.")
            continue
        out.setdefault(source.title, source)
    return out, lacking


def _taken(section: Section, name: str, source: Instances) -> Iterator[ReportPicture]:
    from mmp_env.view.offscreen_renderer import OffscreenRenderer

    cell = source.cell
    items = {item.name: k for k, item in enumerate(source.items)}
    with OffscreenRenderer(cell, WIDTH, HEIGHT) as renderer:
        at_home = renderer.picture({arm.name: arm.robot.home for arm in cell.arms})
        yield _report_picture(f"cell-{name}", f"The cell: {counted(len(cell.arms), 'arm')}.", at_home)
        for choice in choose(section):
            if choice.instance not in items:
                continue
            try:
                problem = source.problem(items[choice.instance])
            except MmpError:
                continue  # the task draws another instance by now
            image = renderer.picture(problem.start, problem.goal)
            yield _report_picture(f"{choice.kind}-{name}", choice.caption, image)


def _report_picture(name: str, caption: str, image: UInt8[np.ndarray, "h w 3"]) -> ReportPicture:
    from mmp_env.view.pictures import encoded

    inline = "data:image/webp;base64," + b64encode(encoded(image, "WEBP")).decode()
    return ReportPicture(name=name, caption=caption, png=encoded(image), inline=inline)
