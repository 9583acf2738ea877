# SPDX-License-Identifier: MIT
"""Loads clips of a character's controls from animation files of any kind."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

import risorius
from risorius import importing
from risorius.importing.mapping import HEAD_ANGLES

from .face import Face

SUFFIX = ".rzc"


@dataclass(frozen=True)
class Performance:
    """A clip prepared for a character.

    Attributes:
        clip: curves of raw controls; the character may lack some of these controls.
        mapping: name of the mapping that was used; "" for none.
        unmapped: names of the file's curves that are no raw controls and that the mapping does not
            know; empty for a .rzc file without a mapping, whose curves all stay.
    """

    clip: risorius.Clip
    mapping: str
    unmapped: tuple[str, ...]


def load_performance(path: Path, face: Face, mapping: str | None = None) -> Performance:
    """Load the clip of a file for a character.

    Args:
        path: a .rzc file, or a file that risorius.importing reads.
        face: the character; curves of its raw controls are used directly, and curves of its GUI
            controls are converted to raw controls.
        mapping: name of a built-in mapping, or path of a TOML file; None: the mapping that fits
            best. With None, a .rzc file is not mapped, and neither is a file with curves of raw
            controls whose format has no mapping of its own.

    Raises:
        OSError, ValueError: the file is no animation, or no mapping fits it; the error names the
            file.
    """
    if path.suffix.lower() == SUFFIX:
        clip = risorius.Clip.load(path)
        if mapping is None:
            return Performance(clip, "", ())
        found = importing.Imported(clip, "rzc", "", str(path))
    else:
        found = importing.read(path)
    raw = set(face.rig.raw_control_names)
    own = [name for name in found.clip.names if name in raw]
    if mapping is None and not found.mapping and own:
        own = [name for name in found.clip.names if name in raw or name in HEAD_ANGLES]
        others = tuple(name for name in found.clip.names if name not in own)
        return Performance(found.clip.selected(own), "", others)
    clip, report = found.apply(mapping, rig=face.rig)
    # The mapping drops the curves that it does not know. Curves of raw controls, such as the neck's
    # rotation, are added to the mapped clip.
    own = [name for name in own if name in report.unmapped and name not in clip]
    if own:
        curves = np.concatenate([clip.curves, found.clip.selected(own).curves])
        clip = clip.replaced(names=[*clip.names, *own], curves=curves)
    unmapped = tuple(name for name in report.unmapped if name not in own)
    return Performance(clip, report.mapping, unmapped)
