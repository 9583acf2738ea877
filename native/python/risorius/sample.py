# SPDX-License-Identifier: MIT
"""The old name of the sample people's package, before it had its own wheel."""

from __future__ import annotations

from typing import Any

from .people import people


def __getattr__(name: str) -> Any:  # any attribute of the package
    if name.startswith("__"):
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(people(), name)
