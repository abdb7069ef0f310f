"""Makes the pictures of docs/how-to/rerun.md: opens new recordings in a viewer without a display.

Needs a Vulkan driver; Mesa's runs on the processor: `apt-get install mesa-vulkan-drivers libvulkan1`.
"""

from __future__ import annotations

import argparse
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

import gymnasium
from PIL import Image
from rerun.experimental import ViewerClient

from mmp_cli.arguments import Parser
from mmp_cli.main import run_script
from mmp_env.view.rerun import RerunRecorder, RerunWatcher
from mmp_planners import make

FOLDER = Path(__file__).parent.parent / "docs" / "images"
WIDTH, COLORS, PORT = 1280, 256, 9911
TITLE_BAR = 38
"""Height [px] of the window's title bar, which is cropped."""
SEARCH, PLAN = ("apf-ecbs", "MultiArmCell-8", 3), ("apf-ecbs", "MultiArmCell-4", 2)
PICTURES = {
    "rerun-search.png": (SEARCH, "Search", {"timeline": "expansion", "sequence": 6}),
    "rerun-tree.png": (("ecbs", "MultiArmCell-8", 11), "Search", {"timeline": "expansion", "sequence": 46}),
    "rerun-repulsion.png": (PLAN, "Repulsion", {"timeline": "repulsion", "sequence": 15}),
    "rerun-plan.png": (SEARCH, "Plan", {"timeline": "plan time", "duration": 3.0}),
    "rerun-environment.png": (None, None, {"timeline": "step", "sequence": 50}),
}


def main() -> None:
    """Writes all pictures."""
    Parser("rerun_pictures.py", __doc__, argparse.RawDescriptionHelpFormatter).parse()
    beside = Path(sys.executable).parent / "rerun"
    with tempfile.TemporaryDirectory() as folder:
        viewer = ViewerClient.spawn(headless=True, port=PORT, hide_welcome_screen=True, executable_path=str(beside))
        try:
            for number, (name, (search, tab, moment)) in enumerate(PICTURES.items()):
                path = Path(folder) / f"{number}.rrd"
                if search is None:
                    record_episodes(path)
                else:
                    record_search(path, *search)
                shot = Path(folder) / "shot.png"
                take(viewer, path, tab, moment, shot)
                keep(shot, FOLDER / name)
        finally:
            viewer.quit()


def record_search(path: Path, planner: str, source: str, seed: int) -> None:
    """Records a search and its plan."""
    env: Any = gymnasium.make(f"mmp_env:{source}")
    env.reset(seed=seed)
    problem = env.unwrapped.problem
    with RerunWatcher(problem, path) as watcher:
        watcher.show_plan(make(planner).plan(problem, seed=seed, watch=watcher).plan)


def record_episodes(path: Path) -> None:
    """Records two episodes of random actions."""
    made = gymnasium.make("mmp_env:MultiArmCell-4", control_mode="delta", terminate_on_contact=False)
    env = RerunRecorder(made, path)
    for seed in range(2):
        env.reset(seed=seed)
        env.action_space.seed(seed)
        for _ in range(60):
            env.step(env.action_space.sample())
    env.close()


def take(viewer: Any, path: Path, tab: str | None, moment: dict[str, Any], shot: Path) -> None:
    """Takes a screenshot of a recording at a tab and a moment."""
    viewer.open(str(path))
    time.sleep(3)  # the viewer does not report when it has drawn
    if tab is not None:
        blueprint = viewer.get_blueprint().blueprint
        parts = {key: part["ContainerBlueprint"] for key, part in blueprint.items() if key.startswith("/container")}
        (wanted,) = (key for key, part in parts.items() if part.get("display_name") == tab)
        for part in parts.values():
            if wanted in part["contents"]:
                part["active_tab"] = wanted
        viewer.set_blueprint(blueprint, "recording")
        time.sleep(1)
    viewer.set_time(**moment, play_state="paused")
    time.sleep(2)
    viewer.save_screenshot(str(shot))


def keep(shot: Path, path: Path) -> None:
    """Writes the screenshot, smaller and with fewer colours."""
    image = Image.open(shot).convert("RGB")
    image = image.crop((0, TITLE_BAR, image.width, image.height))
    image = image.resize((WIDTH, round(WIDTH * image.height / image.width)), Image.Resampling.LANCZOS)
    # Pillow's own palette loses the colours of small parts; cluster means keep them.
    image.quantize(COLORS, kmeans=4, dither=Image.Dither.NONE).save(path, optimize=True)
    print(f"{path.name}: {path.stat().st_size / 1e3:.0f} kB")


if __name__ == "__main__":
    run_script(main)
