# SPDX-License-Identifier: MIT
"""Repairs transferred expressions: closes lids and lips, takes skin out of eyes and teeth."""

from .repairing import Repaired, repair
from .report import Faults, Report

__all__ = ["Faults", "Repaired", "Report", "repair"]
