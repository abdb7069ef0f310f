"""Workers on this machine: each has a seat, a seat has one task at a time, and answers come as they are ready."""

from __future__ import annotations

from collections import deque
from collections.abc import Generator, Iterable
from multiprocessing.connection import wait
from types import TracebackType

from mmp_cli.benchmark.job import Answer, Failure, Job, Task
from mmp_cli.benchmark.worker_slot import TICK_S, Seat
from mmp_env.errors import MmpError


class StartCheck:
    """Tells one worker that did not start, which costs its task, from none that can."""

    def __init__(self) -> None:
        self._has_any_started = False

    def __call__(self, answer: Answer) -> None:
        """Looks at an answer. Raises `MmpError` where no worker has started yet, and this one did not either."""
        if not isinstance(answer, Failure) or answer.started:
            self._has_any_started = True
        elif not self._has_any_started:
            raise MmpError(answer.message)


class Pool:
    """`workers` seats; a context, and no worker is left when it ends. The workers stay from one `run` to the next."""

    def __init__(self, job: Job, workers: int) -> None:
        self._job, self.workers = job, workers
        self._seats: list[Seat] = []
        self._check = StartCheck()

    def __enter__(self) -> Pool:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        for seat in self._seats:
            seat.close()

    def run(self, tasks: Iterable[Task]) -> Generator[tuple[Task, Answer]]:
        """Each task with its answer, in the order in which they come. Raises `MmpError` where none has ever started."""
        waiting = deque(tasks)
        while len(self._seats) < min(self.workers, len(waiting)):
            self._seats.append(Seat(self._job))
        busy: dict[Seat, Task] = {}
        idle = list(self._seats)
        while waiting or busy:
            while waiting and idle:
                seat = idle.pop()
                busy[seat] = waiting.popleft()
                seat.give(busy[seat])
            wait([seat.connection for seat in busy], timeout=TICK_S)
            for seat, task in list(busy.items()):
                answer = seat.look()
                if answer is None:
                    continue
                self._check(answer)
                del busy[seat]
                # The next task first: the worker plans while the one who asked is busy with the answer.
                if waiting:
                    busy[seat] = waiting.popleft()
                    seat.give(busy[seat])
                else:
                    idle.append(seat)
                yield task, answer
