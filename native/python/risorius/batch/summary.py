# SPDX-License-Identifier: MIT
"""The table of all jobs."""

from __future__ import annotations

import csv
import io
import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import risorius

from .files import replacing
from .jobs import Job, Plan
from .outcome import Outcome

_COLUMNS = (
    "frames", "seconds", "largest_move", "translation_unit", "largest_move_joint",
    "largest_move_frame", "correctives_fired", "correctives", "out_of_range", "not_finite",
    "missing_controls", "unmapped_curves", "mapping", "load_seconds", "evaluation_seconds",
    "job_seconds",
)  # fmt: skip


def rows(plan: Plan, outcomes: Mapping[str, Outcome], reused: set[str]) -> list[dict[str, Any]]:
    """A row a job, in the plan's order: done, kept (from an earlier run), failed or not done."""
    return [_row(job, outcomes.get(job.name), job.name in reused) for job in plan.jobs]


def _row(job: Job, outcome: Outcome | None, reused: bool) -> dict[str, Any]:
    state = "not done"
    if outcome is not None:
        state = "failed" if outcome.error else "kept" if reused else "done"
    return {
        "job": job.name,
        "state": state,
        "clip": str(job.clip),
        "character": str(job.character),
        "lod": job.lod,
        "error": outcome.error if outcome else "",
        "attempts": outcome.attempts if outcome else 0,
        **(outcome.facts if outcome else {}),
    }


def write(plan: Plan, table: list[dict[str, Any]]) -> None:
    """Write the summary in each form that is asked for. Raises: OSError."""
    for path in plan.summary:
        text = _as_csv(table) if path.suffix == ".csv" else _as_json(table)
        _put(path, text)


def _put(path: Path, text: str) -> None:
    with replacing(path) as file:
        file.write(text.encode())


def _as_csv(table: list[dict[str, Any]]) -> str:
    """Of lists of names how many there are; the names are in the JSON."""
    out = io.StringIO()
    keys = ["job", "state", "clip", "character", "lod", "error", "attempts", *_COLUMNS]
    writer = csv.writer(out, lineterminator="\n")
    writer.writerow(keys)
    for row in table:
        cells = (row.get(key, "") for key in keys)
        writer.writerow([len(c) if isinstance(c, list) else c for c in cells])
    return out.getvalue()


def _as_json(table: list[dict[str, Any]]) -> str:
    return json.dumps({"risorius": risorius.__version__, "jobs": table}, indent=1) + "\n"
