# SPDX-License-Identifier: GPL-3.0-or-later
"""Names in a .blend or a library never become paths, and files of the user stay."""

import os
from pathlib import Path
from types import SimpleNamespace

import bpy
import numpy as np
import pytest
import risorius
from risorius.files.png import png
from support import scene

JAW = "CTRL_expressions.jawOpen"
NO_SUCH_NAMES = pytest.mark.skipif(os.name == "nt", reason="Windows has no files of these names")


@pytest.fixture
def rig(dna_file, tmp_path):
    face = scene.load(dna_file)
    bpy.context.view_layer.objects.active = scene.controls(face)
    (tmp_path / "library").mkdir()
    use(tmp_path / "library")
    return face


def use(folder):
    addon = bpy.context.preferences.addons.get(scene.MODULE)
    if addon is None:  # it was enabled for this session only
        addon = bpy.context.preferences.addons.new()
        addon.module = scene.MODULE
    addon.preferences.expression_library = str(folder)


def text_of(name, weight=0.5):
    return risorius.expressions.text_of(
        risorius.expressions.Expression(name, name, "own", "", {JAW: weight}, ())
    )


def library(folder, *names):
    """Make a library folder as from another person: one file for an expression of each name."""
    folder.mkdir(parents=True)
    for number, name in enumerate(names):
        (folder / f"{number:02}.toml").write_text(text_of(name), encoding="utf-8")
    return folder


def everything(folder):
    return {p.relative_to(folder).as_posix(): p.read_bytes() for p in folder.rglob("*.*")}


def names_in(folder):
    """Name of each TOML file in a folder -> names of the expressions in the file."""
    return {p.name: list(risorius.expressions.load(p)) for p in folder.glob("*.toml")}


def refused(call, **given):
    with pytest.raises(RuntimeError) as error:
        call(**given)
    return str(error.value)


def hostile(tmp_path):
    return [
        "../up", str(tmp_path / "absolute"), "..\\up", "CON", "aux.x", "C:up", "two\nlines",
        "x" * 400, "", "..", ".hidden", "Smile", "smile", "SMILE", "end. ",
    ]  # fmt: skip


def test_a_library_of_hostile_names_goes_into_its_folder_and_replaces_nothing(rig, tmp_path):
    names = hostile(tmp_path)
    bad, own = library(tmp_path / "bad", *names), tmp_path / "library"
    (own / "up.toml").write_text("mine")
    (own / "_up.toml").write_text("mine too", encoding="utf-8")
    (own / "smile.png").write_text("a picture of mine")
    before = everything(tmp_path)
    assert bpy.ops.risorius.import_expressions(directory=str(bad)) == {"FINISHED"}
    after = everything(tmp_path)
    assert {p: data for p, data in after.items() if p in before} == before
    new = set(after) - set(before)
    assert len(new) == len(names)
    assert all(Path(p).parent.as_posix() == "library" for p in new)
    files = [Path(p).name for p in after if p.startswith("library/")]
    assert len({name.casefold() for name in files}) == len(files)
    assert {"_up-2.toml", "_CON.toml", "C_up.toml", "unnamed.toml", "hidden.toml"} <= set(files)
    for file in own.glob("*up.toml"):
        if file.read_bytes().startswith(b"mine"):
            file.unlink()
    assert sorted(n for found in names_in(own).values() for n in found) == sorted(names)


def test_pose_assets_of_hostile_names_are_exported_into_the_folder(rig, tmp_path):
    out, names = tmp_path / "deep" / "out", hostile(tmp_path)
    for name in names:
        action = bpy.data.actions.new("asset")
        action.asset_mark()
        action["risorius_expression"] = text_of(name)
    before = everything(tmp_path)
    assert bpy.ops.risorius.export_expressions(directory=str(out)) == {"FINISHED"}
    after = everything(tmp_path)
    assert {Path(p).parent.as_posix() for p in set(after) - set(before)} == {"deep/out"}
    assert {p: data for p, data in after.items() if p in before} == before
    assert sorted(n for found in names_in(out).values() for n in found) == sorted(names)


def test_files_of_the_users_are_replaced_only_where_that_is_said(rig, tmp_path):
    own, other = tmp_path / "library", library(tmp_path / "other", "grin", "growl")
    (own / "my grin.toml").write_text(text_of("grin", 0.9), encoding="utf-8")
    (own / "grin.toml").write_text("[expressions", encoding="utf-8")  # the user's own
    before = everything(own)
    said = refused(bpy.ops.risorius.import_expressions, directory=str(other))
    assert "There is an expression grin already: choose Replace" in said
    assert everything(own) == before
    done = bpy.ops.risorius.import_expressions(directory=str(other), replace=True)
    assert done == {"FINISHED"}
    assert (own / "my grin.toml").read_text(encoding="utf-8") == text_of("grin")
    assert (own / "grin.toml").read_bytes() == before["grin.toml"]
    (own / "grin.toml").unlink()
    assert names_in(own) == {"my grin.toml": ["grin"], "growl.toml": ["growl"]}

    out = tmp_path / "out"
    out.mkdir()
    (out / "Grin.toml").write_text("mine", encoding="utf-8")
    said = refused(bpy.ops.risorius.export_expressions, directory=str(out))
    assert "out holds a file Grin.toml already: choose Replace" in said
    assert everything(out) == {"Grin.toml": b"mine"}
    assert bpy.ops.risorius.export_expressions(directory=str(out), replace=True) == {"FINISHED"}
    assert names_in(out) == {"Grin.toml": ["grin"], "growl.toml": ["growl"]}

    (other / "again.toml").write_text(text_of("grin"), encoding="utf-8")
    said = refused(bpy.ops.risorius.import_expressions, directory=str(other), replace=True)
    assert "again.toml: another file of the folder has an expression grin too." in said


def test_a_person_is_asked_before_files_are_replaced():
    kind, asked = scene.submodule("ui.expressions.library_operators")._OfFolder, []
    known = bpy.types.WindowManager.bl_rna.functions["invoke_confirm"].parameters.keys()

    def invoke_confirm(_operator, _event, **words):
        assert set(words) <= set(known)
        asked.append(words["message"])
        return {"RUNNING_MODAL"}

    operator = SimpleNamespace(asked="Grin is there.", replace=False)
    window = SimpleNamespace(window_manager=SimpleNamespace(invoke_confirm=invoke_confirm))
    assert kind.invoke(operator, window, None) == {"RUNNING_MODAL"}
    assert (asked, operator.replace) == (["Grin is there."], True)


def test_an_expression_that_is_saved_or_changed_keeps_to_its_own_file(rig, tmp_path):
    own = tmp_path / "library"
    (own / "by hand.toml").write_text(text_of("grin"), encoding="utf-8")
    (own / "wide.toml").write_text("[expressions", encoding="utf-8")
    scene.face(rig)[JAW] = 0.25
    assert bpy.ops.risorius.save_expression(label="Wide", shared="YES") == {"FINISHED"}
    assert bpy.ops.risorius.update_expression(expression="grin") == {"FINISHED"}
    assert (own / "wide.toml").read_bytes() == b"[expressions"
    (own / "wide.toml").unlink()
    assert names_in(own) == {"by hand.toml": ["grin"], "wide-2.toml": ["wide"]}
    assert risorius.expressions.load(own / "by hand.toml")["grin"].weights == {JAW: 0.25}


@NO_SUCH_NAMES
def test_images_of_an_export_get_names_of_their_own(rig, tmp_path):
    if not bpy.app.build_options.alembic:
        return
    shown = [m for m in scene.meshes(rig).values() if 0 in list(m["dna_lods"])]
    hostile = ["../../up", "x/Skin", "X:skin", "nul\u202e"]
    for number, item in enumerate(shown):
        item.data.materials.clear()
        for name in hostile[number::2]:
            item.data.materials.append(_painted(name, tmp_path))
        for place, polygon in enumerate(item.data.polygons):
            polygon.material_index = place % 2
    path = tmp_path / "deep" / "out.abc"
    path.parent.mkdir()
    before = everything(tmp_path)
    done = bpy.ops.risorius.export_animation(
        filepath=str(path), format="ALEMBIC", range="CUSTOM", start=1, end=1
    )
    assert done == {"FINISHED"}
    new = {Path(p) for p in set(everything(tmp_path)) - set(before)}
    assert {p.parent.as_posix() for p in new} == {"deep", "deep/out_textures"}
    images = [p.name for p in new if p.suffix == ".png"]
    expected = ["X_skin_color.png", "_.._up_color.png", "nul__color.png", "x_Skin_color-2.png"]
    assert sorted(images) == expected


def test_an_image_without_a_path_is_written_beside_the_usd(rig, tmp_path):
    if not bpy.app.build_options.usd:
        return
    item = next(m for m in scene.meshes(rig).values() if 0 in list(m["dna_lods"]))
    item.data.materials.clear()
    item.data.materials.append(_painted("../../../up", tmp_path))
    image = bpy.data.images["../../../up"]
    image.filepath_raw = ""
    image.pack(data=(tmp_path / "p.png").read_bytes(), data_len=(tmp_path / "p.png").stat().st_size)
    path = tmp_path / "a" / "b" / "out.usdc"
    path.parent.mkdir(parents=True)
    before = everything(tmp_path)
    settings = {"format": "USD", "range": "CUSTOM", "start": 1, "end": 1, "bake_materials": False}
    assert bpy.ops.risorius.export_animation(filepath=str(path), **settings) == {"FINISHED"}
    after = everything(tmp_path)
    assert set(after) - set(before) == {"a/b/out.usdc", "a/b/textures/_.._.._up.png"}
    assert {p: data for p, data in after.items() if p in before} == before
    assert image.name == "../../../up"


def _painted(name, folder):
    """A material whose colour is a packed image; material and image have the name `name`.

    The path of the image contains characters that are separators on some systems.
    """
    material = bpy.data.materials.new(name)
    material.use_nodes = True
    tree = material.node_tree
    node = tree.nodes.new("ShaderNodeTexImage")
    (folder / "p.png").write_bytes(png(np.ones((4, 4, 3)) / 2))
    node.image = bpy.data.images.load(str(folder / "p.png"), check_existing=False)
    node.image.name = name
    node.image.pack()
    node.image.filepath_raw = "//../other/picture.p/n:g"
    shader = next(n for n in tree.nodes if n.type == "BSDF_PRINCIPLED")
    tree.links.new(node.outputs["Color"], shader.inputs["Base Color"])
    return material


def test_dialogs_propose_names_in_the_folder_where_they_open(rig):
    proposed = scene.submodule("ui.common").proposed_file
    assert proposed("Ada_rig", ".dna") == "Ada.dna"
    assert proposed("../../Ada_rig", ".dna") == "_.._Ada.dna"
    assert proposed("nul_rig", ".glb") == "_nul.glb"
    assert proposed("_rig", ".html") == "unnamed.html"
