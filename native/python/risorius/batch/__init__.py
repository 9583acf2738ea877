# SPDX-License-Identifier: MIT
"""Plays many clips on many characters: evaluates, bakes and summarises them.

JOBS.toml --read_jobs--> jobs --pool or cluster--> outcomes --> files, journal, summary
"""

from __future__ import annotations
