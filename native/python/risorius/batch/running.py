# SPDX-License-Identifier: MIT
"""Runs a batch: skips finished jobs, collects outcomes, reports progress."""

from __future__ import annotations

import contextlib
import dataclasses
import functools
import time
from collections.abc import Generator, Iterator, Sequence
from dataclasses import dataclass, field
from typing import Any

import risorius

from ..baking.progress import Progress, clock
from ..files import fileio
from ..files.locking import locked
from . import summary
from .cluster import Cluster
from .jobs import Job, Plan
from .journal import Journal
from .outcome import Outcome
from .pool import Pool, default_workers
from .work import run_job


@dataclass
class Report:
    """The result of a batch.

    Attributes:
        plan: the jobs.
        outcomes: job name -> outcome, without facts; a job that was not reached has none.
        reused: names of the jobs that an earlier run had finished.
        seconds: duration of this run.
        frames: number of frames that this run evaluated in jobs without error.
    """

    plan: Plan
    outcomes: dict[str, Outcome] = field(default_factory=dict)
    reused: set[str] = field(default_factory=set)
    seconds: float = 0.0
    frames: int = 0

    def failed(self) -> list[Outcome]:
        """Outcomes of failed jobs, in the plan's order."""
        out = [self.outcomes.get(job.name) for job in self.plan.jobs]
        return [outcome for outcome in out if outcome and outcome.error]

    def facts(self) -> dict[str, Any]:
        """The result of the batch as plain values, which json.dumps accepts."""
        failed = self.failed()
        return {
            "jobs": len(self.plan.jobs),
            "done": len(self.outcomes) - len(self.reused) - len(failed),
            "kept": len(self.reused),
            "failed": [{"job": f.name, "error": f.error, "attempts": f.attempts} for f in failed],
            "not_done": len(self.plan.jobs) - len(self.outcomes),
            "frames": self.frames,
            "seconds": self.seconds,
            "summary": [str(path) for path in self.plan.summary],
        }


def pending(plan: Plan, journal: Journal, report: Report) -> list[Job]:
    """The jobs of a plan that are not finished.

    Args:
        plan: all jobs.
        journal: journal of earlier runs.
        report: report to which the jobs that an earlier run finished are added.
    """
    out = []
    for job in plan.jobs:
        if journal.is_done(job):
            report.outcomes[job.name] = Outcome(job.name)
            report.reused.add(job.name)
        else:
            out.append(job)
    return out


def run(plan: Plan, *, workers: int | None, scheduler: str | None, restart: bool) -> Report:
    """Run all unfinished jobs of a plan and write the summary.

    Args:
        plan: all jobs, and the folder of the outputs.
        workers: number of processes; None for one per core.
        scheduler: address of a Dask scheduler to use instead of processes; None for none.
        restart: True: run finished jobs again.

    Raises:
        LockedError: another batch works in the output folder.
        PoolError: worker processes end before they are ready for a job, or the cluster does not
            answer.
        OSError: the output folder cannot be written.
        KeyboardInterrupt: the workers were stopped; finished jobs are in the journal.
    """
    for path in plan.summary:
        fileio.check_writable(path, parents=True)
    plan.output.mkdir(parents=True, exist_ok=True)
    with locked(plan.output):
        return _run(plan, workers, scheduler, restart)


def _run(plan: Plan, workers: int | None, scheduler: str | None, restart: bool) -> Report:
    report, journal = Report(plan), Journal(plan.journal)
    if not restart:
        journal.read()
    jobs = pending(plan, journal, report)
    journal.begin(job.name for job in plan.jobs if job.name in report.reused)
    folders = {path.parent for job in plan.jobs for _, path in job.outputs}
    progress = Progress(len(plan.jobs), "jobs", before=len(report.reused))
    if report.reused:
        progress.say(f"{len(report.reused):,} of {len(plan.jobs):,} jobs are done already")
    started = time.monotonic()
    try:
        with contextlib.closing(_results(jobs, workers, scheduler, progress)) as results:
            _gather(results, jobs, report, journal, progress)
    finally:
        progress.close()
        fileio.sweep(folders)  # temporary files of killed workers
        report.seconds = time.monotonic() - started
        summary.write(plan, lambda: summary.rows(plan, report.outcomes, report.reused, journal))
    return report


def _results(
    jobs: Sequence[Job], workers: int | None, scheduler: str | None, progress: Progress
) -> Generator[Outcome, None, None]:
    """Run jobs in processes of this machine or on a cluster, and yield their outcomes as they
    arrive."""
    if not jobs:
        return
    if scheduler is None:
        count = workers or default_workers()
        threads = max(1, count // len(jobs))  # few jobs get several threads
        yield from Pool(functools.partial(run_job, threads=threads), count).results(jobs)
        return
    cluster = Cluster(scheduler, functools.partial(run_job, version=risorius.__version__))
    if not cluster.workers():
        progress.say(f"{scheduler}: waiting for workers, there are none")
    yield from cluster.results(jobs)


def _gather(
    results: Iterator[Outcome],
    jobs: Sequence[Job],
    report: Report,
    journal: Journal,
    progress: Progress,
) -> None:
    by_name = {job.name: job for job in jobs}
    failed = 0
    for outcome in results:
        if outcome.error:
            failed += 1
            progress.say(f"{outcome.name}: {outcome.error}")
        else:
            # The journal is written first, so that after Ctrl-C it contains all jobs of the report.
            journal.add(by_name[outcome.name], outcome)
            report.frames += int(outcome.facts.get("frames", 0))
        report.outcomes[outcome.name] = dataclasses.replace(outcome, facts={})
        note = f"{failed:,} failed" if failed else ""
        progress.update(len(report.outcomes), report.frames, note)


def closing_line(report: Report) -> str:
    """The last line of a batch, e.g. "120 jobs: 100 done, 19 done before, 1 failed; ..."."""
    facts = report.facts()
    words = [f"{facts['done']:,} done"]
    words += [f"{facts['kept']:,} done before"] if facts["kept"] else []
    words += [f"{len(facts['failed']):,} failed"] if facts["failed"] else []
    words += [f"{facts['not_done']:,} not done"] if facts["not_done"] else []
    speed = f"{report.frames / report.seconds:,.0f} frames/s" if report.seconds else ""
    return (
        f"{facts['jobs']:,} jobs: {', '.join(words)}; {report.frames:,} frames in "
        f"{clock(report.seconds)}, {speed}"
    )
