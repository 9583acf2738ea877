# SPDX-License-Identifier: MIT
"""Compares random faces with oracle.py, which evaluates in double precision.

The sizes of the faces are near multiples of the SIMD widths.
"""

import numpy as np
import oracle
import pytest
import risorius
from risorius import _native

SIMD = _native.available_simd().split(", ")
LANES = 8  # of AVX2
WIDTHS = [0, 1, LANES - 1, LANES, LANES + 1, 2 * LANES, 100]


def random_group(rng, dna, control_count, rows, columns):
    """A joint group with zeros, several columns of a control, and fewer rows at some LODs."""
    values = rng.uniform(-3, 3, (rows, columns)) * (rng.random((rows, columns)) < 0.7)
    lods = sorted((int(n) for n in rng.integers(0, rows + 1, dna.lod_count - 1)), reverse=True)
    return risorius.JointGroup(
        lods=[rows, *lods],
        input_indices=rng.integers(0, control_count, columns),
        output_indices=rng.permutation(len(dna.joint_names) * 9)[:rows],
        values=values.astype(np.float32),
    )


def random_table(rng, rows, inputs, outputs):
    """A table with up to three successive rows for an input and output; some swap from and to."""
    pairs = [(rng.integers(inputs), rng.integers(outputs)) for _ in range(rows)]
    pairs = [pairs[r - r % 3] if rng.random() < 0.7 else pairs[r] for r in range(rows)]
    bounds = rng.choice([-0.5, 0, 0.25, 0.5, 0.75, 1, 1.5], (rows, 2))
    return risorius.Conditionals(
        input_indices=[int(i) for i, _ in pairs],
        output_indices=[int(o) for _, o in pairs],
        from_values=bounds[:, 0],
        to_values=bounds[:, 1],
        slope_values=rng.uniform(-1, 1, rows),
        cut_values=rng.uniform(-0.25, 0.5, rows),
    )


def random_psds(rng, raw, count):
    """Random correctives of raw controls and other correctives, without cycles, in mixed order."""
    order = rng.permutation(count)
    entries = []
    for rank, p in enumerate(order):
        pool = [*range(raw), *(raw + int(q) for q in order[:rank])]
        picks = rng.choice(pool, min(len(pool), int(rng.integers(1, 5))), replace=False)
        entries += [(raw + int(p), int(c), rng.uniform(0.5, 1.5)) for c in picks]
    entries = [entries[i] for i in rng.permutation(len(entries))]
    return risorius.Psds(
        rows=[e[0] for e in entries],
        columns=[e[1] for e in entries],
        values=[e[2] for e in entries],
    )


def random_face(seed, width):
    """A face with joint groups around the SIMD width.

    Their sizes (rows, columns) are combinations of `width` and LANES + 1, and (70, 3).
    """
    rng = np.random.default_rng(seed)
    raw, psds, joints, lods = 12, 9, 60, 3
    dna = risorius.Dna()
    dna.lod_count = lods
    dna.raw_control_names = [f"raw{i}" for i in range(raw)]
    dna.gui_control_names = [f"gui{i}" for i in range(raw)]
    dna.joint_names = [f"joint{i}" for i in range(joints)]
    dna.joint_parents = [0] * joints
    dna.neutral_joint_translations = np.zeros((joints, 3))
    dna.neutral_joint_rotations = np.zeros((joints, 3))
    dna.blend_shape_channel_names = [f"shape{i}" for i in range(10)]
    dna.animated_map_names = [f"map{i}" for i in range(6)]
    dna.psd_count = psds
    dna.psds = random_psds(rng, raw, psds)
    dna.gui_to_raw = random_table(rng, 40, raw, raw)
    controls = raw + psds
    shapes = [(width, width), (width, LANES + 1), (LANES + 1, width), (70, 3)]
    dna.joint_groups = [random_group(rng, dna, controls, *shape) for shape in shapes]
    dna.blend_shape_channels = risorius.BlendShapeChannels(
        lods=[10, 4, 0],
        input_indices=rng.integers(0, controls, 10),
        output_indices=rng.permutation(10),
    )
    dna.animated_maps = risorius.AnimatedMaps(
        lods=[30, 13, 5], conditionals=random_table(rng, 30, controls, 6)
    )
    return dna


def random_raw(seed, count, frames=6):
    """Sparse random controls, some outside 0 to 1, some exactly at bounds of table rows."""
    rng = np.random.default_rng(seed)
    raw = rng.uniform(-0.5, 1.5, (frames, count)) * (rng.random((frames, count)) < 0.6)
    raw[0] = rng.choice([0, 0.25, 0.5, 0.75, 1], count)
    return raw.astype(np.float32)


def assert_near(actual, wanted, what):
    values, bounds = wanted
    excess = np.abs(actual.astype(float).ravel() - values) - bounds
    worst = int(np.argmax(excess)) if excess.size else 0
    assert excess.size == 0 or excess[worst] <= 0, (
        f"{what}[{worst}]: {actual.ravel()[worst]}, oracle {values[worst]} +- {bounds[worst]}"
    )


@pytest.mark.parametrize("settle", [True, False])
@pytest.mark.parametrize("simd", SIMD)
@pytest.mark.parametrize("width", WIDTHS)
def test_random_face_is_what_the_oracle_says(width, simd, settle):
    dna = random_face(width + 1, width)
    rig = risorius.Rig(dna, simd=simd)
    moved = 0
    for frame, raw in enumerate(random_raw(width, len(dna.raw_control_names))):
        for lod in range(dna.lod_count):
            pose = rig.evaluate(raw, lod=lod, settle=settle)
            joints, shapes, maps, controls = oracle.evaluate(
                dna, raw.astype(float), lod, settle=settle
            )
            where = f"frame {frame} lod {lod} "
            assert_near(pose.controls, controls, where + "controls")
            assert_near(pose.joints, joints, where + "joints")
            assert_near(pose.blend_shapes, shapes, where + "shapes")
            assert_near(pose.animated_maps, maps, where + "maps")
            moved += np.count_nonzero(pose.joints)
    assert moved > 100


def test_settling_changes_faces_whose_correctives_read_correctives():
    dna = random_face(3, 9)
    rig = risorius.Rig(dna)
    raw = np.ones(len(dna.raw_control_names), np.float32)
    settled, first = rig.evaluate(raw), rig.evaluate(raw, settle=False)
    assert not np.array_equal(settled.controls, first.controls)


def test_settled_pose_is_the_instance_at_rest():
    dna = random_face(4, 9)
    rig = risorius.Rig(dna)
    for raw in random_raw(4, len(dna.raw_control_names)):
        instance = rig.instance()
        for _ in range(dna.psd_count + 1):
            pose = instance.evaluate(raw)
        np.testing.assert_array_equal(pose.controls, rig.evaluate(raw).controls)
        np.testing.assert_array_equal(pose.joints, rig.evaluate(raw).joints)


@pytest.mark.parametrize("seed", range(5))
def test_gui_table_is_what_the_oracle_says(seed):
    dna = random_face(seed, 1)
    rig = risorius.Rig(dna)
    rows = len(dna.gui_to_raw.input_indices)
    for gui in random_raw(seed + 100, len(dna.gui_control_names)):
        wanted = oracle.table(dna.gui_to_raw, rows, gui.astype(float), len(dna.raw_control_names))
        assert_near(rig.gui_to_raw(gui), wanted, "raw")


@pytest.mark.parametrize("threads", [0, 1, 2, 3, 100])
def test_batch_rows_are_single_evaluations(threads):
    dna = random_face(5, 17)
    rig = risorius.Rig(dna)
    raw = random_raw(5, len(dna.raw_control_names), frames=23)
    batch = rig.evaluate_batch(raw, lod=1, threads=threads)
    assert batch.joints.shape == (23, rig.joint_count, 9)
    for row, values in enumerate(raw):
        single = rig.evaluate(values, lod=1)
        for field in ("joints", "blend_shapes", "animated_maps", "controls"):
            np.testing.assert_array_equal(getattr(batch, field)[row], getattr(single, field))


def test_batch_without_rows_is_empty():
    rig = risorius.Rig(random_face(6, 4))
    empty = rig.evaluate_batch(np.zeros((0, len(rig.raw_control_names)), np.float32))
    assert empty.joints.shape == (0, rig.joint_count, 9)
