# SPDX-License-Identifier: GPL-3.0-or-later
"""Names of Shape Keys: the user assigns the keys of a head before a rig is made."""

import bpy
import numpy as np
import pytest
import risorius
from support import egg, pictures, scene
from support.layout import drawn

_SAY = bpy.ops.risorius.assign_shape_key
PREFIX = "CTRL_expressions."


@pytest.fixture
def head():
    """An egg-shaped head whose shape keys Key 7 and Key 8 have names that no vocabulary knows."""
    item = egg.egg()
    keys = item.data.shape_keys.key_blocks
    keys["jawOpen"].name, keys["mouthSmileLeft"].name = "Key 7", "Key 8"
    item.active_shape_key_index = keys.find("Key 7")
    return item


def rows(item):
    return scene.submodule("scene.shape_keys.assigned").of(item).rows


def kinds(item):
    return {name: row.kind for name, row in rows(item).items() if row.is_said}


def test_the_list_tells_what_names_become(head):
    found = rows(head)
    assert (found["Key 7"].kind, found["Key 7"].is_known) == ("OWN", False)
    assert (found["eyeBlinkLeft"].controls, found["eyeBlinkLeft"].by) == (("eyeBlinkL",), "ARKit")
    _SAY(key="Key 8", becomes="eyeBlinkL")
    assert rows(head)["eyeBlinkLeft"].holder == "Key 8"  # the user's assignments have precedence
    _SAY(key="Key 8", way="NAME")
    head.data.shape_keys.key_blocks["eyeBlinkLeft"].mute = True
    assert rows(head)["eyeBlinkLeft"].kind == "MUTED"
    said = drawn(scene.submodule("ui.shape_keys.panel").RISORIUS_PT_shape_key_names)
    assert f"2 of {len(found)} unknown" in said.text()
    assert "A control of its own" in said.text()


def test_what_is_said_is_what_the_rig_has(head, tmp_path):
    assert _SAY(becomes="jawOpen") == {"FINISHED"}  # the active key
    assert _SAY(key="Key 8", becomes="@joy") == {"FINISHED"}
    assert _SAY(key="browOuterUpLeft", way="NOTHING") == {"FINISHED"}
    assert _SAY(key="eyeBlinkLeft", way="OWN") == {"FINISHED"}
    assert kinds(head) == {
        "Key 7": "CONTROL",
        "Key 8": "EXPRESSION",
        "browOuterUpLeft": "NOTHING",
        "eyeBlinkLeft": "OWN",
    }
    path = tmp_path / "egg.dna"
    assert bpy.ops.risorius.make_rig(filepath=str(path), joints=5, levels=1) == {"FINISHED"}
    made = {n.removeprefix(PREFIX) for n in risorius.load(path).raw_control_names}
    assert {"jawOpen", "Key_8", "eyeBlinkLeft"} <= made
    assert not {"eyeBlinkL", "browRaiseOuterL", "browOuterUpLeft"} & made
    assert list(risorius.expressions.load(tmp_path / "egg_expressions")) == ["joy"]


def test_names_are_saved_and_loaded_in_the_form_of_author(head, tmp_path):
    from risorius.author.input import said

    path = tmp_path / "names.toml"
    _SAY(key="Key 7", becomes="=mouthFunnel")
    _SAY(key="Key 8", way="NOTHING")
    assert bpy.ops.risorius.save_shape_key_names(filepath=str(path)) == {"FINISHED"}
    assert said.read(path) == {"Key 7": "=mouthFunnel", "Key 8": []}
    path.write_text(path.read_text() + '"of another" = "jawOpen"\n')
    for name in ("Key 7", "Key 8"):
        _SAY(key=name, way="NAME")
    assert not kinds(head)
    assert "risorius_names" not in head.data
    assert bpy.ops.risorius.load_shape_key_names(filepath=str(path)) == {"FINISHED"}
    assert kinds(head) == {"Key 7": "CONTROL", "Key 8": "NOTHING"}
    assert len(rows(head)["Key 7"].controls) == 4
    everything = tmp_path / "all.toml"
    bpy.ops.risorius.save_shape_key_names(filepath=str(everything), use_all=True)
    assert said.read(everything)["eyeBlinkLeft"] == "eyeBlinkL"
    assert len(said.read(everything)) == len(rows(head))


def test_what_cannot_be_said_is_one_sentence(head, tmp_path):
    path = tmp_path / "names.toml"
    for content, sentence in (
        ('[controls]\n"Key 7" = "=smile"', "an ARKit unit such as =jawOpen was expected"),
        ('[controls]\nother = "jawOpen"', "No name of the file is that of a shape key here"),
        ("[other]", "names.toml: a table"),
    ):
        path.write_text(content)
        with pytest.raises(RuntimeError, match=sentence):
            bpy.ops.risorius.load_shape_key_names(filepath=str(path))
    with pytest.raises(RuntimeError, match="an ARKit unit such as =jawOpen was expected"):
        _SAY(becomes="=smile")
    with pytest.raises(RuntimeError, match="has no shape key hat"):
        _SAY(key="hat", becomes="jawOpen")
    assert not kinds(head)
    head.data["risorius_names"] = "[controls"  # written by another program
    assert rows(head)["Key 7"].kind == "OWN"


def test_what_is_said_is_undone(head):
    bpy.ops.ed.undo_push(message="before")
    _SAY(becomes="jawOpen")
    bpy.ops.ed.undo_push(message="said")
    bpy.ops.ed.undo()
    assert not kinds(bpy.data.objects["Egg"])
    bpy.ops.ed.redo()
    assert kinds(bpy.data.objects["Egg"]) == {"Key 7": "CONTROL"}


def test_a_picture_shows_where_a_key_moves_the_head(head):
    """The picture of a shape key colours the vertices that the key moves, in a front view.

    The view is from the front, whatever the rotation of the head. A second picture shows the
    assigned control on the sample man.
    """
    _SAY(becomes="jawOpen")
    shown = scene.submodule("scene.shape_keys.pictures")
    head.rotation_euler.z = np.pi / 2
    bpy.context.view_layer.update()
    assert bpy.ops.risorius.shape_key_pictures() == {"FINISHED"}
    paths = shown.paths_of(head)
    assert set(paths) == set(rows(head))
    jaw, brow = (
        pictures.pixels(paths[name]).reshape(160, 160, 4) for name in ("Key 7", "browOuterUpLeft")
    )
    orange = [np.argwhere(p[..., 0] - p[..., 2] > 0.25).mean(axis=0) for p in (jaw, brow)]
    assert orange[0][0] < orange[1][0] - 20  # rows go upwards: the jaw is below the brows
    assert abs(orange[0][1] - jaw.shape[1] / 2) < 8  # and in the middle
    assert shown.sample_path("jawOpen").is_file()


def test_each_choice_is_something_that_a_face_can_show():
    assigned = scene.submodule("scene.shape_keys.assigned")
    values = [choice.value for choice in assigned.choices()]
    assert len(set(values)) == len(values) > 300
    assert all(assigned.weights_of(value) for value in values)
