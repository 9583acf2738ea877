# SPDX-License-Identifier: GPL-3.0-or-later
"""Tests that a face with layers of animation shows the values of risorius.Mixer and of the NLA."""

import bpy
import numpy as np
import pytest
from support import scene
from support.layout import drawn

PREFIX = "CTRL_expressions."
JAW, PULL, BROW = (PREFIX + n for n in ("jawOpen", "mouthCornerPullL", "browDownL"))


@pytest.fixture
def rig(dna_file):
    bpy.context.scene.render.fps = 24
    rig = scene.load(dna_file, "LIVE")
    scene.controls(rig).risorius_layer_rules = False
    return rig


def _layers():
    return scene.submodule("scene.animation.layers")


def _action(rig, name="Wave", interpolation="BEZIER", **curves):
    """Make an action with keys on sliders.

    Args:
        rig: the face.
        name: name of the action.
        interpolation: interpolation of all keys.
        curves: short name of a slider -> {frame: value}.
    """
    controls, bone = scene.controls(rig), scene.face(rig)
    data = controls.animation_data_create()
    before = data.action
    data.action = action = bpy.data.actions.new(name)
    for short, keys in curves.items():
        for frame, value in keys.items():
            bone[PREFIX + short] = value
            bone.keyframe_insert(f'["{PREFIX}{short}"]', frame=frame)
        bone[PREFIX + short] = 0.0
    for curve in scene.curves(controls):
        for key in curve.keyframe_points:
            key.interpolation = interpolation
    data.action = before
    return action


def _wave(rig, **options):
    return _action(
        rig,
        jawOpen={1: 0.0, 7: 0.9, 12: 0.2, 21: 0.6},
        mouthCornerPullL={3: 0.7, 15: 0.1},
        browDownL={1: 0.3, 21: 1.0},
        **options,
    )


def _raw(rig, frame):
    """The raw controls that the evaluator receives at a frame, float32[controls]."""
    bpy.context.scene.frame_set(int(np.floor(frame)), subframe=float(frame % 1))
    live = scene.submodule("scene.character.runtime").of(rig)
    depsgraph = bpy.context.evaluated_depsgraph_get()
    seen = scene.controls(rig).evaluated_get(depsgraph)
    return scene.submodule("scene.frame.inputs").read_inputs(seen, live, depsgraph)[0]


def _value(rig, frame, name):
    live = scene.submodule("scene.character.runtime").of(rig)
    return _raw(rig, frame)[live.labels.index(name)]


def _strip(rig, action, track="Track", **settings):
    """Add an NLA strip that plays an action on a new track, with `settings` of the strip."""
    data = scene.controls(rig).animation_data_create()
    new = data.nla_tracks.new()
    strip = new.strips.new(track, 1, action)
    if hasattr(strip, "action_slot"):
        strip.action_slot = action.slots[0]
    first, last = action.frame_range
    strip.action_frame_start, strip.action_frame_end = first, last
    for name, value in settings.items():
        setattr(strip, name, value)
    return strip


FRAMES = [-3.0, 1.0, 2.0, 5.0, 6.0, 9.0, 12.0, 17.0, 20.0, 27.0, 33.0, 41.0, 60.0]


@pytest.mark.parametrize("interpolation", ["LINEAR", "BEZIER", "CONSTANT"])
@pytest.mark.parametrize(
    ("layer", "strip"),
    [
        ({}, {"blend_type": "REPLACE", "extrapolation": "HOLD"}),
        ({"blend": "ADD"}, {"blend_type": "ADD", "extrapolation": "HOLD"}),
        (
            {"start": 5.0, "scale": 1.5, "extend": "NOTHING"},
            {"frame_start": 5.0, "frame_end": 35.0, "scale": 1.5, "extrapolation": "NOTHING"},
        ),
        (
            {"start": 2.0, "scale": 0.37, "repeat": 4.5, "extend": "HOLD_FORWARD"},
            {"frame_start": 2.0, "scale": 0.37, "repeat": 4.5, "extrapolation": "HOLD_FORWARD"},
        ),
        (
            {"fade_in": 4.0, "fade_out": 7.0, "extend": "NOTHING", "blend": "ADD"},
            {
                "use_auto_blend": False,
                "blend_in": 4.0,
                "blend_out": 7.0,
                "extrapolation": "NOTHING",
                "blend_type": "ADD",
            },
        ),
        ({"weight": 0.4}, {"use_animated_influence": True, "influence": 0.4}),
        ({"reverse": True, "scale": 1.25}, {"use_reverse": True, "scale": 1.25}),
    ],
)
def test_a_layer_is_what_the_nla_makes_of_it(rig, layer, strip, interpolation):
    action = _wave(rig, interpolation=interpolation)
    base = _action(rig, "Base", jawOpen={1: 0.1, 40: 0.8}, browDownL={1: 0.5}, eyeLookUpL={1: 0.25})
    made = _strip(rig, base, "Base", extrapolation="HOLD")
    assert made is not None
    entry = _layers().add_action(scene.controls(rig), action)
    for name, value in layer.items():
        setattr(entry, name, value)
    ours = np.array([_raw(rig, f) for f in FRAMES])
    entry.mute = True
    without = np.array([_raw(rig, f) for f in FRAMES])
    made = _strip(rig, action, **{"extrapolation": "HOLD", **strip})
    if made.use_animated_influence:
        made.influence = layer["weight"]
        made.fcurves[0].keyframe_points.insert(1, layer["weight"])
    theirs = np.array([_raw(rig, f) for f in FRAMES])
    np.testing.assert_allclose(ours, theirs, atol=1e-6)
    assert np.abs(ours - without).max() > 0.1


BLINK = PREFIX + "eyeBlinkL"


@pytest.fixture
def blinker(tmp_path):
    """A face that has the controls of a blink."""
    from support.faces import renumbered, small_face

    eyes = [PREFIX + n for n in ("eyeBlinkL", "eyeBlinkR", "eyeSquintInnerL")]
    dna = renumbered(small_face(), controls=[*range(8), *eyes, 8, 9, 10])
    path = tmp_path / "blinker.dna"
    dna.save(str(path))
    bpy.context.scene.render.fps = 24
    return scene.load(path, "LIVE")


def _entry(rig, **settings):
    controls = scene.controls(rig)
    kind = settings.pop("kind", "ACTION")
    name = settings.pop("name", "Layer")
    entry = _layers().add(controls, kind, name)
    for key, value in settings.items():
        setattr(entry, key, value)
    return entry


def _performance(rig, rules):
    """Add layers: a wave of three sliders, an expression, a repeated blink, and fired reactions.

    The expression moves only the mouth, and fades in and out. `rules` is the setting
    `risorius_layer_rules` of the face.
    """
    controls = scene.controls(rig)
    controls.risorius_layer_rules = rules
    _entry(rig, action=_wave(rig, interpolation="LINEAR"), start=3.0, scale=1.5)
    joy = {"expression": "joy", "start": 10.0, "length": 30.0, "fade_in": 8.0, "fade_out": 5.0}
    _entry(rig, kind="EXPRESSION", regions={"MOUTH"}, blend="MAXIMUM", weight=0.7, **joy)
    blink = _action(rig, "Blink", "LINEAR", eyeBlinkL={0: 0.0, 3: 0.8, 6: 0.0}, jawOpen={0: 0.3})
    _entry(rig, action=blink, start=6.0, extend="REPEAT", blend="ADD", controls="eye* -*squint*")
    _layers().fire(controls, "flash", 14.5, 0.9)
    _layers().fire(controls, "flash", 40.0, 0.5)
    _layers().fire(controls, "blink", 400.0)  # long after all other layers have ended


def _mixer(rig, rules):
    """A risorius.Mixer with the same layers and rules as `_performance`, with times in seconds."""
    import risorius

    names = scene.submodule("scene.character.runtime").of(rig).labels
    frames = np.array([1.0, 7.0, 12.0, 21.0])
    jaw = np.interp(np.arange(1, 22), frames, [0.0, 0.9, 0.2, 0.6])
    pull = np.interp(np.arange(1, 22), [3.0, 15.0], [0.7, 0.1])
    brow = np.linspace(0.3, 1.0, 21)
    wave = risorius.Clip([JAW, PULL, BROW], [jaw, pull, brow], 24.0, start=1 / 24)
    blink = risorius.Clip([BLINK], [np.interp(np.arange(7), [0, 3, 6], [0, 0.8, 0])], 24.0)
    mixer = risorius.Mixer(
        names,
        [
            risorius.Layer(wave, start=3 / 24, scale=1.5),
            risorius.Layer(
                "joy",
                mask={"mouth": 1.0},
                blend="max",
                weight=0.7,
                start=10 / 24,
                end=40 / 24,
                fade_in=8 / 24,
                fade_out=5 / 24,
            ),
            risorius.Layer(blink, start=6 / 24, extend="repeat", blend="additive"),
        ],
        exclusives="default" if rules else None,
    )
    mixer.fire("blink", 400.0 / 24)
    mixer.fire("flash", 40.0 / 24, 0.5)
    mixer.fire("flash", 14.5 / 24, 0.9)
    return mixer


@pytest.mark.parametrize("rules", [False, True])
def test_what_one_sees_is_what_the_mixer_computes(blinker, rules):
    _performance(blinker, rules)
    mixer = _mixer(blinker, rules)
    scene.face(blinker)["CTRL_expressions.eyeLookUpL"] = 0.3
    scene.update(scene.controls(blinker))
    base = np.zeros(len(mixer.names), np.float32)
    base[mixer.names.index("CTRL_expressions.eyeLookUpL")] = 0.3
    for frame in (*range(0, 60, 3), 7.25, 15.5, 15.75, 41.125, 403):
        wanted = mixer.evaluate(frame / 24, base)
        np.testing.assert_allclose(_raw(blinker, frame), wanted, atol=2e-6)
    assert _value(blinker, 18.5, BLINK) > 0.85  # the reaction flash


def test_the_mesh_shows_the_layers(rig, dna_file):
    _entry(rig, action=_wave(rig))
    bpy.context.scene.frame_set(9)
    raw = _raw(rig, 9)
    assert raw[0] > 0.3
    assert scene.face(rig)[JAW] == 0.0
    assert scene.error_against_oracle(rig, dna_file, raw) < scene.TOLERANCE


def test_any_order_of_frames_gives_the_same(blinker):
    _performance(blinker, True)
    forwards = {}
    for frame in (2, 16, 30, 44):
        bpy.context.scene.frame_set(frame)
        forwards[frame] = scene.snapshot(blinker)
    for frame in (44, 2, 30, 16):
        bpy.context.scene.frame_set(frame)
        np.testing.assert_array_equal(scene.snapshot(blinker), forwards[frame])


def test_a_render_shows_what_the_viewport_shows(blinker, tmp_path):
    from support import pictures

    _performance(blinker, True)
    camera = bpy.data.objects.new("camera", bpy.data.cameras.new("camera"))
    setup = pictures.small_render(camera, 16)
    setup.collection.objects.link(camera)
    seen, wanted = {}, {}

    def note(_scene, depsgraph):
        runtime = scene.submodule("scene.character.runtime")
        inputs = scene.submodule("scene.frame.inputs")
        face = scene.controls(blinker).evaluated_get(depsgraph)
        frame = depsgraph.scene.frame_current_final
        seen[frame] = inputs.read_inputs(face, runtime.of(blinker), depsgraph)[0]

    setup.frame_start, setup.frame_end, setup.frame_step = 15, 17, 2
    setup.render.filepath = str(tmp_path / "frame")
    bpy.app.handlers.frame_change_post.append(note)
    try:
        bpy.ops.render.render(animation=True)
    finally:
        bpy.app.handlers.frame_change_post.remove(note)
    scene.submodule("scene.base.session").end("undo")
    wanted = {frame: _raw(blinker, frame) for frame in (15, 17)}
    for frame, raw in wanted.items():
        np.testing.assert_array_equal(seen[frame], raw)


def _names(controls):
    """The names of a face's layers, the lowest layer first."""
    return [layer.name for layer in _layers().of(controls)]


def test_keys_of_a_weight_go_with_their_layer(rig):
    controls = scene.controls(rig)
    _entry(rig, name="low", action=_action(rig, "Low", jawOpen={1: 1.0, 2: 1.0}))
    _entry(rig, name="high", action=_action(rig, "High", mouthCornerPullL={1: 1.0, 2: 1.0}))
    for frame, value in ((1, 0.0), (11, 1.0)):
        controls.risorius_layers[1].weight = value
        controls.keyframe_insert("risorius_layers[1].weight", frame=frame)
    for curve in scene.curves(controls):
        for key in curve.keyframe_points:
            key.interpolation = "LINEAR"
    assert _value(rig, 6, PULL) == pytest.approx(0.5)
    assert _value(rig, 6, JAW) == 1.0
    assert _value(rig, 3.5, PULL) == pytest.approx(0.25)  # subframes, which motion blur evaluates
    assert bpy.ops.risorius.layer_move(up=False) == {"FINISHED"}
    assert _names(controls) == ["high", "low"]
    assert _value(rig, 6, PULL) == pytest.approx(0.5)
    assert _value(rig, 6, JAW) == 1.0
    assert bpy.ops.risorius.layer_duplicate() == {"FINISHED"}
    assert _names(controls) == ["high", "high.001", "low"]
    assert _value(rig, 6, PULL) == pytest.approx(0.75)  # half of the remaining half
    assert _value(rig, 3.5, PULL) == pytest.approx(1.0 - 0.75**2)  # its keys were copied
    controls.risorius_layers_index = 1
    assert bpy.ops.risorius.layer_remove() == {"FINISHED"}
    assert _names(controls) == ["high.001", "low"]
    assert _value(rig, 6, PULL) == pytest.approx(0.5)
    assert bpy.ops.risorius.layer_move(up=True) == {"FINISHED"}
    assert _names(controls) == ["low", "high.001"]
    assert bpy.ops.risorius.layer_remove() == {"FINISHED"}
    assert _value(rig, 6, PULL) == 0.0
    assert _value(rig, 6, JAW) == 1.0


def _key_weights(controls, name, *values):
    """An action that no object uses, with keyframes at frame 1 for weights of layers.

    Args:
        controls: control armature of the face.
        name: name of the action.
        values: weights of the first layers, from the lowest layer on.
    """
    data = controls.animation_data_create()
    data.action = action = bpy.data.actions.new(name)
    for place, value in enumerate(values):
        controls.risorius_layers[place].weight = value
        controls.keyframe_insert(f"risorius_layers[{place}].weight", frame=1)
    data.action = None
    return action


def _as_assigned(controls, action):
    data = controls.animation_data
    data.action = action
    if hasattr(data, "action_slot") and data.action_slot is None:
        data.action_slot = action.slots[0]


def _as_meta_strip(controls, action):
    from support.past_scenes import make_meta

    strip = controls.animation_data.nla_tracks.new().strips.new("Weights", 1, action)
    if hasattr(strip, "action_slot"):
        strip.action_slot = action.slots[0]
    make_meta(controls, strip)


def _as_linked(controls, action, folder):
    """Move the action to another .blend file, link it from there and assign it to the controls."""
    path = folder / "actions.blend"
    name = action.name
    bpy.data.libraries.write(str(path), {action})
    bpy.data.actions.remove(action)
    with bpy.data.libraries.load(str(path), link=True) as (_there, here):
        here.actions = [name]
    _as_assigned(controls, here.actions[0])


@pytest.mark.parametrize("how", ["later", "meta", "linked", "driver"])
def test_order_and_removal_leave_the_weights_of_every_action_where_they_are(rig, tmp_path, how):
    controls = scene.controls(rig)
    poses = {
        "jaw": ("jawOpen", JAW),
        "pull": ("mouthCornerPullL", PULL),
        "brow": ("browDownL", BROW),
    }
    for name, (short, _control) in poses.items():
        _entry(rig, name=name, action=_action(rig, name, **{short: {1: 1.0, 2: 1.0}}))
    weights = {"jaw": 0.25, "pull": 0.5, "brow": 0.75}
    action = _key_weights(controls, "Weights", *weights.values())
    if how == "meta":
        _as_meta_strip(controls, action)
    elif how == "linked":
        _as_linked(controls, action, tmp_path)
    elif how == "driver":
        for place, value in enumerate(weights.values()):
            controls.driver_add(f"risorius_layers[{place}].weight").driver.expression = str(value)
    controls.risorius_layers_index = 0
    assert bpy.ops.risorius.layer_move(up=True) == {"FINISHED"}
    assert bpy.ops.risorius.layer_move(up=True) == {"FINISHED"}
    assert bpy.ops.risorius.layer_move(up=True) == {"CANCELLED"}
    assert _names(controls) == ["pull", "brow", "jaw"]
    if how == "later":
        _as_assigned(controls, action)
    found = {name: _value(rig, 5, control) for name, (_short, control) in poses.items()}
    assert found == pytest.approx(weights)
    controls.risorius_layers_index = 1
    assert bpy.ops.risorius.layer_remove() == {"FINISHED"}
    assert _names(controls) == ["brow", "jaw"]
    new = _entry(rig, name="new", action=_action(rig, "New", mouthCornerPullR={1: 1.0, 2: 1.0}))
    found = {name: _value(rig, 5, control) for name, (_short, control) in poses.items()}
    assert found == pytest.approx({**weights, "pull": 0.0})
    assert _value(rig, 5, PREFIX + "mouthCornerPullR") == new.weight == 1.0


def test_a_shared_action_moves_the_other_face_as_before(rig, dna_file):
    controls, other = scene.controls(rig), scene.load(dna_file, "LIVE")
    scene.controls(other).risorius_layer_rules = False
    for one in (rig, other):
        _entry(one, name="jaw", action=_action(one, "Jaw", jawOpen={1: 1.0, 2: 1.0}))
        _entry(one, name="pull", action=_action(one, "Pull", mouthCornerPullL={1: 1.0, 2: 1.0}))
    shared = _key_weights(controls, "Shared", 0.25, 0.5)
    for one in (rig, other):
        scene.controls(one).animation_data_create()
        _as_assigned(scene.controls(one), shared)
    bpy.context.view_layer.objects.active = controls
    controls.risorius_layers_index = 0
    assert bpy.ops.risorius.layer_move(up=True) == {"FINISHED"}
    assert (_value(other, 5, JAW), _value(other, 5, PULL)) == pytest.approx((0.25, 0.5))
    assert bpy.ops.risorius.layer_duplicate() == {"FINISHED"}
    assert bpy.ops.risorius.layer_remove() == {"FINISHED"}
    controls.risorius_layers_index = 0
    assert bpy.ops.risorius.layer_remove() == {"FINISHED"}
    assert (_value(other, 5, JAW), _value(other, 5, PULL)) == pytest.approx((0.25, 0.5))
    assert _value(rig, 5, PULL) == pytest.approx(0.5)


def test_the_list_shows_the_highest_first_and_no_empty_places(rig):
    controls = scene.controls(rig)
    for name in ("a", "b", "c"):
        _entry(rig, name=name, kind="EXPRESSION", expression="joy")
    _key_weights(controls, "Keyed", 1.0, 1.0, 1.0)
    _layers().move(controls, 0, up=True)
    _layers().remove(controls, 1)
    fake = type("List", (), {"bitflag_filter_item": 1 << 30})()
    filter_items = bpy.types.RISORIUS_UL_layers.filter_items
    shown, order = filter_items(fake, bpy.context, controls, "risorius_layers")
    lines = sorted(
        (line, y.name)
        for y, line, s in zip(controls.risorius_layers, order, shown, strict=True)
        if s
    )
    assert lines == [(0, "c"), (1, "a")]
    assert sorted(order) == [0, 1, 2]


def test_places_that_no_action_knows_go_with_their_layers(rig):
    controls = scene.controls(rig)
    for name in ("a", "b"):
        _entry(rig, name=name, kind="EXPRESSION", expression="joy")
    _layers().remove(controls, 0)
    assert len(controls.risorius_layers) == 2
    _layers().remove(controls, 1)
    assert len(controls.risorius_layers) == 0
    assert bpy.ops.risorius.layer_move.poll() is False


def test_an_edit_of_an_action_is_seen_at_once(rig):
    action = _action(rig, jawOpen={1: 0.25, 20: 0.25})
    _entry(rig, action=action)
    assert _value(rig, 10, JAW) == pytest.approx(0.25)
    before = scene.snapshot(rig)
    for curve in scene.submodule("scene.base.compat").curves_of(action):
        for key in curve.keyframe_points:
            key.co[1] = key.handle_left[1] = key.handle_right[1] = 0.75
        curve.update()
    bpy.context.view_layer.update()
    assert np.abs(scene.snapshot(rig) - before).max() > 1e-3
    assert _value(rig, 10, JAW) == pytest.approx(0.75)


def test_mute_solo_and_masks(rig):
    wave = _action(rig, jawOpen={1: 0.5, 2: 0.5}, browDownL={1: 0.5, 2: 0.5})
    one = _entry(rig, action=wave, regions={"BROW"})
    assert (_value(rig, 5, JAW), _value(rig, 5, BROW)) == (0.0, 0.5)
    one.regions, one.controls = set(), "-brow*"
    assert (_value(rig, 5, JAW), _value(rig, 5, BROW)) == (0.5, 0.0)
    one.mute = True
    assert _value(rig, 5, JAW) == 0.0
    one.mute = False
    two = _entry(rig, action=_action(rig, "Two", mouthCornerPullL={1: 1.0, 2: 1.0}))
    two.solo = True
    assert (_value(rig, 5, JAW), _value(rig, 5, PULL)) == (0.0, 1.0)


def test_warp_points_pin_what_is_shown(rig):
    entry = _entry(rig, action=_action(rig, "Ramp", "LINEAR", jawOpen={0: 0.0, 20: 1.0}), start=0)
    _raw(rig, 10)
    assert bpy.ops.risorius.layer_warp() == {"FINISHED"}
    assert _value(rig, 5, JAW) == pytest.approx(0.25)  # the pin keeps the current time
    point = next(p for p in entry.warp if p.frame == 10)
    point.frame = 4
    assert _value(rig, 4, JAW) == pytest.approx(0.5)
    assert _value(rig, 2, JAW) == pytest.approx(0.25)
    assert _value(rig, 12, JAW) == pytest.approx(0.75)


def test_the_head_of_a_layer_replaces_or_adds(rig):
    clips = scene.submodule("scene.animation.clip_actions")
    import risorius

    clip = risorius.Clip(["head.yaw"], [[0.4, 0.4]], 24.0)
    timing = clips.timing_of(clip, bpy.context.scene, 0.0)
    action = clips.make_action(rig, clip, timing, "Turn").action
    head = scene.controls(rig).pose.bones["head"]
    head.rotation_mode = "XYZ"
    head.rotation_euler = (0.0, 0.1, 0.0)  # about the upright bone: yaw
    entry = _entry(rig, action=action)
    for blend, wanted in (("OVERRIDE", 0.4), ("ADD", 0.5)):
        entry.blend = blend
        bpy.context.scene.frame_set(0)
        depsgraph = bpy.context.evaluated_depsgraph_get()
        seen = scene.controls(rig).evaluated_get(depsgraph)
        live = scene.submodule("scene.character.runtime").of(rig)
        turn = scene.submodule("scene.frame.inputs").read_inputs(seen, live, depsgraph)[1]["head"]
        assert turn.angle == pytest.approx(wanted, abs=1e-5)


@pytest.mark.parametrize("how", ["save", "undo", "copy", "replace"])
def test_layers_live_on(rig, dna_file, tmp_path, how):
    from support.faces import other_face

    bpy.context.preferences.edit.use_global_undo = True
    _entry(rig, action=_action(rig, "Keep", jawOpen={1: 0.6, 2: 0.6}), weight=0.5)
    name = rig.name
    if how == "save":
        path = tmp_path / "kept.blend"
        bpy.ops.wm.save_as_mainfile(filepath=str(path))
        bpy.ops.wm.open_mainfile(filepath=str(path))
    elif how == "undo":
        bpy.ops.ed.undo_push(message="a layer")
        scene.controls(rig).risorius_layers[0].weight = 1.0
        _entry(rig, action=_action(rig, "More", mouthCornerPullL={1: 1.0, 2: 1.0}))
        bpy.ops.ed.undo_push(message="two layers")
        assert _value(rig, 5, PULL) == 1.0
        bpy.ops.ed.undo()
    elif how == "copy":
        name = _duplicated(rig)
        scene.controls(rig).risorius_layers[0].weight = 0.0
        assert _value(rig, 5, JAW) == 0.0
    else:
        other = tmp_path / "other.dna"
        other_face().save(str(other))
        assert bpy.ops.risorius.replace_dna(filepath=str(other)) == {"FINISHED"}
    bpy.context.view_layer.update()
    kept = bpy.data.objects[name]
    assert _value(kept, 5, JAW) == pytest.approx(0.3)
    assert _value(kept, 5, PULL) == 0.0


def _duplicated(rig):
    bpy.context.view_layer.objects.active = None
    for item in [o for o in bpy.context.scene.objects if o.name.startswith("Small")]:
        item.hide_set(False)
        item.select_set(True)
    bpy.ops.object.duplicate()
    bpy.context.view_layer.update()
    return next(o.name for o in bpy.context.selected_objects if "risorius_controls" in o)


def test_layers_on_an_override(rig, tmp_path):
    _entry(rig, action=_action(rig, "Keep", jawOpen={1: 0.6, 2: 0.6}))
    path = tmp_path / "library.blend"
    bpy.ops.wm.save_as_mainfile(filepath=str(path))
    bpy.ops.wm.read_homefile(use_empty=True)
    bpy.ops.wm.link(directory=f"{path}/Collection/", filename="Small", instance_collections=True)
    item = next(o for o in bpy.data.objects if o.instance_collection)
    bpy.context.view_layer.objects.active = item
    bpy.context.view_layer.update()
    assert bpy.ops.risorius.make_override() == {"FINISHED"}
    own = next(o for o in bpy.data.objects if "risorius_controls" in o and not o.library)
    assert _value(own, 5, JAW) == pytest.approx(0.6)
    scene.controls(own).risorius_layers[0].weight = 0.5
    bpy.context.view_layer.objects.active = scene.controls(own)
    assert bpy.ops.risorius.layer_add(kind="EXPRESSION", source="joy") == {"FINISHED"}
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "shot.blend"))
    bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "shot.blend"))
    own = next(o for o in bpy.data.objects if "risorius_controls" in o and not o.library)
    kept = scene.controls(own).risorius_layers
    assert [(y.kind, y.weight) for y in kept] == [("ACTION", 0.5), ("EXPRESSION", 1.0)]
    assert _value(own, 5, PULL) > 0.5
    bpy.context.view_layer.objects.active = scene.controls(own)
    scene.controls(own).risorius_layers_index = 0
    assert bpy.ops.risorius.layer_move(up=True) == {"FINISHED"}
    assert _value(own, 5, JAW) > 0.3
    assert bpy.ops.risorius.layer_remove() == {"FINISHED"}  # the layer of the library
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "shot.blend"))
    bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "shot.blend"))
    own = next(o for o in bpy.data.objects if "risorius_controls" in o and not o.library)
    assert [y.kind for y in _layers().of(scene.controls(own))] == ["EXPRESSION"]


def test_layers_become_strips_that_show_the_same(rig):
    controls = scene.controls(rig)
    base = _action(rig, "Base", "LINEAR", jawOpen={1: 0.2, 40: 0.5}, browDownL={1: 0.1, 2: 0.1})
    scene.submodule("scene.animation.clip_actions").play(rig, base)
    wave = _wave(rig)
    _entry(rig, action=wave, start=4.0, scale=1.5, regions={"JAW", "MOUTH"}, extend="NOTHING")
    _entry(rig, action=wave, blend="ADD", reverse=True, repeat=2.0)
    joy = {"length": 16.0, "fade_in": 9.0, "fade_out": 11.0, "start": 2.0, "extend": "NOTHING"}
    _entry(rig, kind="EXPRESSION", expression="joy", name="Joy", weight=0.3, **joy)
    _entry(rig, kind="EXPRESSION", expression="joy", name="Joy", weight=0.1)
    _entry(rig, action=wave, start=8.0, fade_in=5.0, fade_out=6.0, weight=0.8, extend="NOTHING")
    controls.risorius_layers[1].weight = 0.2
    controls.keyframe_insert("risorius_layers[1].weight", frame=1)
    controls.risorius_layers[1].weight = 0.9
    controls.keyframe_insert("risorius_layers[1].weight", frame=30)
    wanted = [_raw(rig, f) for f in FRAMES]
    assert bpy.ops.risorius.layers_to_nla() == {"FINISHED"}
    assert all(layer.mute for layer in controls.risorius_layers)
    assert len(controls.animation_data.nla_tracks) == 6
    for frame, raw in zip(FRAMES, wanted, strict=True):
        np.testing.assert_allclose(_raw(rig, frame), raw, atol=1e-6)


@pytest.mark.parametrize(("fade_in", "fade_out"), [(3.0, 9.0), (9.0, 3.0), (0.0, 6.0), (6.0, 0.0)])
def test_fades_of_a_strip_lie_at_their_own_ends(rig, fade_in, fade_out):
    held = _action(rig, "Held", "LINEAR", jawOpen={1: 0.8, 21: 0.8})
    _entry(rig, action=held, fade_in=fade_in, fade_out=fade_out, extend="NOTHING")
    frames = np.arange(1.0, 21.01, 0.5)
    up = (frames - 1) / fade_in if fade_in else np.ones(len(frames))
    down = (21 - frames) / fade_out if fade_out else np.ones(len(frames))
    wanted = 0.8 * np.minimum(1.0, np.minimum(up, down))
    np.testing.assert_allclose([_value(rig, f, JAW) for f in frames], wanted, atol=1e-6)
    assert bpy.ops.risorius.layers_to_nla() == {"FINISHED"}
    np.testing.assert_allclose([_value(rig, f, JAW) for f in frames], wanted, atol=1e-6)


def test_what_no_strip_can_say_stays_a_layer_and_all_above_it(rig):
    controls = scene.controls(rig)
    wave = _wave(rig)
    _entry(rig, name="a", action=wave)
    _entry(rig, name="b", action=wave, blend="MAXIMUM")
    _entry(rig, name="c", action=wave)
    assert bpy.ops.risorius.layers_to_nla() == {"FINISHED"}
    assert [layer.mute for layer in controls.risorius_layers] == [True, False, False]


def test_operators_and_panel(rig):
    controls = scene.controls(rig)
    play = scene.submodule("scene.animation.clip_actions").play
    play(rig, _wave(rig))
    assert bpy.ops.risorius.layer_add(kind="ACTION") == {"FINISHED"}
    assert controls.animation_data.action is None
    assert bpy.ops.risorius.layer_add(kind="EXPRESSION", source="joy") == {"FINISHED"}
    assert bpy.ops.risorius.fire(reaction="flash") == {"FINISHED"}
    with pytest.raises(RuntimeError, match="no reaction sneeze"):
        bpy.ops.risorius.fire(reaction="sneeze")
    _entry(rig, name="broken", kind="EXPRESSION", expression="nothing")
    assert "broken: nothing: an expression" in drawn(bpy.types.RISORIUS_PT_layers).text()
    assert bpy.ops.risorius.unfire() == {"FINISHED"}
    assert not len(controls.risorius_reactions)


def test_expressions_set_and_key_sliders(rig):
    face = scene.face(rig)
    face[BROW] = 1.0
    assert bpy.ops.risorius.expression(expression="joy", strength=0.5, key=True) == {"FINISHED"}
    assert face[PULL] == pytest.approx(0.5)
    assert face[BROW] == pytest.approx(0.5)
    paths = {c.data_path for c in scene.curves(scene.controls(rig))}
    assert f'pose.bones["face"]["{PULL}"]' in paths


def test_expressions_become_pose_assets_in_catalogues(rig, tmp_path):
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "poses.blend"))
    rig = bpy.data.objects["Small_rig"]
    assert bpy.ops.risorius.make_pose_assets() == {"FINISHED"}
    joy = bpy.data.actions["Face Joy"]
    count = len(bpy.data.actions)
    assert joy.asset_data is not None
    catalogs = (tmp_path / "blender_assets.cats.txt").read_text(encoding="utf-8")
    assert f"{joy.asset_data.catalog_id}:Faces/Emotions:Faces-Emotions" in catalogs
    scene.face(rig)["CTRL_expressions.jawOpen"] = 0.9
    scene.controls(rig).pose.apply_pose_from_action(joy)
    scene.update(scene.controls(rig))
    assert scene.face(rig)[PULL] == pytest.approx(1.0)
    assert bpy.ops.risorius.make_pose_assets() == {"FINISHED"}
    assert len(bpy.data.actions) == count


def test_the_catalogues_are_whole_for_whoever_reads_them(rig, tmp_path):
    """Blender's file of asset catalogues is replaced, not rewritten, when catalogues are added.

    So a program that reads the file never sees half of it. The new file contains the old
    catalogues too, and a symbolic link to the file remains a link.
    """
    shared, link = tmp_path / "shared.txt", tmp_path / "blender_assets.cats.txt"
    old = "VERSION 1\n\n6f0a5c9e-2f0b-4d2e-9a3b-0d9f6f0b7a12:Props:Props\n"
    shared.write_text(old, encoding="utf-8")
    link.symlink_to(shared)
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "poses.blend"))
    with shared.open(encoding="utf-8") as reader:
        assert bpy.ops.risorius.make_pose_assets() == {"FINISHED"}
        assert reader.read() == old
    assert link.is_symlink()
    new = shared.read_text(encoding="utf-8")
    assert new.startswith(old)
    assert "Faces/Emotions" in new
    assert sorted(p.name for p in tmp_path.glob("*cats*")) == [link.name]


def test_idle_life_is_that_of_its_seed(blinker):
    from risorius.anim.idle import idle

    scene.controls(blinker).risorius_lids = 0.0  # otherwise a gaze moves the lids too
    entry = _entry(blinker, kind="IDLE", seed=7, start=5.0, length=240.0)
    wanted = idle(7, 10.0)
    for frame in (5, 33, 100, 200.5):
        value = wanted.sample((frame - 5) / 24)[0, wanted.names.index(BLINK)]
        assert _value(blinker, frame, BLINK) == pytest.approx(value, abs=1e-6)
    entry.length = 0.0
    loop = idle(7, 120.0, loop=True).curve(BLINK)
    assert loop.max() > 0.9
    top = int(np.argmax(loop)) / 60  # seconds
    for turn in (-1, 0, 3):
        frame = 5 + (top + 120.0 * turn) * 24
        assert _value(blinker, frame, BLINK) == pytest.approx(loop.max(), abs=1e-4)
    assert bpy.ops.risorius.layer_add(kind="IDLE") == {"FINISHED"}


def test_idle_life_with_a_length_becomes_a_strip(blinker):
    _entry(blinker, kind="IDLE", seed=7, start=5.0, length=240.0, extend="NOTHING")
    frames = (3, 33, 100, 200, 260)
    scene.controls(blinker).risorius_layer_rules = False
    wanted = [_raw(blinker, f) for f in frames]
    assert bpy.ops.risorius.layers_to_nla() == {"FINISHED"}
    for frame, raw in zip(frames, wanted, strict=True):
        np.testing.assert_allclose(_raw(blinker, frame), raw, atol=2e-6)


def test_keys_of_weights_outlive_their_action(rig, tmp_path):
    controls = scene.controls(rig)
    scene.submodule("scene.animation.clip_actions").play(
        rig, _action(rig, "First", jawOpen={1: 0.5, 9: 0.5})
    )
    _entry(rig, kind="EXPRESSION", expression="joy")
    for frame, value in ((1, 0.0), (11, 1.0)):
        controls.risorius_layers[0].weight = value
        controls.keyframe_insert("risorius_layers[0].weight", frame=frame)
    wanted = [_value(rig, frame, PULL) for frame in (4, 8)]
    assert 0.0 < wanted[0] < wanted[1]
    table = tmp_path / "brow.csv"
    table.write_text("time,browDownLeft\n0,0.1\n1,0.2\n", encoding="utf-8")
    assert bpy.ops.risorius.import_animation(filepath=str(table)) == {"FINISHED"}
    assert [_value(rig, frame, PULL) for frame in (4, 8)] == pytest.approx(wanted)
    assert bpy.ops.risorius.layer_add(kind="ACTION") == {"FINISHED"}
    assert [y.name for y in controls.risorius_layers] == ["Layer", "brow"]
    assert [_value(rig, frame, PULL) for frame in (4, 8)] == pytest.approx(wanted)
    assert _value(rig, 4, BROW) == pytest.approx(0.1 + 0.1 * 3 / 24, abs=1e-5)


def test_undo_of_an_edited_action(rig):
    bpy.context.preferences.edit.use_global_undo = True
    action = _action(rig, "Edited", "LINEAR", jawOpen={1: 0.25, 20: 0.25})
    _entry(rig, action=action)
    bpy.ops.ed.undo_push(message="as it was")
    assert _value(rig, 5, JAW) == pytest.approx(0.25)
    for curve in scene.submodule("scene.base.compat").curves_of(action):
        for key in curve.keyframe_points:
            key.co[1] = 0.75
        curve.update()
    bpy.context.view_layer.update()
    bpy.ops.ed.undo_push(message="edited")
    assert _value(rig, 5, JAW) == pytest.approx(0.75)
    assert bpy.ops.ed.undo() == {"FINISHED"}
    assert _value(bpy.data.objects["Small_rig"], 5, JAW) == pytest.approx(0.25)


@pytest.mark.parametrize(
    ("setting", "value"),
    [
        ("start", 4.0),
        ("scale", 0.5),
        ("trim_start", 3.0),
        ("trim_end", 9.0),
        ("repeat", 2.0),
        ("reverse", True),
        ("blend", "MAXIMUM"),
        ("extend", "NOTHING"),
        ("fade_in", 9.0),
        ("fade_out", 9.0),
        ("mute", True),
        ("controls", "jaw*"),
        ("regions", {"JAW"}),
        ("kind", "EXPRESSION"),
    ],
)
def test_every_setting_is_heeded_at_once(rig, setting, value):
    entry = _entry(rig, action=_wave(rig), expression="anger")
    scene.face(rig)[BROW] = 0.5
    other = _entry(rig, kind="EXPRESSION", expression="joy", weight=0.1)
    frames = (2, 6, 14, 25)
    before = np.array([_raw(rig, f) for f in frames])
    setattr(entry, setting, value)
    changed = np.array([_raw(rig, f) for f in frames])
    assert np.abs(changed - before).max() > 0.01
    scene.submodule("scene.base.session").end("undo")
    np.testing.assert_array_equal([_raw(rig, f) for f in frames], changed)
    assert other.name == "Layer.001"


def test_a_reaction_needs_no_layer(blinker):
    assert _value(blinker, 19, BLINK) == 0.0
    bpy.context.scene.frame_set(15)
    assert bpy.ops.risorius.fire(reaction="flash") == {"FINISHED"}
    assert _value(blinker, 19, BLINK) > 0.9


def test_a_copy_of_a_layer_has_its_own_warp_points(rig):
    controls = scene.controls(rig)
    _entry(rig, name="a", action=_wave(rig), weight=0.5)
    for frame in (5, 15):
        bpy.context.scene.frame_set(frame)
        assert bpy.ops.risorius.layer_warp() == {"FINISHED"}
    assert bpy.ops.risorius.layer_duplicate() == {"FINISHED"}
    first, second = _layers().of(controls)
    pins = [(point.frame, point.source) for point in first.warp]
    assert {5, 15} <= {frame for frame, _source in pins}
    assert [(point.frame, point.source) for point in second.warp] == pins
    assert (second.action, second.weight) == (first.action, 0.5)
    assert bpy.ops.risorius.layer_warp(clear=True) == {"FINISHED"}
    assert sorted(len(layer.warp) for layer in _layers().of(controls)) == [0, len(pins)]


@pytest.mark.parametrize(
    ("kind", "words"), [("EXPRESSION", "no expression gone"), ("ACTION", "no action gone")]
)
def test_a_layer_of_what_is_not_there_is_refused(rig, kind, words):
    with pytest.raises(RuntimeError, match=words):
        bpy.ops.risorius.layer_add(kind=kind, source="gone")
    assert not len(_layers().of(scene.controls(rig)))
    assert bpy.ops.risorius.layer_add(kind="EXPRESSION", source="joy") == {"FINISHED"}
    with pytest.raises(RuntimeError, match="Only a layer with an action"):
        bpy.ops.risorius.layer_warp()


def test_an_expression_starts_at_the_current_frame_and_so_does_its_strip(rig):
    bpy.context.scene.frame_set(20)
    assert bpy.ops.risorius.layer_add(kind="EXPRESSION", source="joy") == {"FINISHED"}
    assert _layers().of(scene.controls(rig))[0].start == 20.0
    assert [_value(rig, frame, PULL) > 0.5 for frame in (19, 20, 50)] == [False, True, True]
    assert bpy.ops.risorius.layers_to_nla() == {"FINISHED"}
    assert [_value(rig, frame, PULL) > 0.5 for frame in (19, 20, 50)] == [False, True, True]


def test_a_reaction_that_is_gone_is_named_and_the_others_are_shown(blinker):
    bpy.context.scene.frame_set(15)
    assert bpy.ops.risorius.fire(reaction="flash") == {"FINISHED"}
    _layers().reactions_of(scene.controls(blinker))[0].name = "sneeze"
    _entry(blinker, kind="EXPRESSION", expression="joy", weight=0.0)
    assert bpy.ops.risorius.fire(reaction="flash") == {"FINISHED"}
    assert _value(blinker, 19, BLINK) > 0.9
    assert "sneeze: there is no such reaction" in drawn(bpy.types.RISORIUS_PT_layers).text()
