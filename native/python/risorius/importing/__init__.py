# SPDX-License-Identifier: MIT
"""Imports animation of other software as clips of raw controls.

file --read--> Imported (the file's own curves) --apply(mapping)--> Clip of raw controls, Report
"""

from __future__ import annotations

from . import process
from .clock.units import CHOICES as TIME_UNITS
from .errors import AnimationFileError
from .mapping import (
    Mapping,
    MappingError,
    best_mapping,
    check,
    load_mapping,
    mapping_names,
    mapping_text,
    mapping_title,
)
from .ranges import ANGLE_UNITS
from .reading import KINDS, ROTATIONS, Imported, import_curves, import_file, read
from .report import Report
from .writing import csv_text, curve_table_text, json_text, mapping_with, write_text

__all__ = [
    "ANGLE_UNITS",
    "KINDS",
    "ROTATIONS",
    "TIME_UNITS",
    "AnimationFileError",
    "Imported",
    "Mapping",
    "MappingError",
    "Report",
    "best_mapping",
    "check",
    "csv_text",
    "curve_table_text",
    "import_curves",
    "import_file",
    "json_text",
    "load_mapping",
    "mapping_names",
    "mapping_text",
    "mapping_title",
    "mapping_with",
    "process",
    "read",
    "write_text",
]
