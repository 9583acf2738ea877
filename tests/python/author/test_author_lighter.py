# SPDX-License-Identifier: MIT
"""A made rig has at most as many deltas as its input.

The last line of the command states its numbers of joints and deltas, its size and its errors.
"""

import re

import command_line
import dna_bytes
import face_shapes
import numpy as np
import pytest
from risorius.author import FitOptions, LodOptions, RigOptions, make_joint_rig
from risorius.author.correctives import add_correctives
from risorius.author.input import shape_face
from risorius.author.joint_rig import lighten
from risorius.author.measure import posed_meshes
from risorius.author.work import TOLERANCE

POSITIONS, FACES = face_shapes.head()
HEIGHT_MM = 10 * np.ptp(POSITIONS[:, 1])
ARKIT = ("jawOpen", "mouthSmileLeft", "mouthSmileRight", "browOuterUpLeft")


def noise():
    return np.random.default_rng(5).normal(0, 0.2, (len(POSITIONS), 3))


HEADS = {
    "sparse": {n: face_shapes.bump(POSITIONS, x, 2, 1.7)[:, None] * [0, 0.3, 0.8]
               for n, x in zip(ARKIT, (-4, -2, 2, 4), strict=True)},
    "one shape": {"jawOpen": face_shapes.expressions(POSITIONS)["jawOpen"]},
    "dense noise": {name: (k + 1) * noise() for k, name in enumerate(ARKIT)},
    "smooth": face_shapes.expressions(POSITIONS),
}  # fmt: skip


def face_of(shapes):
    mesh = shape_face.ObjMesh(POSITIONS, np.zeros((0, 2)), [list(f) for f in FACES])
    became = {name: [name] for name in shapes}
    return shape_face.make_shape_face(shape_face.ShapeSet("x", mesh, shapes), became)


def deltas(dna):
    """The number of nonzero blend shape deltas at LOD 0."""
    read = dna_bytes.Face(dna.to_bytes())
    meshes = [dna.meshes[m] for m in read.lod_meshes[0]]
    return sum(int(np.asarray(t.deltas).any(axis=1).sum()) for m in meshes
               for t in m.blend_shape_targets)  # fmt: skip


def options(tolerance_mm):
    fit = FitOptions(joints=6, rounds=3)
    return RigOptions(fit, tolerance_mm, lods=LodOptions(count=1))


@pytest.mark.parametrize("tolerance_mm", [0.0, 0.05, None])
@pytest.mark.parametrize("head", HEADS)
def test_no_head_becomes_heavier(head, tolerance_mm):
    face = face_of(HEADS[head])
    rig = make_joint_rig(face, options(tolerance_mm))
    assert (deltas(face), deltas(rig.dna)) == (rig.deltas_before, rig.deltas_after)
    assert rig.deltas_after <= rig.deltas_before
    asked = TOLERANCE * HEIGHT_MM if tolerance_mm is None else tolerance_mm
    assert rig.raised == (rig.tolerance_mm > asked + 1e-6)
    (errors,) = rig.errors
    for row, column in enumerate(rig.columns):  # the file confirms the reported errors
        (reached,) = posed_meshes(rig.dna, column, [0], shapes=True)
        (goal,) = posed_meshes(face, column, [0], shapes=True)
        off = 10 * np.linalg.norm(reached - goal, axis=1).max()
        assert off <= max(errors.largest[row], 0) + 2e-3
    assert rig.levels[0].largest_with_shapes == errors.largest.max()


def test_so_many_deltas_are_kept_as_came_in_and_the_longest():
    face = face_of(HEADS["dense noise"])
    every = make_joint_rig(face, RigOptions(options(0.0).fit, 0.0, lighter=False))
    face.meshes[0].blend_shape_targets = face.meshes[0].blend_shape_targets[:1]
    lighten(every, face)
    assert every.raised
    assert 0.95 * every.deltas_before < every.deltas_after <= every.deltas_before
    lengths = np.concatenate([np.linalg.norm(t.deltas, axis=1)
                              for t in every.dna.meshes[0].blend_shape_targets])  # fmt: skip
    assert 10 * lengths.min() > every.tolerance_mm


def test_correctives_that_were_found_count_as_output_alone():
    face = face_of(HEADS["smooth"])
    more = add_correctives(face, 0, [((0, 1), noise()), ((0, 2), noise()), ((1, 2), noise())])
    rig = make_joint_rig(more, options(0.0))
    lighten(rig, face)
    assert deltas(rig.dna) == rig.deltas_after <= rig.deltas_before == deltas(face)
    assert max(c.largest for c in rig.combinations) > 0.1


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    folder = tmp_path_factory.mktemp("trade")
    more = "rounds = 3\n[lods]\ncount = 1\n"
    face_shapes.write_all(folder, joints=8, more=more)
    return folder


@pytest.mark.parametrize(
    ("tolerance", "mm"), [("0.4mm", 0.4), ("0.2%", 0.002 * HEIGHT_MM), ("2", 2.0), ("0", None)]
)
def test_the_last_line_states_the_trade(folder, tmp_path, capsys, tolerance, mm):
    out = tmp_path / "a.dna"
    spec = folder / "spec.toml"
    done = command_line.run("author", spec, "-o", out, "--tolerance", tolerance, text=True)
    assert done.returncode == 0, done.stderr
    *_, note, last = done.stdout.splitlines()
    trade = re.fullmatch(
        r".*a\.dna: (\d+) new joints, deltas ([\d,]+) -> ([\d,]+), ([\d,]+) bytes, largest error "
        r"([\d.]+) mm \(by joints alone ([\d.]+)\), RMS by joints alone ([\d.]+) % of (\d+) mm",
        last,
    )
    joints, before, after, size, largest, alone, _, height = (
        float(text.replace(",", "")) for text in trade.groups()
    )
    assert (joints, size, height) == (8, out.stat().st_size, round(HEIGHT_MM))
    assert after <= before
    assert largest <= alone
    if mm is None:
        assert note.startswith("note: blend shapes keep what joints leave beyond")
    else:
        assert largest <= mm
        assert not note.startswith("note")


@pytest.mark.parametrize("text", ["-1", "nan", "x", "101%", "1cm"])
def test_a_tolerance_that_is_none_is_one_sentence(folder, tmp_path, text):
    given = f"--tolerance={text}"
    done = command_line.run(
        "author", folder / "spec.toml", "-o", tmp_path / "a.dna", given, text=True
    )
    assert done.returncode == 2
    assert "--tolerance" in done.stderr
    assert not (tmp_path / "a.dna").exists()
