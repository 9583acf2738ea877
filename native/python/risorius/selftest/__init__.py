# SPDX-License-Identifier: MIT
"""Does this installation work on this machine? Faces in the wheel against values of a reference."""

from .checks import Row, run
from .report import failed, text

__all__ = ["Row", "failed", "run", "text"]
