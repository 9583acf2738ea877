# SPDX-License-Identifier: MIT
"""Tests rigs of faces with many vertices.

Joints are fitted to a simplified mesh, the rest is computed in blocks of vertices, and shapes are
stored sparsely.
"""

import numpy as np
import pytest
import risorius
from risorius.author import (
    FitOptions,
    LodOptions,
    RigOptions,
    make_joint_rig,
    meshes,
)
from risorius.author.correctives import add_correctives
from risorius.author.geometry import blocks, fewer, sparse
from risorius.author.geometry import skeleton as sk
from risorius.author.geometry import wanted as wanted_module
from risorius.author.input import shape_face
from risorius.author.measure import posed_meshes
from support import face_shapes

TOLERANCE_MM = 0.2


@pytest.fixture(scope="module")
def face():
    """A face of 506 vertices with a corrective of jawOpen and mouthSmileLeft."""
    positions, faces = face_shapes.head()
    moved = face_shapes.expressions(positions)
    mesh = shape_face.ObjMesh(positions, np.zeros((0, 2)), faces.tolist())
    shapes = shape_face.ShapeSet("egg", mesh, moved)
    dna = shape_face.make_shape_face(shapes, {name: [name] for name in moved})
    controls = tuple(sorted(list(moved).index(name) for name in ("jawOpen", "mouthSmileLeft")))
    together = face_shapes.bump(positions, 2, -6, 3)[:, None] * [0.3, 0.1, 0.2]
    return add_correctives(dna, 0, [(controls, together)])


@pytest.fixture
def few(monkeypatch):
    """Lower the limits, so that 200 vertices make a mesh large and a block has about 100."""
    for module in (blocks, meshes, sparse, wanted_module):
        monkeypatch.setattr(module, "LARGE", 200)
    monkeypatch.setattr(blocks, "_BLOCK", 100)
    monkeypatch.setattr(fewer, "_SMALL", 50)


def options(fit_vertices):
    fit = FitOptions(joints=24, rounds=6, threads=1)
    lods = LodOptions(3, vertices=(506, 300, 100))
    return RigOptions(fit, TOLERANCE_MM, lighter=False, lods=lods, fit_vertices=fit_vertices)


def test_a_large_face_keeps_the_tolerance_and_nearly_the_joints_errors(face, few):
    whole = make_joint_rig(face, options(60_000))
    told = []
    rig = make_joint_rig(face, options(250), lambda share: told.append(share) is None)
    assert told == sorted(told)
    for column in rig.columns:
        (goal,) = posed_meshes(face, column, [0], shapes=True)
        (reached,) = posed_meshes(rig.dna, column, [0], shapes=True)
        off = 10 * np.linalg.norm(goal - reached, axis=1)
        assert off.max() < TOLERANCE_MM + 1e-3
    assert rig.errors[0].vertices == 506
    assert rig.levels[0].largest_with_shapes <= TOLERANCE_MM
    assert rig.levels[0].rms < 2 * whole.levels[0].rms + 0.02
    assert [level.vertices for level in rig.levels] == [v.vertices for v in whole.levels]
    assert rig.combinations[0].largest <= TOLERANCE_MM
    assert all(mesh.maximum_influence_per_vertex < 25 for mesh in rig.dna.meshes)


def test_the_errors_of_blocks_are_the_errors_of_the_mesh(face, few):
    """Errors measured block by block equal the errors of the joints in the written file."""
    rig = make_joint_rig(face, options(250))
    errors = rig.errors[0]
    for row, column in enumerate(rig.columns):
        (goal,) = posed_meshes(face, column, [0], shapes=True)
        (reached,) = posed_meshes(rig.dna, column, [0], shapes=False)
        off = 10 * np.linalg.norm(goal - reached, axis=1)
        assert errors.joints_largest[row] == pytest.approx(off.max(), abs=2e-3)
        assert errors.joints_rms[row] == pytest.approx(np.sqrt((off**2).mean()), abs=1e-3)


def test_progress_that_says_no_stops_at_every_step(face, few):
    asked = []
    make_joint_rig(face, options(250), lambda share: asked.append(share) is None)
    for number in (0, 1, len(asked) // 2, len(asked) - 1):
        left = iter([True] * number)
        with pytest.raises(risorius.DnaError, match="stopped"):
            make_joint_rig(face, options(250), lambda _share, left=left: next(left, False))


def test_a_split_mesh_has_the_skin_and_shapes_of_its_vertices(face, few):
    mesh = face.meshes[0]
    parts = blocks.blocks_of(np.asarray(mesh.positions, np.float64))
    assert len(parts) > 3
    assert np.array_equal(np.sort(np.concatenate(parts)), np.arange(506))
    split = blocks.split_mesh(mesh, parts)
    columns = sk.column_count(face)
    whole = sk.column_shapes(face, mesh, columns)
    for vertices, part in zip(parts, split, strict=True):
        assert np.array_equal(part.positions, np.asarray(mesh.positions)[vertices])
        own = sk.column_shapes(face, part, columns)
        for column, delta in whole.items():
            none = np.zeros((len(vertices), 3))
            assert np.array_equal(own.get(column, none), delta[vertices])
        assert np.array_equal(sk.dense_weights(part, 2), sk.dense_weights(mesh, 2)[vertices])
    joined = blocks.joined_targets(
        [(v, part.blend_shape_targets) for v, part in zip(parts, split, strict=True)]
    )
    for before, after in zip(mesh.blend_shape_targets, joined, strict=False):
        assert len(before.vertex_indices) == len(after.vertex_indices) or len(joined) > 1


def test_sparse_shapes_give_what_they_were_given():
    rng = np.random.default_rng(0)
    some = np.where(rng.random((50, 1)) < 0.3, rng.normal(size=(50, 3)), 0.0)
    shapes = sparse.SparseShapes(50, {"a": some})
    shapes.add("b", some[:20], 0)
    shapes.add("b", some[20:], 20)
    shapes.take("c", shapes, "a")
    for name in "abc":
        assert np.array_equal(shapes[name], some)
    del shapes["a"]
    assert list(shapes) == ["b", "c"]
    assert "a" not in shapes
    assert list(sparse.subset(shapes, ["c"])) == ["c"]
