# SPDX-License-Identifier: GPL-3.0-or-later
"""A rotated head with neck poses in all outputs of Blender, compared with a NumPy evaluator."""

import base64
import gzip
import importlib
import json
import re
import sys
from pathlib import Path
from types import SimpleNamespace

import bpy
import numpy as np
import pytest
import risorius
from mathutils import Euler, Quaternion
from risorius.cli import main
from risorius.web import page as pages
from support import oracle, probe, scene
from support.faces import neck_face

sys.path.append(str(Path(__file__).resolve().parents[2] / "tests" / "python" / "support"))
behavior, pose_oracle = (importlib.import_module(n) for n in ("oracle_behavior", "oracle"))

NECK, HEAD = (0, 1), 2
JAW = "CTRL_expressions.jawOpen"
# Frame -> (value of the jaw slider, Euler angles of the neck's control bone, Euler angles of the
# head's control bone); angles in radians.
KEYS = {
    1: (0.0, (0.1, 0.0, -0.05), (-0.2, 0.1, 0.1)),
    2: (0.6, (-0.25, 0.2, 0.1), (0.35, -0.2, 0.15)),
    3: (0.3, (0.3, -0.1, 0.0), (-0.1, 0.4, -0.3)),
}
SAME = 1e-5  # tolerance of channels, which go up to 1
NEAR = 2e-5  # tolerance of vertices, as a share of the head's size: bones are float32


def two_necks():
    """The Dna of `neck_face` with two neck joints; its RBF solver reads the lower one."""
    dna = neck_face()
    dna.joint_names = ["neck_01", "neck_02", *dna.joint_names[2:]]
    return dna


class _Reference:
    """The expected face at the frames of KEYS, computed from the description of the DNA format.

    The reference gives values of the blend shape channels, and vertices in the space of the face's
    armature.
    """

    def __init__(self, dna, rig):
        self.dna = dna
        self.names = list(dna.raw_control_names)
        self.turns = {
            bone: self._turns(rig, bone, n + 1) for n, bone in enumerate(("neck", "head"))
        }

    def _turns(self, rig, bone, column):
        rest = scene.controls(rig).data.bones[bone].matrix_local.to_quaternion()
        own = {f: Euler(key[column]).to_quaternion() for f, key in KEYS.items()}
        return {f: rest @ q @ rest.inverted() for f, q in own.items()}

    def matrices(self, frame):
        """Index of a joint -> its rotation from rest about its own axes, float64[3, 3]."""
        half = Quaternion().slerp(self.turns["neck"][frame], 0.5)
        basis = oracle.to_blender(self.dna, np.eye(3)) * 100.0
        rest = oracle._world(self.dna, np.zeros((len(self.dna.joint_names), 9)))
        found = {}
        for joint, turn in (*((j, half) for j in NECK), (HEAD, self.turns["head"][frame])):
            axes = basis.T @ rest[joint][:3, :3]
            found[joint] = axes.T @ np.array(turn.to_matrix(), np.float64) @ axes
        return found

    def raw(self, frame):
        raw = np.array(risorius.Rig(self.dna).initial_raw_controls, np.float64)
        raw[self.names.index(JAW)] = KEYS[frame][0]
        turns = self.matrices(frame)
        for name, joint in (("neck_01", NECK[0]), ("head", HEAD)):
            q = pose_oracle.matrix_to_quaternion(turns[joint].T)  # of row vectors
            first = self.names.index(f"{name}.qx")
            raw[first : first + 4] = q
        return raw

    def pose(self, frame):
        raw, count = self.raw(frame), risorius.Rig(self.dna).control_count
        c = behavior.settled(self.dna, behavior.solvers_of(self.dna), raw, 0, count)
        joints, shapes, _maps, _controls = pose_oracle.evaluate(
            self.dna, raw, 0, settle=False, controls=c, control_count=count
        )
        return SimpleNamespace(joints=joints[0].reshape(-1, 9), blend_shapes=shapes[0])

    def vertices(self, frame, mesh, turns=None, pose=None):
        turns = self.matrices(frame) if turns is None else turns
        return oracle.vertices(self.dna, mesh, pose or self.pose(frame), turns=turns)


@pytest.fixture
def face(tmp_path):
    """An animated face whose parent object is mirrored: (rig, path of the DNA file, _Reference)."""
    path, dna = tmp_path / "neck.dna", two_necks()
    dna.save(str(path))
    rig = scene.load(path)
    parent = bpy.data.objects.new("parent", None)
    bpy.context.scene.collection.objects.link(parent)
    parent.scale, parent.location = (-1.0, 1.0, 1.0), (0.3, 0.0, 0.0)
    scene.controls(rig).parent = parent
    for frame, (jaw, *turns) in KEYS.items():
        scene.face(rig)[JAW] = jaw
        scene.face(rig).keyframe_insert(f'["{JAW}"]', frame=frame)
        for name, angles in zip(("neck", "head"), turns, strict=True):
            bone = scene.controls(rig).pose.bones[name]
            bone.rotation_mode, bone.rotation_euler = "XYZ", angles
            bone.keyframe_insert("rotation_euler", frame=frame)
    bpy.context.scene.frame_start, bpy.context.scene.frame_end = 1, 3
    bpy.context.view_layer.objects.active = scene.controls(rig)
    return rig, path, _Reference(dna, rig)


def _check(shown, reference, frame, place):
    """Compare the vertices of a face with the reference.

    Args:
        shown: index of a mesh -> its vertices in world space, float64[V, 3].
        reference: the expected face.
        frame: a frame of KEYS.
        place: world matrix of the face, float64[4, 4].
    """
    for mesh, points in shown.items():
        wanted = reference.vertices(frame, mesh) @ place[:3, :3].T + place[:3, 3]
        assert np.abs(points - wanted).max() < NEAR * np.ptp(wanted, axis=0).max(), (frame, mesh)


def _seen(rig):
    return {m: scene.evaluated(o) for m, o in scene.meshes(rig).items() if 0 in list(o["dna_lods"])}


def _in_page(path):
    text = path.read_text(encoding="utf-8")
    found = dict(re.findall(r'id="([^"]*)">([^<]*)</script>', text))
    clip = json.loads(found["face-table"])["clip"]
    values = np.frombuffer(gzip.decompress(base64.b64decode(found["clip"])), "<f4")
    return clip, values.reshape(clip["frames"], -1)


def test_frames_renders_bakes_exports_clips_and_pages_have_the_same_turned_head(
    face, tmp_path, monkeypatch
):
    rig, path, reference = face
    stage = bpy.context.scene
    wanted = {frame: reference.pose(frame).blend_shapes for frame in KEYS}
    assert min(np.abs(w[4:]).max() for w in wanted.values()) > 0.01
    place = np.array([[-1, 0, 0, 0.3], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]], np.float64)
    for frame in (3, 1, 2):
        stage.frame_set(frame)
        np.testing.assert_allclose(rig["channels"][:], wanted[frame], atol=SAME)
        _check(_seen(rig), reference, frame, place)
    stage.render.filepath = str(tmp_path / "render_")
    with probe.rendering(stage) as seen:
        bpy.ops.render.render(animation=True)
        for frame in KEYS:
            _check(seen[frame], reference, frame, place)
    _clips(rig, path, reference, wanted, tmp_path)
    _pages(reference, wanted, tmp_path, monkeypatch)
    _exports(reference, place, tmp_path)
    bpy.context.view_layer.objects.active = scene.controls(rig)
    assert bpy.ops.risorius.bake(range="CUSTOM", start=1, end=3) == {"FINISHED"}
    for frame in KEYS:
        stage.frame_set(frame)
        _check(_seen(rig), reference, frame, place)


def _clips(rig, path, reference, wanted, folder):
    clip, out = folder / "take.rzc", folder / "out.npz"
    done = bpy.ops.risorius.export_animation(
        filepath=str(clip), format="RZC", range="CUSTOM", start=1, end=3
    )
    assert done == {"FINISHED"}
    assert main(["eval", str(clip), str(path), "-o", str(out)]) == 0
    with np.load(out) as found:
        for frame in KEYS:
            np.testing.assert_allclose(found["blend_shapes"][frame - 1], wanted[frame], atol=SAME)
    # A clip with only the jaw and the angles of neck and head, without raw controls of joint
    # rotations, gives the same channels.
    loaded = risorius.Clip.load(clip)
    angles = [f"{bone}.{way}" for bone in ("neck", "head") for way in ("yaw", "pitch", "roll")]
    loaded.selected([JAW, *angles]).save(clip)
    assert main(["eval", str(clip), str(path), "-o", str(out)]) == 0
    with np.load(out) as found:
        for frame in KEYS:
            np.testing.assert_allclose(found["blend_shapes"][frame - 1], wanted[frame], atol=SAME)
    other = scene.load(path)
    bpy.context.view_layer.objects.active = scene.controls(other)
    assert bpy.ops.risorius.import_animation(filepath=str(clip), start=1) == {"FINISHED"}
    for frame in KEYS:
        bpy.context.scene.frame_set(frame)
        np.testing.assert_allclose(other["channels"][:], wanted[frame], atol=SAME)
        np.testing.assert_allclose(rig["channels"][:], wanted[frame], atol=SAME)
        _check(_seen(other), reference, frame, np.eye(4))
    for item in (*scene.meshes(other).values(), scene.controls(other), other):
        bpy.data.objects.remove(item)


def _pages(reference, wanted, folder, monkeypatch):
    monkeypatch.setattr(pages, "empty_page", lambda: "<title>Risorius</title><!--FACE-->")
    page = folder / "face.html"
    done = bpy.ops.risorius.export_web(filepath=str(page), range="CUSTOM", start=1, end=3)
    assert done == {"FINISHED"}
    clip, values = _in_page(page)
    count = len(clip["controls"])
    assert sorted(clip["turns"]) == [*NECK, HEAD]
    rig = risorius.Rig(reference.dna)
    for frame in KEYS:
        raw = rig.initial_raw_controls.copy()
        raw[clip["controls"]] = values[frame - 1, :count]
        pose = rig.evaluate(raw)
        np.testing.assert_allclose(pose.blend_shapes, wanted[frame], atol=SAME)
        turns = values[frame - 1, count:].reshape(-1, 4).astype(np.float64)
        matrices = {
            j: pose_oracle.quaternion_to_matrix(q).T
            for j, q in zip(clip["turns"], turns, strict=True)
        }
        shown = reference.vertices(frame, 0, matrices, pose)
        np.testing.assert_allclose(shown, reference.vertices(frame, 0), atol=2e-6)


def _exports(reference, place, folder):
    """Check that an Alembic file contains the expected vertices of the head.

    Does nothing in a Blender without Alembic.
    """
    if not bpy.app.build_options.alembic:
        return
    path = folder / "face.abc"
    done = bpy.ops.risorius.export_animation(
        filepath=str(path), format="ALEMBIC", range="CUSTOM", start=1, end=3, bake_materials=False
    )
    assert done == {"FINISHED"}
    before = set(bpy.data.objects)
    bpy.ops.wm.alembic_import(filepath=str(path), as_background_job=False)
    found = [o for o in bpy.data.objects if o not in before]
    head = next(o for o in found if o.type == "MESH" and o.name.startswith("head"))
    for frame in KEYS:
        bpy.context.scene.frame_set(frame)
        _check({0: scene.evaluated(head)}, reference, frame, place)
    for item in found:
        bpy.data.objects.remove(item)
