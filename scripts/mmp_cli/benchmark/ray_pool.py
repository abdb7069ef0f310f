"""Workers on a Ray cluster: an actor for each, with a slot like that of a worker on this machine."""

from __future__ import annotations

import logging
import socket
import sys
from collections import deque
from collections.abc import Generator, Iterable
from typing import Any

from mmp_cli.benchmark.job import Answer, Failure, Job, Task
from mmp_cli.benchmark.pool import StartCheck
from mmp_cli.benchmark.worker_slot import TICK_S, WorkerSlot
from mmp_cli.machine import machine, version
from mmp_env.errors import MmpError
from mmp_env.files.paths import real_path

_PATIENCE_S = 10.0
_TRIES = 3
"""Number of tries for a task whose machine is lost; the task may be the cause."""


class Remote:
    """The code of an actor: one slot."""

    def __init__(self, job: Job, not_imported_from: str | None) -> None:
        sys.path[:] = [folder for folder in sys.path if folder != not_imported_from]
        self._slot = WorkerSlot(job)

    def version(self) -> str:
        """Returns the version of mmp-env on this machine."""
        return version()

    def do(self, task: Task) -> Answer:
        """Returns the answer to a task."""
        from multiprocessing.connection import wait

        self._slot.give(task)
        while True:
            wait([self._slot.connection], timeout=TICK_S)
            answer = self._slot.look()
            if answer is not None:
                return answer


class RayPool:
    """A `Pool` on the cluster at `address`; without a number of workers, it has one per core of the cluster."""

    def __init__(self, job: Job, address: str, workers: int | None) -> None:
        self._ray = _connected(address)
        self._job = self._ray.put(job)
        # Ray's workers also import from our current folder. That may be a checkout without a native core, so they skip
        # it unless it is on our own path.
        here = str(real_path("."))
        self._not_imported_from = None if here in sys.path else here
        cores = int(self._ray.cluster_resources().get("CPU", 1))
        self.workers = workers or max(cores, 1)
        self._kind = self._ray.remote(num_cpus=1, max_restarts=0)(Remote)
        self._actors: list[Any] = []
        self._check_start = StartCheck()
        self._check(address)

    def __enter__(self) -> RayPool:
        return self

    def __exit__(self, *_: object) -> None:
        for actor in self._actors:
            self._ray.kill(actor)
        self._ray.shutdown()

    def run(self, tasks: Iterable[Task]) -> Generator[tuple[Task, Answer]]:
        """Yields each task with its answer as they arrive. Raises `MmpError` if no worker can start."""
        waiting = deque((task, 1) for task in tasks)
        while len(self._actors) < min(self.workers, len(waiting)):
            self._actors.append(self._actor())
        idle, busy = list(self._actors), {}
        while waiting or busy:
            while waiting and idle:
                actor = idle.pop()
                task, tries = waiting.popleft()
                busy[actor.do.remote(task)] = actor, task, tries
            for reference in self._ray.wait(list(busy), num_returns=1)[0]:
                actor, task, tries = busy.pop(reference)
                answer = self._answer(reference)
                if answer is None:
                    self._actors.remove(actor)
                    actor = self._actor()
                    self._actors.append(actor)
                idle.append(actor)
                if answer is not None:
                    self._check_start(answer)
                    yield task, answer
                elif tries < _TRIES:
                    waiting.append((task, tries + 1))
                else:
                    message = f"the cluster lost the machine of the run {tries} times"
                    yield task, Failure(message=message, machine=machine())

    def _actor(self) -> Any:
        return self._kind.remote(self._job, self._not_imported_from)

    def _check(self, address: str) -> None:
        """Raises `MmpError` if the machines of the cluster have another version of mmp-env, or none."""
        first = self._actor()
        self._actors.append(first)
        try:
            there = self._ray.get(first.version.remote())
        except self._ray.exceptions.RayError as error:
            last = str(error).strip().splitlines()[-1]
            raise MmpError(f"the Ray cluster at {address} cannot run mmp-env: {last}") from None
        if there != version():
            raise MmpError(
                f"the Ray cluster at {address} has mmp-env {there}, this machine {version()}; they must agree"
            )

    def _answer(self, reference: Any) -> Answer | None:
        """Returns the answer of an actor, or None if its machine is lost."""
        try:
            return self._ray.get(reference)
        except self._ray.exceptions.RayActorError:
            return None


def _connected(address: str) -> Any:
    """Returns the module `ray`, connected. Raises `MmpError`."""
    try:
        import ray
    except ImportError:
        raise MmpError("--ray needs the package Ray; get it with: pip install 'mmp-env[ray]'") from None
    _check_reachable(address)
    try:
        ray.init(address=address, logging_level=logging.CRITICAL, log_to_driver=False)
    except Exception as error:  # of many kinds: no answer, another version of Ray or Python, a bad address
        lines = str(error).strip().splitlines() or [type(error).__name__]
        raise MmpError(f"the Ray cluster at {address} cannot be reached: {lines[0]}") from None
    return ray


def _check_reachable(address: str) -> None:
    """Raises `MmpError` if nothing answers at `host:port`: Ray itself would try for minutes."""
    host, _, port = address.rpartition("://")[2].rpartition(":")
    if not (host and port.isdigit()):
        return
    try:
        socket.create_connection((host.strip("[]"), int(port)), timeout=_PATIENCE_S).close()
    except (OSError, OverflowError) as error:
        raise MmpError(f"the Ray cluster at {address} cannot be reached: {error}") from None
