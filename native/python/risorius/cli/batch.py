# SPDX-License-Identifier: MIT
"""risorius batch: many clips on many characters, on all cores or on a cluster."""

from __future__ import annotations

import argparse
import contextlib
import json
import signal
import sys
import threading
from collections.abc import Iterator
from pathlib import Path

from risorius.batch.jobs import Plan, read_jobs
from risorius.batch.journal import Journal
from risorius.batch.running import Report, closing_line, pending
from risorius.batch.running import run as run_plan

from .files import whole_number


def add_parser(subparsers: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    parser = subparsers.add_parser(
        "batch",
        help="many clips on many characters: baked files and statistics",
        description="Evaluates clips x characters x LODs from a JOBS.toml, writes .npz, .csv or "
        ".rzc files and a summary of all jobs. A finished job (same clip, DNA, options and "
        "version, files untouched) is skipped, so an interrupted batch continues. The exit code is "
        "1 if a job failed, 130 after an interrupt.",
    )
    parser.add_argument("jobs", type=Path, metavar="JOBS.toml", help="see docs/batch.md")
    where = parser.add_mutually_exclusive_group()
    where.add_argument(
        "--workers",
        type=whole_number(1, 1024),
        metavar="N",
        help="processes on this machine (default: one per core)",
    )
    where.add_argument(
        "--scheduler",
        metavar="ADDRESS",
        help="scheduler of a Dask cluster, e.g. tcp://host:8786; its workers need this version of "
        "risorius and must see the files at the same paths",
    )
    again = parser.add_mutually_exclusive_group()
    again.add_argument(
        "--resume", action="store_true", help="run the jobs that are not done yet (default)"
    )
    again.add_argument("--restart", action="store_true", help="run all jobs again")
    parser.add_argument("--dry-run", action="store_true", help="list the jobs, do none")
    parser.add_argument("--json", action="store_true", help="for a program")
    parser.set_defaults(func=run)


def run(args: argparse.Namespace) -> int:
    try:
        plan = read_jobs(args.jobs)
        if args.dry_run:
            return dry_run(plan, restart=args.restart, as_json=args.json)
        with terminated_as_interrupted():
            report = run_plan(
                plan, workers=args.workers, scheduler=args.scheduler, restart=args.restart
            )
    except KeyboardInterrupt:
        raise KeyboardInterrupt(
            "interrupted: finished files are kept, and the same command goes on from here"
        ) from None
    return tell(report, as_json=args.json)


def dry_run(plan: Plan, *, restart: bool, as_json: bool) -> int:
    """Print the jobs, and mark the finished ones. Returns the exit code 0.

    Args:
        plan: all jobs.
        restart: True: list finished jobs as not done.
        as_json: True: print JSON.
    """
    report, journal = Report(plan), Journal(plan.journal)
    if not restart:
        journal.read()
    pending(plan, journal, report)
    listed = [
        {
            "job": job.name,
            "state": "done" if job.name in report.reused else "to do",
            "clip": str(job.clip),
            "character": str(job.character),
            "lod": job.lod,
            "outputs": [str(path) for _, path in job.outputs],
        }
        for job in plan.jobs
    ]
    if as_json:
        print(json.dumps({"jobs": listed}, indent=2))
        return 0
    for row in listed:
        print(f"{row['state']:<5}  {row['job']}  ({row['clip']}, {row['character']})")
    print(f"{len(listed):,} jobs, {len(listed) - len(report.reused):,} to do")
    return 0


def tell(report: Report, *, as_json: bool) -> int:
    """Print the results of a batch. Returns the exit code, 1 if a job failed.

    Args:
        report: report of the batch.
        as_json: True: print JSON.
    """
    failed = report.failed()
    if as_json:
        print(json.dumps(report.facts(), indent=2))
    else:
        print(closing_line(report))
        print("\n".join(str(path) for path in report.plan.summary))
    if failed:
        print(
            f"risorius: {len(failed):,} of {len(report.plan.jobs):,} jobs failed:", file=sys.stderr
        )
        for outcome in failed:
            print(f"  {outcome.name}: {outcome.error}", file=sys.stderr)
    return 1 if failed else 0


@contextlib.contextmanager
def terminated_as_interrupted() -> Iterator[None]:
    """Make SIGTERM stop a batch as cleanly as Ctrl-C."""
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    before = signal.signal(signal.SIGTERM, signal.default_int_handler)
    try:
        yield
    finally:
        signal.signal(signal.SIGTERM, before)
