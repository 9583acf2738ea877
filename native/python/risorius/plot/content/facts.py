# SPDX-License-Identifier: MIT
"""Collects the data of all drawings: counts, sizes, regions, levels of detail."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

import risorius

from .layers import Extras, Layer, read_extras, read_layers
from .matrix import group_regions
from .regions import REGIONS, regions_of


@dataclass(frozen=True)
class Lod:
    """One LOD: joints per region, and how many coefficients, blend shapes and animated maps it
    evaluates."""

    joints: dict[str, int]
    coefficients: int
    channels: int
    maps: int


@dataclass(frozen=True)
class Facts:
    """A rig's data for the drawing modules; `title` and `file_name` are only displayed."""

    dna: risorius.Dna
    title: str
    file_name: str
    file_size: int
    layers: list[Layer]
    extras: Extras
    joint_regions: list[str]
    group_regions: list[str]
    lods: list[Lod]

    @property
    def controls(self) -> list[tuple[str, int]]:
        """(kind, number) of the controls in the order of the joint matrix's columns."""
        return [
            ("raw", len(self.dna.raw_control_names)),
            ("psd", self.dna.psd_count),
            ("ml", self.extras.ml_controls),
            ("rbf", self.extras.rbf_poses),
        ]

    @property
    def stored(self) -> int:
        """Number of coefficients stored in the joint groups, including zeros."""
        return sum(int(group.values.size) for group in self.dna.joint_groups)

    @property
    def nonzero(self) -> int:
        return sum(int(np.count_nonzero(group.values)) for group in self.dna.joint_groups)

    def region_counts(self) -> dict[str, int]:
        """Region -> number of its joints, for regions with joints, in the order of REGIONS."""
        votes = Counter(self.joint_regions)
        return {region: votes[region] for region in REGIONS if votes[region]}


def gather(dna: risorius.Dna, data: bytes, file_name: str, title: str | None = None) -> Facts:
    """Collects the data of one file.

    Args:
        dna: the face, loaded from `data` with all layers.
        data: bytes of the file, from which sizes are read.
        file_name: file name without folder, for display.
        title: displayed title; None: the character's name, or the file name if there is none.
    """
    regions = regions_of(dna.joint_names)
    return Facts(
        dna=dna,
        title=title or dna.name or file_name,
        file_name=file_name,
        file_size=len(data),
        layers=read_layers(data),
        extras=read_extras(data),
        joint_regions=regions,
        group_regions=group_regions(dna, regions),
        lods=[_lod(dna, level, regions) for level in range(dna.lod_count)],
    )


def listed(mapping: risorius.LodMapping, lod: int) -> npt.NDArray[np.int64]:
    """int64[n]: the indices that a mapping lists for `lod`; empty if it lacks this LOD."""
    return np.asarray(mapping[lod] if lod < len(mapping) else [], np.int64)


def _lod(dna: risorius.Dna, level: int, regions: list[str]) -> Lod:
    joints = listed(dna.lod_joint_mapping, level)
    votes = Counter(regions[j] for j in joints.tolist() if j < len(regions))
    return Lod(
        joints={region: votes[region] for region in REGIONS},
        coefficients=sum(
            int(group.lods[level]) * len(group.input_indices)
            for group in dna.joint_groups
            if level < len(group.lods)
        ),
        channels=len(listed(dna.lod_blend_shape_mapping, level)),
        maps=len(listed(dna.lod_animated_map_mapping, level)),
    )


def counts(facts: Facts) -> list[tuple[str, int]]:
    """(name, number) for each row of the table of counts."""
    dna, meshes = facts.dna, facts.dna.meshes
    targets = [target for mesh in meshes for target in mesh.blend_shape_targets]
    return [
        ("joints", len(dna.joint_names)),
        ("joint groups", len(dna.joint_groups)),
        ("coefficients stored", facts.stored),
        ("coefficients not zero", facts.nonzero),
        ("GUI controls", len(dna.gui_control_names)),
        ("raw controls", len(dna.raw_control_names)),
        ("correctives", dna.psd_count),
        ("network controls", facts.extras.ml_controls),
        ("RBF poses", facts.extras.rbf_poses),
        ("networks", facts.extras.networks),
        ("blend shape channels", len(dna.blend_shape_channel_names)),
        ("animated maps", len(dna.animated_map_names)),
        ("meshes", len(dna.mesh_names)),
        ("vertices", sum(len(mesh.positions) for mesh in meshes)),
        ("faces", sum(max(0, len(mesh.face_offsets) - 1) for mesh in meshes)),
        ("blend shape deltas", sum(len(target.vertex_indices) for target in targets)),
        ("levels of detail", dna.lod_count),
    ]


def human_bytes(size: int) -> str:
    """A size as text in B, kB or MB."""
    if size < 1000:
        return f"{size} B"
    if size < 1_000_000:
        return f"{size / 1000:.1f} kB"
    return f"{size / 1_000_000:.2f} MB"


def descriptor(facts: Facts) -> str:
    """A line of text: version of the DNA format, gender and age of the character, number of LODs,
    units, axes and file size."""
    dna = facts.dna
    parts = [
        f"DNA {dna.generation}.{dna.version}",
        f"{dna.gender}, age {dna.age}",
        f"{dna.lod_count} LODs",
        f"{dna.translation_unit}, {dna.rotation_unit}",
        f"x y z = {' '.join(dna.coordinate_system)}",
        human_bytes(facts.file_size),
    ]
    return "  ·  ".join(parts).replace("  ·  ", " | ")
