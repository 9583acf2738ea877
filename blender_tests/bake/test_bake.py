# SPDX-License-Identifier: GPL-3.0-or-later
"""Tests that baked faces move like unbaked faces, and can be unbaked.

A bake of the kind RESULT moves bones, shape keys and maps by actions, without the evaluator. A bake
of the kind CONTROLS moves the controls by an action, and the evaluator still moves the face.
"""

import addon_utils
import bpy
import numpy as np
import pytest
from support import scene
from support.animation import animate
from support.layout import drawn

NEAR = 1e-5  # allowed error of a baked vertex, as a share of the face's size
FRAMES = (1, 2, 3, 4, 6, 8, 10)


def _face(dna_file, mode="AUTO", **options):
    rig = scene.load(dna_file, mode, **options)
    animate(rig)
    return rig


def _shown(rig, frame, whole=True):
    """Vertices of the visible meshes, and values of the animated maps, at a frame."""
    bpy.context.scene.frame_set(int(frame), subframe=frame - int(frame))
    shown = [m for _, m in sorted(scene.meshes(rig).items()) if not m.hide_viewport]
    return np.concatenate([scene.evaluated(m) for m in shown]), list(rig["maps"])


def _film(rig, frames=FRAMES):
    return [_shown(rig, f) for f in frames]


def _assert_same(film, wanted, near=NEAR):
    for (points, maps), (points_wanted, maps_wanted) in zip(film, wanted, strict=True):
        size = np.ptp(points_wanted, axis=0).max()
        np.testing.assert_allclose(points, points_wanted, rtol=0, atol=near * size)
        np.testing.assert_allclose(maps, maps_wanted, atol=near)


def _bake(rig=None, **options):
    if rig is not None:
        bpy.context.view_layer.objects.active = scene.controls(rig)
    settings = {"range": "CUSTOM", "start": 1, "end": 10, **options}
    assert bpy.ops.risorius.bake(**settings) == {"FINISHED"}


def _state(rig):
    """Actions, NLA tracks, drivers and shape keys of a character, and which meshes are hidden.

    The result contains plain values for comparisons: no keyframes and no strips, only the number of
    strips of each track.
    """
    owners = [rig, scene.controls(rig)]
    owners += [m.data.shape_keys for m in scene.meshes(rig).values() if m.data.shape_keys]
    found = []
    for owner in owners:
        data = owner.animation_data
        if data is None:
            found.append(None)
            continue
        slot = getattr(data, "action_slot", None)
        found.append(
            (
                data.action.name if data.action else None,
                slot.identifier if slot else None,
                data.use_nla,
                round(data.action_influence, 6),
                data.action_blend_type,
                [(t.name, t.mute, t.is_solo, len(t.strips)) for t in data.nla_tracks],
                [(c.data_path, c.array_index, c.mute, c.driver.is_valid) for c in data.drivers],
            )
        )
    blocks = [
        [(b.name, b.mute) for b in m.data.shape_keys.key_blocks]
        for m in scene.meshes(rig).values()
        if m.data.shape_keys
    ]
    shown = [(m.hide_viewport, m.hide_render) for m in scene.meshes(rig).values()]
    return found, blocks, shown


def test_a_baked_face_moves_as_the_live_one(mode, dna_file):
    rig = _face(dna_file, mode)
    wanted = _film(rig)
    _bake()
    _assert_same(_film(rig), wanted)
    assert np.abs(wanted[0][0] - wanted[3][0]).max() > 1e-3  # the animation moves vertices


@pytest.mark.parametrize("options", [{}, {"kind": "CONTROLS", "strip": True}, {"strip": True}])
def test_a_face_baked_under_time_stretching_moves_as_the_live_one(options, dna_file):
    rig = _face(dna_file, "KEYS")
    render = bpy.context.scene.render
    render.frame_map_old, render.frame_map_new = (100, 70) if options else (30, 100)
    wanted = _film(rig)
    _bake(**options)
    _assert_same(_film(rig), wanted)
    assert np.abs(wanted[0][0] - wanted[-1][0]).max() > 1e-3  # the animation moves vertices


def test_it_plays_without_the_add_on_and_controls_move_it_no_more(mode, dna_file):
    rig = _face(dna_file, mode)
    wanted = _film(rig)
    _bake()
    addon_utils.disable(scene.MODULE)
    _assert_same(_film(rig), wanted)
    addon_utils.enable(scene.MODULE)
    shown = _shown(rig, 4)
    scene.controls(rig).animation_data.action = None
    scene.set_controls(rig, jawOpen=0.9)
    np.testing.assert_array_equal(scene.evaluated(scene.meshes(rig)[0]), shown[0][: 12 * 14])
    bpy.context.scene.frame_set(3)
    _assert_same(_film(rig), wanted)


def test_back_to_live_is_exact_also_after_save_and_load(mode, dna_file, tmp_path):
    rig = _face(dna_file, mode)
    wanted, before, counts = _film(rig), _state(rig), scene.counts()
    _bake()
    assert _state(rig) != before
    blend = tmp_path / "baked.blend"
    bpy.ops.wm.save_as_mainfile(filepath=str(blend))
    bpy.ops.wm.open_mainfile(filepath=str(blend))
    rig = bpy.data.objects["Small_rig"]
    _assert_same(_film(rig), wanted)
    assert bpy.ops.risorius.unbake() == {"FINISHED"}
    assert _state(rig) == before
    _assert_same(_film(rig), wanted, near=0)
    assert scene.counts() == counts
    scene.controls(rig).animation_data.action = None
    bpy.ops.risorius.reset()
    scene.set_controls(rig, jawOpen=0.35)
    raw = scene.raw_of(rig, dna_file)
    assert scene.error_against_oracle(rig, dna_file, raw) < scene.TOLERANCE


def _complicate(rig):
    """Add data of a user: an NLA strip, a driver, a constraint, and an animated bone and shape key.

    An action with keys of the control armature's location is blended onto the strip by addition.
    """
    controls = scene.controls(rig)
    data = controls.animation_data
    base = data.action
    track = data.nla_tracks.new()
    strip = track.strips.new("base", 1, base)
    strip.influence = 0.75
    data.action = None
    controls.location = (0.0, 0.0, 0.1)
    for frame, x in ((2, 0.0), (9, 0.3)):
        controls.location.x = x
        controls.keyframe_insert("location", frame=frame)
    data.action_blend_type = "ADD"
    curve = scene.face(rig).driver_add('["CTRL_expressions.browDownL"]')
    curve.driver.expression = "frame / 20"
    empty = bpy.data.objects.new("Target", None)
    bpy.context.scene.collection.objects.link(empty)
    for frame, y in ((1, 0.0), (10, 0.2)):
        empty.location.x = y
        empty.keyframe_insert("location", frame=frame)
    follow = controls.pose.bones["eyes"].constraints.new("COPY_LOCATION")
    follow.target, follow.influence = empty, 0.5
    own = rig.pose.bones["user_joint"]
    for frame, angle in ((1, 0.0), (10, 1.0)):
        own.rotation_mode = "XYZ"
        own.rotation_euler.z = angle
        own.keyframe_insert("rotation_euler", frame=frame)
    mesh = scene.meshes(rig)[0]
    mine = mesh.shape_key_add(name="Mine", from_mix=False)
    mine.points[3].co.z += 0.05
    for frame, value in ((1, 0.0), (10, 1.0)):
        mine.value = value
        mine.keyframe_insert("value", frame=frame)
    scene.update(controls, rig)


def test_nla_drivers_constraints_and_the_users_own_animation_are_baked(mode, dna_file):
    rig = _face(dna_file, mode)
    _complicate(rig)
    wanted, before = _film(rig), _state(rig)
    _bake()
    _assert_same(_film(rig), wanted)
    assert bpy.ops.risorius.unbake() == {"FINISHED"}
    assert _state(rig) == before
    _assert_same(_film(rig), wanted, near=0)


def test_baked_controls_are_one_clean_action(mode, dna_file):
    rig = _face(dna_file, mode)
    _complicate(rig)
    wanted, before = _film(rig), _state(rig)
    _bake(kind="CONTROLS")
    data = scene.controls(rig).animation_data
    assert not data.use_nla
    assert tuple(data.action.frame_range) == (1.0, 10.0)  # the baked range
    assert all(c.mute for c in data.drivers)
    paths = {c.data_path for c in scene.curves(scene.controls(rig))}
    assert 'pose.bones["face"]["CTRL_expressions.browDownL"]' in paths
    assert 'pose.bones["face"]["CTRL_expressions.mouthCornerPullR"]' not in paths  # at rest
    _assert_same(_film(rig), wanted)
    assert bpy.ops.risorius.unbake() == {"FINISHED"}
    assert _state(rig) == before
    _assert_same(_film(rig), wanted, near=0)


def _add_layers(rig):
    """Add a layer with an animated weight; the layer moves two controls and turns the head."""
    controls = scene.controls(rig)
    own = controls.animation_data.action
    controls.animation_data.action = None
    head = controls.pose.bones["head"]
    for frame, value, turn in ((1, 0.0, 0.0), (6, 1.0, 0.5)):
        for name in ("browDownL", "mouthCornerPullR"):
            path = f'["CTRL_expressions.{name}"]'
            scene.face(rig)[f"CTRL_expressions.{name}"] = value
            scene.face(rig).keyframe_insert(path, frame=frame)
        head.rotation_euler.z = turn
        head.keyframe_insert("rotation_euler", frame=frame)
    action = controls.animation_data.action
    controls.animation_data.action = own
    for name in ("browDownL", "mouthCornerPullR"):
        scene.face(rig)[f"CTRL_expressions.{name}"] = 0.0
    layers = scene.submodule("scene.animation.layers")
    layer = layers.add_action(controls, action, blend="ADD")
    for frame, weight in ((1, 1.0), (10, 0.2)):
        layer.weight = weight
        layer.keyframe_insert("weight", frame=frame)
    scene.update(controls)


@pytest.mark.parametrize("kind", ["CONTROLS", "RESULT"])
def test_layers_are_in_the_bake(kind, dna_file):
    rig = _face(dna_file)
    plain = _film(rig)
    _add_layers(rig)
    wanted, before = _film(rig), _state(rig)
    assert np.abs(wanted[4][0] - plain[4][0]).max() > 1e-3
    _bake(kind=kind)
    _assert_same(_film(rig), wanted)
    if kind == "CONTROLS":
        paths = {c.data_path for c in scene.curves(scene.controls(rig))}
        assert 'pose.bones["face"]["CTRL_expressions.mouthCornerPullR"]' in paths
    assert bpy.ops.risorius.unbake() == {"FINISHED"}
    assert _state(rig) == before
    _assert_same(_film(rig), wanted, near=0)


def test_a_face_on_a_body_that_moves(dna_file):
    rig = _face(dna_file)
    data = bpy.data.armatures.new("body")
    body = bpy.data.objects.new("body", data)
    bpy.context.scene.collection.objects.link(body)
    with bpy.context.temp_override(object=body, active_object=body, selected_objects=[body]):
        bpy.context.view_layer.objects.active = body
        bpy.ops.object.mode_set(mode="EDIT")
        parent = None
        for number, name in enumerate(("spine", "neck", "head")):
            bone = data.edit_bones.new(name)
            bone.head, bone.tail = (0, 0, 1.2 + 0.1 * number), (0, 0.01, 1.3 + 0.1 * number)
            bone.parent, bone.roll = parent, 0.5 * number
            parent = bone
        bpy.ops.object.mode_set(mode="OBJECT")
    bpy.context.view_layer.objects.active = scene.controls(rig)
    assert bpy.ops.risorius.attach_body(body="body") == {"FINISHED"}
    for name in ("spine", "neck", "head"):
        bone = body.pose.bones[name]
        bone.rotation_mode = "XYZ"
        for frame, angle in ((1, 0.0), (10, 2.5 if name == "spine" else 0.4)):
            bone.rotation_euler.y = angle
            bone.keyframe_insert("rotation_euler", frame=frame)
    wanted, before = _film(rig), _state(rig)
    assert np.abs(wanted[0][0] - wanted[-1][0]).max() > 0.3
    _bake()
    _assert_same(_film(rig), wanted)
    bpy.ops.risorius.unbake()
    assert _state(rig) == before
    _assert_same(_film(rig), wanted, near=0)


def test_controls_first_and_then_the_result(dna_file):
    rig = _face(dna_file)
    wanted, before, counts = _film(rig), _state(rig), scene.counts()
    _bake(kind="CONTROLS")
    _bake()
    _assert_same(_film(rig), wanted)
    bpy.ops.risorius.unbake()
    _assert_same(_film(rig), wanted)
    bpy.ops.risorius.unbake()
    assert (_state(rig), scene.counts()) == (before, counts)
    assert not bpy.ops.risorius.unbake.poll()  # disabled, because nothing is baked


def test_onto_an_nla_track(dna_file):
    rig = _face(dna_file)
    wanted, before = _film(rig), _state(rig)
    _bake(strip=True, start=1, end=10)
    assert rig.animation_data.action is None
    assert [t.name for t in rig.animation_data.nla_tracks] == ["Small_baked"]
    _assert_same(_film(rig), wanted)
    bpy.ops.risorius.unbake()
    _bake(kind="CONTROLS", strip=True)
    _assert_same(_film(rig), wanted)
    bpy.ops.risorius.unbake()
    assert _state(rig) == before


def _delete(tracks):
    tracks.remove(tracks["quiet"])


def _rename(tracks):
    quiet, alone = tracks["quiet"], tracks["alone"]
    alone.name, quiet.name = "other", "alone"


def _add_before(tracks):
    tracks.new(prev=tracks[0]).name = "mine"


def _swap_for_a_new_one(tracks):
    tracks.remove(tracks["quiet"])
    tracks.new(prev=tracks[0]).name = "mine"


def _rename_the_baked_one(tracks):
    tracks[-1].name = "quiet"


def _group_the_baked_one(tracks):
    from support.past_scenes import make_meta

    make_meta(tracks.id_data, tracks[-1].strips[0])


@pytest.mark.parametrize(
    ("change", "wanted"),
    [
        (None, {"quiet": "muted", "plays": "", "alone": "solo"}),
        (_delete, {"plays": "", "alone": "solo"}),
        (_rename, {"alone": "muted", "plays": "", "other": "solo"}),
        (_add_before, {"quiet": "muted", "mine": "", "plays": "", "alone": "solo"}),
        (_swap_for_a_new_one, {"mine": "", "plays": "", "alone": "solo"}),
        (_rename_the_baked_one, {"quiet": "muted", "plays": "", "alone": "solo"}),
        (_group_the_baked_one, {"quiet": "muted", "plays": "", "alone": "solo"}),
    ],
)
def test_tracks_that_were_changed_meanwhile_get_their_own_flags_back(dna_file, change, wanted):
    controls = animate(scene.load(dna_file))
    data = controls.animation_data
    for name in ("quiet", "plays", "alone"):
        track = data.nla_tracks.new()
        track.name = name
        track.strips.new(f"strip of {name}", 1, data.action)
    data.nla_tracks["quiet"].mute = True
    data.nla_tracks["alone"].is_solo = True
    data.action = None
    _bake(kind="CONTROLS", strip=True)
    assert all(t.mute for t in list(data.nla_tracks)[:3])
    if change is not None:
        change(data.nla_tracks)
    assert bpy.ops.risorius.unbake() == {"FINISHED"}
    found = {t.name: "muted" * t.mute + "solo" * t.is_solo for t in data.nla_tracks}
    assert found == wanted
    assert len(data.nla_tracks) == len(wanted)


def test_a_strip_put_beside_the_baked_one_stays(dna_file):
    controls = animate(scene.load(dna_file))
    data, action = controls.animation_data, controls.animation_data.action
    _bake(kind="CONTROLS", strip=True)
    # Blender 4.3 gives the strip the name of its action instead of the given name.
    mine = data.nla_tracks[-1].strips.new("mine", 100, action).name
    assert bpy.ops.risorius.unbake() == {"FINISHED"}
    assert [[s.name for s in t.strips] for t in data.nla_tracks] == [[mine]]


def test_left_out_keys_stay_within_the_error(dna_file):
    rig = _face(dna_file)
    _bake(step=0.25)
    full = {(c.data_path, c.array_index): c for c in scene.curves(rig)}
    every = np.arange(1, 10.01, 0.25)
    wanted = {k: np.array([c.evaluate(f) for f in every]) for k, c in full.items()}
    count = sum(len(c.keyframe_points) for c in full.values())
    bpy.ops.risorius.unbake()
    _bake(step=0.25, error=1e-3)
    found = {(c.data_path, c.array_index): c for c in scene.curves(rig)}
    assert set(found) == set(full)
    worst = 0.0
    for key, curve in found.items():
        worst = max(worst, np.abs([curve.evaluate(f) for f in every] - wanted[key]).max())
        assert {p.interpolation for p in curve.keyframe_points} == {"LINEAR"}
    assert 0.0 < worst <= 1e-3
    assert sum(len(c.keyframe_points) for c in found.values()) < 0.6 * count


def test_reduction_holds_its_bound_on_any_curve():
    curves = scene.submodule("logic.animation.key_reduction")
    random = np.random.default_rng(3)
    frames = np.cumsum(random.uniform(0.2, 2.0, 400))
    values = np.cumsum(random.normal(0, 0.1, (400, 60)), axis=0).astype(np.float32)
    values[:, 40:] = np.sin(frames / 9)[:, None] * np.arange(1, 21) * 50  # large numbers
    values[:, 0], values[:, 1] = 7.0, frames  # a constant and a line
    for error in (1e-6, 1e-3, 0.05, 1.0):
        keep = curves.reduce_keys(frames, values, error)
        for i in range(values.shape[1]):
            at = keep[:, i]
            line = np.interp(frames, frames[at], values[at, i])
            assert np.abs(line - values[:, i]).max() <= error * 1.0000001, (error, i)
        if error == 0.05:
            assert keep[:, 2:40].mean() < 0.6
    assert keep[:, 0].sum() == 1
    assert curves.reduce_keys(frames, values, 1e-3)[:, 1].sum() == 2
    assert curves.reduce_keys(frames, values)[:, 2:].all()


def test_where_float32_is_coarser_than_the_bound_all_keys_stay():
    curves = scene.submodule("logic.animation.key_reduction")
    frames = np.arange(400.0)
    values = (frames[:, None] * [1.0, 1000.5]).astype(np.float32)  # exact lines
    keep = curves.reduce_keys(frames, values, 1e-4)
    first, last = values[0], values[-1]
    part = np.float32((frames - frames[0]) / (frames[-1] - frames[0]))[:, None]
    off = np.abs(first + part * (last - first) - values).max(axis=0)
    assert off[1] > 1e-4
    assert keep[:, 1].all()


def test_signs_of_quaternions_follow_each_other():
    curves = scene.submodule("logic.animation.key_reduction")
    turns = np.float32(
        [[[1, 0, 0, 0]], [[-0.9, -0.1, 0, 0]], [[-0.8, 0.2, 0, 0]], [[0.9, 0, 0, 0]]]
    )
    wanted = np.float32([[[1, 0, 0, 0]], [[0.9, 0.1, 0, 0]], [[0.8, -0.2, 0, 0]], [[0.9, 0, 0, 0]]])
    np.testing.assert_array_equal(curves.continuous(turns), wanted)


def test_between_baked_frames_lie_straight_lines(dna_file):
    rig = _face(dna_file)
    between = (1.5, 4.25, 7.5)
    wanted = _film(rig, between)
    _bake(step=0.25)
    _assert_same(_film(rig, between), wanted)
    bpy.ops.risorius.unbake()
    _bake()
    _assert_same(_film(rig, between), wanted, near=0.05)


class _Window:
    """Stands for window, context and operator, so that a modal bake runs without a window."""

    def __init__(self, job):
        self.window_manager, self.scene = self, bpy.context.scene
        self._job, self._timer, self.said, self.over = job, None, [], False
        operators = scene.submodule("ui.bake.operators")
        self.modal = lambda kind: operators.RISORIUS_OT_bake.modal(self, self, _Event(kind))
        self._step = lambda *rest: operators.RISORIUS_OT_bake._step(self, *rest)
        self._end = lambda context: operators.RISORIUS_OT_bake._end(self, context)
        self.cancel = lambda: operators.RISORIUS_OT_bake.cancel(self, self)

    def report(self, _kind, words):
        self.said.append(words)

    def progress_update(self, value):
        assert 0 <= value <= 100

    def progress_end(self):
        self.over = True

    def event_timer_remove(self, _timer):
        assert not self.over


class _Event:
    def __init__(self, kind):
        self.type = kind


@pytest.mark.parametrize("ended", [False, True])
def test_with_a_window_it_shows_progress_and_esc_ends_it(ended, dna_file):
    rig = _face(dna_file)
    before, counts = _state(rig), scene.counts()
    bake = scene.submodule("scene.bake.bake_face")
    scene.submodule("ui.bake.operators")._SLICE = 0.0
    window = _Window(bake.bake(bpy.context, [rig], bake.BakeOptions(end=10)))
    assert window.modal("MOUSEMOVE") == {"RUNNING_MODAL"}
    if ended:
        assert window.modal("TIMER") == {"RUNNING_MODAL"}
        assert window.modal("ESC") == {"CANCELLED"}
        assert (_state(rig), scene.counts()) == (before, counts)
    else:
        while (result := window.modal("TIMER")) == {"RUNNING_MODAL"}:
            pass
        assert result == {"FINISHED"}
        assert bake.baked(rig) == "RESULT"
    assert window.over
    assert window.said


@pytest.mark.parametrize("whole_scene", [False, True])
@pytest.mark.parametrize("how", ["closed window", "scene removed", "other file"])
def test_when_blender_ends_it_nothing_is_left(how, whole_scene, dna_file, tmp_path):
    rig = _face(dna_file)
    rig.hide_viewport = whole_scene
    other = tmp_path / "other.blend"
    bpy.ops.wm.save_as_mainfile(filepath=str(other))
    rig = bpy.data.objects["Small_rig"]
    bpy.context.scene.frame_set(7)
    before, counts = _state(rig), scene.counts()
    bake = scene.submodule("scene.bake.bake_face")
    scene.submodule("ui.bake.operators")._SLICE = 0.0
    window = _Window(bake.bake(bpy.context, [rig], bake.BakeOptions(end=10)))
    assert window.modal("TIMER") == {"RUNNING_MODAL"}
    if how == "scene removed" and not whole_scene:
        bpy.data.scenes.remove(bpy.data.scenes["Risorius"])
    elif how == "other file":
        bpy.ops.wm.open_mainfile(filepath=str(other))
    window.cancel()
    assert window.over
    rig = bpy.data.objects["Small_rig"]
    assert (_state(rig), scene.counts()) == (before, counts)
    assert bpy.context.scene.frame_current == (1 if how == "other file" else 7)


@pytest.mark.parametrize("hidden", [False, True])
def test_sampling_is_frame_stepping_and_touches_nothing(hidden, dna_file):
    rig = _face(dna_file)
    _complicate(rig)
    rig.hide_viewport = scene.controls(rig).hide_viewport = hidden
    bpy.context.scene.frame_set(7)
    values, counts = dict(scene.face(rig).items()), scene.counts()
    posed = [tuple(b.rotation_quaternion) for b in rig.pose.bones]
    frames = np.array([1.0, 2.5, 4.0, 10.0])
    sampling, inputs = scene.submodule("scene.bake.sampling"), scene.submodule("scene.frame.inputs")
    job = sampling.sample(bpy.context, [rig], frames)
    while True:
        try:
            next(job)
        except StopIteration as finished:
            (got,) = finished.value
            break
    assert bpy.context.scene.frame_current == 7
    assert dict(scene.face(rig).items()) == values
    assert [tuple(b.rotation_quaternion) for b in rig.pose.bones] == posed
    assert scene.counts() == counts
    live = scene.submodule("scene.character.runtime").of(rig)
    for number, frame in enumerate(frames):
        bpy.context.scene.frame_set(int(frame), subframe=frame % 1)
        depsgraph = bpy.context.evaluated_depsgraph_get()
        seen = scene.controls(rig).evaluated_get(depsgraph)
        raw, turns = inputs.read_inputs(seen, live, depsgraph)
        np.testing.assert_array_equal(got.raw[number], raw)
        assert got.turns[number] == turns
        np.testing.assert_array_equal(got.places[number], np.array(seen.matrix_world))
    assert np.ptp(got.raw[:, 0]) > 0.1
    assert np.ptp(got.places[:, 0, 3]) > 0.1


def test_a_bake_that_is_ended_changes_nothing(dna_file):
    rig = _face(dna_file)
    before, counts = _state(rig), scene.counts()
    bake = scene.submodule("scene.bake.bake_face")
    job = bake.bake(bpy.context, [rig], bake.BakeOptions(end=10))
    assert 0 < next(job) < 1
    assert next(job) < 1
    job.close()
    assert (_state(rig), scene.counts()) == (before, counts)
    assert not bake.baked(rig)


@pytest.mark.parametrize("kind", ["RESULT", "CONTROLS"])
def test_a_bake_that_fails_while_it_writes_takes_back_what_it_wrote(kind, dna_file, monkeypatch):
    rigs = [_face(dna_file), _face(dna_file)]
    before, films = [_state(r) for r in rigs], [_film(r) for r in rigs]
    bake = scene.submodule("scene.bake.bake_face")
    play, played = bake.actions.play, []

    def fails(owner, *others):
        if rigs[1] in played or owner == scene.controls(rigs[1]):
            raise MemoryError("a planted one")
        played.append(owner)
        play(owner, *others)

    monkeypatch.setattr(bake.actions, "play", fails)
    job = bake.bake(bpy.context, rigs, bake.BakeOptions(kind=kind, end=3))
    with pytest.raises(MemoryError, match="planted"):
        list(job)
    assert rigs[0] in played or scene.controls(rigs[0]) in played
    assert not any(bake.baked(rig) for rig in rigs)
    assert [_state(r) for r in rigs] == before
    for rig, film in zip(rigs, films, strict=True):
        _assert_same(_film(rig), film, near=0)


def test_another_level_of_detail(mode, dna_file):
    rig = _face(dna_file, mode, lods=(True, True, *[False] * 6))
    bpy.ops.risorius.set_lod(lod=1)
    coarse = _film(rig)
    bpy.ops.risorius.set_lod(lod=0, target="VIEWPORT")
    bpy.ops.risorius.set_lod(lod=1, target="RENDER")
    wanted, before = _film(rig), _state(rig)
    _bake(lod=1)
    _assert_same(_film(rig), coarse)
    bpy.ops.risorius.unbake()
    assert _state(rig) == before
    _assert_same(_film(rig), wanted, near=0)


def test_parts_that_are_not_baked_stand(dna_file):
    rig = _face(dna_file)
    wanted = _film(rig)
    _bake(wanted={"BONES"})
    assert scene.meshes(rig)[0].data.shape_keys.animation_data is None or not (
        scene.meshes(rig)[0].data.shape_keys.animation_data.action
    )
    assert not any("maps" in c.data_path for c in scene.curves(rig))
    film = _film(rig)
    assert np.abs(film[0][0] - film[3][0]).max() > 1e-3
    bpy.ops.risorius.unbake()
    _assert_same(_film(rig), wanted, near=0)


def test_all_selected_faces_in_one_call_and_one_undo_step(dna_file):
    bpy.context.preferences.edit.use_global_undo = True
    rigs = [_face(dna_file), _face(dna_file, "KEYS")]
    scene.controls(rigs[1]).location.x = 1.0
    films = [_film(rig) for rig in rigs]
    for item in bpy.context.selected_objects:
        item.select_set(False)
    bpy.context.view_layer.objects.active = None
    with pytest.raises(RuntimeError, match="No face is selected"):
        bpy.ops.risorius.bake()
    for rig in rigs:
        scene.controls(rig).select_set(True)
    bpy.ops.ed.undo_push(message="before")
    _bake()
    assert all("risorius_baked" in rig for rig in rigs)
    for rig, film in zip(rigs, films, strict=True):
        _assert_same(_film(rig), film)
    bpy.ops.ed.undo_push(message="after")
    bpy.ops.ed.undo()
    rigs = [bpy.data.objects[n] for n in ("Small_rig", "Small.001_rig")]
    assert not any("risorius_baked" in rig for rig in rigs)
    scene.controls(rigs[0]).select_set(False)
    _bake(every=True)
    assert all("risorius_baked" in rig for rig in rigs)
    assert bpy.ops.risorius.unbake(every=True) == {"FINISHED"}
    bpy.context.view_layer.update()
    for rig, film in zip(rigs, films, strict=True):
        _assert_same(_film(rig), film)


def test_an_edited_baked_key_stays_a_real_key(dna_file):
    rig = _face(dna_file, "LIVE")
    mesh = scene.meshes(rig)[0]
    _bake()
    block = mesh.data.shape_keys.key_blocks["jaw"]
    block.points[5].co.z += 0.02
    bpy.ops.risorius.unbake()
    names = [b.name for b in mesh.data.shape_keys.key_blocks]
    assert names == ["Basis", "<channel sum>", "jaw"]
    bad, _seen = scene.invalid_drivers()
    assert not bad
    bpy.context.scene.frame_set(5)
    assert mesh.data.shape_keys.key_blocks["jaw"].value == pytest.approx(1.0)


def test_back_to_live_keeps_what_the_user_made_of_it(dna_file):
    rig = _face(dna_file)
    _bake()
    curve = scene.curves(rig)[0]
    curve.keyframe_points[3].co.y += 0.25
    bpy.ops.risorius.unbake()
    assert bpy.data.actions["Small_baked"].use_fake_user
    assert "Small_head_lod0_mesh_baked" not in bpy.data.actions
    _bake(kind="CONTROLS")
    mine = bpy.data.actions.new("Mine")
    scene.controls(rig).animation_data.action = mine
    bpy.ops.risorius.unbake()
    assert mine.use_fake_user
    assert scene.controls(rig).animation_data.action.name == "Small_controlsAction"


def test_a_copy_of_a_baked_face_is_a_baked_face(mode, dna_file):
    rig = _face(dna_file, mode)
    wanted = _film(rig)
    _bake()
    for item in [rig, scene.controls(rig), *scene.meshes(rig).values()]:
        item.select_set(True)
    bpy.ops.object.duplicate()
    bpy.context.view_layer.update()
    copy = next(o for o in bpy.data.objects if "risorius_controls" in o and o != rig)
    assert bpy.ops.risorius.unbake(every=True) == {"FINISHED"}
    for one in (rig, copy):
        assert "risorius_baked" not in one
        _assert_same(_film(one), wanted)
    assert not any("_baked" in a.name for a in bpy.data.actions)


def test_the_panel_shows_the_state_and_the_way_back(dna_file):
    _face(dna_file)
    panel = scene.submodule("ui.face.panel").RISORIUS_PT_character
    assert "risorius.unbake" not in drawn(panel).operators
    _bake(start=2, end=9)
    assert "risorius.unbake" in drawn(panel).operators
    below = scene.submodule("ui.bake.panel").RISORIUS_PT_out
    out = drawn(below)
    assert "it plays its actions, frames 2 to 9." in out.text()
    assert out.operators == [
        "risorius.unbake",
        "risorius.bake",
        "risorius.export_animation",
        "risorius.bake_physics",
        "risorius.export_web",
        "risorius.export_game_face",
    ]
    bpy.ops.risorius.unbake()
    _bake(kind="CONTROLS")
    assert (
        "The controls are baked; layers, NLA and drivers rest, frames 1 to 10."
        in drawn(below).text()
    )


def test_what_cannot_be_baked_says_so(dna_file):
    rig = _face(dna_file)
    _bake()
    with pytest.raises(RuntimeError, match="baked already: choose Back to Live first"):
        bpy.ops.risorius.bake()
    with pytest.raises(RuntimeError, match="This face is baked"):
        bpy.ops.risorius.set_shape_mode(mode="KEYS")
    bpy.ops.risorius.unbake()
    with pytest.raises(RuntimeError, match="ends at frame 2, before it starts at 5"):
        bpy.ops.risorius.bake(range="CUSTOM", start=5, end=2)
    with pytest.raises(RuntimeError, match="Level 9 was not built"):
        bpy.ops.risorius.bake(lod=9)
    data = scene.controls(rig).animation_data
    data.nla_tracks.new().strips.new("base", 1, data.action)
    data.action = None
    data.nla_tracks[0].select = data.nla_tracks[0].strips[0].select = True
    data.use_tweak_mode = True
    if data.use_tweak_mode:
        with pytest.raises(RuntimeError, match="tweak mode"):
            bpy.ops.risorius.bake(kind="CONTROLS")
    else:
        pytest.fail("Blender did not enter the tweak mode")
