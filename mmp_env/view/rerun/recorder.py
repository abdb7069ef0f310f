"""Episodes of an environment as a recording: geoms, spheres, actions, rewards and contacts."""

from __future__ import annotations

from os import PathLike
from typing import Any

import gymnasium
import numpy as np

from mmp_env.errors import MmpError
from mmp_env.model.plan import Plan
from mmp_env.sim.execution import ExecutionReport
from mmp_env.sim.monitor import Monitor
from mmp_env.view.rerun.episodes import EpisodeLog
from mmp_env.view.rerun.sdk import Recording, check


class RerunRecorder(gymnasium.Wrapper[Any, np.ndarray, Any, np.ndarray]):
    """Records the episodes of a `MultiArmCell-*` environment, one after the other on the timeline `step`.

    The file is complete after `close`.

    Args:
        env: the environment; the wrapper does not change it.
        to: a file `*.rrd`, or `spawn` to open the viewer.

    Raises:
        MmpError: if rerun is not installed, if `to` cannot be written, if there is no display for the viewer, or if
            `env` is another kind of environment.
    """

    def __init__(self, env: gymnasium.Env[Any, np.ndarray], to: str | PathLike[str]) -> None:
        from mmp_env.gym.env import MultiArmCellEnv

        super().__init__(env)
        check(to)
        if not isinstance(env.unwrapped, MultiArmCellEnv):
            raise MmpError(f"RerunRecorder records MultiArmCell environments; {env} is none")
        name, self._to = env.unwrapped.cell.name, to
        self._recording: Recording | None = Recording(to, f"episodes of {name}", name)
        self._episodes = EpisodeLog(self._recording.stream, env.unwrapped)

    def reset(self, *, seed: int | None = None, options: dict[str, Any] | None = None) -> tuple[Any, dict[str, Any]]:
        observation, info = self.env.reset(seed=seed, options=options)
        if self._recording is not None:
            self._episodes.begin(info)
        return observation, info

    def step(self, action: np.ndarray) -> tuple[Any, float, bool, bool, dict[str, Any]]:
        observation, reward, terminated, truncated, info = self.env.step(action)
        if self._recording is not None:
            self._episodes.add(np.asarray(action, dtype=float), float(reward), info)
        return observation, float(reward), terminated, truncated, info

    def execute(self, plan: Plan | None, *, monitor: Monitor | None = None) -> ExecutionReport:
        """Executes as `env.unwrapped.execute`, and records 25 rows per second; `env.unwrapped` itself records none."""
        report = self.env.unwrapped.execute(plan, monitor=monitor)  # pyright: ignore[reportAttributeAccessIssue]
        if self._recording is not None:
            self._episodes.play(report)
        return report

    def close(self) -> None:
        """Completes the recording and closes the environment. Raises `MmpError` if the file cannot be written."""
        if self._recording is not None:
            recording, self._recording = self._recording, None
            try:
                recording.end(self._episodes.end())
            except OSError as error:
                raise MmpError(f"{self._to} cannot be written: {error.strerror}") from None
        super().close()
