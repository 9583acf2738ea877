# SPDX-License-Identifier: GPL-3.0-or-later
"""Blender's vertices equal those of an independent NumPy implementation for the same controls.

The NumPy side computes pose, morph and skinning in float64 from the format's description
(tests/python/support/oracle.py, support/oracle.py). The tests compare all levels of detail, three
ways to pose and shape a face, edits, playback, frames of a render engine, and subframes.
"""

import importlib.util
from pathlib import Path
from types import SimpleNamespace

import bpy
import numpy as np
import pytest
import risorius
from support import oracle, probe, scene
from support.faces import small_face

ROOT = Path(__file__).resolve().parents[2]
GOLDEN = ROOT / "tests" / "data" / "golden"


@pytest.fixture(params=["AUTO", "LIVE", "KEYS"])
def mode(request):
    """The mode of the face: Direct mode, or posed bones with one of two kinds of shape keys.

    LIVE has one live shape key per mesh, KEYS has a shape key for each channel.
    """
    return request.param


def _load_rig_oracle():
    """Load tests/python/support/oracle.py, the oracle that computes poses from raw controls.

    It is loaded by its path, because blender_tests/support has another module `oracle`.
    """
    place = ROOT / "tests" / "python" / "support" / "oracle.py"
    described = importlib.util.spec_from_file_location("rig_oracle", place)
    module = importlib.util.module_from_spec(described)
    described.loader.exec_module(module)
    return module


RIG_ORACLE = _load_rig_oracle()


class _Face:
    """An imported face, and the vertices that Blender must show for it."""

    def __init__(self, path, mode, levels=range(8)):
        self.rig = scene.load(path, mode, lods=tuple(i in levels for i in range(8)))
        self.dna = risorius.load(str(path))
        self.labels = scene.submodule("logic.base.names").unique_labels(self.dna.raw_control_names)

    def wanted(self, raw, lod):
        """The expected vertices: mesh index -> float64[V, 3], in Blender's space.

        Args:
            raw: values of the raw controls, float64[R].
            lod: level of detail.
        """
        joints, shapes, _maps, _controls = RIG_ORACLE.evaluate(self.dna, raw, lod, settle=True)
        pose = SimpleNamespace(joints=joints[0].reshape(-1, 9), blend_shapes=shapes[0])
        there = self.dna.lod_mesh_mapping[lod]
        return {int(m): oracle.vertices(self.dna, int(m), pose) for m in there}

    def error(self, shown, raw, lod):
        """Largest coordinate difference of shown and expected vertices, as a share of face size.

        Args:
            shown: mesh index -> vertices that Blender shows, float64[V, 3].
            raw: values of the raw controls, float64[R].
            lod: level of detail.
        """
        wanted = self.wanted(raw, lod)
        assert set(shown) == set(wanted)
        size = max(np.ptp(points, axis=0).max() for points in wanted.values())
        return max(float(np.abs(shown[m] - wanted[m]).max()) / size for m in wanted)

    def shown(self, lod):
        items = scene.meshes(self.rig).items()
        return {i: scene.evaluated(m) for i, m in items if lod in list(m["dna_lods"])}

    def set(self, raw):
        bone = scene.face(self.rig)
        for label, value in zip(self.labels, raw, strict=True):
            bone[label] = float(value)
        scene.update(scene.controls(self.rig))

    def animate(self, seed):
        """Insert keys with random values on every slider at frames 1, 5 and 10.

        Returns a function: frame -> values of the raw controls at this frame, float64[R].
        """
        random = np.random.default_rng(seed)
        bone = scene.face(self.rig)
        for frame in (1, 5, 10):
            for label in self.labels:
                bone[label] = float(random.random())
                bone.keyframe_insert(
                    f'["{bpy.utils.escape_identifier(label)}"]', frame=frame, group="Face"
                )
        curves = {c.data_path: c for c in scene.curves(scene.controls(self.rig))}
        path = scene.submodule("scene.base.parts").property_path
        return lambda frame: np.array([curves[path(n)].evaluate(frame) for n in self.labels])


@pytest.fixture(params=["small", "medium", "units"])
def path(request, tmp_path):
    """The path of one of three DNA files.

    "small" has two LODs and unusual names; "medium" has four LODs, 122 joints and ten meshes;
    "units" has other axes and units.
    """
    if request.param == "small":
        small_face().save(str(tmp_path / "small.dna"))
        return tmp_path / "small.dna"
    return GOLDEN / f"{request.param}.dna"


def test_random_controls_at_every_level(path, mode):
    face = _Face(path, mode)
    random = np.random.default_rng(5)
    for lod in range(face.dna.lod_count):
        assert bpy.ops.risorius.set_lod(lod=lod) == {"FINISHED"}
        for _ in range(2):
            raw = random.random(len(face.labels)).astype(np.float32)
            face.set(raw)
            assert face.error(face.shown(lod), raw, lod) < scene.TOLERANCE
    assert face.error(face.shown(lod), raw * 0.9, lod) > scene.TOLERANCE


def test_playback_in_any_order_and_between_frames(path, mode):
    face = _Face(path, mode, levels=(0,))
    raw_at = face.animate(seed=6)
    for frame in (3.0, 10.0, 1.0, 5.25, 2.5, 3.0):
        bpy.context.scene.frame_set(int(frame), subframe=frame % 1)
        assert face.error(face.shown(0), raw_at(frame), 0) < scene.TOLERANCE


@pytest.mark.parametrize("animation", [True, False], ids=["animation", "single frames"])
def test_what_a_render_engine_is_given(path, mode, animation):
    face = _Face(path, mode)
    raw_at = face.animate(seed=7)
    setup = bpy.context.scene
    setup.frame_start, setup.frame_end, setup.frame_step = 1, 9, 4
    frames = (1.0, 5.0, 9.0)
    last = face.dna.lod_count - 1
    for lod in (0, last):
        assert bpy.ops.risorius.set_lod(lod=lod, target="RENDER") == {"FINISHED"}
        with probe.rendering(setup) as seen:
            if animation:
                bpy.ops.render.render(animation=True)
            for frame in () if animation else reversed(frames):
                setup.frame_set(int(frame))
                bpy.ops.render.render()
            assert set(seen) == set(frames)
            for frame in frames:
                assert face.error(seen[frame], raw_at(frame), lod) < scene.TOLERANCE
            assert face.error(seen[1.0], raw_at(5.0), lod) > scene.TOLERANCE


def test_what_a_render_engine_is_given_between_frames(path, mode):
    face = _Face(path, mode, levels=(0,))
    raw_at = face.animate(seed=8)
    setup = bpy.context.scene
    setup.frame_start, setup.frame_end, setup.frame_step = 4, 6, 2
    setup.render.use_motion_blur = True
    with probe.rendering(setup, between=(-0.25, 0.25, 0.5)) as seen:
        bpy.ops.render.render(animation=True)
        assert len(seen) == 2 * 5
        for time, shown in seen.items():
            assert face.error(shown, raw_at(time), 0) < scene.TOLERANCE
