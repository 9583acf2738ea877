# SPDX-License-Identifier: GPL-3.0-or-later
"""The solid view, used for animation: gaze and lids are visible, no mask blackens the head."""

import bpy
import numpy as np
import pytest
from support import child, looks, scene
from support.faces import _mesh as fine_mesh
from support.faces import small_face

SKIN = (0.8, 0.5, 0.2)  # red, green and blue stored in the head's colour texture
HAIR, THIN = (0.5, 0.4, 0.4), 0.15  # colour of brows, and the share of their cards that hair covers


def _face(tmp_path, color=True):
    """Save a face for the solid view: a head with a mask, teeth, and a fine eye.

    Lashes, a clear film and brows are in front of the eye. If `color` is True, the head has a
    colour texture, and the brows have a texture of thin hair. Returns the path of the file.
    """
    face = small_face()
    random = np.random.default_rng(5)
    place = np.array([3.0, 160.0, 12.0])
    eye = fine_mesh(random, (41, 41), 1.2, place, (3,), ())
    patch = face.meshes[1]
    names = ("head", "eyeLeft", "eyelashes", "eyeshell", "teeth", "brows")
    meshes = (
        face.meshes[0],
        eye,
        looks.copy_mesh(eye, (0, 0, 0.3)),
        looks.copy_mesh(eye, (0, 0, 0.2)),
        patch,
        looks.copy_mesh(eye, (0, 0, 0.4)),
    )
    looks.set_meshes(face, {f"{n}_lod0_mesh": m for n, m in zip(names, meshes, strict=True)})
    face.metadata = {"texture:head_lod0_mesh:map:flush": "flush.png"}
    if color:
        face.metadata = {**face.metadata, "texture:brows_lod0_mesh:color": "hair.png"}
    if color:
        face.metadata = {**face.metadata, "texture:head_lod0_mesh:color": "skin.png"}
    path = tmp_path / "face.dna"
    face.save(str(path))
    folder = tmp_path / "face_textures"
    folder.mkdir()
    looks.write_image(folder / "hair.png", looks.halves((*HAIR, 0.0), (*HAIR, 2 * THIN)))
    looks.write_image(folder / "flush.png", np.zeros((8, 8, 3), np.float32))
    looks.write_image(folder / "skin.png", np.full((8, 8, 3), SKIN, np.float32))
    return path


def _eye_slots(rig):
    mesh = scene.meshes(rig)[1].data
    slots = np.empty(len(mesh.polygons), np.int32)
    mesh.polygons.foreach_get("material_index", slots)
    return mesh, slots


def test_the_iris_has_a_slot_of_the_same_surface(tmp_path):
    rig = scene.load(_face(tmp_path))
    mesh, slots = _eye_slots(rig)
    white, iris = mesh.materials
    middles = np.array([polygon.center[:] for polygon in mesh.polygons])
    points = np.array([v.co[:] for v in mesh.vertices])
    middle = (points.min(axis=0) + points.max(axis=0)) / 2
    radius = np.ptp(points[:, 2]) / 2
    away = np.hypot(*(middles - middle)[:, [0, 2]].T) / radius
    # Polygons inside the edge of the iris have the slot of the iris. The shader's edge is at 0.47
    # radii of the eye; polygons within 0.04 radii of it, about half a polygon, are not tested.
    assert (slots[away < 0.43] == 1).all()
    assert (slots[away > 0.51] == 0).all()
    assert max(iris.diffuse_color[:3]) < 0.1
    assert min(white.diffuse_color[:3]) > 0.5
    nodes = [sorted(n.bl_idname for n in m.node_tree.nodes) for m in (white, iris)]
    assert nodes[0] == nodes[1]
    assert len(white.node_tree.links) == len(iris.node_tree.links)


@pytest.mark.parametrize("color", [True, False])
def test_the_active_picture_is_the_colour(color, tmp_path):
    rig = scene.load(_face(tmp_path, color))
    nodes = scene.meshes(rig)[0].data.materials[0].node_tree.nodes
    pictures = {n.image.name for n in nodes if n.type == "TEX_IMAGE"}
    assert pictures == {"flush.png", "skin.png"} if color else {"flush.png"}
    if color:
        assert nodes.active.image.name == "skin.png"
    else:
        assert nodes.active.type in ("TEX_NOISE", "TEX_VORONOI")


def test_hair_is_as_light_and_as_thin_as_its_picture(tmp_path):
    rig = scene.load(_face(tmp_path))
    shown = {m.name: m.data.materials[0].diffuse_color[:] for m in scene.meshes(rig).values()}
    brows = next(color for name, color in shown.items() if "brows" in name)
    linear = [((x + 0.055) / 1.055) ** 2.4 for x in HAIR]
    assert brows[:3] == pytest.approx(linear, abs=0.02)
    assert brows[3] == pytest.approx(THIN, abs=0.03)


def test_replacing_the_file_keeps_the_iris(tmp_path):
    path = _face(tmp_path)
    rig = scene.load(path)
    slots = _eye_slots(rig)[1]
    bpy.context.view_layer.objects.active = scene.controls(rig)
    bpy.ops.risorius.reload()
    mesh, after = _eye_slots(rig)
    np.testing.assert_array_equal(after, slots)
    assert len(mesh.materials) == 2


_WORKBENCH = """
import numpy as np
from pathlib import Path
from support import looks
folder = Path({folder!r})
plain = scene.load(folder / "plain" / "face.dna")
items = {{-i - 1: item for i, item in scene.meshes(plain).items()}}
rig = scene.load(folder / "face.dna")
items.update(scene.meshes(rig))
scene.controls(rig).location = scene.controls(plain).location  # it was put beside the other
scene.update(scene.controls(rig))
setup, _ = looks.stage([items[1]], 32, "CYCLES")
setup.render.engine = "BLENDER_WORKBENCH"
setup.render.film_transparent = True
shading = setup.display.shading
shading.light, shading.show_specular_highlight = "FLAT", False
print("READY", flush=True)
def shot(name, colors, *shown):
    for index, item in items.items():
        item.hide_render = index not in shown
    shading.color_type = colors
    middle = looks.render(setup, folder / f"{{name}}.png")[..., :3]
    print("RENDERED", name, *middle[16, 16], *middle[16, 3], *middle[3, 16], flush=True)
shot("eye", "MATERIAL", 1)
shot("film", "MATERIAL", 1, 3)
shot("textured_eye", "TEXTURE", 1)
shot("head", "TEXTURE", 0)
shot("plain", "TEXTURE", -1)
shot("skin", "MATERIAL", -1)
shot("lashes", "MATERIAL", 1, 2)
shot("brows", "MATERIAL", 1, 5)
"""


def test_solid_view_shows_the_gaze_and_no_black_head(tmp_path):
    _face(tmp_path)
    (tmp_path / "plain").mkdir()
    _face(tmp_path / "plain", color=False)
    code, said = child.run(tmp_path, _WORKBENCH.format(folder=str(tmp_path)))
    assert "READY" in said, said
    if "RENDERED" not in said:
        pytest.skip("WORKBENCH NOT RUN: no OpenGL here")
    assert code == 0, said
    rows = [line.split()[1:] for line in said.splitlines() if line.startswith("RENDERED")]
    shots = {row[0]: np.array(row[1:], float).reshape(3, 3) for row in rows}
    for name in ("eye", "film", "textured_eye"):  # without a texture the colours of the slots
        pupil, side, below = shots[name]
        assert pupil.max() < 0.35, name
        assert side.min() > 0.8, name
        assert below.min() > 0.8, name
    np.testing.assert_allclose(shots["head"][0], SKIN, atol=0.03)
    np.testing.assert_allclose(shots["plain"][0], shots["skin"][0], atol=0.03)  # not the mask
    assert shots["skin"][0].min() > 0.3
    lashes, white = shots["lashes"][1].mean(), shots["eye"][1].mean()
    assert 0.5 * white < lashes < 0.95 * white  # the eye behind them is visible
    assert 0.8 * white < shots["brows"][1].mean() < 0.98 * white  # no black spot
