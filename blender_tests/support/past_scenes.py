# SPDX-License-Identifier: GPL-3.0-or-later
"""Makes the files that past.py plays: one for each way of animating a face."""

import bpy

from . import faces, scene
from .faces import small_face

PREFIX = "CTRL_expressions."
EYES = ("eyeBlinkL", "eyeBlinkR", "eyeSquintInnerL")


def make_all(folder):
    """Make each scene in an empty .blend file, and save the file under the name of its function.

    Args:
        folder: folder of the files.
    """
    dna = folder / "face.dna"
    face = small_face(head_grid=(5, 6))
    names = [PREFIX + n for n in EYES]
    faces.renumbered(face, controls=[*range(8), *names, 8, 9, 10]).save(str(dna))
    try:
        for make in (
            layers,
            meta,
            linked_action,
            shared_action,
            nla,
            baked_result,
            baked_controls,
            shape_modes,
            bones,
            overridden_live,
            overridden_keys,
        ):
            _empty()
            make(dna, folder)
            save(folder / f"{make.__name__}.blend")
    finally:
        dna.unlink()


def _empty():
    bpy.ops.wm.read_homefile(use_empty=True)
    bpy.context.scene.render.fps = 24
    bpy.context.preferences.filepaths.save_version = 0


def save(path):
    """Save the open file, compressed, at frame 9, at which faces are not at rest."""
    bpy.context.scene.frame_set(9)
    bpy.context.view_layer.update()
    bpy.ops.wm.save_as_mainfile(filepath=str(path), compress=True)


def _empty_action(item, name):
    """Assign a new, empty action to the control armature, and return it."""
    data = item.animation_data_create()
    data.action = bpy.data.actions.new(name)
    data.action.use_fake_user = True
    return data.action


def _key_sliders(item, **curves):
    """Insert keys of sliders into the assigned action, and set the sliders to 0.

    Args:
        item: control armature.
        curves: short name of a slider -> {frame: value}.
    """
    bone = item.pose.bones["face"]
    for short, keys in curves.items():
        for frame, value in keys.items():
            bone[PREFIX + short] = value
            bone.keyframe_insert(f'["{PREFIX}{short}"]', frame=frame)
        bone[PREFIX + short] = 0.0


def _key_weight(item, place, keys):
    """Insert keys of a layer's weight whose data path contains the index of the layer.

    Versions of the add-on up to commit 38364e4 stored weights so.

    Args:
        item: control armature.
        place: index of the layer.
        keys: frame -> weight.
    """
    for frame, value in keys.items():
        item.risorius_layers[place].weight = value
        item.keyframe_insert(f"risorius_layers[{place}].weight", frame=frame)


def _three_layers(rig):
    """Add three layers: an action, an expression and idle life. Returns the control armature.

    The control armature has no assigned action, so its sliders have no keys.
    """
    item, layers_module = scene.controls(rig), scene.submodule("scene.animation.layers")
    item.risorius_layer_rules = False
    wave = _empty_action(item, f"Wave of {rig.name}")
    _key_sliders(item, jawOpen={1: 0.1, 8: 0.9, 20: 0.3}, eyeBlinkL={2: 0.0, 6: 0.8, 12: 0.1})
    item.animation_data.action = None
    layers_module.add(item, "ACTION", "Wave", action=wave, start=1.0)
    layers_module.add(item, "EXPRESSION", "Joy", expression="joy", fade_in=6.0, start=2.0)
    layers_module.add(item, "IDLE", 'Idle "Life"', seed=5, start=1.0, blend="ADD")
    return item


def layers(dna, _folder):
    """Weights of two layers have keys in the assigned action and in another action.

    The weight of the third layer has a driver.
    """
    item = _three_layers(scene.load(dna, "LIVE"))
    other = _empty_action(item, "Other")
    _key_weight(item, 0, {1: 0.2, 20: 0.9})
    _key_weight(item, 1, {1: 1.0, 14: 0.0})
    _key_sliders(item, browDownL={1: 0.4, 9: 0.1})
    _empty_action(item, "Main")
    _key_weight(item, 0, {1: 1.0, 18: 0.1})
    _key_weight(item, 1, {3: 0.0, 12: 0.8})
    _key_sliders(item, browDownL={1: 0.0, 20: 1.0})
    assert other.users
    curve = item.driver_add("risorius_layers[2].weight")
    curve.driver.expression = "min(frame / 25, 1)"


def meta(dna, _folder):
    """Layer weights have keys in an action inside a meta strip."""
    item = _three_layers(scene.load(dna, "LIVE"))
    action = _empty_action(item, "In a meta strip")
    _key_weight(item, 1, {1: 0.0, 20: 1.0})
    _key_weight(item, 2, {1: 0.9, 12: 0.2})
    _key_sliders(item, browDownL={1: 0.0, 20: 0.7})
    make_meta(item, _strip(item, action))


def _strip(item, action, name="", **settings):
    """Add a strip of an action to a new NLA track, at the frames of its keys."""
    data = item.animation_data
    slot = getattr(data, "action_slot", None)
    data.action = None
    track = data.nla_tracks.new()
    track.name = name or action.name
    first, last = action.frame_range
    strip = track.strips.new(track.name, int(first), action)
    if slot is not None:
        strip.action_slot = slot
    strip.action_frame_start, strip.action_frame_end = first, last
    strip.frame_start, strip.frame_end = first, last
    strip.use_auto_blend = False
    for key, value in settings.items():
        setattr(strip, key, value)
    return strip


def make_meta(item, strip):
    """Put an NLA strip into a meta strip; Blender's operator runs only in an NLA editor."""
    bpy.context.view_layer.objects.active = item
    item.select_set(True)
    for track in item.animation_data.nla_tracks:
        for other in track.strips:
            other.select = other == strip
    window = bpy.context.window_manager.windows[0]
    area = window.screen.areas[0]
    before, area.type = area.type, "NLA_EDITOR"
    region = next(r for r in area.regions if r.type == "WINDOW")
    with bpy.context.temp_override(window=window, area=area, region=region):
        assert bpy.ops.nla.meta_add() == {"FINISHED"}
    area.type = before


def linked_action(dna, folder):
    """Layer weights have keys in an action that is linked from another file."""
    item = _three_layers(scene.load(dna, "LIVE"))
    _empty_action(item, "Of a library")
    _key_weight(item, 0, {1: 0.3, 16: 0.9})
    _key_weight(item, 1, {1: 0.9, 16: 0.1})
    _key_sliders(item, browDownL={1: 0.0, 20: 0.6})
    library = folder / "library_actions.blend"
    bpy.data.libraries.write(str(library), {item.animation_data.action}, compress=True)
    own = item.animation_data.action
    item.animation_data.action = None
    bpy.data.actions.remove(own)
    save(folder / "linked_action.blend")  # so that the link is relative
    with bpy.data.libraries.load(str(library), link=True, relative=True) as (_there, here):
        here.actions = ["Of a library"]
    item = scene.controls(next(o for o in bpy.data.objects if "risorius_controls" in o))
    _assign(item, here.actions[0])


def _assign(item, action):
    item.animation_data.action = action
    if hasattr(item.animation_data, "action_slot"):
        item.animation_data.action_slot = action.slots[0]


def shared_action(dna, _folder):
    """Two characters, whose layers have different orders, use one action."""
    one = _three_layers(scene.load(dna, "LIVE"))
    two = _three_layers(scene.load(dna, "KEYS"))
    two.risorius_layers.move(0, 2)
    shared = _empty_action(one, "Shared")
    _key_weight(one, 0, {1: 0.1, 20: 1.0})
    _key_weight(one, 1, {1: 0.7, 13: 0.0})
    _key_sliders(one, browDownL={1: 0.0, 20: 0.9})
    two.animation_data_create()
    _assign(two, shared)


def nla(dna, _folder):
    """NLA strips replace, add and fade, and one is muted; the active action adds to the strips."""
    item = _three_layers(scene.load(dna, "LIVE"))
    _strips(item)
    _empty_action(item, "On top")
    _key_sliders(item, eyeLookUpL={1: 0.0, 14: 0.5})
    item.animation_data.action_blend_type = "ADD"


def _strips(item):
    low = _empty_action(item, "Low")
    _key_weight(item, 0, {1: 0.2, 20: 0.8})
    _key_sliders(item, browDownL={1: 0.1, 20: 0.8}, jawOpen={1: 0.4, 12: 0.0})
    _strip(item, low, extrapolation="HOLD", repeat=1.5)
    high = _empty_action(item, "High")
    _key_weight(item, 1, {4: 0.9, 16: 0.3})
    _key_sliders(item, browDownL={4: 0.3, 16: 0.1}, mouthCornerPullR={4: 0.0, 16: 0.9})
    _strip(item, high, blend_type="ADD", blend_in=3.0, blend_out=5.0, extrapolation="NOTHING")
    silent = _empty_action(item, "Silent")
    _key_sliders(item, jawOpen={1: 1.0, 20: 1.0})
    _strip(item, silent)
    item.animation_data.nla_tracks["Silent"].mute = True


def baked_result(dna, _folder):
    """The result is baked: NLA strips of bones, shape keys and maps lie above muted tracks."""
    rig = scene.load(dna, "LIVE")
    item = _three_layers(rig)
    _strips(item)
    _own_joint(rig)
    _bake(item, kind="RESULT")


def _own_joint(rig):
    """Add two tracks for a user's bone to the deforming armature: one is muted, one plays."""
    bone = rig.pose.bones["user_joint"]
    bone.rotation_mode = "XYZ"
    for name, angle in (("Turn", 0.7), ("Back", -0.4)):
        action = _empty_action(rig, name)
        for frame, share in ((1, 0.0), (20, 1.0)):
            bone.rotation_euler.z = angle * share
            bone.keyframe_insert("rotation_euler", frame=frame)
        _strip(rig, action)
    rig.animation_data.nla_tracks["Back"].mute = True


def baked_controls(dna, _folder):
    """The controls are baked into an NLA strip above a muted track and a solo track."""
    item = _three_layers(scene.load(dna, "KEYS"))
    _strips(item)
    item.animation_data.nla_tracks["Low"].is_solo = True
    _bake(item, kind="CONTROLS")


def _bake(item, kind):
    bpy.context.view_layer.objects.active = item
    bpy.context.view_layer.update()
    assert bpy.ops.risorius.bake(kind=kind, range="CUSTOM", start=1, end=31, strip=True) == {
        "FINISHED"
    }


def shape_modes(dna, _folder):
    """One face is in the mode LIVE, the other in the mode KEYS; both have a shape key of a user."""
    for mode in ("LIVE", "KEYS"):
        rig = scene.load(dna, mode)
        item = scene.controls(rig)
        _empty_action(item, f"Moves {mode}")
        _key_sliders(
            item,
            jawOpen={1: 0.0, 9: 1.0, 20: 0.2},
            mouthCornerPullL={1: 0.8, 20: 0.0},
            browDownL={1: 0.1, 14: 0.9},
        )
        item.location = (0.1, 0.2, 0.3)
        own = scene.meshes(rig)[0].shape_key_add(name="Own")
        own.value = 0.25


def bones(dna, _folder):
    """An action has keys of head, neck and eye bones, and of a slider that the gaze moves too."""
    rig = scene.load(dna, "LIVE")
    item = _three_layers(rig)
    _empty_action(item, "Bones")
    for name, axis in (("head", 0), ("neck", 2), ("eye_L", 0)):
        bone = item.pose.bones[name]
        bone.rotation_mode = "XYZ"
        for frame, angle in ((1, 0.0), (9, 0.3), (20, -0.2)):
            bone.rotation_euler[axis] = angle
            bone.keyframe_insert("rotation_euler", frame=frame)
    eyes = item.pose.bones["eyes"]
    for frame, place in ((1, 0.0), (14, 0.05)):
        eyes.location = (place, 0.0, -place)
        eyes.keyframe_insert("location", frame=frame)
    _key_sliders(item, eyeLookUpL={1: 0.2, 20: 0.4})


def overridden_live(dna, folder):
    """The face is an override of a linked face in Live mode, with layers and keys."""
    _overridden(dna, folder, "LIVE")


def overridden_keys(dna, folder):
    """The face is an override of a linked face in the mode KEYS, with layers and keyframes."""
    _overridden(dna, folder, "KEYS")


def _overridden(dna, folder, mode):
    _three_layers(scene.load(dna, mode))
    library = folder / f"library_face_{mode.lower()}.blend"
    save(library)
    _empty()
    save(folder / f"overridden_{mode.lower()}.blend")
    bpy.ops.wm.link(
        directory=f"{library}/Collection/",
        filename="Small",
        instance_collections=True,
        relative_path=True,
    )
    shown = next(o for o in bpy.context.scene.objects if o.instance_collection)
    bpy.context.view_layer.objects.active = shown
    assert bpy.ops.risorius.make_override(shapes="DRIVEN") == {"FINISHED"}
    rig = next(o for o in bpy.data.objects if "risorius_controls" in o and not o.library)
    item = scene.controls(rig)
    _empty_action(item, "Own")
    scene.submodule("scene.animation.layers").add(item, "EXPRESSION", "Fear", expression="fear")
    _key_weight(item, 0, {1: 0.0, 20: 1.0})
    _key_weight(item, 1, {1: 0.8, 16: 0.2})
    _key_weight(item, 3, {1: 0.0, 14: 0.5})
    _key_sliders(item, browDownL={1: 0.1, 20: 0.9})
