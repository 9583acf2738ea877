# SPDX-License-Identifier: GPL-3.0-or-later
"""The face board: bones, values, switching between board and sliders, keys."""

import bpy
import numpy as np
import pytest
import risorius
from mathutils import Vector
from support import scene
from support.faces import small_face

SAME = 1e-4  # tolerance as a share of the head's size, see error_against_oracle
JAW, LOOK, PULL_L, PULL_R = "CTRL_C_jaw", "CTRL_L_eye", "CTRL_L_mouth_pull", "CTRL_R_mouth_pull"
GUI = [
    "CTRL_C_jaw.ty",
    "CTRL_L_mouth_pull.ty",
    "CTRL_R_mouth_pull.ty",
    "CTRL_L_eye.tx",
    "CTRL_L_eye.ty",
    "CTRL_L_brow.ty",
]
# Rows (input, output, from, to, slope, cut) of the table that computes raw controls from GUI
# controls. Input 0 has two rows with different slopes. Inputs 3 and 4 drive one output with
# positive values and another output with negative values. Input 5 is in degrees.
ROWS = [
    (0, 0, 0.0, 0.5, 0.5, 0.0),
    (0, 0, 0.5, 1.0, 1.5, -0.5),
    (1, 1, 0.0, 1.0, 1.0, 0.0),
    (2, 2, 0.0, 1.0, 1.0, 0.0),
    (3, 4, 0.0, 1.0, 1.0, 0.0),
    (3, 5, -1.0, 0.0, -1.0, 0.0),
    (4, 6, 0.0, 1.0, 1.0, 0.0),
    (4, 7, -1.0, 0.0, -1.0, 0.0),
    (5, 3, 0.0, 90.0, 1.0 / 90.0, 0.0),
]


def board_face():
    """The Dna of the small face, with GUI controls and the table ROWS for a face board."""
    dna = small_face()
    dna.gui_control_names = GUI
    names = ("input_indices", "output_indices", "from_values", "to_values")
    names += ("slope_values", "cut_values")
    dna.gui_to_raw = risorius.Conditionals(**dict(zip(names, zip(*ROWS, strict=True), strict=True)))
    return dna


@pytest.fixture(scope="module")
def board_file(tmp_path_factory):
    path = tmp_path_factory.mktemp("board") / "board.dna"
    board_face().save(str(path))
    return path


@pytest.fixture
def rig(board_file):
    """An imported face that its face board moves."""
    rig = scene.load(board_file)
    scene.add_board()
    return rig


def handle(rig, name):
    return scene.controls(rig).pose.bones[name]


def put(rig, **places):
    """Move handles to locations (x, y), as the user would."""
    for name, place in places.items():
        handle(rig, name).location = (*place, 0.0)
    scene.update(scene.controls(rig))


def raw_by_rows(gui, count=11):
    """Raw controls computed from the rows of ROWS, float64[count].

    Of the rows with the same input and output, only the first row counts whose range from `from` to
    `to` contains the value of the input.

    Args:
        gui: name of a GUI control -> value.
        count: number of raw controls.
    """
    raw, done = np.zeros(count), set()
    for control, out, low, high, slope, cut in ROWS:
        value = gui.get(GUI[control], 0.0)
        if (control, out) not in done and low <= value <= high:
            raw[out] += slope * value + cut
            done.add((control, out))
    return raw.clip(0.0, 1.0)


def error(rig, path, **gui):
    named = {name.replace("__", "."): value for name, value in gui.items()}
    return scene.error_against_oracle(rig, path, raw_by_rows(named))


def lead(rig):
    return scene.controls(rig).get("risorius_lead", "SLIDERS")


def shown(rig):
    """Short name of a control -> value that the add-on gives, for all controls that are not 0."""
    values = scene.submodule("scene.character.sides").values_of(rig)
    return {name.rpartition(".")[2]: round(v, 5) for name, v in values.items() if v}


def test_handles_move_the_face_through_the_table(rig, board_file):
    put(rig, **{JAW: (0.0, 0.75), LOOK: (-0.4, 0.6), PULL_L: (0.0, 0.3), "CTRL_L_brow": (0.0, 0.5)})
    gui = {"CTRL_C_jaw__ty": 0.75, "CTRL_L_eye__tx": -0.4, "CTRL_L_eye__ty": 0.6}
    gui |= {"CTRL_L_mouth_pull__ty": 0.3, "CTRL_L_brow__ty": 45.0}
    assert error(rig, board_file, **gui) < SAME
    assert error(rig, board_file) > 0.01  # the pose moves the face
    assert lead(rig) == "BOARD"


def test_what_the_board_does_not_lead_to_stays_with_the_sliders(rig, board_file):
    put(rig, **{JAW: (0.0, 1.0)})
    face = scene.face(rig)
    face["CTRL_expressions.jawOpen"] = 0.2  # has no effect, because the board leads
    face["twice"] = 0.7
    scene.update(scene.controls(rig))
    raw = raw_by_rows({"CTRL_C_jaw.ty": 1.0})
    raw[9] = 0.7
    assert scene.error_against_oracle(rig, board_file, raw) < SAME


def test_handles_beyond_their_range_count_as_its_end(rig, board_file):
    put(rig, **{JAW: (0.5, 7.0), LOOK: (-3.0, float("nan"))})
    assert error(rig, board_file, CTRL_C_jaw__ty=1.0, CTRL_L_eye__tx=-1.0) < SAME
    put(rig, **{LOOK: (0.0, 0.0)})
    seen = scene.controls(rig).evaluated_get(bpy.context.evaluated_depsgraph_get())
    jaw = seen.pose.bones[JAW]
    local = seen.convert_space(
        pose_bone=jaw, matrix=jaw.matrix, from_space="POSE", to_space="LOCAL"
    )
    assert np.abs(np.array(local.translation) - [0.0, 1.0, 0.0]).max() < 1e-4  # shown there


def test_a_board_that_was_moved_with_its_face_gives_the_same(rig, board_file):
    put(rig, **{JAW: (0.0, 0.75)})
    controls = scene.controls(rig)
    handle(rig, "board").location = (1.0, 2.0, 3.0)
    controls.location, controls.scale = (5.0, -2.0, 1.0), (2.0, 2.0, 2.0)
    scene.update(controls)
    assert scene.submodule("scene.character.board").read(
        controls, scene.submodule("scene.character.runtime").of(rig)
    )[0] == np.float32(0.75)


def test_constraints_and_drivers_of_the_user_move_handles(rig, board_file):
    controls = scene.controls(rig)
    copy = handle(rig, PULL_R).constraints.new("COPY_LOCATION")
    copy.target, copy.subtarget = controls, PULL_L
    copy.owner_space = copy.target_space = "LOCAL"
    driver = handle(rig, JAW).driver_add("location", 1).driver
    driver.expression = "0.75"
    put(rig, **{PULL_L: (0.0, 0.4)})
    gui = {"CTRL_L_mouth_pull__ty": 0.4, "CTRL_R_mouth_pull__ty": 0.4, "CTRL_C_jaw__ty": 0.75}
    assert error(rig, board_file, **gui) < SAME


def _key_jaw(rig):
    for frame, value in ((1, 0.0), (5, 1.0), (9, 0.25)):
        handle(rig, JAW).location.y = value
        handle(rig, JAW).keyframe_insert("location", index=1, frame=frame)


@pytest.mark.parametrize("hidden", [False, True])
def test_a_keyed_board_plays_at_any_frame(rig, board_file, hidden):
    _key_jaw(rig)
    scene.controls(rig).hide_viewport = hidden
    for frame in (9, 1, 5, 3, 5):
        bpy.context.scene.frame_set(frame)
        value = scene.curves(scene.controls(rig))[0].evaluate(frame)
        assert error(rig, board_file, CTRL_C_jaw__ty=value) < SAME


def test_a_keyed_board_renders(rig, board_file, tmp_path):
    """A rendered frame shows the pose of the board's keys at this frame."""
    _key_jaw(rig)
    render = bpy.context.scene.render
    render.engine, render.resolution_x, render.resolution_y = "CYCLES", 8, 8
    cycles = bpy.context.scene.cycles
    cycles.samples, cycles.use_denoising, cycles.device = 1, False, "CPU"
    bpy.context.scene.camera = bpy.data.objects.new("camera", bpy.data.cameras.new("camera"))
    bpy.context.scene.collection.objects.link(bpy.context.scene.camera)
    bpy.context.scene.frame_start = bpy.context.scene.frame_end = 5
    render.filepath = str(tmp_path / "frame_")
    seen = []

    def note(_scene, depsgraph=None):
        bone = rig.evaluated_get(depsgraph).pose.bones["FACIAL_C_Jaw"]
        seen.append((depsgraph.mode, np.array(bone.matrix_basis)))

    bpy.app.handlers.frame_change_post.append(note)
    try:
        bpy.ops.render.render(animation=True)
    finally:
        bpy.app.handlers.frame_change_post.remove(note)
    bpy.context.scene.frame_set(5)
    assert error(rig, board_file, CTRL_C_jaw__ty=1.0) < SAME
    wanted = np.array(rig.pose.bones["FACIAL_C_Jaw"].matrix_basis)
    rendered = [matrix for mode, matrix in seen if mode == "RENDER"]
    assert rendered
    assert np.abs(rendered[-1] - wanted).max() < 1e-5


def test_switching_keeps_the_pose_and_says_what_is_lost(board_file):
    rig = scene.load(board_file)
    scene.set_controls(rig, jawOpen=0.4, mouthCornerPullL=0.6, eyeLookUpL=0.5, eyeLookDownL=0.3)
    assert "risorius_lead" not in scene.controls(rig)
    assert len(scene.controls(rig).pose.bones) == 6  # a board is only made on request
    scene.add_board()
    # One handle drives eyeLookUpL by its way up and eyeLookDownL by its way down. It cannot show
    # both, so only the larger value stays.
    expected = {"jawOpen": 0.4, "mouthCornerPullL": 0.6, "eyeLookUpL": 0.5}
    assert shown(rig) == expected
    keys = scene.submodule("scene.animation.board_keys")
    bpy.ops.risorius.lead(by="SLIDERS")
    assert shown(rig) == expected
    assert lead(rig) == "SLIDERS"
    scene.set_controls(rig, eyeLookDownL=0.3)
    loss = keys.switch(rig, by_board=True, with_keys=False).loss
    assert loss.largest == pytest.approx(0.3, abs=1e-5)
    assert loss.worst == (("CTRL_expressions.eyeLookDownL", pytest.approx(0.3, abs=1e-5)),)
    assert "largest difference 0.300 of 1 (eyeLookDownL 0.30)" in keys.lost(loss)


def test_keys_go_over_to_the_board_and_back(board_file):
    rig = scene.load(board_file)
    face = scene.face(rig)
    for frame, jaw, up in ((1, 0.0, 0.5), (6, 0.9, 0.0), (10, 0.2, 0.0)):
        face["CTRL_expressions.jawOpen"], face["CTRL_expressions.eyeLookUpL"] = jaw, up
        for name in ("jawOpen", "eyeLookUpL"):
            face.keyframe_insert(f'["CTRL_expressions.{name}"]', frame=frame)
    scene.controls(rig).pose.bones["head"].keyframe_insert("rotation_quaternion", frame=1)
    before = {}
    for frame in range(1, 11):
        bpy.context.scene.frame_set(frame)
        before[frame] = scene.snapshot(rig)
    action = scene.controls(rig).animation_data.action
    scene.add_board()
    assert lead(rig) == "SLIDERS"  # otherwise the keys of the sliders would have no effect
    for by in ("BOARD", "SLIDERS"):
        assert bpy.ops.risorius.lead(by=by) == {"FINISHED"}
        paths = {c.data_path.partition("]")[0] for c in scene.curves(scene.controls(rig))}
        ours = {JAW, LOOK} if by == "BOARD" else {"face"}
        assert paths == {f'pose.bones["{name}"' for name in (*ours, "head")}
        for frame, wanted in before.items():
            bpy.context.scene.frame_set(frame)
            assert np.abs(scene.snapshot(rig) - wanted).max() < 2e-3 * np.ptp(wanted)
    assert action.use_fake_user
    assert len(action.fcurves if hasattr(action, "fcurves") else [0]) > 0


def test_keys_of_handles_go_into_groups_by_region(rig):
    put(rig, **{JAW: (0.0, 0.5), LOOK: (0.2, 0.1)})
    bpy.ops.risorius.key()
    found = {(c.data_path, c.array_index): c.group.name for c in scene.curves(scene.controls(rig))}
    paths = {path.split('"')[1] for path, _index in found}
    assert paths == {*(n.rpartition(".")[0] for n in GUI), "face", "neck", "head", "eye_L", "eye_R",
                     "eyes"}  # fmt: skip
    sliders = {path for path, _index in found if '"face"' in path}
    assert len(sliders) == 3  # the sliders without a handle
    own = {key: group for key, group in found.items() if JAW in key[0] or LOOK in key[0]}
    assert own == {
        (f'pose.bones["{JAW}"].location', 1): "Jaw",
        (f'pose.bones["{LOOK}"].location', 0): "Eyes",
        (f'pose.bones["{LOOK}"].location', 1): "Eyes",
    }


def test_auto_key_keys_handles_that_operators_moved(rig):
    put(rig, **{PULL_L: (0.0, 0.7), JAW: (0.0, 0.5)})
    tools, edit = bpy.context.scene.tool_settings, bpy.context.preferences.edit
    tools.use_keyframe_insert_auto, edit.use_keyframe_insert_available = True, False
    bpy.context.scene.frame_set(7)
    bpy.ops.risorius.mirror()
    bpy.ops.risorius.reset_board()
    tools.use_keyframe_insert_auto = False
    found = {}
    for curve in scene.curves(scene.controls(rig)):
        points = [(round(k.co.x), round(k.co.y, 4)) for k in curve.keyframe_points]
        found[curve.data_path.split('"')[1], curve.array_index] = points
    assert found == {
        (PULL_L, 1): [(7, 0.0)],
        (PULL_R, 1): [(7, 0.0)],
        (JAW, 1): [(7, 0.0)],
    }


def test_operators_work_on_the_board_where_it_leads(rig, board_file):
    put(rig, **{PULL_L: (0.0, 0.7), JAW: (0.0, 0.5)})
    sliders = dict(scene.face(rig).items())
    bpy.ops.risorius.mirror()
    assert handle(rig, PULL_R).location.y == pytest.approx(0.7, abs=1e-5)
    assert handle(rig, PULL_L).location.y == pytest.approx(0.0, abs=1e-5)
    assert handle(rig, JAW).location.y == pytest.approx(0.5, abs=1e-5)
    assert handle(rig, "board").matrix_basis == handle(rig, "board").matrix_basis.Identity(4)
    bpy.ops.risorius.copy_pose()
    bpy.ops.risorius.reset(region="mouth")
    assert (handle(rig, PULL_R).location.y, handle(rig, JAW).location.y > 0.4) == (0.0, True)
    bpy.ops.risorius.reset()
    assert not shown(rig)
    bpy.ops.risorius.paste_pose()
    assert handle(rig, PULL_R).location.y == pytest.approx(0.7, abs=1e-5)
    assert dict(scene.face(rig).items()) == sliders  # all sliders are unchanged
    bpy.ops.risorius.select_board(region="EYE")
    bones = scene.controls(rig).pose.bones
    chosen = [b.name for b in bones if (b if hasattr(b, "select") else b.bone).select]
    assert chosen == [LOOK]
    put(rig, **{LOOK: (0.3, 0.3)})
    bpy.ops.risorius.reset_board(selected=True)
    assert not handle(rig, LOOK).location.length
    assert handle(rig, PULL_R).location.y > 0.6


def test_blenders_pose_pasted_flipped_swaps_sides_on_the_board(rig):
    put(rig, **{PULL_L: (0.0, 0.7), LOOK: (0.4, 0.2)})
    bpy.context.view_layer.objects.active = scene.controls(rig)
    bpy.ops.object.mode_set(mode="POSE")
    bpy.ops.risorius.select_board(region="MOUTH")
    bpy.ops.pose.copy()
    put(rig, **{PULL_L: (0.0, 0.1)})
    sliders = dict(scene.face(rig).items())
    assert bpy.ops.risorius.paste_pose_flipped() == {"FINISHED"}
    bpy.ops.object.mode_set(mode="OBJECT")
    assert handle(rig, PULL_R).location.to_tuple(4) == (0.0, 0.7, 0.0)
    assert handle(rig, PULL_L).location.to_tuple(4) == (0.0, 0.0, 0.0)
    assert handle(rig, LOOK).location.to_tuple(4) == (0.4, 0.2, 0.0)  # it was not copied
    assert dict(scene.face(rig).items()) == sliders


def test_blenders_pose_pasted_flipped_swaps_sides_on_a_primary_board(primary):
    put(primary, **{CORNER_L: (0.0, 0.7)})
    bpy.context.view_layer.objects.active = scene.controls(primary)
    bpy.ops.object.mode_set(mode="POSE")
    bpy.ops.risorius.select_board(region="ALL")
    bpy.ops.pose.copy()
    assert bpy.ops.risorius.paste_pose_flipped() == {"FINISHED"}
    bpy.ops.object.mode_set(mode="OBJECT")
    assert handle(primary, CORNER_R).location.to_tuple(4) == (0.0, 0.7, 0.0)
    assert handle(primary, CORNER_L).location.to_tuple(4) == (0.0, 0.0, 0.0)


def test_a_drag_moves_the_board_where_it_leads(rig, board_file):
    put(rig, **{JAW: (0.0, 0.2)})
    sliders = dict(scene.face(rig).items())
    vertex, item = 12, scene.meshes(rig)[1]  # of the teeth, which the jaw moves
    before = scene.evaluated(item)[vertex]
    put(rig, **{JAW: (0.0, 0.8)})
    goal = scene.evaluated(item)[vertex]
    put(rig, **{JAW: (0.0, 0.2)})
    bpy.ops.risorius.drag(mesh=1, vertex=vertex, offset=tuple(goal - before))
    there = scene.evaluated(item)[vertex]
    assert np.linalg.norm(there - goal) < 0.2 * np.linalg.norm(goal - before)
    assert dict(scene.face(rig).items()) == sliders
    assert handle(rig, JAW).location.y > 0.4


def test_what_works_on_sliders_alone_says_who_leads(rig):
    with pytest.raises(RuntimeError, match="The board leads this face"):
        bpy.ops.risorius.link_sides()
    with pytest.raises(RuntimeError, match="The board leads this face"):
        bpy.ops.risorius.live_start()
    bpy.ops.risorius.lead(by="SLIDERS")
    assert bpy.ops.risorius.link_sides() == {"FINISHED"}


def test_renamed_handles_get_their_names_back_and_deleted_ones_come_back(rig, board_file):
    put(rig, **{JAW: (0.0, 0.75), PULL_L: (0.0, 0.5)})
    controls = scene.controls(rig)
    controls.data.bones[JAW].name = "chin"
    bpy.context.view_layer.update()
    bpy.context.view_layer.update()
    assert JAW in controls.pose.bones
    assert error(rig, board_file, CTRL_C_jaw__ty=0.75, CTRL_L_mouth_pull__ty=0.5) < SAME
    bpy.context.view_layer.objects.active = controls
    bpy.ops.object.mode_set(mode="EDIT")
    controls.data.edit_bones.remove(controls.data.edit_bones[PULL_L])
    bpy.ops.object.mode_set(mode="OBJECT")
    bpy.context.view_layer.update()
    assert error(rig, board_file, CTRL_C_jaw__ty=0.75) < SAME
    scene.add_board()
    assert error(rig, board_file, CTRL_C_jaw__ty=0.75) < SAME
    put(rig, **{PULL_L: (0.0, 0.5)})
    assert error(rig, board_file, CTRL_C_jaw__ty=0.75, CTRL_L_mouth_pull__ty=0.5) < SAME
    assert handle(rig, PULL_L).parent == handle(rig, "board")


def test_without_any_handle_the_sliders_lead(rig, board_file):
    scene.face(rig)["CTRL_expressions.jawOpen"] = 0.6
    controls = scene.controls(rig)
    bpy.context.view_layer.objects.active = controls
    bpy.ops.object.mode_set(mode="EDIT")
    for name in [b.name for b in controls.data.edit_bones if b.name.startswith("CTRL_")]:
        controls.data.edit_bones.remove(controls.data.edit_bones[name])
    bpy.ops.object.mode_set(mode="OBJECT")
    scene.update(controls)
    raw = np.zeros(11)
    raw[0] = 0.6
    assert scene.error_against_oracle(rig, board_file, raw) < SAME


def test_removing_leaves_nothing_but_the_pose(board_file):
    rig = scene.load(board_file)
    before = scene.counts()
    scene.add_board()
    put(rig, **{JAW: (0.0, 0.75)})
    assert bpy.ops.risorius.remove_board() == {"FINISHED"}
    assert scene.counts() == before
    assert len(scene.controls(rig).pose.bones) == 6
    assert not scene.controls(rig).data.collections
    assert error(rig, board_file, CTRL_C_jaw__ty=0.75) < SAME
    assert scene.invalid_drivers()[0] == []


def test_two_faces_and_a_copy_each_have_their_board(rig, board_file, tmp_path):
    put(rig, **{JAW: (0.0, 0.75)})
    for item in bpy.data.objects:
        item.select_set(item.name in bpy.context.view_layer.objects)
    bpy.ops.object.duplicate()
    bpy.context.view_layer.update()
    other = next(o for o in bpy.data.objects if "risorius_controls" in o and o != rig)
    put(other, **{JAW: (0.0, 0.25)})
    for one, value in ((rig, 0.75), (other, 0.25)):
        assert error(one, board_file, CTRL_C_jaw__ty=value) < SAME
    names = rig.name, other.name
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "two.blend"))
    bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "two.blend"))
    for name, value in zip(names, (0.75, 0.25), strict=True):
        assert error(bpy.data.objects[name], board_file, CTRL_C_jaw__ty=value) < SAME
    bpy.context.view_layer.objects.active = scene.controls(bpy.data.objects[names[1]])
    bpy.ops.risorius.remove_board()  # of the copy; the handles' outlines are shared
    assert handle(bpy.data.objects[names[0]], JAW).custom_shape is not None


def test_a_file_without_gui_controls_gets_a_board_of_our_own(tmp_path):
    dna, path = small_face(), tmp_path / "plain.dna"
    dna.gui_control_names, dna.gui_to_raw = [], risorius.Conditionals()
    dna.save(str(path))
    rig = scene.load(path)
    scene.add_board()
    put(rig, CTRL_jawOpen=(0.0, 0.4), CTRL_eyeLookL=(-0.3, 0.2), CTRL_mouthCornerPullR=(0.0, 1.0))
    raw = np.zeros(11)
    raw[[0, 2, 5, 6]] = 0.4, 1.0, 0.3, 0.2
    assert scene.error_against_oracle(rig, path, raw) < SAME


def test_a_new_file_renews_the_board(rig, tmp_path):
    put(rig, **{JAW: (0.0, 0.75), PULL_L: (0.0, 0.5)})
    dna, path = board_face(), tmp_path / "new.dna"
    dna.gui_control_names = [*GUI[:1], "CTRL_L_mouth_tug.ty", *GUI[2:]]
    dna.save(str(path))
    bpy.ops.risorius.replace_dna(filepath=str(path))
    bones = scene.controls(rig).pose.bones
    assert PULL_L not in bones
    assert "CTRL_L_mouth_tug" in bones
    assert lead(rig) == "BOARD"
    assert error(rig, path, CTRL_C_jaw__ty=0.75) < SAME


@pytest.mark.parametrize("kind", ["RESULT", "CONTROLS"])
def test_what_is_baked_plays_whoever_led(rig, kind):
    _key_jaw(rig)
    bpy.context.scene.frame_start, bpy.context.scene.frame_end = 1, 9
    frames = {}
    for frame in (1, 5, 7):
        bpy.context.scene.frame_set(frame)
        frames[frame] = scene.snapshot(rig)
    for _time in range(2):
        bpy.ops.risorius.bake(kind=kind)
        for frame, wanted in frames.items():
            bpy.context.scene.frame_set(frame)
            assert np.abs(scene.snapshot(rig) - wanted).max() < 1e-3 * np.ptp(wanted)
        bpy.ops.risorius.unbake()
        for frame, wanted in frames.items():
            bpy.context.scene.frame_set(frame)
            assert np.abs(scene.snapshot(rig) - wanted).max() < 1e-6 * np.ptp(wanted)


CORNER_L, CORNER_R = "face_L_mouth_corner", "face_R_mouth_corner"


@pytest.fixture
def primary(board_file):
    rig = scene.load(board_file)
    scene.add_board("PRIMARY")
    return rig


def test_a_primary_board_moves_the_face_by_its_own_handles(primary, board_file):
    names = {bone.name for bone in scene.controls(primary).pose.bones}
    assert {"face_jaw", "face_gaze", CORNER_L, CORNER_R, "face_L_brow_inner"} <= names
    assert "face_tongue" not in names  # this face has no tongue
    assert not names & {JAW, LOOK}
    put(primary, face_jaw=(0.0, -0.5), face_gaze=(0.4, -0.2), **{CORNER_L: (0.7, 0.3)})
    raw = np.zeros(11)
    raw[[0, 1, 4, 7]] = 0.5, 0.3, 0.4, 0.2  # jaw, left corner, look left, look down
    assert scene.error_against_oracle(primary, board_file, raw) < SAME
    scene.face(primary)["twice"] = 0.7  # a slider without a handle
    raw[9] = 0.7
    scene.update(scene.controls(primary))
    assert scene.error_against_oracle(primary, board_file, raw) < SAME


def test_handles_of_both_sides_lie_and_go_alike(primary):
    names = (CORNER_L, CORNER_R, "face_gaze")
    rest = [np.array(handle(primary, name).matrix.translation) for name in names]
    put(primary, **{CORNER_L: (0.0, 0.5), CORNER_R: (0.0, 0.5)})
    left, right = (np.array(handle(primary, name).matrix.translation) for name in names[:2])
    assert rest[0][0] - rest[2][0] == pytest.approx(rest[2][0] - rest[1][0], rel=1e-3)
    assert rest[0][0] > rest[2][0]  # the character's left is the viewer's right
    assert left[2] - rest[0][2] == pytest.approx(right[2] - rest[1][2], rel=1e-3)
    assert left[2] > rest[0][2]


def test_one_kind_of_board_takes_the_place_of_the_other_with_pose_and_keys(board_file):
    rig = scene.load(board_file)
    scene.add_board("COMPLETE")
    _key_jaw(rig)
    put(rig, **{PULL_L: (0.0, 0.4), LOOK: (0.0, 0.0)})
    bpy.context.scene.frame_set(5)
    kept = scene.controls(rig).animation_data.action
    for kind, own, other in (("PRIMARY", "face_jaw", JAW), ("COMPLETE", JAW, "face_jaw")):
        before = len(bpy.data.actions)
        scene.add_board(kind)
        bones = scene.controls(rig).pose.bones
        assert own in bones
        assert other not in bones
        assert lead(rig) == "BOARD"
        assert shown(rig) == {"jawOpen": 1.0, "mouthCornerPullL": 0.4}
        assert {c.data_path for c in scene.curves(scene.controls(rig))} == {
            f'pose.bones["{own}"].location'
        }
        bpy.context.scene.frame_set(9)
        assert shown(rig)["jawOpen"] == pytest.approx(0.125, abs=1e-3)  # the bent line of ROWS
        bpy.context.scene.frame_set(5)
        assert len(bpy.data.actions) == before + 1  # the earlier action is kept
    assert kept.use_fake_user
    bpy.ops.risorius.add_board()  # without a kind, the existing board is restored
    assert JAW in scene.controls(rig).pose.bones


def test_a_primary_board_survives_a_new_file_and_leaves_nothing_when_it_goes(primary, tmp_path):
    put(primary, face_jaw=(0.0, -0.75))
    dna, path = board_face(), tmp_path / "new.dna"
    dna.raw_control_names = ["CTRL_expressions.jawLeft", *dna.raw_control_names[1:]]
    dna.save(str(path))
    bpy.ops.risorius.replace_dna(filepath=str(path))
    assert handle(primary, "face_jaw").lock_location[:] == (False, True, True)
    assert lead(primary) == "BOARD"
    bpy.ops.risorius.remove_board()
    assert "risorius_board_kind" not in scene.controls(primary)
    assert len(scene.controls(primary).pose.bones) == 6


def test_a_face_of_unknown_names_gets_the_complete_board(tmp_path):
    dna, path = board_face(), tmp_path / "other.dna"
    dna.raw_control_names = [f"blob{i}" for i in range(len(dna.raw_control_names))]
    dna.save(str(path))
    rig = scene.load(path)
    assert bpy.ops.risorius.add_board(kind="PRIMARY") == {"FINISHED"}
    assert JAW in scene.controls(rig).pose.bones


@pytest.mark.parametrize("perspective", ["PERSP", "ORTHO"])
def test_a_new_board_lies_beside_the_face_in_the_view_and_in_the_hand(board_file, perspective):
    rig = scene.load(board_file)
    area = next(a for a in bpy.context.window.screen.areas if a.type == "VIEW_3D")
    view, lens = area.spaces.active.region_3d, area.spaces.active.lens
    view.view_perspective = perspective
    assert bpy.ops.risorius.add_board(kind="PRIMARY") == {"FINISHED"}
    controls = scene.controls(rig)
    assert (bpy.context.mode, bpy.context.object) == ("POSE", controls)
    assert bpy.context.selected_objects == [controls]
    turn = view.view_rotation.to_matrix().inverted()
    assert (turn @ Vector((0.0, -1.0, 0.0))).z == pytest.approx(1.0, abs=1e-5)  # from the front
    regions = {region.type: region for region in area.regions}
    window, tools = regions["WINDOW"], regions["TOOLS"]
    fit = scene.submodule("logic.character.view_fit")

    def pixels(points):
        places = [turn @ (point - view.view_location) for point in points]
        size = window.width, window.height
        seen = fit.on_screen(places, view.view_distance, lens, size, perspective == "PERSP")
        return seen + np.array(size) / 2

    corners = [
        item.matrix_world @ Vector(corner)
        for item in scene.meshes(rig).values()
        if "head" in item.name.lower()
        for corner in item.bound_box
    ]
    bone = controls.pose.bones["board"]
    outline = [bone.matrix @ v.co for v in bone.custom_shape.data.vertices]
    head, board = pixels(corners), pixels(outline)
    assert head[:, 0].max() < board[:, 0].min()
    both = np.concatenate([head, board])
    assert both.min(axis=0)[0] >= tools.width
    assert both.min(axis=0)[1] >= 0.0
    assert both.max(axis=0)[0] <= window.width
    assert both.max(axis=0)[1] <= regions["TOOL_HEADER"].y - window.y
    state = (*view.view_location, view.view_distance)
    view.view_distance *= 3.0
    assert bpy.ops.risorius.frame_board() == {"FINISHED"}
    assert (*view.view_location, view.view_distance) == pytest.approx(state, rel=1e-4)
    filled = np.ptp(both, axis=0) / (window.width - tools.width, window.height - 26 * 2)
    assert filled.max() > 0.9
    bpy.ops.object.mode_set(mode="OBJECT")
