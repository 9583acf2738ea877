# SPDX-License-Identifier: MIT
"""Tests that readers refuse small files that demand much memory.

Each test makes such a file and reads it through the public readers. Its largest memory use is
measured by Python's count of allocations, which is the same on every machine.
"""

import json
import struct
import tracemalloc
import zlib

import fbx_files
import numpy as np
import pytest
import risorius
from risorius import Clip, ClipError, importing
from risorius.base.budget import BASE_BYTES, BYTES_PER_BYTE, Budget, BudgetError
from risorius.batch.jobs import JobsError, read_jobs
from risorius.cli import main
from risorius.importing import AnimationFileError, MappingError, process

MB = 1 << 20


def peak_of(work):
    """Run work(). Returns the largest number of additional bytes in use, and the error or None."""
    error = None
    tracemalloc.start()
    try:
        work()
    except risorius.RisoriusError as raised:
        error = raised
    finally:
        peak = tracemalloc.get_traced_memory()[1]
        tracemalloc.stop()
    return peak, error


def refused(path, words):
    """Check that a file is refused with these words. Returns the most additional bytes in use."""
    peak, error = peak_of(lambda: importing.read(path))
    assert isinstance(error, AnimationFileError), path
    assert str(error).startswith(str(path))
    assert words in str(error)
    assert peak <= BASE_BYTES + BYTES_PER_BYTE * path.stat().st_size
    return peak


def zeros_array(letter, count, size):
    """A compressed FBX array of zeros, which is a thousand times larger when it is unpacked."""
    packed = zlib.compress(bytes(count * size), 9)
    return letter + struct.pack("<III", count, 1, len(packed)) + packed


class Raw:
    """A value of an FBX property that is written as the given bytes, without a type letter."""

    def __init__(self, data):
        self.data = data


@pytest.fixture
def raw_values(monkeypatch):
    """Let fbx_files write an object of the class Raw as the bytes in it."""
    plain = fbx_files.value
    monkeypatch.setattr(fbx_files, "value", lambda v: v.data if isinstance(v, Raw) else plain(v))


def test_a_budget_stops_before_it_is_over():
    budget = Budget(100, 10)
    budget.hold(60, "first")
    with pytest.raises(BudgetError, match=r"^second: 41 bytes more than the 60 .* 100 in"):
        budget.hold(41, "second")
    budget.hold(40, "second")
    with pytest.raises(BudgetError, match=r"^far: inf steps more than the 0 done before .* 10"):
        budget.work(float("inf"), "far")
    with pytest.raises(BudgetError):
        budget.hold(float("nan"), "nowhere")
    assert BudgetError.code == "limit"


def test_arrays_of_an_fbx_that_nobody_asks_for_stay_folded(tmp_path, raw_values):
    path = tmp_path / "unused.fbx"
    bomb = Raw(zeros_array(b"d", 2 * MB, 8))
    extra = [("Objects", (), [("Model", (fbx_files.I64(10_000 + i), "m\0\1Model", "Mesh"),
                               [("Stuff", (bomb,))]) for i in range(20)])]  # fmt: skip
    path.write_bytes(fbx_files.fbx(extra))
    peak = refused(path, "expected, found none")
    assert peak < 4 * MB  # it would unpack to 320 MB


def test_curves_of_an_fbx_that_unfold_without_end_are_refused(tmp_path, raw_values):
    keys = 1 * MB
    times = Raw(zeros_array(b"l", keys, 8))
    values = Raw(zeros_array(b"f", keys, 4))
    objects, links = [], []
    for i in range(1, 12):
        curve, node, model = (fbx_files.I64(1000 * k + i) for k in (1, 2, 3))
        objects += [
            ("AnimationCurve", (curve, "c\0\1AnimCurve", ""),
             [("KeyTime", (times,)), ("KeyValueFloat", (values,))]),
            ("AnimationCurveNode", (node, "n\0\1AnimCurveNode", "")),
            ("Model", (model, f"m{i}\0\1Model", "Null")),
        ]  # fmt: skip
        links += [("C", ("OP", curve, node, f"d|p{i}")), ("C", ("OP", node, model, f"p{i}"))]
    path = tmp_path / "keys.fbx"
    path.write_bytes(fbx_files.fbx([("Objects", (), objects), ("Connections", (), links)]))
    assert path.stat().st_size < MB
    # The first curve is invalid, because its times do not ascend, so that no other curve is
    # unpacked.
    peak = refused(path, "key times that ascend were expected")
    assert peak < 40 * keys


def gltf_bomb(channels, keys):
    """A GLB with many channels, each for another morph target, which share an accessor."""
    times = np.arange(keys, dtype="<f4")
    body = times.tobytes() + np.zeros(keys, "<f4").tobytes()
    document = {
        "asset": {"version": "2.0"},
        "buffers": [{"byteLength": len(body)}],
        "bufferViews": [
            {"buffer": 0, "byteLength": 4 * keys},
            {"buffer": 0, "byteOffset": 4 * keys, "byteLength": 4 * keys},
        ],
        "accessors": [
            {"bufferView": i, "componentType": 5126, "count": keys, "type": "SCALAR"}
            for i in range(2)
        ],
        "meshes": [
            {"primitives": [{"targets": [{}]}], "extras": {"targetNames": [f"t{i}"]}}
            for i in range(channels)
        ],
        "nodes": [{"mesh": i} for i in range(channels)],
        "animations": [
            {
                "samplers": [{"input": 0, "output": 1}],
                "channels": [
                    {"sampler": 0, "target": {"node": i, "path": "weights"}}
                    for i in range(channels)
                ],
            }
        ],
    }
    text = json.dumps(document).encode()
    text += b" " * (-len(text) % 4)
    chunks = struct.pack("<I4s", len(text), b"JSON") + text
    chunks += struct.pack("<I4s", len(body), b"BIN\0") + body
    return struct.pack("<4sII", b"glTF", 2, 12 + len(chunks)) + chunks


def test_many_channels_on_one_accessor_of_a_gltf_are_refused(tmp_path):
    path = tmp_path / "channels.glb"
    path.write_bytes(gltf_bomb(300, 60_000))
    peak = refused(path, "300 curves of 60000 frames, from a key at 0 s to one at 59999 s")
    assert peak < 32 * MB  # the accessor is read once, not 300 times
    few = tmp_path / "few.glb"
    few.write_bytes(gltf_bomb(3, 100))
    assert importing.read(few).clip.frame_count == 100


def test_keys_far_apart_that_bend_are_refused(tmp_path):
    path = tmp_path / "far.fbx"
    curve = fbx_files.curve(7, [0.0, 1e8], [0.0, 1.0], fbx_files.CUBIC, np.ones((2, 2)))
    track = ("Model/Null", "face", "jawOpen", {"d|jawOpen": curve}, 0)
    path.write_bytes(fbx_files.animation([track]))
    assert refused(path, "from a key at 0 s to one at 1e+08 s") < 4 * MB


def test_frames_that_each_name_another_curve_are_refused(tmp_path):
    path = tmp_path / "names.json"
    frames = [{"time": i / 30, f"curve{i}": 1.0} for i in range(6000)]
    path.write_text(json.dumps({"frames": frames}))
    assert refused(path, "6000 curves of 6000 frames") < 64 * MB


def test_mouth_shapes_without_number_over_hours_are_refused(tmp_path):
    path = tmp_path / "shapes.dat"
    rows = [f"{1 + 400 * i} shape{i}" for i in range(400)]
    path.write_text("\n".join(["MohoSwitch1", *rows]) + "\n")
    assert refused(path, "400 mouth shapes of 399009 frames") < 4 * MB


@pytest.mark.parametrize("rate", ["1e-300", "1e300", "0", "-1"])
@pytest.mark.parametrize("form", ["matrix", "own"])
def test_a_frame_rate_that_is_none_is_refused(form, rate, tmp_path):
    path = tmp_path / "rate.json"
    texts = {
        "matrix": '{"exportFps": %s, "facsNames": ["jawOpen"], "weightMat": [[0], [1]]}',
        "own": '{"risorius_clip": 1, "rate": %s, "frames": 2, "curves": {"jawOpen": [0, 1]}}',
    }
    path.write_text(texts[form] % rate)
    with pytest.raises(AnimationFileError, match="frames a second above 0|finite number") as found:
        importing.read(path)
    assert len(str(found.value)) < 250 + len(str(path))


def test_a_whole_number_without_end_is_one_sentence(tmp_path):
    path = tmp_path / "long.json"
    path.write_text('{"fps": 30, "names": ["jawOpen"], "frames": [[1%s]]}' % ("0" * 400))
    with pytest.raises(AnimationFileError, match="a finite number was expected, found a long"):
        importing.read(path)
    path.write_text('{"fps": 30, "names": ["jawOpen"], "frames": [[1%s]]}' % ("0" * 9000))
    with pytest.raises(AnimationFileError, match="not JSON that can be read"):
        importing.read(path)


ENTITIES = "".join(f'<!ENTITY e{i} "{f"&e{i - 1};" * 10}">' for i in range(1, 8))


@pytest.mark.parametrize("hidden", ["%s", "<?a <!--?>%s<?b -->?>"])
def test_a_document_type_is_refused_however_it_is_hidden(hidden, tmp_path):
    path = tmp_path / "laughs.xml"
    declared = f'<!DOCTYPE rhubarbResult [<!ENTITY e0 "{"lol" * 20}">{ENTITIES}]>'
    path.write_text(
        f'<?xml version="1.0"?>{hidden % declared}<rhubarbResult><mouthCues>'
        '<mouthCue start="0" end="1">&e7;</mouthCue></mouthCues></rhubarbResult>'
    )
    assert refused(path, "XML without declarations of its own was expected") < 2 * MB


def test_comments_and_instructions_of_a_rhubarb_file_are_read(tmp_path):
    path = tmp_path / "plain.xml"
    path.write_text(
        '<?xml version="1.0"?><?tool x?><!-- <!DOCTYPE x> --><rhubarbResult><mouthCues>'
        '<mouthCue start="0" end="1">A</mouthCue></mouthCues></rhubarbResult>'
    )
    assert importing.read(path).clip.names == ("A",)


DEEP = {
    "array": "a = " + "[" * 100_000 + "]" * 100_000,
    "table": "a = " + "{b=" * 20_000 + "1" + "}" * 20_000,
    "key": ".".join("a" * 50_000) + " = 1",
    "header": "[" + " . ".join("a" * 50_000) + "]",
    "headers": "\n".join(f"[{'.'.join('ab'[:1] * n)}]" for n in range(1, 70)),
}


@pytest.mark.parametrize("deep", DEEP)
def test_toml_nested_without_end_is_one_sentence(deep, tmp_path):
    path = tmp_path / "deep.toml"
    path.write_text(DEEP[deep])
    with pytest.raises(MappingError, match="nested at most 64 deep was expected") as found:
        importing.load_mapping(path)
    assert len(str(found.value)) < 200 + len(str(path))
    with pytest.raises(JobsError, match="nested at most 64 deep"):
        read_jobs(path)


def test_a_mapping_that_makes_a_thousand_of_each_curve_is_refused(tmp_path):
    path = tmp_path / "m.toml"
    many = ", ".join(f"c{i} = 1.0" for i in range(3000))
    path.write_text(f"[rows]\njawOpen = {{ {many} }}\n")
    clip = Clip(["jawOpen"], np.ones((1, 20_000)), 60.0)
    found = importing.Imported(clip, "csv", "", "take.csv")
    peak, error = peak_of(lambda: found.apply(path))
    assert isinstance(error, BudgetError)
    assert "mapping m: " in str(error)
    assert peak <= BASE_BYTES + BYTES_PER_BYTE * clip.curves.nbytes
    patterns = "\n".join(f'"*x{i}" = {{ "y{i}*" = 1.0 }}' for i in range(1000))
    path.write_text(f"[rows]\n{patterns}\n")
    names = [f"name{i}" for i in range(1000)]
    found = importing.Imported(Clip(names, np.ones((1000, 2)), 60.0), "csv", "", "take.csv")
    with pytest.raises(BudgetError, match="1000 patterns"):
        found.apply(path)


def test_reading_an_fbx_needs_nothing_from_elsewhere(tmp_path, monkeypatch):
    def refuse(*_arguments, **_options):
        raise AssertionError

    monkeypatch.setattr("socket.socket", refuse)
    monkeypatch.setattr("subprocess.Popen", refuse)
    curve = fbx_files.curve(7, [0.0, 1.0], [0.0, 1.0])
    path = tmp_path / "take.fbx"
    path.write_bytes(
        fbx_files.animation([("Model/Null", "face", "jawOpen", {"d|jawOpen": curve}, 0)])
    )
    assert importing.read(path).clip.names == ("jawOpen",)


def test_toml_as_people_write_it_is_not_deep(tmp_path):
    path = tmp_path / "m.toml"
    rows = "\n".join(f'"a.b.c.{i}" = {{ jawOpen = 1.0 }}' for i in range(200))
    text = "1." * 63  # a string may contain many dots
    path.write_text(f'description = "{text}"\n[rows]\n{rows}\n')
    assert len(importing.load_mapping(path).rows) == 200


@pytest.mark.parametrize("options", [["--fill-gaps"], ["--rate", "60"]])
def test_a_gap_without_end_names_frame_time_and_what_to_do(options, tmp_path, capsys):
    path, out = tmp_path / "gap.csv", tmp_path / "out.rzc"
    path.write_text("time,jawOpen\n0,0\n0.5,1\n1e12,1\n")
    assert main(["clip", "convert", str(path), "-o", str(out), *options]) == 1
    said = capsys.readouterr().err
    assert said.startswith("risorius: frame 2 comes 1e+12 s after frame 1 at 0.5 s: ")
    assert "are the most of a clip of this size: mend the time, or cut the clip before" in said
    assert said.count("\n") == 1
    assert not out.exists()
    cut = tmp_path / "cut.rzc"
    assert main(["clip", "convert", str(path), "-o", str(cut), "--cut", "0:1"]) == 0
    assert main(["clip", "convert", str(cut), "-o", str(out), *options]) == 0


def test_resampling_gives_the_bits_that_one_sampling_of_all_frames_gives():
    rng = np.random.default_rng(5)
    times = np.cumsum(rng.uniform(0.001, 0.03, 3000))
    clip = Clip(["a", "b"], rng.random((2, 3000), np.float32), 60.0, start=times[0], times=times)
    even = clip.resampled(240.0)
    assert even.frame_count > 4096 * 2
    at = clip.start + np.arange(even.frame_count) / 240.0
    assert np.array_equal(even.curves, clip.sample(at).T)


def test_frames_that_can_be_held_are_made():
    clip = Clip(["jawOpen"], [[0.0, 1.0]], 30.0, times=[0.0, 3600.0])
    filled = process.fill_gaps(clip)
    assert filled.frame_count == 108001
    peak, error = peak_of(lambda: clip.resampled(1e6))
    assert isinstance(error, BudgetError)
    assert peak < MB


def test_a_window_longer_than_any_face_needs_is_refused():
    clip = Clip(["jawOpen"], np.zeros((1, 30_000)), 60.0)
    peak, error = peak_of(lambda: process.smooth(clip, 400.0))
    assert isinstance(error, BudgetError)
    assert peak < 2 * MB


def test_a_clip_that_unfolds_without_end_is_read_in_parts(monkeypatch):
    monkeypatch.setattr(risorius.anim.clip, "MOST_BYTES", MB)
    packed = Clip([f"c{i}" for i in range(100)], np.zeros((100, 10_000)), 60.0).to_bytes()
    assert len(packed) * 32 < 2 * MB
    peak, error = peak_of(lambda: Clip.load(packed))
    assert isinstance(error, ClipError)
    assert "read it in parts" in str(error)
    assert peak < MB
    assert Clip.load(packed, frames=(0, 1000)).frame_count == 1000
    assert Clip.load(packed, controls=["c7"]).frame_count == 10_000
