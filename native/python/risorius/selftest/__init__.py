# SPDX-License-Identifier: MIT
"""Checks an installation: evaluates faces from the wheel and compares them with a reference."""

from .checks import Row, run
from .report import failed, text

__all__ = ["Row", "failed", "run", "text"]
