# SPDX-License-Identifier: MIT
"""What has become of a job."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any


@dataclass(frozen=True)
class Outcome:
    """A job that is done, or that has failed and will not be tried again.

    Attributes:
        name: of the job.
        error: the sentence why it failed; "" if it is done.
        stamp: of what it was made from, see stamp().
        facts: of Measure, and seconds that reading, evaluating and writing took.
        attempts: workers that it was given to.
    """

    name: str
    error: str = ""
    stamp: str = ""
    facts: dict[str, Any] = field(default_factory=dict)
    attempts: int = 1
