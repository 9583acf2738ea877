# SPDX-License-Identifier: MIT
"""Runs jobs on an existing Dask cluster."""

from __future__ import annotations

import contextlib
import importlib
import logging
import uuid
from collections import deque
from collections.abc import Iterator, Sequence
from typing import Any

from .jobs import Job
from .outcome import Outcome
from .pool import PoolError, Work

_CONNECT_SECONDS = 10.0


class Cluster:
    """Runs jobs on the workers of a Dask scheduler.

    Every worker must find the files under the same paths and have this version of Risorius. If a
    worker dies, another worker runs its job; Dask gives the job up after more than
    `distributed.scheduler.allowed-failures` (default 3) dead workers. Dask also counts the death
    against other jobs of that worker. So each job that Dask gave up is tried once more, alone.

    Args:
        address: e.g. tcp://10.0.0.5:8786.
        work: function that runs a job: one that the workers can import, or a functools.partial of
            such a function.

    Raises:
        PoolError: the package `distributed` is missing, or no scheduler answers.
    """

    def __init__(self, address: str, work: Work) -> None:
        try:
            self._dask: Any = importlib.import_module("distributed")
        except ImportError as error:
            raise PoolError(
                "--scheduler needs the package distributed: pip install distributed"
            ) from error
        self._work, self.address = work, address
        # Dask logs lost connections with tracebacks; we report them in one sentence.
        logging.getLogger("distributed").setLevel(logging.CRITICAL)
        try:
            self._dask.comm.get_address_host_port(address)
            self._client: Any = self._dask.Client(
                address, timeout=_CONNECT_SECONDS, set_as_default=False, name="risorius-batch"
            )
        except (OSError, ValueError, TypeError) as error:
            raise PoolError(f"{address}: no Dask scheduler answers there: {error}") from error
        self._run = uuid.uuid4().hex[:8]

    def workers(self) -> dict[str, int]:
        """Address of each worker -> number of jobs that it runs at the same time.

        Raises:
            PoolError: the scheduler does not answer.
        """
        try:
            return dict(self._client.nthreads())
        except (OSError, ValueError) as error:
            raise self._gone() from error

    def _gone(self) -> PoolError:
        return PoolError(f"{self.address}: the scheduler has gone, or has cancelled the jobs")

    def results(self, jobs: Sequence[Job]) -> Iterator[Outcome]:
        """Outcomes as they arrive. Closing the iterator early cancels jobs that have not begun.

        Raises:
            PoolError: the scheduler does not answer, or has cancelled a job.
        """
        suspects: list[Job] = []
        try:
            yield from self._all(deque(jobs), suspects)
            for job in suspects:
                again: list[Job] = []
                yield from self._all(deque([job]), again)
                for _ in again:
                    yield Outcome(job.name, "given up: it ends every worker that it is given to")
        finally:
            with contextlib.suppress(Exception):  # the scheduler itself may have failed
                self._client.close(timeout=_CONNECT_SECONDS)

    def _all(self, waiting: deque[Job], suspects: list[Job]) -> Iterator[Outcome]:
        """Run jobs and yield their outcomes. About twice as many jobs are submitted as the workers
        can run at once, so that no worker waits.

        Args:
            waiting: the jobs; they are removed.
            suspects: gets the jobs that Dask gave up; these have no outcome.
        """
        running: dict[Any, Job] = {}
        finished = self._dask.as_completed(loop=self._client.loop)
        try:
            while waiting or running:
                room = 2 * sum(self.workers().values()) + 2 if waiting else 0
                while waiting and len(running) < room:
                    job = waiting.popleft()
                    future = self._submit(job)
                    running[future] = job
                    finished.add(future)
                future = next(finished)
                if future.status == "lost":  # the worker died; Dask runs the job again
                    finished.add(future)
                    continue
                job = running.pop(future)
                if outcome := self._outcome(future, job, suspects):
                    yield outcome
        finally:
            if running:
                self._client.cancel(list(running))

    def _submit(self, job: Job) -> Any:
        key = f"risorius-{self._run}-{uuid.uuid4().hex[:8]}-{job.name}"
        return self._client.submit(self._work, job, key=key, pure=False)

    def _outcome(self, future: Any, job: Job, suspects: list[Job]) -> Outcome | None:
        if future.status == "cancelled":
            raise self._gone()
        error = future.exception()
        if isinstance(error, self._dask.scheduler.KilledWorker):
            suspects.append(job)
            return None
        if error is not None:
            return Outcome(job.name, f"{type(error).__name__}: {error}")
        outcome = future.result()
        assert isinstance(outcome, Outcome)
        return outcome
