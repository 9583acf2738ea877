# SPDX-License-Identifier: MIT
"""Makes a DNA file of a real MetaHuman's size and shape, with no content of one.

    python tests/fullscale/generate.py OUT.dna [--seed N] [--deltas-per-channel N]

870 joints, 800 channels that move about 800 vertices each, a head of 24,000 vertices and 7 more
meshes, 8 LODs, 260 raw controls; centimetres, y up, degrees. Like real files it holds what trips
readers: GUI controls that drive nothing, raw controls that no GUI control drives, a name of 100
characters, equal names and 12 influences a vertex. The same seed gives the same bytes.

With --deltas-per-channel the meshes are one head per LOD instead, each with half the vertices of
the one before and shapes only for its LOD's channels: what reading by LOD is measured with.
2500 gives a file of 50 MB.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Callable, Sequence
from functools import partial
from itertools import pairwise
from pathlib import Path

import numpy as np
import risorius
from numpy.typing import NDArray
from risorius.controls import arkit

Floats = NDArray[np.float32]
Ints = NDArray[np.int64]
Triple = tuple[float, float, float]
Shape = tuple[str, tuple[int, int], Triple, Triple]  # name, grid, radii in cm, centre

JOINTS = 870
CHANNELS = 800
RAW = 260
CORRECTIVES = CHANNELS - RAW
GUI = 174
IDLE_GUI = 10  # GUI controls that drive nothing
RAW_ONLY = 40  # raw controls that no GUI control drives
MAPS = 80
LODS = 8
GROUPS = 60
INFLUENCES = 12
HEAD_CENTRE = (0.0, 150.0, 0.0)
MESHES: tuple[Shape, ...] = (
    ("head_lod0_mesh", (150, 160), (7.5, 12.0, 9.5), HEAD_CENTRE),
    ("teeth_lod0_mesh", (60, 70), (2.5, 1.5, 3.0), (0.0, 145.0, 5.0)),
    ("saliva_lod0_mesh", (25, 40), (2.3, 1.0, 2.8), (0.0, 145.0, 5.0)),
    ("eyeLeft_lod0_mesh", (22, 35), (1.2, 1.2, 1.2), (3.2, 153.0, 7.0)),
    ("eyeRight_lod0_mesh", (22, 35), (1.2, 1.2, 1.2), (-3.2, 153.0, 7.0)),
    ("eyeshell_lod0_mesh", (25, 30), (4.5, 1.4, 1.3), (0.0, 153.0, 7.4)),
    ("eyelashes_lod0_mesh", (40, 50), (4.6, 1.5, 1.4), (0.0, 153.0, 7.5)),
    ("eyeEdge_lod0_mesh", (25, 40), (4.4, 1.3, 1.2), (0.0, 153.0, 7.3)),
)
# One head per LOD: the grid of each has half the vertices of the one before.
HEADS: tuple[Shape, ...] = tuple(
    (
        f"head_lod{lod}_mesh",
        (round(150 * 2 ** (-lod / 2)), round(160 * 2 ** (-lod / 2))),
        (7.5, 12.0, 9.5),
        HEAD_CENTRE,
    )
    for lod in range(LODS)
)


def raw_names() -> list[str]:
    """Known names first, generated ones after them, one of them 100 characters long."""
    known = list(dict.fromkeys(name for row in arkit.mapping().values() for name in row))[:200]
    made = [f"CTRL_expressions.generated{i:03d}" for i in range(RAW - len(known))]
    made[-1] = "CTRL_expressions.".ljust(100, "x")
    return known + made


def joint_names() -> list[str]:
    names = ["spine_04", "neck_01", "neck_02", "head", "FACIAL_L_Eye", "FACIAL_R_Eye"]
    names += [f"FACIAL_{'LRC'[i % 3]}_Skin{i:03d}" for i in range(JOINTS - len(names))]
    names[-1] = names[-2]
    return names


def joint_count(lod: int) -> int:
    return JOINTS - 90 * lod


def add_definition(dna: risorius.Dna) -> None:
    every_lod = [list(range(joint_count(lod))) for lod in range(LODS)]
    dna.gui_control_names = [f"CTRL_L_generated{i:03d}.ty" for i in range(GUI)]
    dna.raw_control_names = raw_names()
    dna.joint_names = joint_names()
    channels = [f"head__shape{i:03d}" for i in range(CHANNELS)]
    channels[1] = channels[0]
    dna.blend_shape_channel_names = channels
    dna.animated_map_names = [f"head_wm{i // 27 + 1}.map{i:02d}" for i in range(MAPS)]
    dna.mesh_names = [name for name, *_ in MESHES]
    dna.lod_joint_mapping = every_lod
    dna.lod_blend_shape_mapping = [list(range(CHANNELS >> lod)) for lod in range(LODS)]
    dna.lod_animated_map_mapping = [list(range(MAPS)) if lod < 4 else [] for lod in range(LODS)]
    dna.lod_mesh_mapping = [list(range(len(MESHES) - lod)) for lod in range(LODS)]


def add_joints(dna: risorius.Dna, random: np.random.Generator) -> Floats:
    """A short spine with a bush of facial joints on the surface of the head.

    Returns:
        float32[J, 3] world positions in the neutral pose, up to the small neutral rotations.
    """
    parents = np.full(JOINTS, 3)
    parents[:4] = [0, 0, 1, 2]
    depth = np.arange(JOINTS) % 3 == 0
    depth[:200] = False
    parents[depth] = random.integers(6, 200, int(depth.sum()))
    points = surface(random.random((JOINTS, 2)), MESHES[0][2], HEAD_CENTRE)
    points[:4] = [(0, 120, -3), (0, 132, -3), (0, 137, -2), (0, 142, -1)]
    points[4:6] = [(3.2, 153, 7), (-3.2, 153, 7)]
    offsets = points - points[parents]
    offsets[0] = points[0]
    angles = random.uniform(-0.5, 0.5, (JOINTS, 3))
    angles[:6] = 0
    dna.joint_parents = parents
    dna.neutral_joint_translations = offsets
    dna.neutral_joint_rotations = angles
    return points


def surface(places: NDArray[np.float64], radii: Sequence[float], centre: Sequence[float]) -> Floats:
    """Points of an ellipsoid; places are (along, around) in 0..1."""
    polar, around = np.pi * (0.05 + 0.9 * places[:, 0]), 2 * np.pi * places[:, 1]
    unit = np.stack(
        [np.sin(polar) * np.sin(around), np.cos(polar), np.sin(polar) * np.cos(around)], axis=1
    )
    return (unit * np.asarray(radii) + np.asarray(centre)).astype(np.float32)


def add_behavior(dna: risorius.Dna, random: np.random.Generator) -> None:
    inputs = RAW + CORRECTIVES
    driven = np.arange(RAW - RAW_ONLY)
    gui = driven % (GUI - IDLE_GUI)
    dna.gui_to_raw = conditionals(gui, driven)
    dna.psd_count = CORRECTIVES
    sizes = random.integers(2, 5, CORRECTIVES)
    dna.psds = risorius.Psds(
        rows=np.repeat(np.arange(RAW, inputs), sizes),
        columns=np.concatenate([np.sort(random.choice(RAW, n, replace=False)) for n in sizes]),
        values=random.uniform(0.8, 1.6, int(sizes.sum())),
    )
    dna.joint_row_count, dna.joint_column_count = 9 * JOINTS, inputs
    bounds = np.linspace(0, JOINTS, GROUPS + 1).astype(int)
    dna.joint_groups = [joint_group(range(a, b), random) for a, b in pairwise(bounds)]
    channels = np.arange(CHANNELS)
    dna.blend_shape_channels = risorius.BlendShapeChannels(
        lods=[CHANNELS >> lod for lod in range(LODS)],
        input_indices=channels,
        output_indices=channels,
    )
    dna.animated_maps = risorius.AnimatedMaps(
        lods=[MAPS if lod < 4 else 0 for lod in range(LODS)],
        conditionals=conditionals(np.arange(MAPS), np.arange(MAPS)),
    )


def conditionals(inputs: Ints, outputs: Ints) -> risorius.Conditionals:
    """Rows that hand a value in 0..1 through."""
    count = len(inputs)
    return risorius.Conditionals(
        input_indices=inputs,
        output_indices=outputs,
        from_values=np.zeros(count),
        to_values=np.ones(count),
        slope_values=np.ones(count),
        cut_values=np.zeros(count),
    )


def joint_group(joints: range, random: np.random.Generator) -> risorius.JointGroup:
    """Translations and rotations of some joints from 30 to 70 controls, half of them zero."""
    columns = np.sort(random.choice(RAW + CORRECTIVES, random.integers(30, 71), replace=False))
    rows = np.array([9 * j + k for j in joints for k in range(6)])
    turns = rows % 9 >= 3
    values = random.normal(0, 1, (len(rows), len(columns))) * np.where(turns, 0.4, 0.02)[:, None]
    values[random.random(values.shape) < 0.5] = 0
    return risorius.JointGroup(
        lods=[len(rows) * (LODS - lod) // LODS // 6 * 6 for lod in range(LODS)],
        input_indices=columns,
        output_indices=rows,
        values=values,
        joint_indices=list(joints),
    )


def make_mesh(
    shape: Shape,
    joints: Floats,
    make_targets: Callable[[Floats], list[risorius.BlendShapeTarget]],
) -> risorius.Mesh:
    _, (rows, columns), radii, centre = shape
    grid = np.stack(np.meshgrid(np.arange(rows), np.arange(columns), indexing="ij"), axis=-1)
    places = grid.reshape(-1, 2) / [rows - 1, columns]
    points = surface(places, radii, centre)
    count = len(points)
    at = np.arange(count).reshape(rows, columns)
    after = np.roll(at, -1, axis=1)
    quads = np.stack([at[:-1], at[1:], after[1:], after[:-1]], axis=-1).reshape(-1, 4)
    normals = (points - np.float32(centre)) / np.square(np.float32(radii))
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    near, weights = skin(points, joints)
    return risorius.Mesh(
        positions=points,
        texture_coordinates=places[:, ::-1],
        normals=normals,
        layout_positions=np.arange(count),
        layout_texture_coordinates=np.arange(count),
        layout_normals=np.arange(count),
        face_offsets=np.arange(len(quads) + 1) * 4,
        face_layouts=quads.ravel(),
        maximum_influence_per_vertex=INFLUENCES,
        skin_offsets=np.arange(count + 1) * INFLUENCES,
        skin_weights=weights.ravel(),
        skin_joint_indices=near.ravel(),
        blend_shape_targets=make_targets(points),
    )


def skin(points: Floats, joints: Floats) -> tuple[Ints, Floats]:
    """The nearest joints of each vertex, weighted by closeness; weights sum to 1."""
    square = np.square(points).sum(1)[:, None] + np.square(joints).sum(1) - 2 * points @ joints.T
    near = np.argpartition(square, INFLUENCES, axis=1)[:, :INFLUENCES]
    weights = 1 / (np.maximum(np.take_along_axis(square, near, axis=1), 0) + 0.05)
    order = np.argsort(-weights, axis=1, kind="stable")
    near, weights = (np.take_along_axis(a, order, axis=1) for a in (near, weights))
    return near, (weights / weights.sum(1, keepdims=True)).astype(np.float32)


def part_targets(
    index: int, points: Floats, random: np.random.Generator
) -> list[risorius.BlendShapeTarget]:
    """Every channel on the head, 100 elsewhere."""
    if index == 0:
        return targets(range(CHANNELS), 800, points, random)
    channels = sorted(random.choice(CHANNELS, 100, replace=False))
    return targets(channels, len(points) / 4, points, random)


def targets(
    channels: Sequence[int], mean: float, points: Floats, random: np.random.Generator
) -> list[risorius.BlendShapeTarget]:
    """A soft bump of a random patch per channel, of about so many vertices."""
    found = []
    for channel in channels:
        size = int(np.clip(random.lognormal(np.log(mean) - 0.18, 0.6), 8, len(points) - 1))
        square = np.square(points - points[random.integers(len(points))]).sum(1)
        moved = np.sort(np.argpartition(square, size)[:size])
        fall = 1 - np.sqrt(square[moved] / square[moved].max())
        deltas = fall[:, None] * random.normal(0, 0.25, 3)
        kept = fall > 0
        found.append(
            risorius.BlendShapeTarget(
                deltas=deltas[kept],
                vertex_indices=moved[kept],
                blend_shape_channel_index=int(channel),
            )
        )
    return found


def add_heads(
    dna: risorius.Dna, joints: Floats, deltas_per_channel: int, random: np.random.Generator
) -> None:
    """One head per LOD, made of its LOD's joints and channels alone."""

    def head(lod: int) -> risorius.Mesh:
        def shapes(points: Floats) -> list[risorius.BlendShapeTarget]:
            mean = deltas_per_channel * len(points) / (HEADS[0][1][0] * HEADS[0][1][1])
            return targets(range(CHANNELS >> lod), mean, points, random)

        return make_mesh(HEADS[lod], joints[: joint_count(lod)], shapes)

    dna.mesh_names = [name for name, *_ in HEADS]
    dna.lod_mesh_mapping = [[lod] for lod in range(LODS)]
    dna.meshes = [head(lod) for lod in range(LODS)]


def generate(seed: int = 1, deltas_per_channel: int | None = None) -> risorius.Dna:
    """The whole file as a value; with deltas_per_channel its meshes are one head per LOD."""
    random = np.random.default_rng(seed)
    dna = risorius.Dna()
    dna.name, dna.archetype, dna.gender, dna.age = "Fullscale", "other", "other", 30
    dna.translation_unit, dna.rotation_unit = "cm", "degrees"
    dna.coordinate_system = ("right", "up", "front")
    dna.lod_count, dna.max_lod, dna.complexity, dna.db_name = LODS, 0, "A", "generated"
    dna.metadata = {"generator": "tests/fullscale", "seed": str(seed)}
    add_definition(dna)
    joints = add_joints(dna, random)
    add_behavior(dna, random)
    if deltas_per_channel is None:
        dna.meshes = [
            make_mesh(shape, joints, partial(part_targets, i, random=random))
            for i, shape in enumerate(MESHES)
        ]
    else:
        add_heads(dna, joints, deltas_per_channel, random)
    pairs = [
        (mesh, target.blend_shape_channel_index)
        for mesh, data in enumerate(dna.meshes)
        for target in data.blend_shape_targets
    ]
    dna.mesh_blend_shape_channel_mapping = np.array(pairs)
    return dna


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("out", type=Path)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--deltas-per-channel", type=int, help="one head per LOD, see above")
    args = parser.parse_args()
    dna = generate(args.seed, args.deltas_per_channel)
    dna.save(args.out)
    moved = np.mean([len(t.vertex_indices) for t in dna.meshes[0].blend_shape_targets])
    print(f"{args.out}: {args.out.stat().st_size / 1e6:.1f} MB, {moved:.0f} vertices a channel")
    for warning in dna.validate():
        print(f"  warning: {warning}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
