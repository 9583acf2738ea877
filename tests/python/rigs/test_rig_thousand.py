# SPDX-License-Identifier: MIT
"""Compares a thousand random rigs with a short NumPy version and with the scalar code.

Each rig is evaluated with each instruction set, precision and kind of rotation, as a single frame,
a batch and a settled instance.
"""

from collections import Counter

import numpy as np
import oracle
import oracle_behavior
import pytest
import risorius
from risorius import _native
from test_rig_random import random_group, random_psds, random_raw, random_table

SIMD = _native.available_simd().split(", ")
RIGS, PIECES = 1000, 10
LANES = (4, 8, 16)  # NEON and SSE4, AVX2, AVX-512
WIDTHS = sorted({0, 1, 2, 40, *(w + d for w in LANES for d in (-1, 0, 1)), *(2 * w for w in LANES)})
FIELDS = ("joints", "blend_shapes", "animated_maps", "controls")
EPS = oracle.EPS


def random_shape(rng):
    """Numbers of raw controls, correctives, joints and LODs; (rows, columns) of each group."""
    joints = int(rng.choice([0, 1, 2, 7, 30]))
    groups = [
        (min(int(rng.choice(WIDTHS)), 9 * joints), int(rng.choice(WIDTHS)))
        for _ in range(rng.integers(0, 5))
    ]
    lods = int(rng.choice([1, 2, 4, 33]))
    return int(rng.choice([1, 2, 12, 70])), int(rng.choice([0, 1, 6])), joints, lods, groups


def falling(rng, rows, lods):
    """Random numbers of rows at each LOD: all rows at LOD 0, and never more at the next LOD."""
    return [rows, *sorted((int(n) for n in rng.integers(0, rows + 1, lods - 1)), reverse=True)]


def random_dna(rng, shape):
    raw, psds, joints, lods, groups = shape
    channels, maps = (int(rng.choice([0, 1, 9])) for _ in range(2))
    controls = raw + psds
    dna = risorius.Dna()
    dna.lod_count = lods
    dna.rotation_sequence = oracle_behavior.SEQUENCES[rng.integers(6)]
    dna.rotation_unit = ("degrees", "radians")[rng.integers(2)]
    dna.raw_control_names = [f"raw{i}" for i in range(raw)]
    dna.joint_names = [f"joint{i}" for i in range(joints)]
    dna.joint_parents = [0] * joints
    dna.neutral_joint_translations = np.zeros((joints, 3))
    dna.neutral_joint_rotations = np.zeros((joints, 3))
    dna.blend_shape_channel_names = [f"shape{i}" for i in range(channels)]
    dna.animated_map_names = [f"map{i}" for i in range(maps)]
    dna.psd_count = psds
    dna.psds = random_psds(rng, raw, psds)
    dna.joint_groups = [random_group(rng, dna, controls, *size) for size in groups]
    dna.blend_shape_channels = risorius.BlendShapeChannels(
        lods=falling(rng, channels, lods),
        input_indices=rng.integers(0, controls, channels),
        output_indices=rng.permutation(channels),
    )
    rows = int(rng.integers(0, 12)) if maps else 0
    dna.animated_maps = risorius.AnimatedMaps(
        lods=falling(rng, rows, lods),
        conditionals=random_table(rng, rows, min(3, controls), max(1, maps)),
    )
    return dna


def expected(dna, raw, lod, precision):
    """A pose computed by NumPy in double precision, and bounds of float32 errors, as two dicts."""
    c = np.zeros(len(raw) + dna.psd_count)
    c[: len(raw)] = raw
    oracle.correctives(dna, c, oracle.used_controls(dna, lod), settle=True)
    joints, loss = np.zeros((2, 9 * len(dna.joint_names)))
    for group in dna.joint_groups:
        n = int(group.lods[lod])
        matrix = np.asarray(group.values)[:n].astype(precision).astype(float)
        joints[group.output_indices[:n]] = matrix @ c[group.input_indices]
        terms = np.abs(matrix) @ np.abs(c[group.input_indices])
        loss[group.output_indices[:n]] = (matrix.shape[1] + oracle.FACTORS + 2) * EPS * terms
    shapes, channels = np.zeros(len(dna.blend_shape_channel_names)), dna.blend_shape_channels
    n = int(channels.lods[lod])
    shapes[channels.output_indices[:n]] = c[channels.input_indices[:n]]
    n, table = int(dna.animated_maps.lods[lod]), dna.animated_maps.conditionals
    maps, lost = oracle.table(table, n, c, len(dna.animated_map_names))
    relative = oracle.FACTORS * EPS
    return (
        dict(zip(FIELDS, (joints.reshape(-1, 9), shapes, maps, c), strict=True)),
        dict(
            zip(
                FIELDS,
                (loss.reshape(-1, 9), relative * np.abs(shapes), lost, relative * np.abs(c)),
                strict=True,
            )
        ),
    )


def turned(dna, values, losses):
    """Convert joints [J, 9] with Euler angles, and their errors, to [J, 10] with quaternions."""
    scale = oracle_behavior.radians_per_unit(dna)
    out, lost = np.zeros((2, len(values), 10))
    out[:, :3], out[:, 7:] = values[:, :3], values[:, 6:]
    lost[:, :3], lost[:, 7:] = losses[:, :3], losses[:, 6:]
    out[:, 3:7] = oracle_behavior.from_euler(
        dna.rotation_sequence, dna.rotation_signs, values[:, 3:6] * scale
    )
    # The error of a quaternion is half of the angles' error and rounding, 1e-7 for the sine of each
    # of three angles, and the rounding of three products.
    angles = np.abs(values[:, 3:6]) * scale
    loss = 0.5 * (losses[:, 3:6] * scale + 4 * EPS * angles).sum(axis=1) + 3e-7 + 12 * EPS
    lost[:, 3:7] = loss[:, None]
    return out, lost


def near(actual, wanted, loss, what):
    excess = np.abs(actual.astype(float) - wanted) - loss
    assert excess.size == 0 or excess.max() <= 0, (
        f"{what}: {actual.ravel()[excess.argmax()]}, wanted {wanted.ravel()[excess.argmax()]}"
        f" +- {loss.ravel()[excess.argmax()]}"
    )


def same(a, b, what):
    for field in FIELDS:
        np.testing.assert_array_equal(getattr(a, field), getattr(b, field), what)


def check_frames(rig, raw, lod, threads, what):
    """Check that frames of a batch and a settled instance equal single frames bit for bit."""
    batch = rig.evaluate_batch(raw, lod=lod, threads=threads)
    alone = [rig.evaluate(values, lod=lod) for values in raw]
    for field in FIELDS:
        frames = np.stack([getattr(pose, field) for pose in alone])
        np.testing.assert_array_equal(getattr(batch, field), frames, f"{what} batch")
    instance = rig.instance()
    instance.lod = lod
    for _ in range(7):  # a chain of six correctives, and one frame more
        pose = instance.evaluate(raw[0])
    same(pose, rig.evaluate(raw[0], lod=lod), f"{what} instance")


def check_rig(seed):
    rng = np.random.default_rng(seed)
    shape = random_shape(rng)
    dna = random_dna(rng, shape)
    lods = dna.lod_count
    lod = int(rng.integers(lods)) * int(rng.integers(2))
    raw = random_raw(seed, shape[0], frames=int(rng.choice([1, 2, 7, 8, 9, 17])))
    for precision in ("float32", "float16"):
        values, losses = expected(dna, raw[0].astype(float), lod, precision)
        for rotation in ("euler", "quaternion"):
            if rotation == "quaternion":
                values["joints"], losses["joints"] = turned(dna, values["joints"], losses["joints"])
            for simd in SIMD:
                what = f"seed {seed} {precision} {rotation} {simd} lod {lod}"
                rig = risorius.Rig(dna, precision=precision, rotation=rotation, simd=simd)
                assert rig.simd == simd
                pose = rig.evaluate(raw[0], lod=lod)
                if simd == "scalar":
                    scalar = pose
                for field in FIELDS:
                    near(getattr(pose, field), values[field], losses[field], f"{what} {field}")
                    near(
                        getattr(pose, field),
                        getattr(scalar, field).astype(float),
                        2 * losses[field],
                        f"{what} {field} by scalar",
                    )
                check_frames(rig, raw, lod, threads=int(seed % 3), what=what)
    return np.count_nonzero(values["joints"][:, :3])


@pytest.mark.parametrize("piece", range(PIECES))
def test_a_thousand_rigs(piece):
    seeds = range(piece * RIGS // PIECES, (piece + 1) * RIGS // PIECES)
    assert sum(check_rig(seed) for seed in seeds) > 200


def test_the_thousand_have_every_shape():
    seen = Counter()
    for seed in range(RIGS):
        _, psds, joints, lods, groups = random_shape(np.random.default_rng(seed))
        seen.update([("correctives", psds), ("joints", joints), ("LODs", lods)])
        seen.update({("rows", rows) for rows, _ in groups})
        seen.update({("columns", columns) for _, columns in groups})
        seen.update(("empty group", rows, columns) for rows, columns in groups if rows == 0)
        seen["groups", len(groups)] += 1
    wanted = [("joints", 0), ("LODs", 1), ("LODs", 33), ("groups", 0), ("correctives", 0)]
    wanted += [(side, width) for side in ("rows", "columns") for width in WIDTHS]
    wanted += [("empty group", 0, 0), ("empty group", 0, 1)]
    assert [shape for shape in wanted if seen[shape] < 10] == []
