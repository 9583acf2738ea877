# SPDX-License-Identifier: GPL-3.0-or-later
"""Expressions: blending compared with numbers calculated by hand; pictures, assets, libraries."""

import tomllib

import bpy
import numpy as np
import pytest
import risorius
from support import faces, oracle, scene

JAW, LEFT, RIGHT, BROW = (
    f"CTRL_expressions.{name}"
    for name in ("jawOpen", "mouthCornerPullL", "mouthCornerPullR", "browDownL")
)
START = {JAW: 0.2, LEFT: 0.4, RIGHT: 0.1, BROW: 0.5}
OWN = """format = 1
prefix = "CTRL_expressions."
group = "own"
[expressions.half_grin]
label = "Half Grin"
description = "One corner."
regions = ["mouth"]
weights = { mouthCornerPullL = 0.9 }
[expressions.wide]
label = "Wide"
weights = { jawOpen = 0.8, mouthCornerPullL = 0.6 }
"""


@pytest.fixture
def folder(tmp_path):
    """A folder with the user's own expressions of OWN, which is the library of the add-on."""
    path = tmp_path / "library"
    path.mkdir()
    (path / "own.toml").write_text(OWN, encoding="utf-8")
    use(path)
    return path


@pytest.fixture
def rig(dna_file, folder):
    face = scene.load(dna_file)
    start(face)
    return face


def use(path):
    addon = bpy.context.preferences.addons.get(scene.MODULE)
    if addon is None:  # it was enabled for this session only
        addon = bpy.context.preferences.addons.new()
        addon.module = scene.MODULE
    addon.preferences.expression_library = str(path)


def start(face):
    for name, value in START.items():
        scene.face(face)[name] = value
    scene.update(scene.controls(face))
    bpy.context.view_layer.objects.active = scene.controls(face)


def values(face):
    return {name: float(scene.face(face)[name]) for name in START}


def other(**changed):
    """The slider values of START, except the values in `changed`, for comparisons."""
    names = {"jaw": JAW, "left": LEFT, "right": RIGHT, "brow": BROW}
    return pytest.approx({**START, **{names[k]: v for k, v in changed.items()}}, abs=1e-6)


def apply(name, **how):
    return bpy.ops.risorius.expression(expression=name, **how)


def refused(call, **given):
    """The error text of an operator call that must fail."""
    with pytest.raises(RuntimeError) as error:
        call(**given)
    return str(error.value)


# (options of the operator, sliders that it changes -> new values); the values were calculated by
# hand from the sliders START and the expression "wide" of OWN.
MIXED = [
    ({"only": True}, {"jaw": 0.8, "left": 0.6, "right": 0, "brow": 0}),
    ({"only": False}, {"jaw": 0.8, "left": 0.6}),
    ({"only": False, "strength": 0.25}, {"jaw": 0.35, "left": 0.45}),
    ({"only": False, "flip": True}, {"jaw": 0.8, "right": 0.6}),
    ({"additive": True}, {"jaw": 1.0, "left": 1.0}),
    ({"additive": True, "strength": 0.5}, {"jaw": 0.6, "left": 0.7}),
    ({"additive": True, "flip": True, "strength": 0.5}, {"jaw": 0.6, "right": 0.4}),
    ({"only": True, "regions": {"mouth"}}, {"left": 0.6, "right": 0}),
    ({"only": True, "regions": {"jaw", "brow"}, "strength": 0.5}, {"jaw": 0.5, "brow": 0.25}),
    ({"only": True, "regions": {"nose"}}, {}),
]


@pytest.mark.parametrize(("how", "after"), MIXED, ids=[str(i) for i in range(len(MIXED))])
def test_mixed_in_as_worked_out_by_hand(rig, how, after):
    assert apply("wide", **how) == {"FINISHED"}
    assert values(rig) == other(**after)


def test_an_expression_that_names_its_regions_leaves_all_others_alone(rig):
    apply("half_grin", only=True)
    assert values(rig) == other(left=0.9, right=0)
    start(rig)
    apply("half_grin", only=True, flip=True, strength=0.5)
    assert values(rig) == other(left=0.2, right=0.5)


def test_what_is_shown_follows(rig, dna_file):
    apply("wide")
    raw = scene.raw_of(rig, dna_file)
    assert raw[:3] == pytest.approx([0.8, 0.6, 0.0])
    assert scene.error_against_oracle(rig, dna_file, raw) < scene.TOLERANCE


def test_one_click_saves_what_is_not_at_rest(rig, folder):
    scene.face(rig)[BROW] = 0.0
    chosen = bpy.context.window_manager.risorius_expressions
    chosen.new_label, chosen.new_group, chosen.to_library = "Mein Gruß", "mood", True
    assert bpy.ops.risorius.save_expression() == {"FINISHED"}
    table = tomllib.loads((folder / "mein_gruß.toml").read_text(encoding="utf-8"))
    row = table["expressions"]["mein_gruß"]
    assert row["weights"] == pytest.approx({k: v for k, v in START.items() if k != BROW})
    assert (row["label"], row["group"]) == ("Mein Gruß", "mood")
    assert row["regions"] == ["mouth", "jaw"]
    loaded = risorius.expressions.load(folder / "mein_gruß.toml")["mein_gruß"]
    assert dict(loaded.weights) == pytest.approx(row["weights"])
    assert (folder / "mein_gruß.png").stat().st_size > 1000
    action = bpy.data.actions["Face Mein Gruß"]
    assert action.asset_data is not None
    assert {t.name for t in action.asset_data.tags} == {"mood", "mouth", "jaw"}
    bpy.ops.risorius.reset()
    scene.face(rig)[BROW] = 0.7  # a slider that the expression does not contain
    apply("mein_gruß")
    assert values(rig) == other(brow=0.7)


def test_saved_in_this_file_only_and_by_number(rig, folder):
    before = sorted(folder.iterdir())
    names = []
    for _ in range(2):
        assert bpy.ops.risorius.save_expression(shared="NO", regions={"jaw"}) == {"FINISHED"}
        names.append(bpy.context.window_manager.risorius_expressions.active)
    assert names == ["expression", "expression_2"]
    assert sorted(folder.iterdir()) == before
    bpy.ops.risorius.reset()
    apply("expression_2")
    assert values(rig) == pytest.approx({JAW: 0.2, LEFT: 0.0, RIGHT: 0.0, BROW: 0.0})


def test_update_rename_delete_of_ones_own(rig, folder):
    bpy.ops.risorius.save_expression(label="First", shared="YES")
    bpy.ops.risorius.star_expression(expression="first", on=True)
    scene.face(rig)[JAW] = 0.9
    assert bpy.ops.risorius.update_expression(expression="first") == {"FINISHED"}
    assert risorius.expressions.load(folder / "first.toml")["first"].weights[JAW] == pytest.approx(
        0.9
    )
    assert bpy.ops.risorius.rename_expression(expression="first", label="Second") == {"FINISHED"}
    assert not (folder / "first.toml").exists()
    assert not (folder / "first.png").exists()
    assert "Face First" not in bpy.data.actions
    bpy.ops.risorius.reset()
    apply("second")
    assert values(rig) == other(jaw=0.9)
    library = scene.submodule("scene.expressions.library")
    assert library.favourites() == {"second"}
    assert bpy.ops.risorius.delete_expression(expression="second") == {"FINISHED"}
    assert library.favourites() == set()
    assert sorted(p.name for p in folder.iterdir()) == ["own.toml"]
    assert "Face Second" not in bpy.data.actions


def test_what_came_with_risorius_stays(rig, folder):
    for operator in ("update_expression", "delete_expression"):
        said = refused(getattr(bpy.ops.risorius, operator), expression="joy")
        assert "Joy came with Risorius" in said
    assert "There is an expression Joy already." in refused(
        bpy.ops.risorius.save_expression, label="joy"
    )
    said = refused(bpy.ops.risorius.delete_expression, expression="wide")
    assert "own.toml holds several expressions" in said
    assert (folder / "own.toml").read_text(encoding="utf-8") == OWN
    bpy.ops.risorius.reset()
    assert "at rest" in refused(bpy.ops.risorius.save_expression, label="Nothing")
    assert sorted(p.name for p in folder.iterdir()) == ["own.toml"]


def troubles(folder):
    return scene.submodule("scene.expressions.library").all_items(folder)[1]


def test_a_library_that_is_missing_newer_or_of_another_rig_is_one_sentence(rig, folder):
    assert troubles(folder) == []
    said = troubles(folder / "gone")
    assert len(said) == 1
    assert "gone: no library of expressions: No such file" in said[0]
    (folder / "new.toml").write_text(OWN.replace("format = 1", "format = 9"), encoding="utf-8")
    (folder / "bad.toml").write_text("[expressions", encoding="utf-8")
    said = troubles(folder)
    assert len(said) == 2
    assert said[0].startswith("bad.toml: a TOML file was expected")
    assert said[1].startswith("new.toml: it was written by a newer Risorius: format 1 at most")
    apply("wide", only=False)  # the readable expressions are available
    start(rig)
    text = f'[expressions.alien]\nlabel = "Alien"\n[expressions.alien.weights]\n"{JAW}" = 0.9\n'
    text += "antenna = 1.0\n"
    (folder / "alien.toml").write_text(text, encoding="utf-8")
    said = refused(apply, name="alien")
    assert "Alien was made for another rig: this face lacks 1 of its 2 controls" in said
    assert "antenna" in said
    assert values(rig) == other()
    assert "There is no expression gone." in refused(apply, name="gone")


def test_export_and_import_take_all_or_none(rig, folder, tmp_path):
    out, elsewhere = tmp_path / "out", tmp_path / "elsewhere"
    out.mkdir()
    elsewhere.mkdir()
    assert bpy.ops.risorius.export_expressions(directory=str(out)) == {"FINISHED"}
    assert sorted(p.name for p in out.glob("*.toml")) == ["half_grin.toml", "wide.toml"]
    use(elsewhere)
    (out / "zz.toml").write_text("format = 3", encoding="utf-8")
    said = refused(bpy.ops.risorius.import_expressions, directory=str(out))
    assert "zz.toml: it was written by a newer Risorius" in said
    assert list(elsewhere.iterdir()) == []
    (out / "zz.toml").unlink()
    assert bpy.ops.risorius.import_expressions(directory=str(out)) == {"FINISHED"}
    assert sorted(p.name for p in elsewhere.glob("*.toml")) == ["half_grin.toml", "wide.toml"]
    apply("half_grin")
    assert values(rig) == other(left=0.9, right=0)
    said = refused(bpy.ops.risorius.import_expressions, directory=str(out))
    assert "There is an expression Half Grin already: choose Replace" in said
    assert "no library of expressions" in refused(
        bpy.ops.risorius.import_expressions, directory=str(out / "gone") + "/"
    )


def posed(face, *selected):
    """Enter pose mode with only these bones selected. Returns the control armature."""
    controls = scene.controls(face)
    bpy.context.view_layer.objects.active = controls
    bpy.ops.object.mode_set(mode="POSE")
    for bone in controls.pose.bones:
        owner = bone if hasattr(bone, "select") else bone.bone  # since 5.0 on pose bones
        owner.select = bone.name in selected
    return controls


def test_blenders_own_operators_apply_the_assets(rig):
    stamp = scene.submodule("scene.animation.actions").stamp
    stamp(bpy.data.actions.new("Face Smile, closed"))  # the name in an older version
    bpy.ops.risorius.make_pose_assets()
    assert [a.name for a in bpy.data.actions if "smile, c" in a.name.lower()] == [
        "Face Smile, closed"
    ]
    joy = risorius.expressions.load()["joy"].weights
    action = bpy.data.actions["Face Joy"]
    assert "Face PP" in bpy.data.actions  # a viseme is called M B P only in panels
    controls = posed(rig)
    controls.pose.apply_pose_from_action(action)
    goal = {JAW: joy[JAW], LEFT: joy[LEFT], RIGHT: joy[RIGHT]}
    # The expression moves no brow slider of this face, so the asset has no values for the brow
    # region, and the brow keeps its value.
    assert values(rig) == pytest.approx({**START, **goal}, abs=1e-6)
    start(rig)
    controls.pose.blend_pose_from_action(action, blend_factor=0.5)
    half = {name: (START[name] + goal.get(name, START[name])) / 2 for name in START}
    assert values(rig) == pytest.approx(half, abs=1e-6)
    bpy.ops.object.mode_set(mode="OBJECT")


def test_ours_apply_them_whatever_is_selected(rig):
    bpy.ops.risorius.make_pose_assets()
    place = {"asset_library_type": "LOCAL", "relative_asset_identifier": "Action/Face Blink"}
    controls = posed(rig, "head")
    assert bpy.ops.risorius.apply_pose_asset(**place, only=False) == {"FINISHED"}
    blink = risorius.expressions.load()["blink"].weights
    assert values(rig) == other(brow=blink[BROW])
    start(rig)
    joy = risorius.expressions.load()["joy"].weights
    place["relative_asset_identifier"] = "Action/Face Joy"
    given = {"strength": 0.5, "only": False}
    assert bpy.ops.risorius.blend_pose_asset("EXEC_DEFAULT", **place, **given) == {"FINISHED"}
    assert values(rig)[LEFT] == pytest.approx((START[LEFT] + joy[LEFT]) / 2)
    assert controls.mode == "POSE"
    bpy.ops.object.mode_set(mode="OBJECT")
    bpy.data.actions.new("Walk")
    place["relative_asset_identifier"] = "Action/Walk"
    said = refused(bpy.ops.risorius.apply_pose_asset, **place)
    assert "Walk is no expression of a face." in said


JOY = {LEFT: 1.0, RIGHT: 0.94, JAW: 0.24}  # the weights of joy for controls of this face

# --- pictures --------------------------------------------------------------------------------


@pytest.fixture
def lower_jaw(tmp_path, folder):
    """A face whose lower half follows the jaw joint, and whose upper half the head joint."""
    dna = faces.small_face(head_grid=(14, 21))
    dna.meshes = [dna.meshes[0]]
    dna.mesh_names, dna.lod_count = ["head_lod0_mesh"], 1
    dna.lod_mesh_mapping, dna.lod_joint_mapping = [[0]], [list(range(7))]
    dna.lod_blend_shape_mapping, dna.lod_animated_map_mapping = [list(range(6))], [[0, 1]]
    mesh = dna.meshes[0]
    mesh.blend_shape_targets = []
    count, height = len(mesh.positions), mesh.positions[:, 1]
    mesh.skin_offsets = np.arange(count + 1, dtype=np.uint32)
    mesh.skin_weights = np.ones(count, np.float32)
    below = height < 157.0
    mesh.skin_joint_indices = np.where(below, faces.JAW, faces.HEAD).astype(np.uint16)
    dna.meshes = [mesh]
    dna.mesh_blend_shape_channel_mapping = []
    dna.save(str(tmp_path / "jaw.dna"))
    face = scene.load(tmp_path / "jaw.dna")
    return face, tmp_path / "jaw.dna"


def pictured(face, **sliders):
    thumbnails = scene.submodule("scene.expressions.thumbnails")
    portrait = scene.submodule("scene.expressions.portrait")
    given = {f"CTRL_expressions.{name}": value for name, value in sliders.items()}
    return portrait.draw(thumbnails.sitter_of(face), given)


def test_a_picture_shows_the_jaw_where_it_is(lower_jaw):
    face, path = lower_jaw
    rest, opened = pictured(face), pictured(face, jawOpen=1.0)
    assert rest.shape == (160, 160, 3)
    assert rest.std() > 0.05
    dna = risorius.load(str(path))
    moved = np.zeros(len(dna.raw_control_names), np.float32)
    before = oracle.vertices(dna, 0, risorius.Rig(dna).evaluate(moved))
    moved[0] = 1.0
    after = oracle.vertices(dna, 0, risorius.Rig(dna).evaluate(moved))
    still = np.linalg.norm(after - before, axis=1) < 1e-6
    assert 0.3 < still.mean() < 0.7
    # The picture shows the face from the front. The square picture is 1.05 times as wide as the
    # larger of width and height of the face.
    low, high = before.min(axis=0), before.max(axis=0)
    half = 1.05 * (high - low)[[0, 2]].max() / 2
    edge = (before[still, 2].min() - (low + high)[2] / 2) / half  # -1 to 1
    row = round((edge + 1) / 2 * 160)
    apart = np.abs(opened - rest).max(axis=2)
    assert 40 < row < 110
    assert apart[row + 12 :].max() < 0.02  # the shading of a hollow reaches slightly further
    assert (apart[: row - 12] > 0.05).mean() > 0.2
    # The columns that the face covers are as many as the width of the oracle's vertices gives.
    shown = (np.abs(rest - np.linspace(rest[0, 0], rest[-1, 0], 160)[:, None]) > 0.05).any(axis=2)
    columns = np.flatnonzero(shown.any(axis=0))
    wide = (high - low)[0] / (2 * half) * 160
    assert columns[-1] - columns[0] + 1 == pytest.approx(wide, abs=8)


@pytest.fixture
def kept(rig):
    """The folder with the stored pictures of expressions; it is emptied before and after a test."""
    folder = scene.submodule("scene.expressions.library").own_folder("thumbnails")
    for path in folder.iterdir():
        path.unlink()
    yield folder
    for path in folder.iterdir():
        path.unlink()


def test_pictures_are_made_once_and_anew_when_asked(rig, kept, monkeypatch):
    thumbnails = scene.submodule("scene.expressions.thumbnails")
    portrait = scene.submodule("scene.expressions.portrait")
    folder = kept
    assert list(folder.iterdir()) == []
    drawn, draw = [], portrait.draw
    monkeypatch.setattr(thumbnails, "_MOST_FACES", 20)  # use the coarse level of detail
    monkeypatch.setattr(
        portrait, "draw", lambda *given: drawn.append(given) or draw(*given, size=24)
    )
    assert bpy.ops.risorius.render_thumbnails() == {"FINISHED"}
    items, _ = scene.submodule("scene.expressions.library").all_items(folder)
    first = len(drawn)
    assert len({tuple(sorted(d[1].items())) for d in drawn}) == len(list(folder.iterdir())) > 5
    assert first == len(items) + 2  # plus the expressions of the library
    assert bpy.ops.risorius.render_thumbnails() == {"FINISHED"}
    assert len(drawn) == first
    assert bpy.ops.risorius.render_thumbnails(again=True) == {"FINISHED"}
    assert len(drawn) == 2 * first
    look = thumbnails.look_of(rig)
    assert thumbnails.path_of(look, {JAW: 1.0}) != thumbnails.path_of(look, {JAW: 0.9})
    dna = faces.small_face(name="Other")
    dna.save(str(folder.parent / "other.dna"))
    assert thumbnails.look_of(scene.load(folder.parent / "other.dna")) != look


def test_an_asset_shows_the_picture(rig, kept):
    thumbnails = scene.submodule("scene.expressions.thumbnails")
    assets = scene.submodule("scene.expressions.assets")
    for name in ("joy", "blink"):
        path = assets.picture_of(rig, risorius.expressions.load()[name])
        sliders = JOY if name == "joy" else {BROW: 0.05}
        thumbnails.make(thumbnails.sitter_of(rig), [thumbnails.Job(path, sliders)])
    assert len(list(kept.iterdir())) == 2
    bpy.ops.risorius.make_pose_assets()
    seen = []
    for name in ("Joy", "Blink"):
        shown = bpy.data.actions[f"Face {name}"].preview
        assert tuple(shown.image_size) == (160, 160)
        pixels = np.empty(160 * 160 * 4, np.float32)
        shown.image_pixels_float.foreach_get(pixels)
        seen.append(pixels.reshape(160, 160, 4))
        assert (seen[-1][..., 3] == 1.0).all()
        assert seen[-1][..., :3].std() > 0.02
    assert np.abs(seen[0] - seen[1]).max() > 0.1
    picture = scene.submodule("scene.expressions.portrait").draw(thumbnails.sitter_of(rig), JOY)
    assert np.abs(picture - seen[0][..., :3]).max() < 0.01
