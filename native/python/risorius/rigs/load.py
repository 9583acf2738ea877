# SPDX-License-Identifier: MIT
"""Loads the bytes of a DNA file as a Dna, and checks files for errors."""

from __future__ import annotations

import os
from collections.abc import Iterable, Sequence
from typing import NamedTuple

from .._native import (
    Dna,
    DnaError,
    Limits,
    ParseOptions,
    check_bytes,
    check_file,
    parse_bytes,
    parse_file,
)
from ..base import signatures
from ..base.errors import ArgumentError

# Name for the argument `layers` -> the layers of the file that it loads.
_LAYERS = {
    "descriptor": set[str](),
    "definition": {"definition"},
    "behavior": {"definition", "behavior"},
    "geometry": {"definition", "geometry", "blend_shapes"},
    "geometry_without_blend_shapes": {"definition", "geometry"},
    "machine_learned_behavior": {"definition", "machine_learned_behavior"},
    "rbf_behavior": {"definition", "behavior", "rbf_behavior"},
    "joint_behavior_metadata": {"definition", "joint_behavior_metadata"},
    "twist_swing_behavior": {"definition", "twist_swing_behavior"},
}
_LAYERS["all"] = {"unknown_layers"}.union(*_LAYERS.values())


class Finding(NamedTuple):
    """An error, for which load refuses the file, or a warning."""

    is_error: bool
    code: str
    where: str
    """Path of the field in the Dna, e.g. behavior.joint_groups[3].values[7]."""
    offset: int | None
    """Byte offset in the file, or None."""
    message: str

    def __str__(self) -> str:
        place = "" if self.offset is None else f" (byte {self.offset})"
        kind = "error" if self.is_error else "warning"
        return f"{kind}: {self.where or 'file'}{place}: {self.message}"


def load(
    source: str | os.PathLike[str] | bytes,
    *,
    layers: str | Iterable[str] = "all",
    lods: tuple[int, int] | Sequence[int] | None = None,
    unknown_layers: str = "preserve",
    limits: Limits | None = None,
) -> Dna:
    """Loads a DNA file of version 2.1 to 2.8 (or a newer minor version).

    Args:
        source: a path, or the bytes of a file.
        layers: one name or several of "all", "descriptor", "definition", "behavior",
            "geometry", "geometry_without_blend_shapes", "machine_learned_behavior",
            "rbf_behavior", "joint_behavior_metadata", "twist_swing_behavior"; each includes the
            layers that it depends on. Other layers are not read.
        lods: a tuple (max_lod, min_lod), e.g. (0, 2) for the three finest, or a list of LODs; LOD 0
            is the most detailed. All indices are renumbered, see Dna.filter_lods.
        unknown_layers: "preserve" keeps layers that this version does not know as bytes; "ignore"
            drops them and, as the format demands, the blend shape channels that no loaded layer
            drives.
        limits: upper limits for the file.

    Returns:
        A Dna. Its arrays are read-only NumPy views: assign a new array to change one.

    Raises:
        DnaError: not a DNA file, cut short, a newer generation, or inconsistent; with .code,
            .offset and .where. Also for a file that cannot be opened.
        ValueError: an unknown name in layers or unknown_layers.
    """
    names = [layers] if isinstance(layers, str) else list(layers)
    wanted: set[str] = set()
    for name in names:
        if name not in _LAYERS:
            raise ArgumentError(f"layers: one of {', '.join(_LAYERS)} was expected, found {name!r}")
        wanted |= _LAYERS[name]
    if unknown_layers not in ("preserve", "ignore"):
        raise ArgumentError(
            f"unknown_layers: preserve or ignore was expected, found {unknown_layers!r}"
        )
    options = ParseOptions()
    for part in _LAYERS["all"]:
        setattr(options, part, part in wanted)
    if unknown_layers == "ignore":
        options.unknown_layers = options.unreferenced_blend_shapes = False
    if limits is not None:
        options.limits = limits
    options.set_lods(lods)
    try:
        if isinstance(source, bytes | bytearray | memoryview):
            return parse_bytes(bytes(source), options)
        return parse_file(os.fspath(source), options)
    except DnaError as error:
        if error.code != "not_dna":
            raise
        raise signatures.named(error, source) from None


def check(source: str | os.PathLike[str] | bytes, *, limits: Limits | None = None) -> list[Finding]:
    """All errors and warnings of a file, in file order; errors of one layer do not hide others.

    Args:
        source: a path, or the bytes of a file.
        limits: upper limits for the file.

    Raises:
        DnaError: the file cannot be opened.
    """
    limits = limits or Limits()
    if isinstance(source, bytes | bytearray | memoryview):
        found = check_bytes(bytes(source), limits)
    else:
        found = check_file(os.fspath(source), limits)
    findings = [Finding(*finding) for finding in found]
    if [finding.code for finding in findings] != ["not_dna"]:
        return findings
    kind = signatures.kind_of(signatures.ends_of(source))
    if kind is None:
        return findings
    return [findings[0]._replace(message=f"{findings[0].message}; it is {kind}")]
