# SPDX-License-Identifier: MIT
"""Make a DNA file with the size, the shape and the names of a real MetaHuman head.

    python tests/fullscale/generate.py OUT.dna [--seed N] [--deltas-per-channel N]

870 joints; 174 GUI controls; 263 raw controls, of which 251 are expressions and 12 hold the
rotations of `neck_01`, `neck_02` and `head`; 545 correctives of 2 to 20 factors up to 4; a solver
of 18 poses whose outputs are factors of correctives; 122 joint groups that fill 15 % of the merged
matrix; 782 channels; 50 meshes on 8 LODs with 12, 8 and 4 influences per vertex; centimetres, y up,
degrees. The same seed gives the same bytes. The file contains no values of real files except two
neck poses, which are published in a public test.

Like real files it has content that readers often fail on: GUI controls that drive nothing, raw
controls that no GUI control drives, a name of 100 characters, and equal names.

With --deltas-per-channel the file has only one head mesh per LOD, each with half the vertices of
the previous LOD and shapes only for its LOD's channels. Measurements of loading single LODs use
such files; 2500 deltas per channel give a file of 50 MB.
"""

from __future__ import annotations

import argparse
import re
import sys
import tomllib
from collections.abc import Callable, Sequence
from functools import partial
from itertools import pairwise
from pathlib import Path

import numpy as np
import risorius
from numpy.typing import NDArray

Floats = NDArray[np.float32]
Ints = NDArray[np.int64]
Triple = tuple[float, float, float]
Shape = tuple[str, tuple[int, int], Triple, Triple]  # name, grid, radii in cm, centre

PROJECT = Path(__file__).resolve().parents[2]
JOINTS = 870
CHANNELS = 782
EXPRESSIONS = 251
DRIVERS = ("neck_01", "neck_02", "head")  # joints whose rotations are stored in raw controls
RAW = EXPRESSIONS + 4 * len(DRIVERS)
CORRECTIVES = 545
POSES = 18
CONTROLS = RAW + CORRECTIVES + POSES
GUI = 174
IDLE_GUI = 10  # GUI controls that drive nothing
RAW_ONLY = 18 + 4 * len(DRIVERS)  # raw controls that no GUI control drives
MAPS = 82
LODS = 8
GROUPS = 122
FILLED = 0.149  # filled fraction of the merged matrix of the joint groups
HEAD_CENTRE = (0.0, 150.0, 0.0)
# Poses of the neck: name, the joint axis of the rotation, and rotations of neck_01, neck_02 and
# head in degrees.
NECK_POSES: tuple[tuple[str, int, Triple], ...] = (
    ("default", 2, (0, 0, 0)),
    ("turnUp_55", 2, (10, 20, 25)),
    ("turnUp_25", 2, (5, 9, 11)),
    ("turnDown_50", 2, (-10, -20, -25)),
    ("turnDown_25", 2, (-5, -9, -11)),
    ("turnLeft_80", 0, (20, 25, 35)),
    ("turnLeft_40", 0, (10, 13, 17)),
    ("turnRight_80", 0, (-20, -25, -35)),
    ("turnRight_40", 0, (-10, -13, -17)),
    ("tiltLeft_45", 1, (12, 15, 18)),
    ("tiltLeft_20", 1, (5, 7, 8)),
    ("tiltRight_45", 1, (-12, -15, -18)),
    ("tiltRight_20", 1, (-5, -7, -8)),
    ("fwd", 2, (-25, -5, 30)),
    ("back", 2, (20, 5, -25)),
    ("fwdDown", 2, (-25, -15, 5)),
    ("backUp", 2, (20, 15, -5)),
    ("nod", 2, (0, 0, -20)),
)
MESHES: tuple[Shape, ...] = (
    ("head", (150, 160), (7.5, 12.0, 9.5), HEAD_CENTRE),
    ("teeth", (60, 70), (2.5, 1.5, 3.0), (0.0, 145.0, 5.0)),
    ("eyeLeft", (22, 35), (1.2, 1.2, 1.2), (3.2, 153.0, 7.0)),
    ("eyeRight", (22, 35), (1.2, 1.2, 1.2), (-3.2, 153.0, 7.0)),
    ("eyelashes", (40, 50), (4.6, 1.5, 1.4), (0.0, 153.0, 7.5)),
    ("eyeshell", (25, 30), (4.5, 1.4, 1.3), (0.0, 153.0, 7.4)),
    ("eyeEdge", (25, 40), (4.4, 1.3, 1.2), (0.0, 153.0, 7.3)),
    ("saliva", (25, 40), (2.3, 1.0, 2.8), (0.0, 145.0, 5.0)),
    ("cartilage", (12, 16), (4.3, 0.8, 0.8), (0.0, 153.0, 7.2)),
)
MESHES_OF_LOD = (9, 9, 8, 6, 6, 4, 4, 4)
INFLUENCES = (12, 12, 12, 8, 8, 8, 4, 4)
# One head mesh for each LOD. Its grid has half the vertices of the previous LOD's grid.
HEADS: tuple[Shape, ...] = tuple(
    (
        "head",
        (round(150 * 2 ** (-lod / 2)), round(160 * 2 ** (-lod / 2))),
        (7.5, 12.0, 9.5),
        HEAD_CENTRE,
    )
    for lod in range(LODS)
)


def expression_names() -> list[str]:
    """Names of the facial expressions; the last name has 100 characters."""
    words = PROJECT / "addon" / "risorius" / "language" / "controls_en.toml"
    rows = [row for row in tomllib.loads(words.read_text(encoding="utf-8")) if row != "sides"]
    known = [row.replace("*", side) for row in rows for side in ("LR" if "*" in row else " ")]
    names = [f"CTRL_expressions.{name}" for name in known][: EXPRESSIONS - 1]
    names += [f"CTRL_expressions.extra{i:02d}" for i in range(EXPRESSIONS - 1 - len(names))]
    return [*names, "CTRL_expressions.".ljust(100, "x")]


def raw_names() -> list[str]:
    return expression_names() + [f"{joint}.q{part}" for joint in DRIVERS for part in "xyzw"]


def channel_names() -> list[str]:
    """Names of the channels of expressions and correctives; the first two names are equal."""
    single = [_snake(name.partition(".")[2][:50]) for name in expression_names()]
    names = [f"head__{name}" for name in single]
    names += [f"head__cor_{i:03d}" for i in range(CHANNELS - len(names))]
    return [names[1], *names[1:]]


def _snake(name: str) -> str:
    """A name such as `eyeBlinkL`, written as `eye_blink_L`."""
    words = re.findall(r"[A-Z]?[a-z0-9]+|[A-Z]+(?![a-z])", name)
    return "_".join(word if word in {"L", "R"} else word.lower() for word in words)


def joint_names() -> list[str]:
    names = ["spine_04", *DRIVERS, "FACIAL_L_Eye", "FACIAL_R_Eye"]
    names += [f"FACIAL_{'LRC'[i % 3]}_Skin{i:03d}" for i in range(JOINTS - len(names))]
    names[-1] = names[-2]
    return names


def joint_count(lod: int) -> int:
    return JOINTS - 90 * lod


def channel_count(lod: int) -> int:
    return CHANNELS >> lod


def add_definition(dna: risorius.Dna) -> None:
    every_lod = [list(range(joint_count(lod))) for lod in range(LODS)]
    dna.gui_control_names = [f"CTRL_L_generated{i:03d}.ty" for i in range(GUI)]
    dna.raw_control_names = raw_names()
    dna.joint_names = joint_names()
    dna.blend_shape_channel_names = channel_names()
    dna.animated_map_names = [f"head_wm{i // 27 + 1}.map{i:02d}" for i in range(MAPS)]
    dna.mesh_names = [
        f"{name}_lod{lod}_mesh" for lod in range(LODS) for name, *_ in MESHES[: MESHES_OF_LOD[lod]]
    ]
    dna.lod_joint_mapping = every_lod
    dna.lod_blend_shape_mapping = [list(range(channel_count(lod))) for lod in range(LODS)]
    dna.lod_animated_map_mapping = [list(range(MAPS)) if lod < 4 else [] for lod in range(LODS)]
    ends = np.cumsum(MESHES_OF_LOD)
    dna.lod_mesh_mapping = [list(range(a, b)) for a, b in pairwise([0, *ends.tolist()])]


def add_joints(dna: risorius.Dna, random: np.random.Generator) -> Floats:
    """Add a short spine and facial joints on the surface of the head.

    Returns:
        float32[J, 3] world positions in the neutral pose.
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
    turns = euler_matrices(random.uniform(-0.5, 0.5, (JOINTS, 3)))
    turns[:1] = turns[4:6] = np.eye(3)
    # In joints of the neck, x points up along the bone and z to the character's right, so that a
    # rotation about z looks up.
    turns[1:4] = np.array([[0, 0, -1], [1, 0, 0], [0, -1, 0]])
    local, offsets = turns.copy(), points.copy()
    for joint, parent in enumerate(parents.tolist()):
        if joint != parent:
            local[joint] = turns[parent].T @ turns[joint]
            offsets[joint] = turns[parent].T @ (points[joint] - points[parent])
    dna.joint_parents = parents
    dna.neutral_joint_translations = offsets
    dna.neutral_joint_rotations = euler_angles(local)
    return points


def euler_matrices(degrees: NDArray[np.float64]) -> NDArray[np.float64]:
    """float64[n, 3, 3]: rotation matrices for angles [n, 3] in degrees, about x, then y, then z."""
    (sx, sy, sz), (cx, cy, cz) = np.sin(np.radians(degrees.T)), np.cos(np.radians(degrees.T))
    rows = [
        [cy * cz, sx * sy * cz - cx * sz, cx * sy * cz + sx * sz],
        [cy * sz, sx * sy * sz + cx * cz, cx * sy * sz - sx * cz],
        [-sy, sx * cy, cx * cy],
    ]
    return np.moveaxis(np.array(rows), -1, 0)


def euler_angles(turns: NDArray[np.float64]) -> NDArray[np.float64]:
    """float64[n, 3]: angles in degrees of rotation matrices, the inverse of euler_matrices."""
    x = np.arctan2(turns[:, 2, 1], turns[:, 2, 2])
    y = np.arcsin(np.clip(-turns[:, 2, 0], -1, 1))
    z = np.arctan2(turns[:, 1, 0], turns[:, 0, 0])
    return np.degrees(np.stack([x, y, z], axis=1))


def surface(places: NDArray[np.float64], radii: Sequence[float], centre: Sequence[float]) -> Floats:
    """float32[n, 3] points of an ellipsoid. places: float64[n, 2], height and angle in 0 to 1."""
    polar, around = np.pi * (0.05 + 0.9 * places[:, 0]), 2 * np.pi * places[:, 1]
    unit = np.stack(
        [np.sin(polar) * np.sin(around), np.cos(polar), np.sin(polar) * np.cos(around)], axis=1
    )
    return (unit * np.asarray(radii) + np.asarray(centre)).astype(np.float32)


def add_behavior(dna: risorius.Dna, random: np.random.Generator) -> None:
    driven = np.arange(RAW - RAW_ONLY)
    gui = driven % (GUI - IDLE_GUI)
    dna.gui_to_raw = conditionals(gui, driven)
    dna.psd_count = CORRECTIVES
    dna.psds = correctives(random)
    dna.joint_row_count, dna.joint_column_count = 9 * JOINTS, CONTROLS
    bounds = np.linspace(4, JOINTS, GROUPS + 1).astype(
        int
    )  # joints 0 to 3 (spine, neck, head) are in no group
    dna.joint_groups = [joint_group(range(a, b), random) for a, b in pairwise(bounds)]
    channels = np.arange(CHANNELS)
    dna.blend_shape_channels = risorius.BlendShapeChannels(
        lods=[channel_count(lod) for lod in range(LODS)],
        input_indices=np.where(channels < EXPRESSIONS, channels, RAW + channels - EXPRESSIONS),
        output_indices=channels,
    )
    dna.animated_maps = risorius.AnimatedMaps(
        lods=[MAPS if lod < 4 else 0 for lod in range(LODS)],
        conditionals=conditionals(np.arange(MAPS), np.arange(MAPS)),
    )
    add_neck_solver(dna)


def correctives(random: np.random.Generator) -> risorius.Psds:
    """Correctives of 2 to 20 factors. Most have few factors, and some read a pose of the neck."""
    sizes = np.minimum(2 + random.geometric(0.45, CORRECTIVES) - 1, 20)
    sizes[0] = 20
    columns = [np.sort(random.choice(EXPRESSIONS, n, replace=False)) for n in sizes]
    for corrective in range(CORRECTIVES - 3 * POSES, CORRECTIVES):
        columns[corrective][-1] = RAW + CORRECTIVES + corrective % POSES
    count = int(sizes.sum())
    values = np.where(random.random(count) < 0.7, 1.0, random.uniform(1.0, 4.0, count))
    return risorius.Psds(
        rows=np.repeat(np.arange(RAW, RAW + CORRECTIVES), sizes),
        columns=np.concatenate(columns),
        values=values,
    )


def add_neck_solver(dna: risorius.Dna) -> None:
    """Add an RBF solver whose poses are quaternions of neck and head; the twist axis is x."""
    targets = np.zeros((POSES, len(DRIVERS), 4))
    for row, (_name, axis, degrees) in zip(targets, NECK_POSES, strict=True):
        half = np.radians(degrees) / 2
        row[:, axis], row[:, 3] = np.sin(half), np.cos(half)
    dna.rbf_behavior.lod_solver_mapping = [[0] for _ in range(LODS)]
    dna.rbf_behavior.solvers = [
        risorius.RbfSolver(
            name="neck", raw_control_indices=range(EXPRESSIONS, RAW), pose_indices=range(POSES),
            raw_control_values=targets.ravel(), radius=0.6, weight_threshold=0.001,
            solver_type=1, distance_method=1, twist_axis=0,
        )
    ]  # fmt: skip
    dna.rbf_behavior.poses = [risorius.RbfPose(name=name, scale=1) for name, *_ in NECK_POSES]
    first = RAW + CORRECTIVES
    dna.rbf_behavior_ext.pose_control_names = [f"neck_{name}" for name, *_ in NECK_POSES]
    dna.rbf_behavior_ext.poses = [
        risorius.RbfPoseControls(output_control_indices=[first + i], output_control_weights=[1.0])
        for i in range(POSES)
    ]


def conditionals(inputs: Ints, outputs: Ints) -> risorius.Conditionals:
    """Table rows that copy each input to its output, limited to 0..1."""
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
    """A joint group with translations and rotations of all joints, and scales of every tenth."""
    rows = np.array([9 * j + k for j in joints for k in range(9 if j % 10 == 0 else 6)])
    wanted = FILLED * 9 * JOINTS * CONTROLS / (6.3 * JOINTS)
    columns = np.sort(
        random.choice(CONTROLS, int(wanted * random.uniform(0.6, 1.4)), replace=False)
    )
    columns = columns[(columns < EXPRESSIONS) | (columns >= RAW)]
    size = np.array([0.02, 0.4, 0.01])[rows % 9 // 3]
    values = random.normal(0, 1, (len(rows), len(columns))) * size[:, None]
    return risorius.JointGroup(
        lods=[len(rows) * (LODS - lod) // LODS for lod in range(LODS)],
        input_indices=columns,
        output_indices=rows,
        values=values,
        joint_indices=list(joints),
    )


def make_mesh(
    shape: Shape,
    joints: Floats,
    make_targets: Callable[[Floats], list[risorius.BlendShapeTarget]],
    influences: int,
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
    near, weights = skin(points, joints, influences)
    return risorius.Mesh(
        positions=points,
        texture_coordinates=places[:, ::-1],
        normals=normals,
        layout_positions=np.arange(count),
        layout_texture_coordinates=np.arange(count),
        layout_normals=np.arange(count),
        face_offsets=np.arange(len(quads) + 1) * 4,
        face_layouts=quads.ravel(),
        maximum_influence_per_vertex=influences,
        skin_offsets=np.arange(count + 1) * influences,
        skin_weights=weights.ravel(),
        skin_joint_indices=near.ravel(),
        blend_shape_targets=make_targets(points),
    )


def skin(points: Floats, joints: Floats, influences: int) -> tuple[Ints, Floats]:
    """Indices and weights of the joints nearest to each vertex; weights fall with distance."""
    square = np.square(points).sum(1)[:, None] + np.square(joints).sum(1) - 2 * points @ joints.T
    near = np.argpartition(square, influences, axis=1)[:, :influences]
    weights = 1 / (np.maximum(np.take_along_axis(square, near, axis=1), 0) + 0.05)
    order = np.argsort(-weights, axis=1, kind="stable")
    near, weights = (np.take_along_axis(a, order, axis=1) for a in (near, weights))
    return near, (weights / weights.sum(1, keepdims=True)).astype(np.float32)


def part_targets(
    name: str, lod: int, points: Floats, random: np.random.Generator
) -> list[risorius.BlendShapeTarget]:
    """Shapes of a mesh at LOD 0 or 1: all channels for the head, 100 random ones for others.

    Coarser LODs and meshes of less than 300 vertices have no shapes.
    """
    if lod > 1 or len(points) < 300:
        return []
    if name == "head":
        return targets(range(channel_count(lod)), 800 >> lod, points, random)
    channels = sorted(random.choice(channel_count(lod), 100, replace=False))
    return targets(channels, len(points) / 4, points, random)


def targets(
    channels: Sequence[int], mean: float, points: Floats, random: np.random.Generator
) -> list[risorius.BlendShapeTarget]:
    """A shape per channel: a smooth bump on a random patch of about `mean` vertices."""
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
    """Add one head per LOD that uses only the joints and channels of its LOD."""

    def head(lod: int) -> risorius.Mesh:
        def shapes(points: Floats) -> list[risorius.BlendShapeTarget]:
            mean = deltas_per_channel * len(points) / (HEADS[0][1][0] * HEADS[0][1][1])
            return targets(range(channel_count(lod)), mean, points, random)

        return make_mesh(HEADS[lod], joints[: joint_count(lod)], shapes, INFLUENCES[lod])

    dna.mesh_names = [f"head_lod{lod}_mesh" for lod in range(LODS)]
    dna.lod_mesh_mapping = [[lod] for lod in range(LODS)]
    dna.meshes = [head(lod) for lod in range(LODS)]


def meshes_of(lod: int, joints: Floats, random: np.random.Generator) -> list[risorius.Mesh]:
    """Meshes of a LOD; each has about half the vertices of the same mesh at the previous LOD."""
    found = []
    for name, (rows, columns), radii, centre in MESHES[: MESHES_OF_LOD[lod]]:
        grid = (max(round(rows * 2 ** (-lod / 2)), 4), max(round(columns * 2 ** (-lod / 2)), 5))
        shapes = partial(part_targets, name, lod, random=random)
        near = joints[: joint_count(lod)]
        found.append(make_mesh((name, grid, radii, centre), near, shapes, INFLUENCES[lod]))
    return found


def generate(seed: int = 1, deltas_per_channel: int | None = None) -> risorius.Dna:
    """Generate the face.

    Args:
        seed: seed of the random numbers.
        deltas_per_channel: mean number of deltas of a channel; then the only meshes are one head
            per LOD. None: all meshes.
    """
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
        dna.meshes = [mesh for lod in range(LODS) for mesh in meshes_of(lod, joints, random)]
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
