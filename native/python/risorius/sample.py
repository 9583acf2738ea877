# SPDX-License-Identifier: MIT
"""The sample people by the name of their package in versions without a wheel of their own."""

from __future__ import annotations

from typing import Any

from .people import people


def __getattr__(name: str) -> Any:  # whatever the package has
    if name.startswith("__"):
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(people(), name)
