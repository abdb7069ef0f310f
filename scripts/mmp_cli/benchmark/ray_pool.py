"""Workers on a Ray cluster: an actor for each, which has a seat and its watch just as one on this machine."""

from __future__ import annotations

import logging
import socket
import sys
from collections import deque
from collections.abc import Generator, Iterable
from types import TracebackType
from typing import Any

from mmp_cli.benchmark.job import Answer, Failure, Job, Task
from mmp_cli.benchmark.pool import StartCheck
from mmp_cli.benchmark.worker_slot import TICK_S, Seat
from mmp_cli.machine import machine, version
from mmp_env.errors import MmpError
from mmp_env.files.paths import real_path

_PATIENCE_S = 10.0
_TRIES = 3
"""How often a task is begun whose machine is lost; that may well be the task's doing."""


class Remote:
    """What runs in an actor: one seat."""

    def __init__(self, job: Job, not_imported_from: str | None) -> None:
        sys.path[:] = [folder for folder in sys.path if folder != not_imported_from]
        self._seat = Seat(job)

    def version(self) -> str:
        """The version of mmp-env on this machine."""
        return version()

    def do(self, task: Task) -> Answer:
        """The answer."""
        from multiprocessing.connection import wait

        self._seat.give(task)
        while True:
            wait([self._seat.connection], timeout=TICK_S)
            answer = self._seat.look()
            if answer is not None:
                return answer


class RayPool:
    """As `Pool`, on the cluster at `address`; without a number of workers, one for each core of the cluster."""

    def __init__(self, job: Job, address: str, workers: int | None) -> None:
        self._ray = _connected(address)
        self._job = self._ray.put(job)
        # Ray lets its workers import from the folder in which we were started. That may be a checkout without a core,
        # and is none of their business unless it is ours.
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

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        for actor in self._actors:
            self._ray.kill(actor)
        self._ray.shutdown()

    def run(self, tasks: Iterable[Task]) -> Generator[tuple[Task, Answer]]:
        """Each task with its answer, in the order in which they come. Raises `MmpError` where none has ever started."""
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
                    message = f"{tries} times the machine that it ran on was lost to the cluster"
                    yield task, Failure(message=message, machine=machine())

    def _actor(self) -> Any:
        return self._kind.remote(self._job, self._not_imported_from)

    def _check(self, address: str) -> None:
        """Raises `MmpError` where the machines of the cluster have another mmp-env, or none."""
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
        """What an actor answered; None where it is lost."""
        try:
            return self._ray.get(reference)
        except self._ray.exceptions.RayActorError:
            return None


def _connected(address: str) -> Any:
    """The module `ray`, connected. Raises `MmpError`."""
    try:
        import ray
    except ImportError:
        raise MmpError("--ray needs the package Ray; get it with: pip install 'mmp-env[ray]'") from None
    _knock(address)
    try:
        ray.init(address=address, logging_level=logging.CRITICAL, log_to_driver=False)
    except Exception as error:  # of many kinds: no answer, another version of Ray or Python, a bad address
        told = str(error).strip().splitlines() or [type(error).__name__]
        raise MmpError(f"there is no way to the Ray cluster at {address}: {told[0]}") from None
    return ray


def _knock(address: str) -> None:
    """Raises `MmpError` where nobody is at `host:port`: Ray itself would go on trying for minutes."""
    host, _, port = address.rpartition("://")[2].rpartition(":")
    if not (host and port.isdigit()):
        return
    try:
        socket.create_connection((host.strip("[]"), int(port)), timeout=_PATIENCE_S).close()
    except (OSError, OverflowError) as error:
        raise MmpError(f"there is no way to the Ray cluster at {address}: {error}") from None
