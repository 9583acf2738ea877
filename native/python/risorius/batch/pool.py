# SPDX-License-Identifier: MIT
"""Runs jobs in worker processes on this machine, and survives the death of a worker."""

from __future__ import annotations

import contextlib
import dataclasses
import multiprocessing
import multiprocessing.connection
import os
import signal
import threading
from collections import Counter, OrderedDict, deque
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from ..base.errors import RisoriusError
from .jobs import Job
from .outcome import Outcome

if TYPE_CHECKING:
    from multiprocessing.connection import Connection
    from multiprocessing.context import SpawnProcess

Work = Callable[[Job], Outcome]
_READY = "ready"
_STOP_SECONDS = 5.0


class PoolError(RisoriusError, RuntimeError):
    """Workers cannot be started, or a cluster does not answer."""

    code = "pool"


def _serve(connection: Connection[object, object], work: Work) -> None:
    """The main loop of a worker: receives jobs and sends outcomes until the connection closes."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # the parent handles a terminal's Ctrl-C
    with contextlib.suppress(EOFError, BrokenPipeError, ConnectionResetError):
        connection.send(_READY)
        while True:
            job = connection.recv()
            assert isinstance(job, Job)
            try:
                outcome = work(job)
            except Exception as error:  # noqa: BLE001  a failing job must not end the others
                outcome = Outcome(job.name, f"{type(error).__name__}: {error}")
            connection.send(outcome)


@contextlib.contextmanager
def _ignoring_interrupts() -> Iterator[None]:
    """Processes that start in this context ignore Ctrl-C; without effect outside the main
    thread."""
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    before = signal.signal(signal.SIGINT, signal.SIG_IGN)
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, before)


class _Worker:
    """A worker process and its current job."""

    def __init__(self, work: Work) -> None:
        context = multiprocessing.get_context("spawn")  # the same method on every system
        self.connection, theirs = context.Pipe()
        self.process: SpawnProcess = context.Process(
            target=_serve, args=(theirs, work), daemon=True
        )
        with _ignoring_interrupts():
            self.process.start()
        theirs.close()
        self.job: Job | None = None
        self.ready = False
        self.last: Job | None = None

    def give(self, job: Job) -> None:
        self.job = self.last = job
        # A send fails if the worker has died, which _step notices.
        with contextlib.suppress(OSError):
            self.connection.send(job)

    def end(self) -> str:
        """Collect the exit status of a process that has died, and close the connection to it.

        Returns: the signal or exit code as text.
        """
        self.process.join()
        self.connection.close()
        code = self.process.exitcode or 0
        return f"signal {-code}" if code < 0 else f"exit code {code}"


def _face_of(job: Job) -> tuple[object, ...]:
    return (job.character, job.options.quaternions)


class _Queue:
    """Waiting jobs, grouped so that a worker's next job can reuse its loaded face and clip."""

    def __init__(self, jobs: Sequence[Job]) -> None:
        self._lines: dict[tuple[object, ...], OrderedDict[Path, deque[Job]]] = {}
        self._lengths: Counter[tuple[object, ...]] = Counter()
        for job in jobs:
            self.put(job)

    def put(self, job: Job) -> None:
        line = self._lines.setdefault(_face_of(job), OrderedDict())
        line.setdefault(job.clip, deque()).append(job)
        self._lengths[_face_of(job)] += 1

    def take(self, last: Job | None) -> Job | None:
        """Remove and return a worker's next job, or None if no job waits.

        Jobs with the face of `last` come first, and among them jobs with the clip of `last`. If no
        job with this face waits, the face with the most waiting jobs is next.
        """
        face = _face_of(last) if last else None
        if face is None or not self._lengths[face]:
            face, length = max(self._lengths.items(), key=lambda item: item[1])
            if not length:
                return None
        line = self._lines[face]
        clip = last.clip if last and last.clip in line else next(iter(line))
        job = line[clip].popleft()
        self._lengths[face] -= 1
        line.move_to_end(clip)  # the next worker starts with another clip
        if not line[clip]:
            del line[clip]
        return job


class Pool:
    """Runs jobs in processes of this machine.

    Args:
        work: function that runs a job: one that can be imported, or a functools.partial of such a
            function.
        workers: number of processes.
        attempts: number of workers that a job may kill before it counts as failed.
    """

    def __init__(self, work: Work, workers: int, attempts: int = 3) -> None:
        self._work, self._count, self._attempts = work, workers, attempts
        self._workers: list[_Worker] = []
        self._deaths: Counter[str] = Counter()
        self._false_starts = 0

    def results(self, jobs: Sequence[Job]) -> Iterator[Outcome]:
        """Outcomes as they arrive.

        Closing the iterator early, even by an exception, stops the workers.

        Raises:
            PoolError: worker processes end again and again before they are ready for a job.
            OSError: the system cannot start a process.
        """
        queue, left = _Queue(jobs), len(jobs)
        try:
            self._workers = [_Worker(self._work) for _ in range(min(self._count, left))]
            while left:
                for outcome in self._step(queue):
                    left -= 1
                    yield outcome
        finally:
            self._stop()

    def _step(self, queue: _Queue) -> Iterator[Outcome]:
        """Wait for messages or deaths of workers and handle them."""
        places = {id(w.connection): w for w in self._workers}
        ready = multiprocessing.connection.wait([w.connection for w in self._workers])
        for connection in ready:
            worker = places[id(connection)]
            try:
                message = worker.connection.recv()
            except (EOFError, OSError):
                yield from self._replace(worker, queue)
                continue
            if isinstance(message, Outcome):
                tries = self._deaths[message.name] + 1
                yield dataclasses.replace(message, attempts=tries)
            worker.ready = True
            worker.job = None
            self._feed(worker, queue)

    def _feed(self, worker: _Worker, queue: _Queue) -> None:
        if job := queue.take(worker.last):
            worker.give(job)

    def _replace(self, worker: _Worker, queue: _Queue) -> Iterator[Outcome]:
        """Replace a dead worker; its job is queued again, or fails after too many deaths."""
        how = worker.end()
        self._workers.remove(worker)
        self._false_starts = 0 if worker.ready else self._false_starts + 1
        if self._false_starts > 2 * self._count:
            raise PoolError(f"worker processes end before they have begun ({how})")
        if job := worker.job:
            self._deaths[job.name] += 1
            if self._deaths[job.name] >= self._attempts:
                count = self._deaths[job.name]
                yield Outcome(
                    job.name, f"given up: it has ended {count} workers ({how})", attempts=count
                )
            else:
                queue.put(job)
        self._workers.append(_Worker(self._work))

    def _stop(self) -> None:
        """Stop all workers. A worker that runs a job, or that is not yet ready for one, is killed;
        the caller must delete its partial files."""
        for worker in self._workers:
            worker.connection.close()
            if worker.job is not None or not worker.ready:
                worker.process.terminate()
        for worker in self._workers:
            worker.process.join(_STOP_SECONDS)
            if worker.process.is_alive():
                worker.process.kill()
                worker.process.join()
        self._workers = []


def default_workers() -> int:
    """The number of cores that this process may use."""
    if hasattr(os, "sched_getaffinity"):
        return max(1, len(os.sched_getaffinity(0)))
    return os.cpu_count() or 1
