# SPDX-License-Identifier: MIT
"""The result of a job."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any


@dataclass(frozen=True)
class Outcome:
    """The result of a job that succeeded, or that failed and will not be tried again.

    Attributes:
        name: name of the job.
        error: the reason of the failure; "" if it succeeded.
        stamp: hash of the job's inputs, see stamp().
        facts: results of baking.Measure, and the seconds for reading, evaluating and writing.
        attempts: number of workers that ran the job.
    """

    name: str
    error: str = ""
    stamp: str = ""
    facts: dict[str, Any] = field(default_factory=dict)
    attempts: int = 1
