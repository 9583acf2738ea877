# SPDX-License-Identifier: MIT
"""Tests glTF, GLB and FBX: files of Blender's exporters, and made files for other features."""

from __future__ import annotations

import base64
import json
import struct

import fbx_files as fbx
import numpy as np
import pytest
from conftest import PROJECT
from risorius import importing

DATA = PROJECT / "tests" / "data" / "importing"
RIG = "CTRL_expressions."
# The keyframes that make_blender_files.py sets: frame -> value, with linear interpolation.
KEYS = {
    "jawOpen": {1: 0.0, 11: 1.0, 31: 0.25},
    "eyeBlinkLeft": {1: 1.0, 31: 0.0},
    "mouthSmile_R": {1: 0.0},
}


@pytest.mark.parametrize("name", ["blender.glb", "blender.fbx"])
def test_blenders_own_files(name):
    found = importing.read(DATA / name)
    assert found.mapping == "arkit"
    assert found.clip.names == tuple(KEYS)
    assert (found.clip.rate, found.clip.frame_count) == (30.0, 31)
    frames = 1 + np.arange(31)
    for shape, keys in KEYS.items():
        expected = np.interp(frames, list(keys), list(keys.values()))
        np.testing.assert_allclose(found.clip.curve(shape), expected, atol=1e-6)
    clip, report = found.apply()
    assert report.unmapped == []
    assert RIG + "eyeBlinkL" in clip.names


def parts_of_glb():
    data = (DATA / "blender.glb").read_bytes()
    size = struct.unpack_from("<I", data, 12)[0]
    return json.loads(data[20 : 20 + size]), data[28 + size :]


def glb(document, binary):
    text = json.dumps(document).encode()
    text += b" " * (-len(text) % 4)
    chunks = struct.pack("<I4s", len(text), b"JSON") + text
    chunks += struct.pack("<I4s", len(binary), b"BIN\0") + binary
    return struct.pack("<4sII", b"glTF", 2, 12 + len(chunks)) + chunks


@pytest.mark.parametrize("where", ["beside", "inside"])
def test_gltf_with_its_buffer_beside_or_inside(tmp_path, where):
    document, binary = parts_of_glb()
    document["buffers"][0]["uri"] = (
        "the%20buffer.bin"
        if where == "beside"
        else "data:application/octet-stream;base64," + base64.b64encode(binary).decode()
    )
    (tmp_path / "the buffer.bin").write_bytes(binary)
    (tmp_path / "a.gltf").write_text(json.dumps(document))
    clip = importing.read(tmp_path / "a.gltf").clip
    np.testing.assert_array_equal(clip.curves, importing.read(DATA / "blender.glb").clip.curves)


def small(times, values, channel, way="LINEAR", kind=5126):
    """A glTF with a sampler, and a mesh with two morph targets: (document, bytes of its buffer).

    Args:
        times: times of the keys in seconds.
        values: output values of the sampler in the file's order.
        channel: JSON of the channel's target.
        way: interpolation: LINEAR, STEP or CUBICSPLINE.
        kind: component type of the values: 5126 (float32) or 5121 (uint8, normalized).
    """
    dtype = {5126: "<f4", 5121: "<u1"}[kind]
    first, second = np.array(times, "<f4").tobytes(), np.array(values, dtype).tobytes()
    binary = first + second
    document = {
        "asset": {"version": "2.0"},
        "nodes": [{"mesh": 0}],
        "meshes": [
            {
                "primitives": [{"attributes": {}, "targets": [{}, {}]}],
                "extras": {"targetNames": ["jawOpen", "jawLeft"]},
            }
        ],
        "buffers": [{"byteLength": len(binary)}],
        "bufferViews": [
            {"buffer": 0, "byteLength": len(first)},
            {"buffer": 0, "byteOffset": len(first), "byteLength": len(second)},
        ],
        "accessors": [
            {"bufferView": 0, "componentType": 5126, "count": len(times), "type": "SCALAR"},
            {
                "bufferView": 1,
                "componentType": kind,
                "normalized": True,
                "count": len(values),
                "type": "SCALAR",
            },
        ],
        "animations": [
            {
                "name": "Talk",
                "samplers": [{"input": 0, "output": 1, "interpolation": way}],
                "channels": [{"sampler": 0, "target": dict(channel)}],
            }
        ],
    }
    return document, binary


WEIGHTS = {"node": 0, "path": "weights"}


def pointer(path):
    return {"path": "pointer", "extensions": {"KHR_animation_pointer": {"pointer": path}}}


def read_small(tmp_path, *args, **options):
    (tmp_path / "a.glb").write_bytes(glb(*small(*args, **options)))
    return importing.read(tmp_path / "a.glb")


def test_whole_numbers_are_fractions(tmp_path):
    clip = read_small(tmp_path, [0, 1], [0, 255, 51, 0], WEIGHTS, kind=5121).clip
    np.testing.assert_allclose(clip.curve("jawOpen"), [0, 0.2], atol=1e-7)
    np.testing.assert_allclose(clip.curve("jawLeft"), [1, 0], atol=1e-7)


def test_steps_and_splines_are_sampled(tmp_path):
    clip = read_small(tmp_path, [0, 0.5, 1], [0, 1, 1, 0, 0, 1], WEIGHTS, "STEP").clip
    at = clip.frame_times()
    np.testing.assert_array_equal(clip.curve("jawOpen"), np.where((at >= 0.5) & (at < 1), 1, 0))
    # For each of two keys, the in-slopes, values and out-slopes of two curves: 3 t^2 - 2 t^3 with
    # flat ends, and t with slope 1. Slopes before the first and after the last key (9) are ignored.
    values = [9, 9, 0, 0, 0, 1, 0, 1, 1, 1, 9, 9]
    clip = read_small(tmp_path, [0, 1], values, WEIGHTS, "CUBICSPLINE").clip
    at = clip.frame_times()
    assert at.size == 61
    np.testing.assert_allclose(clip.curve("jawOpen"), 3 * at**2 - 2 * at**3, atol=1e-6)
    np.testing.assert_allclose(clip.curve("jawLeft"), at, atol=1e-6)


@pytest.mark.parametrize(
    ("path", "name"),
    [
        ("/nodes/0/extras/CTRL_expressions_jawOpen", "CTRL_expressions_jawOpen"),
        ("/nodes/0/weights/1", "jawLeft"),
        ("/meshes/0/weights/0", "jawOpen"),
        ("/nodes/0/extras/a~1b", "a/b"),
    ],
)
def test_pointers_move_properties_and_single_weights(tmp_path, path, name):
    clip = read_small(tmp_path, [0, 1], [0.25, 0.5], pointer(path)).clip
    assert clip.names == (name,)
    assert clip.curves.tolist() == [[0.25, 0.5]]


def damaged(change):
    document, binary = small([0, 1], [0, 1, 1, 0], WEIGHTS)
    change(document)
    return glb(document, binary)


@pytest.mark.parametrize(
    ("change", "sentence"),
    [
        (lambda d: d.pop("animations"), "an animation was expected, found none"),
        (lambda d: d["accessors"][1].update(count=3), "4 values for 2 targets and 2 keys"),
        (lambda d: d["accessors"][1].update(count=5), "bytes from 0 of bufferViews.1. were"),
        (lambda d: d["accessors"][0].update(count=3), "12 bytes from 0 of bufferViews.0. were"),
        (lambda d: d["accessors"][0].update(type="VEC3"), "numbers one by one were expected"),
        (lambda d: d["animations"][0]["channels"][0].update(sampler=7), "a sampler was expected"),
        (lambda d: d["nodes"].clear(), r"nodes\[0\] was expected, there are 0"),
        (lambda d: d["buffers"][0].update(uri="../a.bin"), "a file beside this one was expected"),
        (lambda d: d["buffers"][0].update(uri="/a.bin"), "a file beside this one was expected"),
        (lambda d: d["buffers"][0].update(uri="data:,%%%"), "base64 was expected"),
        (lambda d: d["buffers"][0].update(uri=7), "a uri was expected, found 7"),
        (lambda d: d["accessors"][1].update(count=True), "count: a whole number was expected"),
        (lambda d: d["accessors"][1].update(sparse={}), "that is not sparse was expected"),
        (lambda d: d["bufferViews"][0].update(byteStride=16), "numbers close together were"),
        (lambda d: d["animations"][0].pop("channels"), "channels were expected"),
        (lambda d: d["animations"][0]["channels"][0].pop("target"), "a target was expected"),
        (lambda d: d["animations"][0].pop("samplers"), "a sampler was expected, found 0"),
        (lambda d: d["animations"][0]["samplers"][0].update(interpolation=[]),
         "one of STEP, LINEAR, CUBICSPLINE was expected, found a list"),
        (lambda d: d["accessors"][1].update(componentType=[]), "numbers one by one were expected"),
        (lambda d: d["animations"][0]["samplers"][0].update(interpolation="BEZIER"),
         "LINEAR.* was expected, found 'BEZIER'"),
        (lambda d: d["animations"][0]["channels"][0].update(target=pointer("/nodes/0/weights/2")),
         "a weight of 2 was expected, found '/nodes/0/weights/2'"),
        (lambda d: d["asset"].update(version="1.0"), "glTF of version 2 was expected, found '1.0'"),
        (lambda d: d["animations"][0]["channels"][0]["target"].update(path="rotation"),
         "animated morph targets or properties were expected, found none"),
    ],
)  # fmt: skip
def test_odd_gltf_is_one_sentence(tmp_path, change, sentence):
    (tmp_path / "a.glb").write_bytes(damaged(change))
    with pytest.raises(importing.AnimationFileError, match=sentence) as caught:
        importing.read(tmp_path / "a.glb")
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("data", "sentence"),
    [
        (b"glTF\2\0\0\0", "a GLB's header was expected, found 8 bytes"),
        (b"glTF" + struct.pack("<II", 3, 20) + bytes(8), "GLB of version 2 was expected, found 3"),
        (b"glTF" + struct.pack("<II", 2, 99) + bytes(8), "99 bytes were expected, found 20"),
        (
            b"glTF" + struct.pack("<IIII", 2, 20, 50, 0),
            "a chunk of 50 bytes at byte 12 ends beyond",
        ),
        (
            b"glTF" + struct.pack("<III4s", 2, 20, 0, b"BIN\0"),
            "a JSON chunk was expected, found none",
        ),
        (b"glTF" + struct.pack("<III4s", 2, 24, 4, b"JSON") + b'{"\xff}', r"in UTF-8 .*\(byte 2\)"),
    ],
)
def test_odd_glb_is_one_sentence(tmp_path, data, sentence):
    (tmp_path / "a.glb").write_bytes(data)
    with pytest.raises(importing.AnimationFileError, match=sentence) as caught:
        importing.read(tmp_path / "a.glb")
    assert "\n" not in str(caught.value)


def test_two_meshes_of_one_name_keep_the_first_and_say_so(tmp_path):
    document, binary = small([0, 1], [0, 1, 1, 0], WEIGHTS)
    (animation,) = document["animations"]
    animation["channels"].append({"sampler": 0, "target": dict(WEIGHTS)})
    (tmp_path / "a.glb").write_bytes(glb(document, binary))
    done = importing.read(tmp_path / "a.glb")
    assert not any("another mesh" in note for note in done.notes)  # the other mesh moves equally
    animation["samplers"].append({"input": 0, "output": 1, "interpolation": "STEP"})
    document["accessors"].append(document["accessors"][1] | {"byteOffset": 0})
    animation["samplers"][1]["output"] = 2
    document["bufferViews"].append(document["bufferViews"][1] | {"byteOffset": 4})
    document["accessors"][2]["bufferView"] = 2
    animation["channels"][1]["sampler"] = 1
    (tmp_path / "a.glb").write_bytes(glb(document, binary + bytes(16)))
    done = importing.read(tmp_path / "a.glb")
    assert done.clip.curve("jawOpen").tolist()[-1] == 1.0
    assert any("another mesh moves it differently" in note for note in done.notes)


def test_channels_that_turn_a_node_are_counted_and_left_out(tmp_path):
    document, binary = small([0, 1], [0, 1, 1, 0], WEIGHTS)
    channels = document["animations"][0]["channels"]
    for said in ([], ["1 channel(s) move nodes, not shapes or properties: left out"]):
        (tmp_path / "a.glb").write_bytes(glb(document, binary))
        notes = importing.read(tmp_path / "a.glb").notes
        assert [note for note in notes if "move nodes" in note] == said
        channels.append({**channels[0], "target": {"node": 0, "path": "rotation"}})


def test_the_animation_is_chosen_by_name_or_number(tmp_path):
    document, binary = small([0, 1], [0, 1, 1, 0], WEIGHTS)
    document["animations"].append({**document["animations"][0], "name": "Sing"})
    (tmp_path / "a.glb").write_bytes(glb(document, binary))
    for take in ("Sing", "1"):
        assert importing.read(tmp_path / "a.glb", take=take).clip.metadata["take"] == "Sing"
    found = importing.read(tmp_path / "a.glb")
    assert "animation Talk is taken of 2: Talk, Sing" in found.notes
    with pytest.raises(ValueError, match="an animation 'Hum' was expected"):
        importing.read(tmp_path / "a.glb", take="Hum")


def read_fbx(tmp_path, tracks, **options):
    (tmp_path / "a.fbx").write_bytes(fbx.animation(tracks, **options))
    return importing.read(tmp_path / "a.fbx")


def prop(name, made, stack=0, node="root"):
    return ("Model/LimbNode", node, name, {f"d|{name}": made}, stack)


@pytest.mark.parametrize("version", [7300, 7400, 7500, 7700])
def test_unreals_curves_are_properties_of_a_bone(tmp_path, version):
    at = np.arange(61) / 60
    values = np.float32(0.5 + 0.5 * np.sin(at * 7))
    jaw, blink = fbx.curve(1, at, values), fbx.curve(2, at, values[::-1])
    tracks = [prop("CTRL_expressions_jawOpen", jaw), prop("CTRL_expressions_eyeBlinkL", blink)]
    move = {f"d|{axis}": fbx.curve(10 + i, at, values) for i, axis in enumerate("XYZ")}
    tracks.append(("Model/LimbNode", "root", "Lcl Translation", move, 0))
    found = read_fbx(tmp_path, tracks, version=version)
    assert (found.mapping, found.clip.rate, found.clip.frame_count) == ("controls", 60.0, 61)
    assert any(note.startswith("1 track(s) move nodes") for note in found.notes)
    clip, report = found.apply()
    np.testing.assert_array_equal(clip.curve(RIG + "jawOpen"), values)
    np.testing.assert_array_equal(clip.curve(RIG + "eyeBlinkL"), values[::-1])
    assert report.unmapped == []


def test_a_face_boards_sliders_and_a_channels_percent(tmp_path):
    at = [0.0, 1.0]
    place = {"d|X": fbx.curve(1, at, [0, -1]), "d|Y": fbx.curve(2, at, [0, 0.5])}
    tracks = [
        ("Model/Null", "rig:CTRL_C_jaw", "Lcl Translation", place, 0),
        ("Deformer/BlendShapeChannel", "Face.jawOpen", "DeformPercent",
         {"d|DeformPercent": fbx.curve(3, at, [0, 100])}, 0),
    ]  # fmt: skip
    clip = read_fbx(tmp_path, tracks).clip
    assert clip.names == ("CTRL_C_jaw.tx", "CTRL_C_jaw.ty", "Face.jawOpen")
    assert clip.curves[:, -1].tolist() == [-1.0, 0.5, 1.0]


def test_what_moves_chooses_the_mapping(tmp_path):
    still = {f"d|{axis}": fbx.curve(i, [0, 1], [0, 0]) for i, axis in enumerate("XYZ")}
    tracks = [("Model/Null", "CTRL_C_jaw", "Lcl Translation", still, 0)]
    found = read_fbx(tmp_path, [*tracks, prop("jawOpen", fbx.curve(9, [0, 1], [0, 1]))])
    assert found.mapping == "arkit"


def test_key_times_are_exact_after_an_hour(tmp_path):
    clip = read_fbx(tmp_path, [prop("a", fbx.curve(1, [0.0, 4000.0], [0, 1]))]).clip
    assert clip.duration == pytest.approx(4000.0, abs=1e-9)


def test_cubic_and_constant_keys_are_sampled(tmp_path):
    slopes = np.zeros((2, 2))
    smooth = fbx.curve(1, [0, 1], [0, 1], fbx.CUBIC | fbx.USER, slopes)
    slanted = fbx.curve(2, [0, 1], [0, 1], fbx.CUBIC | fbx.USER, [[2.0, 0.5], [7.0, 7.0]])
    step = fbx.curve(3, [0, 0.5, 1], [0, 1, 0], fbx.CONSTANT)
    auto = fbx.curve(4, [0, 0.5, 1], [0, 0.5, 1], fbx.CUBIC | fbx.AUTO)
    tracks = [prop(name, c) for name, c in zip("abcd", (smooth, slanted, step, auto), strict=True)]
    clip = read_fbx(tmp_path, tracks).clip
    at = clip.frame_times()
    assert at.size == 61
    np.testing.assert_allclose(clip.curve("a"), 3 * at**2 - 2 * at**3, atol=1e-6)
    # b is the cubic curve from 0 to 1 with slope 2 at its start and 0.5 at its end.
    np.testing.assert_allclose(clip.curve("b"), 2 * at - 1.5 * at**2 + 0.5 * at**3, atol=1e-6)
    np.testing.assert_array_equal(clip.curve("c"), np.where((at >= 0.5) & (at < 1), 1, 0))
    np.testing.assert_allclose(clip.curve("d"), at, atol=1e-6)


def test_stacks_are_chosen_by_name(tmp_path):
    tracks = [
        prop("a", fbx.curve(1, [0, 1], [0, 1])),
        prop("a", fbx.curve(2, [0, 1], [5, 6]), 1, "x"),
    ]
    data = fbx.animation(tracks, stacks=("Talk", "Sing"))
    (tmp_path / "a.fbx").write_bytes(data)
    assert importing.read(tmp_path / "a.fbx").clip.curves.tolist() == [[0, 1]]
    assert importing.read(tmp_path / "a.fbx", take="Sing").clip.curves.tolist() == [[5, 6]]
    with pytest.raises(ValueError, match="an animation 'Hum' was expected"):
        importing.read(tmp_path / "a.fbx", take="Hum")


@pytest.mark.parametrize(
    ("data", "sentence"),
    [
        (
            b"; FBX 7.4.0 project file\nFBXHeaderExtension:  {\n",
            "a binary FBX was expected, found one",
        ),
        (b"Kaydara FBX Binary  \x00\x1a\x00", "byte 23: a header of 27 bytes was expected"),
        (fbx.fbx([], 6100), "byte 23: FBX 7.1 to 8.x was expected, found 6100"),
        (fbx.fbx([]), "were expected, found none"),
        (
            fbx.animation([prop("a", fbx.curve(1, [0, 1], [0]))]),
            "animation curve 1: 2 values were expected, found 1",
        ),
        (
            fbx.animation([prop("a", fbx.curve(1, [1, 1], [0, 1]))]),
            "animation curve 1: key times that ascend were expected",
        ),
        (
            fbx.animation([prop("a", fbx.curve(1, [0, 1], [0, np.nan]))]),
            "animation curve 1: finite values were expected",
        ),
    ],
)
def test_odd_fbx_is_one_sentence(tmp_path, data, sentence):
    (tmp_path / "a.fbx").write_bytes(data)
    with pytest.raises(importing.AnimationFileError, match=sentence) as caught:
        importing.read(tmp_path / "a.fbx")
    assert "\n" not in str(caught.value)


def test_an_array_that_unpacks_to_more_than_it_says_is_refused(tmp_path):
    data = fbx.animation([prop("a", fbx.curve(1, np.arange(100) / 30, np.zeros(100)))])
    at = data.index(b"KeyTime") + 8
    (tmp_path / "a.fbx").write_bytes(data[:at] + struct.pack("<I", 90) + data[at + 4 :])
    with pytest.raises(importing.AnimationFileError, match=r"byte \d+: 720 bytes of an array"):
        importing.read(tmp_path / "a.fbx")


@pytest.mark.parametrize("name", ["blender.fbx", "blender.glb", "own.fbx"])
def test_cut_and_damaged_files_never_end_in_anything_but_a_sentence(tmp_path, name):
    rng = np.random.default_rng(6)
    own = fbx.animation([prop("a", fbx.curve(1, [0, 1], [0, 1]))], version=7500)
    whole = own if name == "own.fbx" else (DATA / name).read_bytes()
    outcomes = {True: 0, False: 0}
    for i in range(120):
        data = bytearray(whole)
        if i % 4 == 0:
            data = data[: int(rng.integers(30, len(data)))]
        else:
            for _ in range(int(rng.integers(1, 8))):
                data[int(rng.integers(27, len(data)))] = int(rng.integers(0, 256))
        (tmp_path / "x").write_bytes(data)
        try:
            importing.read(tmp_path / "x")
            outcomes[True] += 1
        except importing.AnimationFileError as error:
            assert "\n" not in str(error)
            outcomes[False] += 1
    assert outcomes[False] > 20
