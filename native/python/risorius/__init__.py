# SPDX-License-Identifier: MIT
"""Risorius: read, check, evaluate and write the DNA files of face rigs.

bytes --load--> Dna --Rig--> evaluate(raw controls) --> Pose
"""

from __future__ import annotations

import os
from collections.abc import Iterable

from ._native import (
    AnimatedMaps,
    BlendShapeChannels,
    BlendShapeTarget,
    Conditionals,
    Dna,
    DnaError,
    Instance,
    JointGroup,
    LodMapping,
    Mesh,
    Morph,
    ParseOptions,
    Pose,
    Psds,
    Rig,
    parse_bytes,
    parse_file,
)

__version__ = "0.1.0"
__all__ = [
    "AnimatedMaps",
    "BlendShapeChannels",
    "BlendShapeTarget",
    "Conditionals",
    "Dna",
    "DnaError",
    "Instance",
    "JointGroup",
    "LodMapping",
    "Mesh",
    "Morph",
    "Pose",
    "Psds",
    "Rig",
    "load",
]

_LAYERS = {
    "all": {"definition", "behavior", "geometry", "blend_shapes", "extensions"},
    "descriptor": set[str](),
    "definition": {"definition"},
    "behavior": {"definition", "behavior", "extensions"},
    "geometry": {"definition", "geometry", "blend_shapes"},
    "geometry_without_blend_shapes": {"definition", "geometry"},
}


def load(
    source: str | os.PathLike[str] | bytes,
    *,
    layers: str | Iterable[str] = "all",
    unknown_layers: str = "preserve",
) -> Dna:
    """Read a DNA file of version 2.1 to 2.8 (or a newer minor version).

    Args:
        source: a path, or the bytes of a file.
        layers: one name or several of "all", "descriptor", "definition", "behavior",
            "geometry", "geometry_without_blend_shapes"; each brings what it depends on.
        unknown_layers: "preserve" keeps layers that this version does not know as bytes,
            "ignore" leaves them out.

    Returns:
        A Dna. Its arrays are read-only NumPy views: assign a new array to change one.

    Raises:
        DnaError: not a DNA file, cut short, a newer generation, anything that does not fit
            together; with .code, .offset and .where. Also for a file that cannot be opened.
        ValueError: an unknown name in layers or unknown_layers.
    """
    names = [layers] if isinstance(layers, str) else list(layers)
    wanted: set[str] = set()
    for name in names:
        if name not in _LAYERS:
            raise ValueError(f"layers: one of {', '.join(_LAYERS)} was expected, found {name!r}")
        wanted |= _LAYERS[name]
    if unknown_layers not in ("preserve", "ignore"):
        raise ValueError(
            f"unknown_layers: preserve or ignore was expected, found {unknown_layers!r}"
        )
    options = ParseOptions(
        definition="definition" in wanted,
        behavior="behavior" in wanted,
        geometry="geometry" in wanted,
        blend_shapes="blend_shapes" in wanted,
        extensions="extensions" in wanted,
        unknown_layers=unknown_layers == "preserve" and "extensions" in wanted,
    )
    if isinstance(source, bytes | bytearray | memoryview):
        return parse_bytes(bytes(source), options)
    return parse_file(os.fspath(source), options)
