# SPDX-License-Identifier: MIT
"""Tests heads of several meshes, in any unit and facing any direction.

Joints, sides and textures are tested, and that bad input is refused.
"""

import struct
from functools import cache

import command_line
import face_shapes
import likenesses
import numpy as np
import pytest
import risorius
from fbx_files import I64, fbx
from risorius.author import work
from risorius.author.input import spec
from risorius.author.input.obj import ShapeFileError
from risorius.files.png import png

MAKERS = {
    "Ready Player Me": likenesses.ready_player,
    "VRoid": likenesses.vroid,
    "ICT": likenesses.everything_in_one,
    "Face Cap": likenesses.face_cap,
}
MESHES = {
    "Ready Player Me": ["Wolf3D_Teeth", "eyeLeft", "eyeRight", "Wolf3D_Hair"],
    "VRoid": ["Hair001"],
    "ICT": ["eyeLeft", "eyeRight"],
    "Face Cap": ["eyeLeft", "eyeRight", "teethUpper", "teethLower", "tongue", "glasses"],
}
EYES = ["FACIAL_L_Eye", "FACIAL_R_Eye"]
JOINTS = {"Ready Player Me": EYES, "VRoid": [], "ICT": EYES, "Face Cap": ["FACIAL_C_Jaw", *EYES]}
HEIGHT_CM = 25.05  # height of the face of face_shapes.py


@cache
def made(name):
    return MAKERS[name]()


def read(path, text=""):
    """Read a head's file, or a spec of it.

    Args:
        text: lines for the spec's table [source]; "": read the file without a spec.
    """
    if text:
        toml = path.with_suffix(".toml")
        toml.write_text(f'[source]\nneutral = "{path.name}"\n{text}', encoding="utf-8")
        path = toml
    return spec.read_face(spec.read_spec(path))


def saved(folder, meshes, *stand, **more):
    return likenesses.save_glb(folder / "head.glb", likenesses.placed(meshes, *stand), **more)


def centimetres(dna, mesh=0):
    return np.asarray(dna.meshes[mesh].positions, np.float64) * 100


def target(dna, control, mesh=0):
    """Vertex indices of a control's blend shape, and their displacements in cm."""
    channel = list(dna.blend_shape_channel_names).index(control)
    for found in dna.meshes[mesh].blend_shape_targets:
        if found.blend_shape_channel_index == channel:
            return np.asarray(found.vertex_indices), np.asarray(found.deltas, np.float64) * 100
    return np.zeros(0, int), np.zeros((0, 3))


def strongest(dna, control, mesh=0):
    """Place of the vertex that a control moves most, and its displacement, in cm."""
    vertices, deltas = target(dna, control, mesh)
    at = np.linalg.norm(deltas, axis=1).argmax()
    return centimetres(dna, mesh)[vertices[at]], deltas[at]


@pytest.mark.parametrize("name", MAKERS)
@pytest.mark.parametrize(
    ("stand", "scale"),
    [("+z", 0.01), ("-z", 0.1), ("+x", 1.0), ("-y, z up", 10.0), ("+y, z up", 100.0),
     ("+x, z up", 1 / 2.54), ("+z, x up", 0.01), ("-y, x up", 0.01)],
)  # fmt: skip
def test_every_likeness_stands_and_has_its_size(name, stand, scale, tmp_path):
    path = saved(tmp_path, made(name), stand, scale, (0.3 * scale, 4 * scale, 0))
    found = read(path)
    dna = found.dna
    assert [n.removesuffix("_lod0_mesh") for n in dna.mesh_names][1:] == MESHES[name]
    assert list(dna.joint_names)[2:] == JOINTS[name]
    points = centimetres(dna)
    assert np.ptp(points, axis=0) == pytest.approx([18, 25, 23.4], abs=0.2)
    assert points[points[:, 2].argmax()][:2] - points.mean(axis=0)[:2] == pytest.approx(
        [0, -1.5], abs=1.5
    )  # the nose is the front
    shut = strongest(dna, "eyeBlinkL")
    assert shut[0][0] > 2.5
    assert shut[1] == pytest.approx([0, -0.59, 0.08], abs=0.05)
    assert strongest(dna, "eyeBlinkR")[0][0] < -2.5
    if name != "VRoid":
        smile = strongest(dna, "mouthCornerPullL")
        assert smile[0][0] > 2
        assert smile[1] == pytest.approx([0.8, 0.7, -0.3], abs=0.06)
        assert strongest(dna, "jawOpen")[1][1] < -0.5
    for joint, side in zip(EYES, (1, -1), strict=True):
        if joint in JOINTS[name]:
            at = list(dna.joint_names).index(joint)
            place = np.asarray(dna.neutral_joint_translations)[[1, at]].sum(axis=0) * 100
            box = points.min(axis=0) + np.array([9, 12.5, 11])  # centre of the head
            assert place - box == pytest.approx(likenesses.EYE * [side, 1, 1], abs=0.1)
    said = "\n".join(found.odd)
    assert "the face looks along" in said
    guessed = {0.1: "dm", 1.0: "cm", 10.0: "mm", 100.0: "0.1 mm", 1 / 2.54: "inch"}.get(scale)
    assert (f"taken as {guessed}," in said) == (guessed is not None)
    assert ("Body is left out" in said) == (name in ("VRoid", "Ready Player Me"))


def moved(dna, mesh, control):
    """Neutral vertices of a mesh, and their displacements by a control, in cm."""
    face = work.begin(dna)
    row = face.names.index(f"CTRL_expressions.{control}")
    index = [n.removesuffix("_lod0_mesh") for n in dna.mesh_names].index(mesh)
    return centimetres(dna, index), face.wanted[index][row] * 100


def test_lower_teeth_and_tongue_go_with_the_jaw_and_the_rest_stays(tmp_path):
    found = read(saved(tmp_path, made("Face Cap")))
    face, opened = moved(found.dna, "teethLower", "jawOpen")
    hinge, angle = np.array([0, 0, -2.0]), 0.3
    c, s = np.cos(angle), np.sin(angle)
    wanted = (face - hinge) @ np.array([[1, 0, 0], [0, c, s], [0, -s, c]]) + hinge
    assert np.abs(face + opened - wanted).max() < 0.05
    assert np.abs(moved(found.dna, "tongue", "jawOpen")[1]).max() > 1
    for mesh in ("teethUpper", "glasses", "eyeLeft"):
        assert not np.abs(moved(found.dna, mesh, "jawOpen")[1]).max()
    points, faces, shapes = likenesses.skull()
    only = likenesses.mesh("Head", (points, faces), {"viseme_aa": shapes["jawOpen"]})
    spoken = read(saved(tmp_path, [only, *made("Face Cap")[2:3]]))
    assert np.abs(moved(spoken.dna, "teethLower", "viseme_aa")[1] - opened).max() < 0.05
    whole, *others = made("Face Cap")
    flat = [{**m, "faces": m["faces"][: 5 if m["name"] == "teeth" else 0]} for m in others]
    some = read(saved(tmp_path, [whole, *flat]))
    assert len(some.dna.meshes) == 2
    assert "eyes is left out: it has no polygons" in some.odd
    lines = {"teethLower hangs on the jaw", "teethUpper hangs on the head",
             "tongue hangs on the jaw", "glasses hangs on the head"}  # fmt: skip
    assert lines <= set(found.odd)


def test_eyes_turn_with_look_controls_by_usual_angles_or_by_those_of_the_shapes(tmp_path):
    meshes = made("ICT")
    points, shapes = meshes[0]["points"], dict(meshes[0]["shapes"])
    left = np.linalg.norm(points - likenesses.EYE, axis=1) < 1.01 * likenesses.EYE_RADIUS
    angle = np.radians(20)
    c, s = np.cos(angle), np.sin(angle)
    arm = points - likenesses.EYE
    up = arm @ np.array([[1, 0, 0], [0, c, -s], [0, s, c]]).T - arm  # down, about x
    shapes["eyeLookUp_L"] = np.where(left[:, None], -up, 0)
    shapes["PupilDilate_L"] = np.where(left[:, None] & (arm[:, 2:] > 1.2), arm * [0.3, 0.3, 0], 0)
    found = read(saved(tmp_path, [{**meshes[0], "shapes": shapes}]))
    for mesh, control, way in (
        ("eyeLeft", "eyeLookUpL", [0, np.sin(angle), 0]),
        ("eyeRight", "eyeLookUpR", [0, np.sin(np.radians(25)), 0]),
        ("eyeLeft", "eyeLookLeftL", [np.sin(np.radians(30)), 0, 0]),
    ):
        eye, delta = moved(found.dna, mesh, control)
        front = eye[:, 2].argmax()
        got = delta[front] / likenesses.EYE_RADIUS
        assert got[:2] == pytest.approx(way[:2], abs=0.1)
    assert not np.abs(moved(found.dna, "eyeRight", "eyeLookUpL")[1]).max()
    targets = [len(m.blend_shape_targets) for m in found.dna.meshes]
    assert targets[1:] == [1, 0]  # eye rotations need no targets; a growing pupil needs one
    assert found.kept == ("eyeLeft_lod", "eyeRight_lod")


def test_what_is_drawn_or_shut_with_the_lids_is_no_ball(tmp_path):
    whole, *_ = made("Face Cap")
    points, faces = likenesses.joined(*likenesses.eyes())
    middle = likenesses.EYE[2]
    sockets = likenesses.mesh("eyes", (points * [1, 1, -1] + [0, 0, 2 * middle], faces))
    sockets["faces"] = faces[(sockets["points"][faces][:, :, 2] < middle + 0.1).all(axis=1)]
    used = np.unique(sockets["faces"])
    place = np.zeros(len(points), int)
    place[used] = np.arange(len(used))
    sockets |= {"points": sockets["points"][used], "faces": place[sockets["faces"]]}
    squash = (points - [0, likenesses.EYE[1], 0]) * [0, -0.9, 0]
    drawn = likenesses.mesh("eyes", (points, faces), {"eyeBlink_L": squash})
    for eyes in (sockets, drawn):
        assert list(read(saved(tmp_path, [whole, eyes])).dna.joint_names) == ["root", "head"]


def test_a_lopsided_head_stays_as_it_is(tmp_path):
    even = centimetres(read(saved(tmp_path, made("Ready Player Me"), "-z")).dna)
    found = read(saved(tmp_path, likenesses.ready_player(lopsided=True), "-z"))
    odd = centimetres(found.dna) - even
    assert odd[np.abs(odd).max(axis=1).argmax()] == pytest.approx([2, 1, 1], abs=0.2)
    assert even[np.abs(odd).max(axis=1).argmax()][0] > 3
    assert list(found.dna.joint_names)[2:] == EYES


def test_names_that_disagree_with_places_are_told_and_the_mesh_is_not_mirrored(tmp_path):
    points, faces, shapes = likenesses.skull(lopsided=True)
    other = {
        n: n.replace("Left", "?").replace("Right", "Left").replace("?", "Right") for n in shapes
    }
    swapped = likenesses.mesh("Head", (points, faces), likenesses.rename(shapes, other))
    found = read(saved(tmp_path, [swapped]))
    told = [n for n in found.odd if "names and places disagree" in n]
    assert len(told) == 1
    assert centimetres(found.dna) == pytest.approx(points, abs=1e-4)
    assert strongest(found.dna, "mouthCornerPullL")[0][0] < -2  # the side that the file names
    # A file that was mirrored shows the backs of its polygons; the reader mirrors it again.
    flipped = {**swapped, "points": points * [-1, 1, 1],
               "shapes": {n: d * [-1, 1, 1] for n, d in shapes.items()}}  # fmt: skip
    found = read(saved(tmp_path, [flipped]))
    assert any("mirrored file" in n for n in found.odd)
    assert centimetres(found.dna) == pytest.approx(points, abs=1e-4)
    assert strongest(found.dna, "mouthCornerPullL")[0][0] > 2
    # A direction in the spec has precedence over the reader's guess.
    found = read(saved(tmp_path, [swapped]), 'front = "-z"\nup = "+y"')
    assert not any("disagree" in n for n in found.odd)
    assert strongest(found.dna, "mouthCornerPullL")[0][0] > 2
    for text, why in (('left = "x"', "left: one of"), ('left = "+z"\nfront = "-z"', "three diff")):
        with pytest.raises(ShapeFileError, match=why):
            read(saved(tmp_path, [swapped]), text)


@pytest.mark.parametrize(
    ("scale", "text", "height", "said"),
    [
        (0.005, "", 12.525, "a face is 18 to 30 cm high"),
        (1e-7, "", 2.5e-4, "in no unit that is known"),
        (0.01, "height_mm = 220", 22.0, ""),
        (0.5, "scale = 0.02", 25.05, ""),
        (0.3, 'unit = "dm"', 75.15, "a face is 18 to 30 cm high"),
        (1 / 30.48, 'unit = "foot"', 25.05, ""),
    ],
)
def test_a_size_is_said_or_told(scale, text, height, said, tmp_path):
    found = read(saved(tmp_path, made("VRoid"), "+z", scale), text)
    points = centimetres(found.dna)
    unit = {"m": 1.0, "cm": 0.01}[found.dna.translation_unit]
    assert np.ptp(points[:, 1]) * unit == pytest.approx(height * 25 / HEIGHT_CM, rel=0.01)
    odd = [n for n in found.odd if "18 to 30" in n or "no unit" in n]
    assert bool(odd) == bool(said)
    assert all(said in n for n in odd)
    with pytest.raises(ShapeFileError, match="one of m, cm, mm, inch, dm, foot was expected"):
        read(tmp_path / "head.glb", 'unit = "ell"')


def quick(path, *more):
    return command_line.run("author", path, "-o", path.with_suffix(".dna"), *more, text=True)


def test_the_command_line_takes_a_head_as_it_is_with_its_textures(tmp_path):
    meshes = made("Ready Player Me")
    looks = [{**m, "material": n} for n, m in enumerate(meshes)]
    picture, packed = png(np.full((8, 8, 3), 0.5)), png(np.full((8, 8, 3), 0.7))
    huge = struct.pack(">II", 16384, 16384).join((png(np.zeros((8, 8)))[:16], b"\x08\0\0\0\0"))
    rough = {"metallicRoughnessTexture": {"index": 1}, "baseColorTexture": {"index": 0}}
    materials = [
        {"name": "Skin", "pbrMetallicRoughness": rough, "normalTexture": {"index": 0}},
        {"name": "Eye", "pbrMetallicRoughness": {"baseColorFactor": [0.2, 0.4, 0.1, 1]}},
        {"name": "Eye", "pbrMetallicRoughness": {"baseColorTexture": {"index": 2}}},
        {"name": "Teeth", "pbrMetallicRoughness": {"baseColorTexture": {"index": 3}}},
        {"name": "Hair", "pbrMetallicRoughness": {"baseColorTexture": {"index": 4}}},
        {"name": "Body", "pbrMetallicRoughness": {"baseColorTexture": {"index": 5}}},
    ]
    images = [picture, packed, huge, b"\xabKTX 20\xbb\r\n", picture, huge]
    path = saved(tmp_path, looks, "-z", 1.0, materials=materials, images=images)
    text = "[joints]\ncount = 12\nrounds = 2\n[lods]\ncount = 2\n"
    toml = tmp_path / "anna.toml"
    toml.write_text(f'[source]\nneutral = "{path.name}"\n{text}', encoding="utf-8")
    done = quick(toml, "--height-mm", 240)
    assert done.returncode == 0, done.stderr
    dna = risorius.load(tmp_path / "anna.dna")
    assert np.ptp(np.asarray(dna.meshes[0].positions)[:, 1]) == pytest.approx(0.24, abs=0.002)
    said = dict(dna.metadata)
    assert said["texture:anna_lod0_mesh:color"] == said["texture:anna_lod1_mesh:color"]
    folder = tmp_path / "anna_textures"
    for key, data in {
        "anna_lod0_mesh:color": picture, "anna_lod0_mesh:normal": picture,
        "anna_lod0_mesh:roughness": packed, "eyeRight_lod0_mesh:color": huge,
        "Wolf3D_Hair_lod0_mesh:color": picture,
    }.items():  # fmt: skip
        assert (folder / said[f"texture:{key}"]).read_bytes() == data
    assert said["texture:anna_lod0_mesh:roughness"].endswith("_orm.png")
    assert said["texture:eyeLeft_lod0_mesh:color"] == "Eye_color.png"
    assert said["texture:eyeRight_lod0_mesh:color"] == "Eye2_color.png"
    assert not any("Teeth" in key or "Body" in key for key in said)
    assert "Teeth: its color texture is left out: PNG, JPEG, WebP or BMP" in done.stdout
    assert "its color texture has 16,384 x 16,384 pixels, 1.1 GB" in done.stdout
    face = work.begin(dna)  # the written face still smiles on its left, and its eyes move
    row = face.names.index("CTRL_expressions.mouthCornerPullL")
    length = np.linalg.norm(face.wanted[0][row], axis=1)
    assert np.asarray(dna.meshes[0].positions)[length.argmax()][0] > 0.02
    assert "CTRL_expressions.eyeLookUpL" in face.names
    assert quick(toml, "--height-mm", 240, "--scale", 2).returncode == 2


def test_a_missing_texture_and_a_mesh_of_shared_materials_are_told(tmp_path):
    points, faces, shapes = likenesses.skull()
    half = len(faces) // 2
    one = likenesses.mesh("Head", (points, faces), shapes)
    materials = [{"name": n, "pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}}
                 for n in ("Skin", "Lips")]  # fmt: skip
    picture = png(np.zeros((4, 4)))

    def parts(at):
        return [{**one, "primitives": [(faces[:at], 0), (faces[at:], 1)]}]

    found = read(saved(tmp_path, parts(10), materials=materials, images=[picture]))
    assert len(found.dna.meshes) == 1
    shared = "Head: Skin left out: polygons of other materials are joined to theirs"
    assert any(shared in note for look in found.materials.values() for note in look.notes)
    skull = len(face_shapes.head()[1]) * 2  # the back of the head is a separate island
    apart = read(saved(tmp_path, parts(skull), materials=materials, images=[picture]))
    assert list(apart.dna.mesh_names) == ["head_lod0_mesh", "Head_Lips_lod0_mesh"]
    assert [len(m.positions) for m in apart.dna.meshes] == [506, len(points) - 506]
    materials[1]["name"] = "EyeWhite"  # a mesh of its own, because lids hide its border
    cut = read(saved(tmp_path, parts(half), materials=materials, images=[picture]))
    assert [cut.materials[n].name for n in cut.dna.mesh_names] == ["Skin", "EyeWhite"]
    assert sum(len(m.positions) for m in cut.dna.meshes) > len(points)
    path = saved(tmp_path, parts(half), materials=materials, images=[picture])
    data = path.read_bytes()
    start = data.index(b'"images": [')
    end = data.index(b"]", start)
    uri = b'"images": [{"uri": "no.png"}'
    path.write_bytes(data[:start] + uri.ljust(end - start) + data[end:])
    look = next(iter(read(path).materials.values()))
    assert any(
        "its color texture is left out" in note and "No such file" in note for note in look.notes
    )


def test_two_heads_are_refused_and_one_may_be_chosen(tmp_path):
    one, *_ = made("Ready Player Me")
    twin = {**one, "name": "Twin", "points": one["points"] + [30, 0, 0]}
    path = saved(tmp_path, [one, twin])
    done = quick(path)
    assert done.returncode == 1
    assert "one head was expected, Wolf3D_Head and Twin have the same shapes" in done.stderr
    found = read(path, 'mesh = "Twin"')
    assert "Wolf3D_Head is left out: it is another head" in found.odd
    assert centimetres(found.dna)[:, 0].mean() == pytest.approx(0, abs=0.5)
    with pytest.raises(ShapeFileError, match="Wolf3D_Head and Twin was expected, found Hat"):
        read(path, 'mesh = "Hat"')


def test_names_of_one_meaning_move_together_and_nameless_heads_stand(tmp_path):
    points, faces, shapes = likenesses.skull()
    lashes = likenesses.ball([3.2, 4.8, 8.5], 0.6)
    blink = {"eyeBlink_L": np.full_like(lashes[0], -0.5), "Zz": np.full_like(lashes[0], 0.1)}
    meshes = [likenesses.mesh("Head", (points, faces), shapes),
              likenesses.mesh("Lashes", lashes, blink)]  # fmt: skip
    dna = read(saved(tmp_path, meshes)).dna
    assert len(target(dna, "eyeBlinkL", 1)[0]) == len(lashes[0])
    assert "Zz" in list(dna.blend_shape_channel_names)
    assert list(dna.mesh_names)[1] == "eyelashes_lod0_mesh"
    unknown = {f"shape {i}": delta for i, delta in enumerate(shapes.values())}
    for names in (unknown, {"viseme_aa": shapes["jawOpen"], "viseme_PP": shapes["mouthSmileLeft"]}):
        head = likenesses.mesh("Head", (points, faces), names)
        found = read(saved(tmp_path, [head], "-z"))
        assert "the face looks along -z" in found.odd[0]
        assert centimetres(found.dna) == pytest.approx(points, abs=1e-4)


def test_a_folder_of_obj_files_is_a_head(tmp_path):
    positions, faces = face_shapes.head()
    face_shapes.write_obj(tmp_path / "neutral.obj", positions, faces)
    for name, delta in face_shapes.expressions(positions).items():
        face_shapes.write_obj(tmp_path / f"{name}.obj", positions + delta, faces)
    hair, strands = likenesses.ball([0, 5, -3], 10.5)
    face_shapes.write_obj(tmp_path / "hair.obj", hair, strands)
    neutral = tmp_path / "neutral.obj"
    text = neutral.read_text(encoding="utf-8").replace("f ", "usemtl Skin\nf ", 1)
    neutral.write_text("mtllib head.mtl\n" + text, encoding="utf-8")
    lines = ["newmtl Skin", "Kd 0.5 0.5 0.5", "map_Kd -s 1 1 1 maps/skin.png", "norm no.png"]
    (tmp_path / "head.mtl").write_text("\n".join(lines), encoding="utf-8")
    (tmp_path / "maps").mkdir()
    (tmp_path / "maps" / "skin.png").write_bytes(png(np.zeros((4, 4))))
    found = read(tmp_path)
    look = found.materials[found.dna.mesh_names[0]]
    assert look.pictures == {"color": png(np.zeros((4, 4)))}
    assert "Skin: its normal texture is left out" in look.notes[0]
    assert list(found.dna.mesh_names) == [f"{tmp_path.name}_lod0_mesh", "hair_lod0_mesh"]
    assert "hair hangs on the head" in found.odd
    (tmp_path / "head.mtl").unlink()
    lost = read(tmp_path).materials[found.dna.mesh_names[0]].notes
    assert "head.mtl: the materials are left out" in lost[0]
    face_shapes.write_obj(tmp_path / "jawOpen.obj", hair, strands)
    with pytest.raises(ShapeFileError, match=r"jawOpen\.obj: 506 vertices were expected"):
        read(tmp_path)
    (tmp_path / "neutral.obj").unlink()
    with pytest.raises(ShapeFileError, match="an OBJ file called neutral, basis"):
        read(tmp_path)


def fbx_head(path, picture, *, embedded):
    """Write a head, and eyes with two materials, as an FBX in centimetres.

    Args:
        path: path of the FBX.
        picture: bytes of a PNG, the colour texture of the skin.
        embedded: True: the FBX contains the PNG; False: it only names skin.png.
    """
    points, faces, shapes = likenesses.skull()
    eyes = likenesses.joined(*likenesses.eyes())
    objects, links = [], []

    def link(child, parent, *way):
        links.append(("C", ("OP" if way else "OO", I64(child), I64(parent), *way)))

    for number, (name, (own, own_faces)) in enumerate(
        {"Head": (points, faces), "Eyes": eyes}.items(), 1
    ):
        order = np.array(own_faces, "<i4")
        order[:, 2] = ~order[:, 2]
        half = (np.arange(len(order)) >= len(order) // 2).astype("<i4")
        looks = [("MappingInformationType", ("ByPolygon",)), ("Materials", (half,))]
        inner = [("Vertices", (np.ascontiguousarray(own, "<f8").ravel(),)),
                 ("PolygonVertexIndex", (order.ravel(),))]  # fmt: skip
        if name == "Eyes":
            inner.append(("LayerElementMaterial", (0,), looks))
        objects.append(("Geometry", (I64(number), f"{name}\0\1Geometry", "Mesh"), inner))
        objects.append(("Model", (I64(10 + number), f"{name}\0\1Model", "Mesh")))
        link(number, 10 + number)
    objects.append(("Deformer", (I64(30), "b\0\1Deformer", "BlendShape")))
    link(30, 1)
    for number, (name, delta) in enumerate(shapes.items(), 40):
        moved = np.flatnonzero(np.any(delta, axis=1)).astype("<i4")
        inner = [("Indexes", (moved,)), ("Vertices", (np.ascontiguousarray(delta[moved]).ravel(),))]
        channel = I64(number), f"{name}\0\1SubDeformer", "BlendShapeChannel"
        objects.append(("Deformer", channel, [("FullWeights", (np.array([100.0]),))]))
        objects.append(("Geometry", (I64(number + 50), f"{name}\0\1Geometry", "Shape"), inner))
        link(number, 30)
        link(number + 50, number)
    for number, (name, models) in enumerate({"Skin": [11, 12], "Iris": [12]}.items(), 20):
        objects.append(("Material", (I64(number), f"{name}\0\1Material", "")))
        for model in models:
            link(number, model)
    file = [("RelativeFilename", ("C:\\skins\\skin.png",))]
    objects.append(("Texture", (I64(22), "t\0\1Texture", ""), file))
    objects.append(("Video", (I64(23), "v\0\1Video", "Clip"), [("Content", (picture,))]))
    link(22, 20, "DiffuseColor")
    if embedded:
        link(23, 22)
    path.write_bytes(fbx([("Objects", (), objects), ("Connections", (), links)]))


@pytest.mark.parametrize("embedded", [True, False])
def test_an_fbx_has_all_its_meshes_and_their_textures(embedded, tmp_path):
    picture = png(np.zeros((4, 4)))
    path = tmp_path / "head.fbx"
    fbx_head(path, picture, embedded=embedded)
    found = read(path)
    names = [n.removesuffix("_lod0_mesh") for n in found.dna.mesh_names]
    assert names == ["head", "eyeLeft", "eyeRight"]
    assert list(found.dna.joint_names)[2:] == EYES
    assert np.ptp(centimetres(found.dna)[:, 1]) == pytest.approx(25, abs=0.1)
    looks = [found.materials[n].name for n in found.dna.mesh_names]
    assert looks == ["Skin", "Skin", "Iris"]  # the second half of the eyes is the right one
    skin = found.materials["head_lod0_mesh"]
    if embedded:
        assert skin.pictures == {"color": picture}
        return
    assert "its color texture is left out: skin.png was not found beside the FBX" in skin.notes[0]
    (tmp_path / "textures").mkdir()
    (tmp_path / "textures" / "skin.png").write_bytes(picture)
    assert read(path).materials["head_lod0_mesh"].pictures == {"color": picture}
