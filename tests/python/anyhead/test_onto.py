# SPDX-License-Identifier: MIT
"""Tests of `risorius author --onto`: from the file of a head without expressions to a rig."""

from __future__ import annotations

import numpy as np
import pytest
from risorius import AnimatedMaps, Conditionals, Rig, load
from risorius.anyhead.form.heads import head_form
from risorius.anyhead.reading import read_head
from risorius.author.correctives import add_correctives
from risorius.author.input.obj import ObjMesh
from risorius.author.input.shape_face import ShapeSet, make_shape_face
from risorius.author.levels import extend_levels
from risorius.solving.surface import Surface as Posed

from tests.python.support.command_line import run
from tests.python.support.face_shapes import write_obj

FEW = "[joints]\ncount = 6\nrounds = 2\n[lods]\ncount = 3\n"
CONTROLS = {"jaw_open": "jawOpen", "smile": "mouthCornerPullL", "pucker": "mouthFunnelUL"}
RAW = ["tongueOut", *CONTROLS.values()]  # raw controls of the template; the first moves nothing
# Rows (input, output, from, to, slope, cut) of the template's GUI controls; its second GUI control
# drives only the control that heads lack.
GUI = [(2, 0, -1, 0, -1, 0), (2, 2, 0, 1, 0.5, 0.25), (1, 0, 0, 1, 1, 0), (0, 1, 0, 1, 1, 0)]
# Rows of its animated maps. Inputs are raw controls 0 to 3, then correctives of these controls.
PAIRS = [(0, 1), (1, 2)]
MAPS = [(0, 0, 0, 1, 1, 0), (2, 1, 0, 1, 0.75, 0.125), (5, 0, 0, 1, 0.5, 0), (4, 2, 0, 1, 1, 0),
        (1, 2, 0.5, 1, 1, -0.25), (3, 1, 0, 1, 0.25, 0)]  # fmt: skip


def table(rows):
    """Conditionals of rows (input, output, from, to, slope, cut)."""
    names = ("input_indices", "output_indices", "from_values", "to_values")
    columns = zip(*rows, strict=True)
    return Conditionals(**dict(zip((*names, "slope_values", "cut_values"), columns, strict=True)))


@pytest.fixture(scope="module")
def template(tmp_path_factory):
    """The path of a DNA file of the mean head with three expressions and two LODs."""
    form = head_form()
    every = zip(form.expression_names, form.expressions, strict=True)
    moved = {CONTROLS[name]: way[: form.skin] for name, way in every if name in CONTROLS}
    ways = {name: moved.get(name, np.zeros((form.skin, 3))) for name in RAW}
    faces = form.triangles.tolist()
    mesh = ObjMesh(form.mean[: form.skin], np.zeros((0, 2)), faces, [[]] * len(faces))
    dna = make_shape_face(ShapeSet("mean", mesh, ways), {name: [name] for name in ways})
    dna = add_correctives(dna, 0, [(pair, 0.2 * ways[RAW[pair[1]]]) for pair in PAIRS])
    extend_levels(dna, 2)
    dna.gui_control_names, dna.gui_to_raw = ["a.ty", "b.ty", "c.ty"], table(GUI)
    dna.animated_map_names = ["flush", "wrinkle_L", "wrinkle_R"]
    dna.lod_animated_map_mapping = [[0, 1, 2], [0, 1]]
    dna.animated_maps = AnimatedMaps(lods=[6, 3], conditionals=table(MAPS))
    path = tmp_path_factory.mktemp("template") / "mean.dna"
    dna.save(path)
    return path


@pytest.fixture(scope="module")
def head(tmp_path_factory):
    """Path of the OBJ file of another head, and the head's points in cm.

    The file has z up, metres, and triangles in another order.
    """
    form = head_form()
    parts = np.zeros(len(form.parts))
    parts[[1, 3, 5]] = 1.0, -1.0, 0.7
    points = form.shaped(parts, np.zeros(len(form.expressions)))[: form.skin]
    path = tmp_path_factory.mktemp("head") / "anna.obj"
    order = np.random.default_rng(1).permutation(len(form.triangles))
    write_obj(path, 0.01 * points @ [[1, 0, 0], [0, 0, 1], [0, -1, 0]], form.triangles[order])
    return path, points


def test_a_head_without_expressions_becomes_a_rig(template, head, tmp_path) -> None:
    path, points = head
    out, spec, marks = tmp_path / "anna.dna", tmp_path / "few.toml", tmp_path / "marks.json"
    spec.write_text(FEW)
    done = run("author", "--onto", path, template, "-o", out, "--rig", spec, "--threads", 1,
               "--write-landmarks", marks, "--exact", text=True)  # fmt: skip
    assert done.returncode == 0, done.stderr
    assert "its top is +z" in done.stdout
    assert "backs" not in done.stdout
    assert '"mouth_corner_L"' in marks.read_text()
    dna = load(out)
    names = [name.rpartition(".")[2] for name in dna.raw_control_names]
    assert set(CONTROLS.values()) <= set(names)
    posed = Posed(dna, Rig(dna))
    mesh = dna.mesh_names.index("anna_lod0_mesh")
    rest, open_ = (posed.positions(raw, mesh) for raw in
                   (np.zeros(len(names)), np.eye(len(names))[names.index("jawOpen")]))  # fmt: skip
    assert np.abs(rest - points).max() < 0.01  # converted to y up and cm
    place = dna.neutral_joint_translations[dna.joint_names.index("head")]
    assert abs(place[0]) < 1  # between the ears
    assert points[:, 1].min() < place[1] < points[:, 1].max()
    form = head_form()
    wanted = form.expressions[form.expression_names.index("jaw_open")][: form.skin]
    moves = np.linalg.norm(wanted, axis=1) > 0.1
    assert np.linalg.norm(open_ - rest - wanted, axis=1)[moves].mean() < 0.3
    check_tables(load(template), dna, names)


def check_tables(template, dna, names) -> None:
    """Check that the face board and the animated maps of a template drive and follow the raw
    controls of a face as in the template."""
    assert names == RAW[1:]
    assert [str(issue) for issue in dna.validate()] == []
    one, other = Rig(template), Rig(dna)
    random = np.random.default_rng(3)
    gui = random.uniform(-1, 1, (20, 3))
    assert dna.gui_control_names == ["a.ty", "c.ty"]
    for row in gui:
        raw = one.gui_to_raw(row)
        np.testing.assert_array_equal(other.gui_to_raw(row[[0, 2]]), raw[1:])
    assert dna.animated_map_names == template.animated_map_names
    assert dna.lod_count == 3
    assert [list(dna.lod_animated_map_mapping[lod]) for lod in range(3)] == [
        [0, 1, 2],
        [0, 1],
        [0, 1],
    ]
    for raw in random.uniform(0, 1, (20, 3)):
        whole = np.append(0, raw)  # the head lacks the first control and its corrective
        for lod in range(3):
            wanted = one.evaluate(whole, lod=min(lod, 1)).animated_maps
            np.testing.assert_array_equal(other.evaluate(raw, lod=lod).animated_maps, wanted)


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["--strength", "1"], "--strength is of --onto HEAD, which is missing"),
        (["--onto", "HEAD", "--names"], "--names is of a head with expressions"),
        (["--onto", "HEAD"], "-o OUT.dna was expected"),
        (["--onto", "HEAD", "spec.toml", "-o", "x.dna"], "--rig takes a SPEC.toml"),
        (["--onto", "HEAD", "-o", "x.dna", "--strength", "2"], "1.5"),
    ],
)
def test_options_that_do_not_go_together(words, said) -> None:
    done = run("author", *words, text=True)
    assert done.returncode == 2
    assert said in done.stderr


def test_heads_that_cannot_be_used(template, tmp_path) -> None:
    write_obj(tmp_path / "ball.obj", np.eye(3), [[0, 1, 2]])
    (tmp_path / "empty").mkdir()
    for name, said in (
        ("ball.obj", "ball.obj"),
        ("empty", "a folder with OBJ files was expected"),
        ("head.blend", "Make Rig from Head"),
        ("nothing.obj", "nothing.obj"),
    ):
        out = tmp_path / "out.dna"
        done = run("author", "--onto", tmp_path / name, template, "-o", out, text=True)
        assert done.returncode == 1, name
        assert said in done.stderr
        assert done.stderr.count("\n") == 1
        assert not out.exists()


def test_the_objects_of_an_obj_are_meshes_of_their_names(tmp_path) -> None:
    (tmp_path / "head.obj").write_text(
        "o Head\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n"
        "o Eye Left\nv 5 0 0\nv 6 0 0\nv 5 1 0\nf 4 5 6\n"
    )
    parts, unit = read_head(tmp_path / "head.obj")
    assert unit == "cm"
    assert [(part.name, part.source, len(part.mesh.positions)) for part in parts] == [
        ("Head", "Head", 3),
        ("Eye Left", "Eye Left", 3),
    ]
