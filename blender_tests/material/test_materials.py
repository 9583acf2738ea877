# SPDX-License-Identifier: GPL-3.0-or-later
"""Materials: varied colours, maps for colour and relief, found textures, no seams."""

from types import SimpleNamespace

import bpy
import numpy as np
import pytest
from support import child, looks, scene
from support.faces import _mesh as fine_mesh
from support.faces import small_face


def _save(tmp_path, dna, name="face"):
    path = tmp_path / f"{name}.dna"
    dna.save(str(path))
    return path


def _materials(rig):
    """Base name of a mesh -> its material."""
    prefix = rig.name.removesuffix("_rig") + "_"
    found = [m.data.materials[0] for m in scene.meshes(rig).values()]
    return {m.name.removeprefix(prefix): m for m in found}


def _shown(material):
    """The input socket of a material's base colour; for a clear film, of its roughness."""
    shader = looks.principled(material)
    if shader is not None:
        return shader.inputs["Base Color"]
    nodes = material.node_tree.nodes
    return next(n for n in nodes if n.type == "BSDF_GLOSSY").inputs["Roughness"]


def _emit_only(material, socket=None):
    """Make the material emit the value of its colour socket, or of another socket, as light."""
    tree = material.node_tree
    source = (socket or _shown(material)).links[0].from_socket
    output = next(n for n in tree.nodes if n.type == "OUTPUT_MATERIAL")
    emission = tree.nodes.new("ShaderNodeEmission")
    tree.links.new(source, emission.inputs["Color"])
    tree.links.new(emission.outputs[0], output.inputs["Surface"])


@pytest.fixture
def kinds_file(tmp_path):
    return _save(tmp_path, looks.every_kind())


@pytest.mark.parametrize("kind", ["teeth", "tongue", "gums"])
def test_what_lies_deep_in_a_mouth_is_dark_without_shadows(tmp_path, kind):
    """Materials of the mouth are darker deep in the mouth, without any shadows.

    Otherwise molars would look like a white wall behind the corner of an open mouth.
    """
    face = small_face()
    mesh = looks.copy_mesh(face.meshes[1], scale=2.0)
    points = mesh.positions.copy()
    points[:, 2] = 8.0 - 1.6 * np.abs(points[:, 0] - points[:, 0].mean())  # a bow, as an arch is
    mesh.positions = points
    looks.set_meshes(face, {"head_lod0_mesh": face.meshes[0], f"{kind}_lod0_mesh": mesh})
    head, item = scene.meshes(scene.load(_save(tmp_path, face))).values()
    head.hide_render = True
    setup, (x, _) = looks.stage([item], 24, samples=4)
    _emit_only(item.data.materials[0])
    light = looks.render(setup, tmp_path / "arch.png")[..., :3].mean(axis=2)
    aside = np.abs(x - x.mean()) / np.ptp(x)
    middle, ends = (np.median(light[m][light[m] > 0]) for m in (aside < 0.06, aside > 0.36))
    assert ends < 0.6 * middle


@pytest.mark.parametrize("simple", [False, True])
def test_no_kind_of_mesh_is_flat(kinds_file, tmp_path, simple):
    rig = scene.load(kinds_file, use_simple_materials=simple)
    items = {m.data.materials[0].name.split("_", 1)[1]: m for m in scene.meshes(rig).values()}
    assert set(items) == set(looks.KINDS)
    setup, _ = looks.stage([items["head"]], 24, samples=1)
    for base, item in items.items():
        _emit_only(item.data.materials[0])
        for other in items.values():
            other.hide_render = other is not item
        setup.camera.data.ortho_scale = 0.25 if base in ("head",) else 0.06
        middle = np.array(item.bound_box).mean(axis=0)
        setup.camera.location = (middle[0], middle[1] - 1, middle[2])
        picture = looks.render(setup, tmp_path / f"{base}.png")
        seen = picture[picture[..., 3] > 0.99][:, :3]
        assert len(seen) > 50, base
        assert seen.std(axis=0).max() > 0.01, base


def test_threads_of_cloth_are_gone_where_they_would_be_grains(tmp_path):
    """The weave of cloth is visible from 30 cm, and flat from 3 m.

    From 3 m a thread is smaller than a pixel, so a weave would look like noise. The test renders
    the height of the weave as light.
    """
    face = small_face()
    skin = face.meshes[0]
    shirt = looks.copy_mesh(skin)
    rig = scene.load(
        _save(tmp_path, looks.set_meshes(face, {"head_lod0_mesh": skin, "shirt_lod0_mesh": shirt}))
    )
    head, item = scene.meshes(rig).values()
    head.hide_render = True
    material = item.data.materials[0]
    bump = next(n for n in material.node_tree.nodes if n.type == "BUMP")
    _emit_only(material, bump.inputs["Height"])
    setup, _ = looks.stage([item], 32, samples=1)
    middle = np.array(item.bound_box).mean(axis=0)
    setup.camera.data.clip_end = 10
    grains = []
    for metres in (0.3, 3.0):
        setup.camera.location = (middle[0], middle[1] - metres, middle[2])
        picture = looks.render(setup, tmp_path / f"{metres}.png")
        grains.append(picture[picture[..., 3] > 0.99][:, :3].std())
    assert grains[0] > 0.05
    assert grains[1] < 0.01


def test_skin_scatters_by_the_size_of_the_head(tmp_path):
    scales = []
    for factor in (1.0, 3.0):
        bpy.context.scene.unit_settings.scale_length = 1.0 / factor
        shader = looks.principled(_materials(scene.load(_save(tmp_path, small_face())))["head"])
        # A node tree sets the scattering weight, because it depends on the distance from an open
        # border of the mesh.
        assert shader.inputs["Subsurface Weight"].is_linked
        # The node that scales the scattering distance; its second input is the distance in the
        # palest skin, in Blender units. Darker skin has a smaller distance.
        far = shader.inputs["Subsurface Scale"].links[0].from_node
        scales.append(far.inputs[1].default_value)
    assert scales[1] == pytest.approx(3 * scales[0], rel=1e-4)
    # In a head that is 19 cm high, light is scattered over some millimetres.
    assert 0.001 < scales[0] < 0.006


# --- animated maps ---------------------------------------------------------------------------


def _mapped(label, metadata=None):
    """The Dna of a face whose second animated map has the name `label`.

    The map gets half the value of browDownL, which drives no other map and no bone.
    """
    center = np.array([0.0, 158.0, 2.0])
    head = fine_mesh(np.random.default_rng(1), (40, 44), 10.0, center, (1, 2), ())
    face = looks.set_meshes(small_face(), {"head_lod0_mesh": head})
    face.animated_map_names = ["other", label]
    face.metadata = metadata or {}
    return face


def _before_and_after(rig, tmp_path):
    """Render the head with browDownL at 0 and at 1, which activates the animated map.

    Returns for each pixel: its largest change in a colour channel, the (x, z) that it shows in
    Blender units, and whether the head covers it.
    """
    head = scene.meshes(rig)[0]
    for index, item in scene.meshes(rig).items():
        item.hide_render = index != 0
    shader = looks.principled(head.data.materials[0])
    weight = shader.inputs["Subsurface Weight"]  # scattered light would leave the mask
    for link in list(weight.links):
        head.data.materials[0].node_tree.links.remove(link)
    weight.default_value = 0.0
    setup, places = looks.stage([head], 64)
    before = looks.render(setup, tmp_path / "before.png")
    scene.set_controls(rig, browDownL=1.0)
    after = looks.render(setup, tmp_path / "after.png")
    return np.abs(after - before)[..., :3].max(axis=2), places, before[..., 3] > 0.99


@pytest.mark.parametrize(
    ("label", "side"),
    [
        ("head_wm2_normal.head_wm2_browsDown_L", 1),
        ("head_wm2_normal.head_wm2_browsDown_R", -1),
        ("head_cm2_color.head_wm2_browsDown_L", 1),
    ],
)
def test_a_map_without_textures_shows_in_its_area_only(tmp_path, label, side):
    rig = scene.load(_save(tmp_path, _mapped(label)))
    changed, (x, z), solid = _before_and_after(rig, tmp_path)
    points = np.array([v.co for v in scene.meshes(rig)[0].data.vertices])
    unit = 0.36 * np.ptp(points[:, 0])
    top = points[:, 2].max() - 1.75 * unit
    # Distance of each pixel from the middle of the glabella, the area between the brows. The
    # distance is 1 at the edge of the ellipse that bounds the area.
    away = np.hypot(x / 0.26, (z - top - 0.36 * unit) / 0.32) / unit
    inside = solid & (away < 0.8) & (side * x > 0.05 * unit)
    outside = solid & ((away > 1.5) | (side * x < -0.2 * unit))
    assert inside.sum() > 3
    assert changed[inside].max() > 3 / 255
    assert changed[outside].max() <= 2 / 255


def test_a_mask_of_the_metadata_limits_its_map(tmp_path):
    label = "blush"
    face = _mapped(label, {f"texture:head_lod0_mesh:map:{label}": "mask.png"})
    path = _save(tmp_path, face)
    (tmp_path / "face_textures").mkdir()
    looks.write_image(tmp_path / "face_textures" / "mask.png", looks.halves([1.0] * 3, [0.0] * 3))
    rig = scene.load(path)
    changed, (x, _), solid = _before_and_after(rig, tmp_path)
    width = np.ptp(x[solid])
    # The mask is 1 in its left half. On this mesh u grows with x, so this is the half with low x.
    assert changed[solid & (x < -0.15 * width)].mean() > 6 / 255
    assert changed[solid & (x > 0.15 * width)].max() <= 2 / 255


# Pairs of RGB colours for the left and the right half of a wrinkle map. WHOLE are complete normals
# or colours; OFFSETS are differences from the base map, in which 0.5 means no difference.
WHOLE = ((0.85, 0.5, 0.85), (0.85, 0.5, 0.85))
OFFSETS = ((0.9, 0.5, 0.5), (0.1, 0.5, 0.5))


def _write_maps(folder, wrinkle, mask_left):
    """Write base and wrinkle maps with MetaHuman's file names, and a mask of the wrinkle map.

    The red channel of the mask is 1 in the left half of the image if `mask_left` is True, else in
    the right half.
    """
    folder.mkdir()
    looks.write_image(folder / "head_color_map.png", np.full((16, 16, 3), 0.6, np.float32))
    looks.write_image(folder / "head_normal_map.png", looks.halves([0.5, 0.5, 1], [0.5, 0.5, 1]))
    looks.write_image(folder / "head_wm1_normal_map.png", looks.halves(*wrinkle))
    looks.write_image(folder / "head_cm1_color_map.png", looks.halves(*wrinkle))
    on, off = [1.0, 0, 0, 0], [0.0, 0, 0, 0]
    mask = looks.halves(on, off) if mask_left else looks.halves(off, on)
    looks.write_image(folder / "head_wm1_msk_01.png", mask)


@pytest.mark.parametrize("target", ["normal", "color"])
@pytest.mark.parametrize("wrinkle", [WHOLE, OFFSETS], ids=["whole", "offsets"])
def test_wrinkle_textures_show_where_their_mask_is(tmp_path, target, wrinkle):
    letter = "w" if target == "normal" else "c"
    rig_file = _save(tmp_path, _mapped(f"head_{letter}m1_{target}.head_wm1_blink_L"))
    _write_maps(tmp_path / "Maps", wrinkle, mask_left=True)
    rig = scene.load(rig_file)
    names = {n.image.name for n in _materials(rig)["head"].node_tree.nodes if n.type == "TEX_IMAGE"}
    wanted = "head_wm1_normal_map.png" if target == "normal" else "head_cm1_color_map.png"
    assert {"head_color_map.png", "head_normal_map.png", wanted, "Small_masks"} <= names
    changed, (x, _), solid = _before_and_after(rig, tmp_path)
    width = np.ptp(x[solid])
    assert changed[solid & (x < -0.15 * width)].mean() > 2 / 255
    assert changed[solid & (x > 0.15 * width)].max() <= 2 / 255


@pytest.mark.parametrize("target", ["normal", "color"])
def test_differences_of_nothing_change_nothing(tmp_path, target):
    """A wrinkle map of the value 0.5, which means no difference, does not change the face.

    Newer MetaHuman exports store differences from the base map, so grey is no colour to blend to.
    """
    letter = "w" if target == "normal" else "c"
    path = _save(tmp_path, _mapped(f"head_{letter}m1_{target}.head_wm1_blink_L"))
    _write_maps(tmp_path / "Maps", WHOLE, mask_left=True)
    looks.write_image(tmp_path / "Maps" / "head_wm1_msk_01.png", looks.halves([1.0] * 4, [1.0] * 4))
    pixels = np.full((16, 16, 3), 0.5, np.float32)
    pixels[:, 3:5, 0], pixels[:, 5:7, 0] = 0.9, 0.1
    for name in ("head_wm1_normal_map.png", "head_cm1_color_map.png"):
        looks.write_image(tmp_path / "Maps" / name, pixels)
    changed, (x, _), solid = _before_and_after(scene.load(path), tmp_path)
    width = np.ptp(x[solid])
    assert changed[solid & (x < 0)].max() > 6 / 255
    assert changed[solid & (x > 0.15 * width)].max() <= 2 / 255


def test_only_maps_that_show_get_a_driver(tmp_path):
    face = looks.every_kind()
    face.animated_map_names = ["head_wm1_normal.head_wm1_blink_L", "blush"]
    rig = scene.load(_save(tmp_path, face))
    drivers = {
        base: len(m.node_tree.animation_data.drivers) if m.node_tree.animation_data else 0
        for base, m in _materials(rig).items()
    }
    assert drivers.pop("head") == 2
    body = drivers.pop("body")
    assert body <= 1  # a map without an area shows everywhere
    assert not any(drivers.values())
    bad, seen = scene.invalid_drivers()
    assert not bad
    assert seen >= 2


def test_simple_materials_have_no_drivers_and_no_subsurface(kinds_file):
    rig = scene.load(kinds_file, use_simple_materials=True)
    for material in _materials(rig).values():
        assert material.node_tree.animation_data is None
        shader = looks.principled(material)
        if shader is not None:
            assert shader.inputs["Subsurface Weight"].default_value == 0.0
            assert not shader.inputs["Normal"].is_linked


# --- transparent parts of the eye ------------------------------------------------------------


def _eye_under_a_film(film="eyeshell"):
    """The Dna of a face with an eye and a clear mesh in front of the eye.

    Args:
        film: name of the clear mesh, "eyeshell" or "cornea".
    """
    face = small_face()
    patch = face.meshes[1]
    meshes = {
        "head_lod0_mesh": face.meshes[0],
        "eyeLeft_lod0_mesh": looks.copy_mesh(patch, scale=0.5),
        f"{film}_lod0_mesh": looks.copy_mesh(patch, (0, 0, 0.1), scale=0.52),
    }
    return looks.set_meshes(face, meshes)


@pytest.mark.parametrize("name", ["eyeshell", "cornea"])
def test_the_iris_is_seen_through_the_film(tmp_path, name):
    rig = scene.load(_save(tmp_path, _eye_under_a_film(name)))
    head, eye, film = (scene.meshes(rig)[i] for i in range(3))
    head.hide_render = True
    setup, _ = looks.stage([eye], 24, samples=16)
    film.hide_render = True
    bare = looks.render(setup, tmp_path / "bare.png")[..., :3]
    film.hide_render = False
    covered = looks.render(setup, tmp_path / "covered.png")[..., :3]
    middle = (slice(6, 18), slice(6, 18))
    assert bare[middle].mean(axis=2).std() > 0.05  # pupil, iris and white
    assert np.abs(covered[middle] - bare[middle]).mean() < 0.08
    eye.hide_render = True
    alone = looks.render(setup, tmp_path / "alone.png")
    assert alone[..., 3].mean() < 0.6 or alone[middle][..., :3].mean() < 0.2


def test_a_cornea_refracts_for_cycles_alone(tmp_path):
    rig = scene.load(_save(tmp_path, _eye_under_a_film("cornea")))
    nodes = _materials(rig)["cornea"].node_tree.nodes
    outputs = {n.target: n for n in nodes if n.type == "OUTPUT_MATERIAL"}
    assert set(outputs) == {"ALL", "CYCLES"}

    def shaders(node):
        found = {node.type}
        for socket in node.inputs:
            for link in socket.links:
                found |= shaders(link.from_node)
        return found

    assert "BSDF_REFRACTION" in shaders(outputs["CYCLES"])
    assert "BSDF_REFRACTION" not in shaders(outputs["ALL"])
    # The material of Cycles chooses by the kind of ray: it refracts camera rays, and lets light
    # pass unchanged.
    assert "LIGHT_PATH" in shaders(outputs["CYCLES"])
    assert "BSDF_TRANSPARENT" in shaders(outputs["CYCLES"])


_EEVEE = """
import numpy as np
from pathlib import Path
from support import looks
folder = Path({folder!r})
rig = scene.load(folder / "face.dna")
engine = "BLENDER_EEVEE_NEXT" if bpy.app.version < (5, 0) else "BLENDER_EEVEE"
head, eye, film = (scene.meshes(rig)[i] for i in range(3))
eye.hide_render = film.hide_render = True
setup, _ = looks.stage([head], 24, engine, 1)
print("READY", flush=True)
first = looks.render(setup, folder / "a.png")[..., :3]
print("RENDERED", flush=True)
scene.set_controls(rig, browDownL=1.0)
second = looks.render(setup, folder / "b.png")[..., :3]
print("MAP", float(np.abs(second - first).max()))
head.hide_render, eye.hide_render = True, False
low = np.array(eye.bound_box).min(axis=0); high = np.array(eye.bound_box).max(axis=0)
setup.camera.location = ((low[0] + high[0]) / 2, low[1] - 1, (low[2] + high[2]) / 2)
setup.camera.data.ortho_scale = float(high[0] - low[0]) * 1.1
bare = looks.render(setup, folder / "c.png")[5:19, 5:19, :3]
film.hide_render = False
covered = looks.render(setup, folder / "d.png")[5:19, 5:19, :3]
print("IRIS", float(bare.mean(axis=2).std()), float(np.abs(covered - bare).mean()))
"""


def test_eevee_shows_maps_and_the_iris(tmp_path):
    face = _eye_under_a_film()
    face.animated_map_names = ["other", "blush_and_wrinkle"]
    _save(tmp_path, face)
    code, said = child.run(tmp_path, _EEVEE.format(folder=str(tmp_path)))
    assert "READY" in said, said
    if "RENDERED" not in said:
        pytest.skip("EEVEE NOT RUN: no OpenGL here")
    assert code == 0, said
    words = {line.split()[0]: [float(v) for v in line.split()[1:]] for line in said.splitlines()
             if line.startswith(("MAP ", "IRIS "))}  # fmt: skip
    assert words["MAP"][0] > 6 / 255
    assert words["IRIS"][0] > 0.05
    assert words["IRIS"][1] < 0.08
    assert "compil" not in said.lower() or "error" not in said.lower(), said


# --- textures and their colour spaces --------------------------------------------------------


def test_a_chosen_folder_is_looked_into_first_and_the_finds_are_said(tmp_path):
    path = _save(tmp_path, small_face())
    chosen = tmp_path / "elsewhere"
    chosen.mkdir()
    (tmp_path / "Maps").mkdir()
    for folder, value in ((chosen, 0.2), (tmp_path / "Maps", 0.8)):
        looks.write_image(folder / "T_Head_BC.png", np.full((4, 4, 3), value, np.float32))
    looks.write_image(tmp_path / "Maps" / "teeth_color_map.png", np.ones((4, 4, 3), np.float32))
    rig = scene.load(path, texture_folder=str(chosen))
    image = next(i for i in bpy.data.images if i.name.startswith("T_Head_BC"))
    assert image.packed_file
    assert image.pixels[0] == pytest.approx(0.2, abs=0.01)
    assert rig["risorius_textures"] == "head: color; teeth: color"
    assert not image.colorspace_settings.is_data


def test_lashes_are_hairs_where_a_mask_or_the_alpha_of_a_picture_says_so(tmp_path, kinds_file):
    maps = tmp_path / "Maps"
    maps.mkdir()
    found = []
    for name, channels in (("T_Eyelashes_BC.png", 4), ("T_Eyelashes_Opacity.png", 3)):
        looks.write_image(maps / name, np.full((4, 4, channels), 0.5, np.float32))
        shader = looks.principled(_materials(scene.load(kinds_file))["eyelashes"])
        socket = shader.inputs["Alpha"].links[0].from_socket
        found.append((socket.node.image.name, socket.name))
    assert found == [("T_Eyelashes_BC.png", "Alpha"), ("T_Eyelashes_Opacity.png", "Color")]


def test_a_broken_texture_is_a_sentence(tmp_path):
    path = _save(tmp_path, small_face())
    (tmp_path / "Maps").mkdir()
    (tmp_path / "Maps" / "head_color_map.png").write_bytes(b"no picture at all")
    build = scene.submodule("scene.character.build")
    before = len(bpy.data.images)
    rig, warnings = build.import_file(bpy.context, path, build.BuildOptions())
    assert "The texture head_color_map.png cannot be read." in warnings
    assert len(bpy.data.images) == before
    assert _materials(rig)["head"] is not None


def test_a_very_large_texture_stays_outside(tmp_path, monkeypatch):
    path = _save(tmp_path, small_face())
    (tmp_path / "Maps").mkdir()
    looks.write_image(tmp_path / "Maps" / "head_color_map.png", np.ones((4, 4, 3), np.float32))
    monkeypatch.setattr(scene.submodule("scene.material.image_loading"), "PACK_LIMIT", 10)
    build = scene.submodule("scene.character.build")
    _rig, warnings = build.import_file(bpy.context, path, build.BuildOptions())
    said = "The texture head_color_map.png is large and stays outside the .blend file."
    assert said in warnings
    assert bpy.data.images["head_color_map.png"].packed_file is None


def test_a_name_from_the_file_never_leads_out_of_the_folder(tmp_path):
    folder = tmp_path / "in"
    folder.mkdir()
    looks.write_image(tmp_path / "secret.png", np.ones((4, 4, 3), np.float32))
    face = small_face()
    names = ("../secret.png", str(tmp_path / "secret.png"), "..\\secret.png", "", "face.dna")
    for name in names:
        face.metadata = {"texture:head_lod0_mesh:color": name}
        build = scene.submodule("scene.character.build")
        path = _save(folder, face)
        _rig, warnings = build.import_file(bpy.context, path, build.BuildOptions())
        assert f"The texture {name} was not found beside the file." in warnings
        assert not bpy.data.images


_CONFIG = """ocio_profile_version: 1
strictparsing: false
search_path: luts
roles:
  color_picking: Output - Display
  data: {data}
  default: {data}
  default_byte: Output - Display
  default_float: ACES - Linear
  default_sequencer: Output - Display
  scene_linear: ACES - Linear
  rendering: ACES - Linear
  texture_paint: Output - Display
displays:
  Screen:
    - !<View> {{name: Plain, colorspace: Output - Display}}
active_displays: [Screen]
active_views: [Plain]
colorspaces:
  - !<ColorSpace>
    name: ACES - Linear
    bitdepth: 32f
    isdata: false
  - !<ColorSpace>
    name: Output - Display
    bitdepth: 8ui
    isdata: false
    to_reference: !<ExponentTransform> {{value: [2.2, 2.2, 2.2, 1]}}
  - !<ColorSpace>
    name: Utility - Raw
    bitdepth: 32f
    isdata: true
  - !<ColorSpace>
    name: Utility - sRGB - Texture
    bitdepth: 8ui
    isdata: false
    to_reference: !<ExponentTransform> {{value: [2.4, 2.4, 2.4, 1]}}
"""
_IMPORT = """
rig = scene.load({path!r})
for image in bpy.data.images:
    if image.name.startswith("head"):
        settings = image.colorspace_settings
        print("SPACE", image.name, settings.is_data, settings.name)
"""


@pytest.mark.parametrize("data", ["Utility - Raw", "ACES - Linear"])
def test_a_configuration_with_other_names_gets_the_right_spaces(tmp_path, data):
    """Textures get the right colour spaces in configurations without `sRGB` and `Non-Color`.

    Such a configuration is ACES. In one of the two tested configurations, the role `data` is a
    colour space that is not for data.
    """
    path = _save(tmp_path, _mapped("head_wm1_normal.head_wm1_blink_L"))
    _write_maps(tmp_path / "Maps", WHOLE, mask_left=True)
    config = tmp_path / "config.ocio"
    config.write_text(_CONFIG.format(data=data), encoding="utf-8")
    code, said = child.run(tmp_path, _IMPORT.format(path=str(path)), OCIO=str(config))
    assert code == 0, said
    assert "Traceback" not in said
    spaces = {w[1]: (w[2], " ".join(w[3:])) for w in map(str.split, said.splitlines())
              if w[:1] == ["SPACE"]}  # fmt: skip
    for name in ("head_normal_map.png", "head_wm1_normal_map.png"):
        # Blender sets `is_data` by the role `data` only. If this role is wrong, `is_data` is False,
        # and the add-on must have chosen the space by its name.
        assert spaces[name] == (str(data == "Utility - Raw"), "Utility - Raw"), said
    assert spaces["head_color_map.png"] == ("False", "Utility - sRGB - Texture"), said


class _Spaces:
    """Stands for the colour settings of an image, in a configuration with unknown space names."""

    bl_rna = SimpleNamespace(
        properties={"name": SimpleNamespace(enum_items=[SimpleNamespace(identifier="Vectors")])}
    )
    is_data = False

    def __setattr__(self, key, value):
        if key == "name":
            raise TypeError(f"enum {value!r} not found")
        super().__setattr__(key, value)


@pytest.mark.parametrize("data", [True, False])
def test_where_no_name_is_known_the_configuration_itself_says_what_numbers_are(data):
    settings = _Spaces()
    image = SimpleNamespace(colorspace_settings=settings, is_float=False)
    scene.submodule("scene.material.image_loading").set_color_space(image, data)
    assert settings.is_data is data


# --- the seam between head and body ----------------------------------------------------------


def test_head_and_body_have_the_same_normals_at_the_seam(tmp_path):
    """Head and body have equal normals at their seam, if the DNA file's normals are used.

    The meshes are two parts of a sphere. Without the normals of the DNA file, the seam is visible.
    """
    face = small_face()
    center = np.array([0.0, 158.0, 2.0])
    whole = fine_mesh(np.random.default_rng(1), (40, 44), 10.0, center, (1, 2), ())
    faces = whole.face_layouts.reshape(-1, 4)
    level = whole.positions[faces, 1].mean(axis=1)
    upper = level >= np.median(level)
    # The skin weights change smoothly with the height from one joint to the other, as at a neck.
    height = whole.positions[:, 1]
    share = (height - height.min()) / np.ptp(height)
    parts = {}
    for name, chosen in (("head", faces[upper]), ("body", faces[~upper])):
        part = looks.copy_mesh(whole)
        part.face_layouts = chosen.ravel().astype(np.uint32)
        part.face_offsets = np.arange(0, chosen.size + 1, 4, dtype=np.uint32)
        part.skin_offsets = np.arange(0, 2 * len(share) + 1, 2, dtype=np.uint32)
        part.skin_joint_indices = np.tile(np.array([1, 2], np.uint16), len(share))
        part.skin_weights = np.stack([1 - share, share], axis=1).ravel().astype(np.float32)
        parts[f"{name}_lod0_mesh"] = part
    seam = np.intersect1d(faces[upper], faces[~upper])
    assert len(seam) > 5
    path = _save(tmp_path, looks.set_meshes(face, parts))
    for normals in (True, False):
        rig = scene.load(path, use_normals=normals)
        for turn in (0.0, 0.5):
            head = scene.controls(rig).pose.bones["head"]
            head.rotation_mode = "XYZ"
            head.rotation_euler = (turn, turn, 0)
            scene.update(scene.controls(rig))
            ours, theirs = (_corner_normals(m) for _, m in sorted(scene.meshes(rig).items()))
            gap = max(np.abs(ours[v] - theirs[v]).max() for v in seam)
            # In a pose, Blender rotates the custom normals of each mesh by the mesh's own shape, so
            # the normals of the two meshes at the seam are only nearly equal.
            assert (gap < (0.03 if turn else 2e-3)) == normals, (turn, gap)


def _corner_normals(item):
    """Index of a vertex -> mean of its corner normals in the evaluated mesh, float64[3]."""
    seen = item.evaluated_get(bpy.context.evaluated_depsgraph_get())
    mesh = seen.to_mesh()
    found = {}
    for corner, normal in zip(mesh.loops, mesh.corner_normals, strict=True):
        found.setdefault(corner.vertex_index, []).append(np.array(normal.vector))
    seen.to_mesh_clear()
    return {v: np.mean(n, axis=0) for v, n in found.items()}


def test_map_drivers_are_plain_sums(tmp_path):
    """The drivers of animated maps in a material are of the type Sum Values.

    So they need no Python expressions. scene/material/skin_material.py makes these drivers.
    """
    rig = scene.load(_save(tmp_path, _mapped("head_wm2_normal.head_wm2_browsDown_L")))
    drivers = list(scene.submodule("scene.material.materials").map_drivers(_materials(rig)["head"]))
    assert len(drivers) == 2
    assert {c.driver.type for c in drivers} == {"SUM"}
    assert {t.data_path for c in drivers for v in c.driver.variables for t in v.targets} == {
        '["maps"][0]',
        '["maps"][1]',
    }
