# SPDX-License-Identifier: MIT
"""Clips on characters, many at a time: evaluated, baked to files, summed up in numbers.

JOBS.toml --read_jobs--> jobs --pool or cluster--> outcomes --> files, journal, summary
"""

from __future__ import annotations
