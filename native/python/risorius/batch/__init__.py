# SPDX-License-Identifier: MIT
"""Evaluates many clips on many characters, writes the poses, and summarises the results.

JOBS.toml --read_jobs--> jobs --pool or cluster--> outcomes --> files, journal, summary
"""

from __future__ import annotations
