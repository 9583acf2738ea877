# SPDX-License-Identifier: GPL-3.0-or-later
"""Custom properties with arbitrary values cause no traceback, and the face keeps working."""

import bpy
import pytest
from support import scene
from support.faces import small_face
from support.layout import drawn

VALUES = {
    "words": "x\ny",
    "not a number": float("nan"),
    "a huge number": 1e300,
    "a negative number": -7,
    "a large number": 2**31 - 1,
    "numbers": [0.5, float("nan"), 1e300],
    "words in a list": ["a", "b"],
    "nothing in a list": [],
    "a table": {"channel": "x", "start": [1], "solo": 3.0},
    "an object": "OBJECT",
    "a text": "TEXT",
}
# Kind of data-block or bone (see `_owner`) -> names of the add-on's custom properties on it.
PROPERTIES = {
    "rig": """risorius_rig risorius_controls risorius_dna risorius_lod risorius_lod_render
        risorius_lod_by_distance risorius_lod_distances risorius_follow risorius_unit
        risorius_source risorius_textures risorius_mesh_000 risorius_test risorius_look
        risorius_heat risorius_baked maps channels risorius_pull risorius_before""",
    "controls": """risorius_rig risorius_overdrive risorius_body_neck risorius_body_head
        risorius_baked risorius_lead risorius_pins risorius_handles_selected
        risorius_handles_hidden risorius_curves risorius_version risorius_favourites risorius_tweak
        risorius_before""",
    "mesh": """risorius_rig dna_mesh dna_lods risorius_mode risorius_hide_viewport
        risorius_user_hide_viewport risorius_strands""",
    "key": "risorius_real risorius_key_names risorius_key_order risorius_opened risorius_before",
    "mesh data": "risorius_heat_before risorius_heat risorius_names",
    "joint": "dna_joint",
    "control bone": "risorius_part risorius_board",
    "slider": "CTRL_expressions.jawOpen",
    "text": "risorius_bytes risorius_hash risorius_length",
    "action": """risorius_baked_action risorius_digest risorius_blinks risorius_report
        risorius_expression""",
    "scene": "risorius_gaze",
    "object": "risorius_gaze risorius_rig risorius_controls dna_mesh risorius_landmark "
    "risorius_landmark_found",
    "landmark": "risorius_landmark risorius_landmark_found",
}
# (owner, property, key of VALUES): values that would hide the effects of other wrong values. So
# each is tested with no other wrong value.
ALONE = (
    ("rig", "risorius_controls", "numbers"),
    ("rig", "risorius_controls", "an object"),
    ("rig", "risorius_dna", "words in a list"),
    ("rig", "risorius_mesh_000", "a table"),
    ("rig", "risorius_baked", "a negative number"),
    ("controls", "risorius_rig", "words"),
    ("controls", "risorius_baked", "a table"),
    ("mesh", "risorius_rig", "a text"),
    ("mesh", "dna_mesh", "a large number"),
    ("mesh", "dna_mesh", "not a number"),
)
TOGETHER = [
    (who, name)
    for who, names in PROPERTIES.items()
    for name in names.split()
    if (who, name) not in {case[:2] for case in ALONE}
]


@pytest.fixture
def rig(tmp_path):
    """A small face with LODs and an action.

    The scene also has a mesh with a landmark, an empty and a text data-block.
    """
    path = tmp_path / "small.dna"
    small_face(head_grid=(5, 6)).save(str(path))
    found = scene.load(path, "LIVE", lods=(True,) * 8)
    scene.face(found).keyframe_insert('["CTRL_expressions.jawOpen"]', frame=1)
    bpy.context.scene.collection.objects.link(bpy.data.objects.new("Other", None))
    mesh = bpy.data.meshes.new("Head")
    mesh.from_pydata([(0, 0, 0), (1, 0, 0), (0, 0, 1)], [], [(0, 1, 2)])
    mark = bpy.data.objects.new("chin", None)
    mark.parent = bpy.data.objects.new("Head", mesh)
    mark["risorius_landmark"], mark["risorius_landmark_found"] = "chin", [0.0, 0.0, 0.0]
    for item in (mark, mark.parent):
        bpy.context.scene.collection.objects.link(item)
    bpy.data.texts.new("Other")
    return found


def _owner(rig, who):
    mesh = scene.meshes(rig)[0]
    return {
        "rig": rig,
        "controls": scene.controls(rig),
        "mesh": mesh,
        "key": mesh.data.shape_keys,
        "mesh data": mesh.data,
        "joint": rig.data.bones[3],
        "control bone": scene.controls(rig).data.bones["head"],
        "slider": scene.face(rig),
        "text": rig["risorius_dna"],
        "action": scene.controls(rig).animation_data.action,
        "scene": bpy.context.scene,
        "object": bpy.data.objects["Other"],
        "landmark": bpy.data.objects["chin"],
    }[who]


def _value(what):
    others = {"OBJECT": bpy.data.objects["Other"], "TEXT": bpy.data.texts["Other"]}
    return others.get(what, what) if isinstance(what, str) else what


def _panels():
    """Draw all panels of the sidebar tab whose poll succeeds."""
    for panel in bpy.types.Panel.__subclasses__():
        ours = getattr(panel, "bl_category", "") == "Risorius" and panel.is_registered
        if ours and getattr(panel, "poll", lambda _context: True)(bpy.context):
            drawn(panel)


def _use(tmp_path, number):
    """Use the face as in a short session: move a slider, show frames, draw panels, call operators.

    Args:
        tmp_path: folder of the files that the operators read and write.
        number: number of the session, which gives the value of the slider.
    """
    context = bpy.context
    controls = bpy.data.objects.get("Small_controls")
    context.view_layer.objects.active = controls
    controls.pose.bones["face"]["CTRL_expressions.mouthCornerPullL"] = 0.1 * (number % 7)
    scene.update(controls)
    for frame in (2, 3):
        context.scene.frame_set(frame)
    _panels()
    context.view_layer.objects.active = bpy.data.objects.get("Head")
    _panels()
    _try(lambda _folder: risorius.place_landmark(landmark="chin"), tmp_path)
    context.view_layer.objects.active = controls
    for step in STEPS:
        _try(step, tmp_path)


def _try(step, tmp_path):
    try:
        step(tmp_path)
    except RuntimeError as error:
        text = str(error)
        assert "Traceback" not in text, text


risorius = bpy.ops.risorius
STEPS = [
    lambda folder: risorius.export_dna(filepath=str(folder / "out.dna")),
    lambda _folder: risorius.set_shape_mode(mode="KEYS"),
    lambda _folder: risorius.set_shape_mode(mode="LIVE"),
    lambda _folder: risorius.set_lod(lod=1, target="VIEWPORT"),
    lambda _folder: risorius.set_lod_by_distance(enable=True),
    lambda _folder: risorius.set_lod_by_distance(enable=False),
    lambda _folder: risorius.describe(),
    lambda _folder: risorius.key(),
    lambda _folder: risorius.reset(),
    lambda _folder: risorius.bake(range="CUSTOM", start=1, end=2),
    lambda _folder: risorius.unbake(),
    lambda _folder: risorius.bake(range="CUSTOM", start=1, end=2, kind="CONTROLS"),
    lambda _folder: risorius.unbake(),
    lambda folder: risorius.replace_dna(filepath=str(folder / "small.dna")),
    lambda folder: bpy.ops.wm.save_as_mainfile(filepath=str(folder / "a.blend"), copy=True),
]


def _plant(rig, who, name, what):
    """Set the property `name` of the owner `who` to VALUES[what], if Blender accepts this value."""
    owner = _owner(rig, who)
    if name in owner:
        del owner[name]
    try:
        owner[name] = _value(VALUES[what])
    except (TypeError, ValueError):
        return  # a property of a mesh accepts no object


@pytest.mark.parametrize("turn", range(len(VALUES)))
def test_all_properties_hold_something_else(turn, rig, tmp_path):
    kinds = list(VALUES)
    for number, (who, name) in enumerate(TOGETHER):
        _plant(rig, who, name, kinds[(number + turn) % len(kinds)])
    _use(tmp_path, turn)
    bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "a.blend"))


@pytest.mark.parametrize(("who", "name", "what"), ALONE)
def test_a_property_that_others_are_found_by_holds_something_else(who, name, what, rig, tmp_path):
    _plant(rig, who, name, what)
    _use(tmp_path, 3)
    bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "a.blend"))


def test_a_face_whose_properties_were_all_wrong_is_moved_by_its_sliders(rig, tmp_path):
    for number, (who, name) in enumerate(TOGETHER):
        if name not in (
            "dna_lods",
            "risorius_bytes",
            "risorius_hash",
            "risorius_length",
            "dna_joint",
        ):
            _plant(rig, who, name, list(VALUES)[number % 3])
    scene.update(scene.controls(rig))
    scene.set_controls(rig, jawOpen=0.6, mouthCornerPullL=0.4)
    path = tmp_path / "small.dna"
    assert scene.error_against_oracle(rig, path, scene.raw_of(rig, path)) < scene.TOLERANCE
