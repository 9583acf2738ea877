# SPDX-License-Identifier: MIT
"""The options of the glTF export."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

TEXTURES = 1024


@dataclass(frozen=True)
class Wishes:
    """Options of the glTF export.

    Attributes:
        shapes: groups of targets, of GROUPS.
        lod: the level of detail.
        skeleton: root, neck, head, jaw and eyes are joints.
        sparse, quantize, meshopt: how lists are kept.
        normals: targets change normals too.
        textures: pixels of the longer side of a picture at most.
        mb: megabytes that the file may have, None: any number.
        most: targets that the client takes, None: any number.
        within: millimetres that sums of two may deviate; the driver adds what is missing. None: no
            driver.
        frames: of typical captures, unit of ARKit -> weight: combinations are fitted to them too.
        humanoid: of avatar.humanoid.KINDS: missing bones are made up; "": none.
        vrm: 1.0 or 0.x, "": a glTF that is no VRM.
        licence: fields of a VRM, as avatar.licence asks for them.
        body: a character in glTF or VRM that the face is hung on; None: the face alone.
        body_scale: metres of a unit of the body; None: found by its height.
        without: names of meshes of the body, or of the face, that are left out.
        springs: long hair of a VRM swings.
    """

    shapes: Sequence[str] = ("arkit", "visemes")
    lod: int = 0
    skeleton: bool = True
    sparse: bool = False
    quantize: bool = False
    meshopt: bool = False
    normals: bool = False
    textures: int = TEXTURES
    mb: float | None = None
    most: int | None = None
    within: float | None = None
    frames: Sequence[Mapping[str, float]] = ()
    humanoid: str = ""
    vrm: str = ""
    licence: Mapping[str, Any] = field(default_factory=dict)
    body: Path | None = None
    body_scale: float | None = None
    without: Sequence[str] = ()
    springs: bool = True
