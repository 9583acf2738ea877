# SPDX-License-Identifier: MIT
"""What transfer breaks, repaired: lids that close on this eye, lips that meet, skin that is cut."""

from .repairing import Repaired, repair
from .report import Faults, Report

__all__ = ["Faults", "Repaired", "Report", "repair"]
