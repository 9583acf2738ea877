# SPDX-License-Identifier: MIT
"""The folder for files that can be made or downloaded again."""

from __future__ import annotations

import os
import sys
from pathlib import Path


def cache_folder() -> Path:
    """Risorius' folder among the user's caches, by the platform's convention.

    The folder may not exist.
    """
    if sys.platform == "win32":
        given = os.environ.get("LOCALAPPDATA", "")
        base = Path(given) if given else Path.home() / "AppData" / "Local"
    elif sys.platform == "darwin":
        base = Path.home() / "Library" / "Caches"
    else:
        given = os.environ.get("XDG_CACHE_HOME", "")
        base = Path(given) if Path(given).is_absolute() else Path.home() / ".cache"
    return base / "risorius"
