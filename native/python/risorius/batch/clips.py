# SPDX-License-Identifier: MIT
"""Clips from files of any kind that animation comes in."""

from __future__ import annotations

import csv
from pathlib import Path

import numpy as np

import risorius


def load_clip(path: Path) -> risorius.Clip:
    """A clip from a file.

    Raises:
        OSError: it cannot be read.
        ValueError: what is in it is no animation; names the file.
    """
    with open(path, encoding="utf-8", newline="") as file:
        rows = list(csv.reader(file))
    if not rows or not rows[0] or rows[0][0] != "time":
        raise ValueError(f"{path}: a CSV whose first column is time was expected")
    try:
        values = np.array(rows[1:], np.float64).reshape(-1, len(rows[0]))
        steps = np.diff(values[:, 0])
        rate = 1 / float(np.median(steps)) if len(steps) else 60.0
        return risorius.Clip(rows[0][1:], values[:, 1:].T, rate, times=values[:, 0])
    except ValueError as error:
        raise ValueError(f"{path}: {error}") from error
