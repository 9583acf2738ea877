# SPDX-License-Identifier: MIT
"""Keeps the old import `risorius.sample` working: passes on the names of `risorius_people`."""

from __future__ import annotations

from typing import Any

from .people import people


def __getattr__(name: str) -> Any:  # any attribute of the package
    if name.startswith("__"):
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(people(), name)
