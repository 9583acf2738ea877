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
        stamp: hash of everything that the outputs depend on, from work.stamp; "" after a failure.
        facts: the results of baking.bake, the name of the mapping, the curves that the mapping left
            out, the seconds for loading, and the seconds for the whole job.
        attempts: number of processes of this run that got the job; 1 on a cluster.
    """

    name: str
    error: str = ""
    stamp: str = ""
    facts: dict[str, Any] = field(default_factory=dict)
    attempts: int = 1
