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
        shapes: groups of targets: some of "arkit", "visemes", "vrm", "expressions" and "all".
        lod: number of the LOD.
        skeleton: whether to write joints of root, neck, head, jaw and eyes.
        sparse: whether morph targets store only the vertices that move; without effect if `meshopt`
            is set.
        quantize: whether values of vertices are stored as integers of 8 or 16 bits.
        meshopt: whether vertices and triangles are compressed with meshoptimizer.
        normals: whether targets change normals too.
        textures: largest number of pixels of a picture's longer side; half of it for hair, lashes
            and roughness.
        mb: size limit of the file in MB, None for no limit.
        most: largest number of targets that the app showing the file accepts, None for no limit.
        within: allowed deviation of sums of two targets from the rig, in mm; larger deviations are
            corrected by combinations. None: no combinations.
        frames: typical captured frames, ARKit unit -> weight: combinations are fitted to them too.
        humanoid: "minimal" or "mixamo", a kind of humanoid whose missing bones are added; "": no
            bones are added.
        vrm: version "1.0" or "0.x"; "": plain glTF.
        licence: licence fields of a VRM, checked by avatar.licence.
        body: glTF or VRM of a character on whose body the face is put; None: the face alone.
        body_scale: metres per unit of the body's file; None: found by the body's height.
        without: names of meshes of the body or the face that are left out.
        springs: whether long hair of a VRM swings.
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
