# SPDX-License-Identifier: MIT
"""The summary of a batch: a table with a row per job, as .csv or .json."""

from __future__ import annotations

import csv
import io
import json
from collections.abc import Callable, Iterator, Mapping
from typing import Any, TextIO

import risorius

from ..files.fileio import replacing
from .jobs import Plan
from .journal import Journal
from .outcome import Outcome

_COLUMNS = (
    "frames", "seconds", "largest_move", "translation_unit", "largest_move_joint",
    "largest_move_frame", "correctives_fired", "correctives", "out_of_range", "not_finite",
    "missing_controls", "unmapped_curves", "mapping", "load_seconds", "evaluation_seconds",
    "job_seconds",
)  # fmt: skip


Rows = Iterator[dict[str, Any]]


def rows(plan: Plan, outcomes: Mapping[str, Outcome], reused: set[str], journal: Journal) -> Rows:
    """A row for each job, in the order of the plan. The state of a job is "done" (by this run),
    "kept" (an earlier run finished it), "failed" or "not done".

    Args:
        plan: all jobs.
        outcomes: name of a job -> its result.
        reused: names of the jobs that an earlier run finished ("kept").
        journal: journal with the facts of finished jobs.
    """
    for job in plan.jobs:
        outcome = outcomes.get(job.name)
        state = "not done"
        if outcome is not None:
            state = "failed" if outcome.error else "kept" if job.name in reused else "done"
        yield {
            "job": job.name,
            "state": state,
            "clip": str(job.clip),
            "character": str(job.character),
            "lod": job.lod,
            "error": outcome.error if outcome else "",
            "attempts": outcome.attempts if outcome else 0,
            **(journal.facts(job.name) if outcome and not outcome.error else {}),
        }


def write(plan: Plan, table: Callable[[], Rows]) -> None:
    """Write the summary in each requested file format, row by row.

    Args:
        plan: plan with the paths of the summary.
        table: function that returns the rows from the first one on; called once per file.

    Raises:
        OSError: a file cannot be written.
    """
    for path in plan.summary:
        path.parent.mkdir(parents=True, exist_ok=True)
        with replacing(path) as file:
            text = io.TextIOWrapper(file, encoding="utf-8", newline="\n", write_through=True)
            (_write_csv if path.suffix == ".csv" else _write_json)(text, table())
            text.detach()


def _write_csv(file: TextIO, table: Rows) -> None:
    """Write the rows as .csv. A list of names is written as its length; the .json has the names."""
    keys = ["job", "state", "clip", "character", "lod", "error", "attempts", *_COLUMNS]
    writer = csv.writer(file, lineterminator="\n")
    writer.writerow(keys)
    for row in table:
        cells = (row.get(key, "") for key in keys)
        writer.writerow([len(c) if isinstance(c, list) else c for c in cells])


def _write_json(file: TextIO, table: Rows) -> None:
    file.write(f'{{"risorius": {json.dumps(risorius.__version__)}, "jobs": [')
    for index, row in enumerate(table):
        file.write(f"{',' if index else ''}\n{json.dumps(row)}")
    file.write("\n]}\n")
