# SPDX-License-Identifier: MIT
"""Tests of the transfer of expressions to heads for which the right result can be computed."""

from __future__ import annotations

import numpy as np
import pytest
from risorius.anyhead.errors import AnyHeadError, Stopped
from risorius.anyhead.onto import whole_ways
from risorius.anyhead.surface import Surface
from risorius.anyhead.transfer.template import left_over, read_template
from risorius.anyhead.transfer.transfer import TransferOptions, transfer
from risorius.author.correctives import add_correctives
from risorius.author.geometry.rigid import rigid_fit
from risorius.author.input.obj import ObjMesh
from risorius.author.input.shape_face import ShapeSet, make_shape_face

from tests.python.support import face_shapes

SMILE, BLINK = "mouthCornerPullL", "eyeBlinkL"
NAMES = {"mouthSmileLeft": SMILE, "eyeBlinkLeft": BLINK, "jawOpen": "jawOpen"}


def face(unit="cm", scale=1.0):
    """(face, displacements of its three expressions in cm, displacement of its corrective in cm).

    Args:
        unit: unit that the face states.
        scale: factor of all lengths of the face in cm.
    """
    points, faces = face_shapes.head()
    ways = {NAMES[n]: d for n, d in face_shapes.expressions(points).items() if n in NAMES}
    mesh = ObjMesh(scale * points, np.zeros((0, 2)), faces.tolist(), [[]] * len(faces))
    shapes = ShapeSet("small", mesh, {n: scale * d for n, d in ways.items()}, unit=unit)
    dna = make_shape_face(shapes, {n: [n] for n in ways})
    more = 0.1 * scale * face_shapes.bump(points, 3, -5, 4)[:, None] * [0.0, 0.0, 1.0]
    raw = [n.rpartition(".")[2] for n in dna.raw_control_names]
    both = tuple(sorted((raw.index("jawOpen"), raw.index(SMILE))))
    return add_correctives(dna, 0, [(both, more)]), ways, more / scale


@pytest.fixture(scope="module")
def template():
    return read_template(face()[0])


def on(template, points, target=None, **options):
    """Transfer the template's expressions to a head, and return its displacements by pose.

    Args:
        template: the TemplateFace to transfer from.
        points: positions of the template's vertices on the head.
        target: surface of the head; None: the template's triangles with these points.
        options: fields of TransferOptions.
    """
    target = target or Surface(points, template.surface.triangles)
    return transfer(
        template, target, points, np.ones(len(points)), TransferOptions(threads=1, **options)
    ).ways


def test_a_template_has_its_controls_and_what_is_left_over_in_cm(template) -> None:
    _, ways, more = face()
    for name, way in ways.items():
        assert np.abs(template.ways[(name,)] - way).max() < 1e-4
    (pose,) = [pose for pose in template.ways if len(pose) == 2]
    assert set(pose) == {SMILE, "jawOpen"}
    assert np.abs(left_over(template.ways)[pose] - more).max() < 1e-3
    metres = read_template(face("m", 0.01)[0])
    assert np.abs(metres.surface.points - template.surface.points).max() < 1e-4
    assert np.abs(metres.ways[(SMILE,)] - template.ways[(SMILE,)]).max() < 1e-4


def test_a_file_with_other_axes_stands_as_any_other(template) -> None:
    dna = face()[0]
    dna.coordinate_system = ("left", "up", "front")  # mirrors the x axis
    turned = read_template(dna)
    assert np.abs(turned.surface.points - template.surface.points * [-1, 1, 1]).max() < 1e-6
    assert (turned.surface.normals()[:, 2] > 0).mean() > 0.9


def test_the_same_head_gets_the_same_expressions(template) -> None:
    got = on(template, template.surface.points)
    for name in (SMILE, BLINK, "jawOpen"):
        assert np.abs(got[(name,)] - template.ways[(name,)]).max() < 0.01
    whole = whole_ways(got)
    for pose, way in template.ways.items():
        assert np.abs(whole[pose] - way).max() < 0.01


def test_a_small_head_smiles_less_and_opens_its_jaw_by_the_same_angle(template) -> None:
    points = 0.5 * template.surface.points
    got = on(template, points)
    assert np.abs(got[(SMILE,)] - 0.5 * template.ways[(SMILE,)]).max() < 0.01
    before, jaw = template.surface.points, template.ways[("jawOpen",)]
    held = np.flatnonzero(before[:, 1] < -9)
    turns = [rigid_fit(p[held], p[held] + way[held])[0]
             for p, way in ((before, jaw), (points, got[("jawOpen",)]))]  # fmt: skip
    angles = [np.degrees(np.arccos((np.trace(turn) - 1) / 2)) for turn in turns]
    assert angles[1] == pytest.approx(angles[0], abs=0.5)


def test_a_wider_head_has_a_wider_smile_and_no_longer_one(template) -> None:
    points = template.surface.points * [1.3, 1.0, 1.0]
    ratio = on(template, points)[(SMILE,)].sum(axis=0) / template.ways[(SMILE,)].sum(axis=0)
    assert ratio[0] == pytest.approx(1.3, abs=0.1)
    assert ratio[1] == pytest.approx(1.0, abs=0.05)


def finer(points, triangles):
    """Points and triangles of a surface, each triangle split into four at its edges' middles."""
    edges, rows = np.unique(
        np.sort(triangles[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1),
        axis=0, return_inverse=True,
    )  # fmt: skip
    new = len(points) + rows.reshape(-1, 3)
    a, b, c, ab, bc, ca = *triangles.T, *new.T
    made = [(a, ab, ca), (ab, b, bc), (ca, bc, c), (ab, bc, ca)]
    return np.concatenate([points, points[edges].mean(axis=1)]), np.concatenate(
        [np.stack(t, axis=1) for t in made]
    )


def test_other_triangles_and_what_the_template_does_not_have(template) -> None:
    points, triangles = finer(template.surface.points, template.surface.triangles)
    hair = points[:3] * 2.0 + [0, 8.0, 0]  # far from all skin
    target = Surface(
        np.concatenate([points, hair]),
        np.concatenate([triangles, [[len(points) + k for k in range(3)]]]),
    )
    got = on(template, template.surface.points, target)[(SMILE,)]
    old = len(template.surface.points)
    assert np.abs(got[:old] - template.ways[(SMILE,)]).max() < 0.02
    assert not got[len(points) :].any()
    grown = np.linalg.norm(np.diff(got[target.edges()], axis=1)[:, 0], axis=1)
    assert grown.max() < 0.5


def test_a_hole_of_the_template_is_filled_from_around_it(template) -> None:
    trust = np.ones(len(template.surface.points))
    middle = np.linalg.norm(template.surface.points - [3, -5, 8], axis=1) < 1.5
    points = template.surface.points + 5.0 * middle[:, None] * np.array([0.0, 0.0, 1.0])
    found = transfer(template, template.surface, points, np.where(middle, 0.0, trust),
                     TransferOptions(threads=1))  # fmt: skip
    assert middle.sum() > 3
    off = np.linalg.norm(found.ways[(SMILE,)] - template.ways[(SMILE,)], axis=1)
    assert off[middle].max() < 0.5 * np.linalg.norm(template.ways[(SMILE,)], axis=1).max()


def slit():
    """Points in cm and quads of two plates, edge to edge with a gap of 0.2 mm, as two lips.

    Also returns the number of vertices of the upper plate, which come first.
    """
    x, y = np.meshgrid(np.linspace(-2, 2, 21), np.linspace(0.01, 4, 21))
    up = np.stack([x, y, 0 * x], axis=-1).reshape(-1, 3)
    corner = np.arange(21 * 21).reshape(21, 21)
    a, b, c, d = (corner[:-1, :-1], corner[:-1, 1:], corner[1:, 1:], corner[1:, :-1])
    quads = np.stack([a, b, c, d], axis=-1).reshape(-1, 4)
    both = np.concatenate([quads, quads[:, ::-1] + len(up)])
    return np.concatenate([up, up * [1, -1, 1]]), both, len(up)


def test_no_vertex_is_torn_across_a_slit_that_the_template_misses_by_two_millimetres() -> None:
    points, quads, half = slit()
    down = np.zeros_like(points)
    down[half:] = [0, -2.0, 0]
    mesh = ObjMesh(points, np.zeros((0, 2)), quads.tolist(), [[]] * len(quads))
    shapes = ShapeSet("lips", mesh, {"mouthLowerLipDepressL": down})
    names = {n: [n] for n in shapes.expressions}
    template = read_template(make_shape_face(shapes, names))
    got = on(template, points + np.array([0, 0.2, 0]), Surface(points, template.surface.triangles))
    ((_, way),) = got.items()
    assert np.abs(way[:half, 1]).max() < 0.4  # the upper plate does not move
    assert np.abs(way[half:, 1] + 2).max() < 0.4


def test_strength_is_a_factor_and_meets_its_own_square(template) -> None:
    points = template.surface.points
    half, whole = on(template, points, strength=0.5), on(template, points)
    assert np.abs(half[(SMILE,)] - 0.5 * whole[(SMILE,)]).max() < 0.003
    (pose,) = [pose for pose in whole if len(pose) == 2]
    assert np.abs(half[pose] - 0.25 * whole[pose]).max() < 0.003
    assert not any(way.any() for way in on(template, points, strength=0.0).values())
    with pytest.raises(AnyHeadError, match=r"strength: a number from 0 to 1\.5 was expected"):
        on(template, points, strength=2.0)


def test_whoever_is_told_may_stop_it_and_a_head_elsewhere_is_refused(template) -> None:
    points, dna = template.surface.points, face()[0]
    surface = Surface(points, template.surface.triangles)
    with pytest.raises(Stopped):
        transfer(template, surface, points, np.ones(len(points)), None, lambda share: share < 0.5)
    with pytest.raises(Stopped):
        read_template(dna, lambda _: False)
    with pytest.raises(AnyHeadError, match="no part of the head"):
        on(template, points + 100.0, surface)


def test_a_file_without_expressions_is_no_template() -> None:
    dna = face()[0]
    for mesh in (meshes := list(dna.meshes)):
        mesh.blend_shape_targets = []
    dna.meshes = meshes
    with pytest.raises(ValueError, match="controls that move the skin were expected"):
        read_template(dna)
