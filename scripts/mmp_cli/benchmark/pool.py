"""Workers on this machine. Each has a slot with one task at a time; answers come as they are ready."""

from __future__ import annotations

from collections import deque
from collections.abc import Generator, Iterable
from multiprocessing.connection import wait

from mmp_cli.benchmark.job import Answer, Failure, Job, Task
from mmp_cli.benchmark.worker_slot import TICK_S, WorkerSlot
from mmp_env.errors import MmpError


class StartCheck:
    """Distinguishes a worker that did not start, which costs one task, from workers that cannot start at all."""

    def __init__(self) -> None:
        self._has_any_started = False

    def __call__(self, answer: Answer) -> None:
        """Raises `MmpError` if the answer is that of a worker that did not start, and no other one has started."""
        if not isinstance(answer, Failure) or answer.started:
            self._has_any_started = True
        elif not self._has_any_started:
            raise MmpError(answer.message)


class Pool:
    """`workers` slots; a context manager that ends all workers. They stay from one `run` to the next."""

    def __init__(self, job: Job, workers: int) -> None:
        self._job, self.workers = job, workers
        self._slots: list[WorkerSlot] = []
        self._check = StartCheck()

    def __enter__(self) -> Pool:
        return self

    def __exit__(self, *_: object) -> None:
        for slot in self._slots:
            slot.close()

    def run(self, tasks: Iterable[Task]) -> Generator[tuple[Task, Answer]]:
        """Yields each task with its answer as they arrive. Raises `MmpError` if no worker can start."""
        waiting = deque(tasks)
        while len(self._slots) < min(self.workers, len(waiting)):
            self._slots.append(WorkerSlot(self._job))
        busy: dict[WorkerSlot, Task] = {}
        idle = list(self._slots)
        while waiting or busy:
            while waiting and idle:
                slot = idle.pop()
                busy[slot] = waiting.popleft()
                slot.give(busy[slot])
            wait([slot.connection for slot in busy], timeout=TICK_S)
            for slot, task in list(busy.items()):
                answer = slot.look()
                if answer is None:
                    continue
                self._check(answer)
                del busy[slot]
                # Hand out the next task first: the worker plans while the caller handles the answer.
                if waiting:
                    busy[slot] = waiting.popleft()
                    slot.give(busy[slot])
                else:
                    idle.append(slot)
                yield task, answer
