# SPDX-License-Identifier: MIT
"""Tests of conform, which gives a face the form of another head but keeps its topology."""

import copy
import json
from types import SimpleNamespace

import face_shapes
import jointed_face
import numpy as np
import oracle
import pytest
import risorius
import skin_oracle
from risorius.anyhead.conform import conform, conform_face, head, is_same_topology
from risorius.anyhead.conform.parts import Ball
from risorius.anyhead.errors import Stopped
from risorius.anyhead.laying import Laid
from risorius.author.geometry import skeleton as sk
from risorius.author.heads.parts import HeadPart
from risorius.author.input.obj import ObjMesh
from risorius.base.errors import ArgumentError
from risorius.cli import main

pytestmark = pytest.mark.filterwarnings("ignore:.*several axes")
SKIN = "head_lod0_mesh"
LID = 12  # a joint of the skin that `face` turns into the joint of the left lid
EYES = {"eyeLeft_lod0_mesh": (6, (3, 3, 6)), "eyeRight_lod0_mesh": (7, (-3, 3, 6))}


def ball(middle, joint, radius=1.3, rings=8, around=12):
    """A sphere of quads and two fans of triangles, skinned to one joint."""
    up = np.linspace(0, np.pi, rings + 1)[1:-1]
    turn = np.arange(around) * 2 * np.pi / around
    ring = np.stack(
        [np.outer(np.sin(up), np.cos(turn)), np.outer(np.sin(up), np.sin(turn))], axis=-1
    )
    height = np.repeat(np.cos(up), around).reshape(len(up), around, 1)
    points = np.concatenate([ring, height], axis=-1).reshape(-1, 3)
    points = radius * np.concatenate([points, [[0, 0, 1], [0, 0, -1]]]) + middle
    at = np.arange(len(up) * around).reshape(len(up), around)
    after = np.roll(at, -1, axis=1)
    faces = [
        list(q)
        for q in zip(at[:-1].flat, at[1:].flat, after[1:].flat, after[:-1].flat, strict=True)
    ]
    faces += [[len(points) - 2, a, b] for a, b in zip(at[0], after[0], strict=True)]
    faces += [[len(points) - 1, b, a] for a, b in zip(at[-1], after[-1], strict=True)]
    flat = np.arange(len(points))
    return risorius.Mesh(
        positions=points, normals=(points - middle) / radius, texture_coordinates=points[:, :2],
        layout_positions=flat, layout_texture_coordinates=flat, layout_normals=flat,
        face_offsets=np.cumsum([0, *map(len, faces)]), face_layouts=np.concatenate(faces),
        maximum_influence_per_vertex=1, skin_offsets=np.arange(len(points) + 1),
        skin_weights=np.ones(len(points)), skin_joint_indices=np.full(len(points), joint),
    )  # fmt: skip


def with_lid(mesh):
    """The skin with a left lid skinned to a joint in the eye's centre, so that it slides."""
    lid = (np.abs(mesh.positions[:, :2] - 3.0) < 1.7).all(axis=1)
    joints = np.array(mesh.skin_joint_indices).reshape(-1, 4)
    weights = np.array(mesh.skin_weights).reshape(-1, 4)
    joints[lid], weights[lid] = [LID, 0, 1, 2], [1, 0, 0, 0]
    mesh.skin_joint_indices, mesh.skin_weights = joints.ravel(), weights.ravel()
    return mesh


@pytest.fixture(scope="module")
def face():
    """A face with rotated joints, two eyeballs and three LODs."""
    dna = jointed_face.build()
    eyes = [ball(middle, joint) for joint, middle in EYES.values()]
    dna.meshes = [*map(with_lid, dna.meshes), *eyes]
    dna.mesh_names = [*dna.mesh_names, *EYES]
    dna.lod_mesh_mapping = [[0, 3, 4], [1], [2]]
    places = sk.world_matrices(dna, np.zeros((len(dna.joint_names), 9)))[:, :3, 3]
    places[LID] = EYES["eyeLeft_lod0_mesh"][1]
    dna.neutral_joint_rotations = np.random.default_rng(4).uniform(-40, 40, places.shape)
    turns = sk.world_matrices(dna, np.zeros((len(places), 9)))[:, :3, :3]
    parents = np.asarray(dna.joint_parents, np.int64)
    local = np.einsum("jki,jk->ji", turns[parents], places - places[parents])
    local[0] = places[0]
    dna.neutral_joint_translations = local
    return risorius.load(dna.to_bytes())


def skin_points(dna):
    return np.asarray(dna.meshes[0].positions, np.float64)


def stretched(points):
    """Skin points changed to another head's: wider at the top, with a longer chin, moved."""
    out = points * [1.1, 1.0, 0.95]
    out[:, 0] *= 1 + 0.01 * points[:, 1]
    out[:, 1] -= 0.02 * np.clip(-points[:, 1], 0, None) ** 1.5
    return out + np.array([0.3, 120, -2])


def posed(dna, mesh, **raw):
    """float64[V, 3]: posed vertices, computed without the package by oracle.py and skin_oracle.py.

    Args:
        raw: raw control without prefix -> value; the others keep their initial values.
    """
    rig = risorius.Rig(dna)
    values = np.array(rig.initial_raw_controls, np.float64)
    for name, value in raw.items():
        values[dna.raw_control_names.index(f"CTRL_expressions.{name}")] = value
    lod = next(i for i, row in enumerate(dna.lod_mesh_mapping.rows) if mesh in row)
    joints, shapes, _, _ = oracle.evaluate(
        dna, values, lod, settle=True, control_count=rig.control_count
    )

    class Pose:
        pass

    pose = Pose()
    pose.joints, pose.blend_shapes = joints[0].reshape(-1, 9), shapes[0]
    return skin_oracle.skinned(dna, pose, mesh)


POSES = ({}, {"jawOpen": 1.0, "mouthSmileLeft": 0.7}, {"eyeBlinkLeft": 1.0, "browOuterUpRight": 1})


def test_its_own_form_leaves_a_face_as_it_is(face):
    same = conform(face, {SKIN: skin_points(face)})
    for before, after in zip(face.meshes, same.meshes, strict=True):
        for name in ("positions", "normals"):
            assert np.abs(getattr(before, name) - getattr(after, name)).max() < 1e-5
        for own, other in zip(before.blend_shape_targets, after.blend_shape_targets, strict=True):
            assert np.abs(own.deltas - other.deltas).max() < 1e-6
    assert np.abs(face.neutral_joint_translations - same.neutral_joint_translations).max() < 2e-5
    assert np.array_equal(face.neutral_joint_rotations, same.neutral_joint_rotations)
    for before, after in zip(face.joint_groups, same.joint_groups, strict=True):
        assert np.abs(before.values - after.values).max() < 1e-5


@pytest.mark.parametrize("degrees", [0.0, 65.0])
def test_a_head_that_is_moved_and_larger_is_so_in_each_pose(face, degrees):
    angle = np.radians(degrees)
    turn = sk.matrices_of_vectors(angle * np.array([0.6, -0.64, 0.48]))

    def there(points):
        return 1.7 * points @ turn.T + [5, -20, 3]

    other = conform(face, {SKIN: there(skin_points(face))})
    for pose in POSES:
        for mesh in (1, 3):
            wanted, found = there(posed(face, mesh, **pose)), posed(other, mesh, **pose)
            assert np.abs(wanted - found).max() < 2e-4, (pose, mesh)


def test_another_form_keeps_names_counts_and_layers(face):
    other = risorius.load(conform(face, {SKIN: stretched(skin_points(face))}).to_bytes())
    before, after = (json.loads(dna.to_json()) for dna in (face, other))

    def outline(value):
        if isinstance(value, dict):
            return {key: outline(own) for key, own in value.items()}
        if isinstance(value, list):
            numbers = all(isinstance(own, int | float) for own in value)
            return len(value) if numbers else [outline(own) for own in value]
        return type(value)

    assert outline(before) == outline(after)
    changed = {key for key in before if before[key] != after[key]}
    assert changed == {"defn1.1", "bhvr1.1", "geom1.1"}
    assert list(face.joint_names) == list(other.joint_names)
    assert np.abs(posed(other, 0) - stretched(skin_points(face))).max() < 1e-4


def test_coarser_levels_lie_on_the_skin_and_act_as_it_does(face):
    other = conform(face, {SKIN: stretched(skin_points(face))})
    grid = np.arange(506).reshape(face_shapes.DOWN, face_shapes.ACROSS)
    for lod, step in ((1, 2), (2, 3)):
        same = grid[::step, ::step].ravel()
        off = other.meshes[lod].positions - other.meshes[0].positions[same]
        assert np.abs(off).max() < 1e-3
    fine, coarse = (posed(other, m, mouthSmileLeft=1) - posed(other, m) for m in (0, 1))
    was = [posed(face, m, mouthSmileLeft=1) - posed(face, m) for m in (0, 1)]
    same = grid[::2, ::2].ravel()
    apart = np.abs(fine[same] - coarse).max()
    assert apart < 1.5 * np.abs(was[0][same] - was[1]).max() + 0.02


def test_what_controls_do_grows_as_the_face_does_there(face):
    before = skin_points(face)
    wide = before * [2.0, 1.0, 1.0]
    other = conform(face, {SKIN: wide})
    own, found = (posed(d, 0, mouthSmileLeft=1) - posed(d, 0) for d in (face, other))
    middle = (np.abs(before[:, 0]) < 4) & (np.linalg.norm(own, axis=1) > 0.2)
    assert np.median(found[middle, 0] / own[middle, 0]) == pytest.approx(2.0, abs=0.35)
    assert np.median(found[middle, 1] / own[middle, 1]) == pytest.approx(1.0, abs=0.2)


def test_eyes_stay_spheres_about_their_joints_and_turn_in_place(face):
    other = conform(face, {SKIN: stretched(skin_points(face))})
    frames = sk.world_matrices(other, np.zeros((len(other.joint_names), 9)))
    for mesh, (joint, middle) in zip((3, 4), EYES.values(), strict=True):
        points = np.asarray(other.meshes[mesh].positions, np.float64)
        far = np.linalg.norm(points - frames[joint, :3, 3], axis=1)
        assert np.ptp(far) < 1e-4
        assert 1.0 < far.mean() < 1.7
        assert np.linalg.norm(frames[joint, :3, 3] - stretched(np.array([middle]))[0]) < 1.0
    balls = [Ball(np.array([3.5, 123.0, 4.0]), 1.1), Ball(np.array([-3.0, 123.0, 4.0]), 1.2)]
    given = conform(face, {SKIN: stretched(skin_points(face))}, balls=balls)
    points = np.asarray(given.meshes[3].positions, np.float64)
    assert np.linalg.norm(points - balls[0].middle, axis=1) == pytest.approx(1.1, abs=1e-4)


COLUMNS = np.radians(np.linspace(-60, 60, 13))
# Rows of the upper lid: elevation in degrees, distance from the eye's centre in cm.
ROWS = [(60, 1.1), (45, 1.1), (30, 1.1), (20, 1.1), (10, 1.1), (10, 1.0)]


def face_with_lids(shape):
    """A face of two lids in front of an eye with radius 1 cm at the origin.

    A control rotates the upper lid by 20 degrees, so that its rim meets the lower lid.
    shape: adds a blend shape without motion.
    """
    upper = np.array([
        [r * np.sin(a), r * np.cos(a) * np.sin(e), r * np.cos(a) * np.cos(e)]
        for e, r in ((np.radians(e), r) for e, r in ROWS) for a in COLUMNS
    ])  # fmt: skip
    at = np.arange(len(upper)).reshape(len(ROWS), -1)
    quads = np.stack([at[:-1, :-1], at[1:, :-1], at[1:, 1:], at[:-1, 1:]], axis=-1).reshape(-1, 4)
    points = np.concatenate([upper, upper * [1, -1, 1]])
    quads = np.concatenate([quads, quads[:, ::-1] + len(upper)])
    flat = np.arange(len(points))
    held = np.repeat(np.array([0, 0.3, 0.6, 0.9, 1, 1]), len(COLUMNS))
    weights = np.stack([1 - held, held], axis=1)
    weights = np.concatenate([weights, np.tile([1.0, 0.0], (len(upper), 1))])
    mesh = risorius.Mesh(
        positions=points, normals=points, texture_coordinates=points[:, :2],
        layout_positions=flat, layout_texture_coordinates=flat, layout_normals=flat,
        face_offsets=4 * np.arange(len(quads) + 1), face_layouts=quads.ravel(),
        maximum_influence_per_vertex=2, skin_offsets=2 * np.arange(len(points) + 1),
        skin_weights=weights.ravel(), skin_joint_indices=np.tile([0, 2], len(points)),
        blend_shape_targets=[
            risorius.BlendShapeTarget(
                deltas=np.zeros((1, 3)), vertex_indices=[0], blend_shape_channel_index=0
            )
        ] if shape else [],
    )  # fmt: skip
    dna = risorius.Dna(
        name="lids", lod_count=1, raw_control_names=["CTRL_expressions.eyeBlinkL"],
        joint_names=["head", "FACIAL_L_Eye", "FACIAL_L_Lid"], joint_parents=[0, 0, 0],
        mesh_names=["head_lod0_mesh", "eyeLeft_lod0_mesh"],
        coordinate_system=("right", "up", "front"),
        joint_row_count=27, joint_column_count=1,
    )  # fmt: skip
    dna.neutral_joint_translations = np.zeros((3, 3))
    dna.neutral_joint_rotations = np.zeros((3, 3))
    dna.meshes = [mesh, ball((0, 0, 0), 1, 1.0)]
    dna.lod_mesh_mapping, dna.lod_joint_mapping = [[0, 1]], [[0, 1, 2]]
    if shape:
        dna.blend_shape_channel_names = ["eyeBlinkL"]
        dna.lod_blend_shape_mapping = [[0]]
        dna.mesh_blend_shape_channel_mapping = [(0, 0)]
        dna.blend_shape_channels = risorius.BlendShapeChannels(
            lods=[1], input_indices=[0], output_indices=[0]
        )
    dna.joint_groups = [
        risorius.JointGroup(
            lods=[3], input_indices=[0], output_indices=[21, 22, 23], joint_indices=[2],
            values=[[20.0], [0.0], [0.0]],
        )
    ]  # fmt: skip
    return dna


@pytest.mark.parametrize(("shape", "left"), [(False, 0.45), (True, 0.01)])
def test_lids_close_on_an_eye_that_is_wider_open(shape, left):
    face = face_with_lids(shape)
    rim = np.arange(4, 6)[:, None] * len(COLUMNS) + np.arange(2, len(COLUMNS) - 2)

    def gap(dna, **raw):
        points = posed(dna, 0, **raw)
        return np.linalg.norm(points[rim] - points[rim + len(ROWS) * len(COLUMNS)], axis=-1)

    assert gap(face, eyeBlinkL=1).max() < 0.06
    points = skin_points(face)
    wide = points * [1.0, 1.5, 1.0]
    wide[:, 1] += 0.05 * (points[:, 1] > 0) * np.cos(points[:, 0])
    other = conform(face, {SKIN: wide})
    assert np.abs(skin_points(other) - wide).max() < 1e-5
    # If the upper lid rotated as in the original face, it would stop above the lower lid.
    was = copy.copy(other)
    was.joint_groups = face.joint_groups
    if shape:
        was.meshes = [copy.copy(m) for m in other.meshes]
        was.meshes[0].blend_shape_targets = face.meshes[0].blend_shape_targets
    assert gap(was, eyeBlinkL=1).mean() > 0.08
    assert gap(other, eyeBlinkL=1).mean() < left * gap(was, eyeBlinkL=1).mean()


def test_axes_and_units_of_the_file_do_not_matter(face):
    moved = {SKIN: stretched(skin_points(face))}
    system = dict(
        axes=("front", "left", "down"), rotation_sequence="zxy", rotation_signs=(1, -1, 1),
        face_winding_order="cw", translation_unit="m", rotation_unit="radians",
    )  # fmt: skip
    there, wanted = face.convert(**system), conform(face, moved).convert(**system)
    x, y, z = moved[SKIN].T / 100
    found = conform(there, {SKIN: np.stack([z, -x, -y], axis=1)})
    for a, b in zip(found.meshes, wanted.meshes, strict=True):
        assert np.abs(a.positions - b.positions).max() < 1e-5
        assert np.abs(a.normals - b.normals).max() < 0.05  # polygons have other triangulations
    # The smoothing uses a grid along the axes of the file, so joints may differ slightly. The root
    # joint, far below the head, differs most.
    off = np.abs(found.neutral_joint_translations - wanted.neutral_joint_translations)
    assert off.max() < 3e-3
    assert np.median(off) < 1e-4
    assert np.array_equal(found.neutral_joint_rotations, wanted.neutral_joint_rotations)
    for a, b in zip(found.joint_groups, wanted.joint_groups, strict=True):
        assert np.abs(a.values - b.values).max() < 2e-4


def as_part(dna, points, cut=False, name="sculpt"):
    """The face's skin with other vertices as a HeadPart. cut: quads are cut into triangles."""
    mesh = dna.meshes[0]
    faces = np.asarray(mesh.layout_positions)[np.asarray(mesh.face_layouts)].reshape(-1, 4).tolist()
    if cut:
        faces = [t for a, b, c, d in faces for t in ([b, c, d], [b, d, a])]
    mesh = ObjMesh(points, np.zeros((0, 2)), faces, [[] for _ in faces])
    return HeadPart(name, mesh, source=name)


@pytest.mark.parametrize("cut", [False, True])
def test_a_sculpt_is_known_by_its_polygons_in_any_axes_and_unit(face, cut):
    points = stretched(skin_points(face))
    in_metres = np.stack([points[:, 0], -points[:, 2], points[:, 1]], axis=1) / 100
    part = as_part(face, in_metres, cut)
    assert is_same_topology(face, part.mesh)
    made = conform_face(face, [part])
    assert made.sculpted == [SKIN]
    assert "multiplied by 100" in made.notes[1]
    wanted = conform(face, {SKIN: points})
    for a, b in zip(made.dna.meshes, wanted.meshes, strict=True):
        assert np.abs(a.positions - b.positions).max() < 1e-4
    shuffled = as_part(face, in_metres)
    shuffled.mesh.faces[7] = [0, 1, 2, 3]
    assert not is_same_topology(face, shuffled.mesh)


def test_a_head_of_another_topology_comes_to_the_place_of_the_face(face, monkeypatch):
    """Only the last step, which moves the head to the face, is tested.

    The registration, which other tests cover, is replaced by its exact result.
    """
    system = {"axes": ("front", "left", "down"), "translation_unit": "m"}
    mirrored = face.convert(**system, face_winding_order="ccw")
    points = stretched(skin_points(face))  # cm, standing
    lean = sk.matrices_of_vectors(np.array([0, np.pi / 2, 0]))
    given = 1.0 * points @ lean.T + [40, -3, 7]
    part = as_part(face, given)
    part.mesh.faces.reverse()
    part.mesh.faces[0] = [0, 30, 77]  # not a polygon of the face, so the topology differs
    standing = SimpleNamespace(parts=[part], found=None, notes=["as it is"])
    monkeypatch.setattr(head, "stand", lambda *_: standing)
    seen = []

    def lay(template, name, target, found, threads, progress):
        seen.append((template, target))
        progress(1.0)
        return Laid(given, np.ones(len(given)))

    monkeypatch.setattr(head, "lay_surface", lay)
    heard = []
    made = conform_face(mirrored, [part], None, heard.append)
    template, target = seen[0]
    assert np.abs(template.points - skin_points(face)).max() < 1e-4
    assert (template.normals()[:, 2] > 0).mean() > 0.9
    assert np.abs(target.points - given).max() < 1e-9
    x, y, z = (points - points.mean(axis=0) + skin_points(face).mean(axis=0)).T / 100
    assert np.abs(made.moved - np.stack([z, -x, -y], axis=1)).max() < 1e-6
    assert made.notes == ["as it is"]
    assert made.sculpted == []
    assert heard == sorted(heard)
    assert heard[-1] == 1.0
    with pytest.raises(Stopped):
        conform_face(mirrored, [part], None, lambda share: share < 0.5)


def test_meshes_of_another_face_are_a_head(face):
    other = conform(face, {SKIN: stretched(skin_points(face))})
    made = conform_face(face, head.parts_of(other.convert(axes=("right", "front", "up"))))
    assert made.sculpted == [SKIN, *EYES]
    for a, b in zip(made.dna.meshes, other.meshes, strict=True):
        assert np.abs(a.positions - b.positions).max() < 1e-3


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (lambda p: {}, "the skin, were expected"),
        (lambda p: {SKIN: p[:-1]}, "506 places were expected, found 505"),
        (lambda p: {SKIN: np.where(p == p[0], np.nan, p)}, "no place that a number can say"),
        (lambda p: {SKIN: p, "nose": p}, "nose: a mesh of the face was expected"),
        (lambda p: {SKIN: 0 * p}, "all vertices lie at one place"),
    ],
)
def test_places_that_cannot_be_are_one_sentence(face, change, said):
    with pytest.raises(ArgumentError, match=said):
        conform(face, change(skin_points(face)))
    bare = copy.copy(face)
    bare.mesh_names = ["eyeA", "eyeB", "eyeC", *EYES]
    with pytest.raises(ArgumentError, match="a mesh of skin at LOD 0 was expected"):
        conform(bare, {SKIN: skin_points(face)})


def test_progress_rises_and_may_stop(face):
    heard = []
    conform(face, {SKIN: skin_points(face)}, heard.append)
    assert heard == sorted(heard)
    assert heard[-1] == 1.0
    with pytest.raises(Stopped):
        conform(face, {SKIN: skin_points(face)}, lambda share: share < 0.5)


def test_the_command_writes_the_face_of_a_sculpt(face, tmp_path, capsys):
    head, source, out = tmp_path / "head.obj", tmp_path / "face.dna", tmp_path / "out.dna"
    points = stretched(skin_points(face))
    face_shapes.write_obj(head, points, face_shapes.head()[1])
    source.write_bytes(face.to_bytes("2.5"))
    command = ["author", "--conform", head, source, "-o", out]
    assert main([str(word) for word in command]) == 0
    said = capsys.readouterr().out
    assert "head_lod0_mesh: the head has the topology of the face" in said
    made = risorius.load(out)
    assert made.version == 5
    assert np.abs(posed(made, 0) - points).max() < 1e-3
    assert main([str(word) for word in [*command, "--json"]]) == 0
    assert json.loads(capsys.readouterr().out)["registered"] is False
    kept = out.read_bytes()
    for more, code, sentence in (
        (["--bound"], 2, "--conform takes no --bound"),
        (["--scale", "nan"], 2, "--scale"),
        (["--height-mm", "240"], 1, "use scale instead"),
    ):
        assert main([str(word) for word in [*command, *more]]) == code
        assert sentence in capsys.readouterr().err
    assert main(["author", "--conform", str(head), str(source), "-o", str(source)]) == 2
    assert main(["author", "--conform", str(head), "-o", str(out)]) == 2
    assert main(["author", "--conform", str(tmp_path / "no.obj"), str(source), "-o", str(out)]) == 1
    assert out.read_bytes() == kept
