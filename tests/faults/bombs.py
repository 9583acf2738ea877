# SPDX-License-Identifier: MIT
"""Makes small files that would need much memory or time if readers had no limits."""

from __future__ import annotations

import json
import struct
import zlib
from collections.abc import Callable
from pathlib import Path

import fbx_files
import numpy as np
import risorius
from conftest import GOLDEN

MiB = 1 << 20


def fbx_arrays(path: Path) -> None:
    """Write an FBX of 10 MB with 40 compressed arrays, of which each unpacks to 256 MiB.

    The arrays are in records that no reader needs.
    """
    raw = zlib.compress(bytes(256 * MiB), 9)
    packed = b"d" + struct.pack("<III", 32 * MiB, 1, len(raw)) + raw
    inner = b"".join(_raw_record(b"Vertices", packed) for _ in range(40))
    head = b"Kaydara FBX Binary  \x00\x1a\x00" + struct.pack("<I", 7400)
    path.write_bytes(_placed(head, b"Objects", inner) + bytes(13))


_HEAD = struct.calcsize("<IIIB")


def _raw_record(name: bytes, values: bytes) -> bytes:
    """An FBX record whose end offset counts from its beginning; _placed() corrects the offset."""
    size = _HEAD + len(name) + len(values)
    return struct.pack("<IIIB", size, 1, len(values), len(name)) + name + values


def _placed(head: bytes, name: bytes, inner: bytes) -> bytes:
    """`head` and a record that contains `inner`; end offsets count from the file's beginning.

    Args:
        head: the beginning of the file.
        name: name of the record.
        inner: records of _raw_record(), concatenated.
    """
    start = len(head) + _HEAD + len(name)
    out, at = [], 0
    while at < len(inner):
        size, *rest = struct.unpack_from("<IIIB", inner, at)
        out.append(struct.pack("<IIIB", start + at + size, *rest) + inner[at + _HEAD : at + size])
        at += size
    end = start + len(inner) + _HEAD
    record = struct.pack("<IIIB", end, 0, 0, len(name)) + name
    return head + record + b"".join(out) + bytes(_HEAD)


def fbx_curve(path: Path) -> None:
    """An FBX with an animation curve of eight million equal keyframes."""
    curve = fbx_files.curve(1, np.zeros(8 * MiB), np.zeros(8 * MiB, "<f4"))
    tracks = [("Model/LimbNode", "jawOpen", "jawOpen", {"jawOpen": curve}, 0)]
    path.write_bytes(fbx_files.animation(tracks))


def glb_channels(path: Path, channels: int = 1200, keys: int = 200_000) -> None:
    """A GLB with many channels that share an accessor; each becomes a curve of its own."""
    views = [(0, 4 * keys), (4 * keys, keys)]
    document = {
        "asset": {"version": "2.0"},
        "buffers": [{"byteLength": 5 * keys}],
        "bufferViews": [{"buffer": 0, "byteOffset": a, "byteLength": n} for a, n in views],
        "accessors": [
            {"bufferView": 0, "componentType": 5126, "count": keys, "type": "SCALAR"},
            {"bufferView": 1, "componentType": 5121, "count": keys, "type": "SCALAR",
             "normalized": True},
        ],
        "nodes": [{"mesh": i} for i in range(channels)],
        "meshes": [
            {"primitives": [{"attributes": {}, "targets": [{}]}],
             "extras": {"targetNames": [f"s{i}"]}} for i in range(channels)
        ],
        "animations": [{
            "samplers": [{"input": 0, "output": 1}],
            "channels": [{"sampler": 0, "target": {"node": i, "path": "weights"}}
                         for i in range(channels)],
        }],
    }  # fmt: skip
    text = json.dumps(document).encode()
    text += b" " * (-len(text) % 4)
    body = np.arange(keys, dtype="<f4").tobytes() + bytes(keys)
    chunks = struct.pack("<I4s", len(text), b"JSON") + text
    chunks += struct.pack("<I4s", len(body), b"BIN\0") + body
    path.write_bytes(struct.pack("<4sII", b"glTF", 2, 12 + len(chunks)) + chunks)


def gap(path: Path) -> None:
    """A table of curves with two rows that are 30,000 years apart."""
    path.write_text("time,jawOpen\n0,0\n1e12,1\n")


def gap_granted(path: Path) -> None:
    """A table with two rows half a year apart; a system may grant the memory for all frames."""
    path.write_text("time,jawOpen,jawLeft\n0,0,0\n1.5e7,1,1\n")


def slow_rate(path: Path) -> None:
    """Audio2Face JSON with one frame per 10^300 seconds."""
    document = {"exportFps": 1e-300, "numPoses": 1, "numFrames": 2, "facsNames": ["jawOpen"]}
    path.write_text(json.dumps(document | {"weightMat": [[0], [1]]}))


def deep_toml(path: Path) -> None:
    """TOML with 100,000 nested lists."""
    path.write_text("x = " + "[" * 100_000 + "]" * 100_000)


def deep_json(path: Path) -> None:
    """JSON with 100,000 nested lists."""
    path.write_text("[" * 100_000 + "]" * 100_000)


def laughs(path: Path) -> None:
    """Rhubarb XML with nested entities that expand to 10^9 texts.

    Comment marks around the entities deceive a reader that removes comments by a text search.
    """
    entities = ['<!ENTITY a0 "lol">']
    entities += [f'<!ENTITY a{i} "{f"&a{i - 1};" * 10}">' for i in range(1, 10)]
    path.write_text(
        f"<?x <!-- ?><!DOCTYPE rhubarbResult [{''.join(entities)}]><?x --> ?><rhubarbResult>"
        '<mouthCues><mouthCue start="0" end="1">&a9;</mouthCue></mouthCues></rhubarbResult>'
    )


def rotation_order(path: Path) -> None:
    """A DNA file with an invalid rotation order."""
    facts = json.loads(risorius.load(GOLDEN / "core.dna").to_json())
    facts["dsce1.0"]["rotationSequence"] = 40
    risorius.Dna.from_json(json.dumps(facts)).save(path)


def _solvers(count: int, poses: list[int], outputs: int) -> risorius.Dna:
    """core.dna with RBF solvers added.

    Args:
        count: number of solvers.
        poses: indices of the poses of each solver.
        outputs: number of controls that each pose writes.
    """
    dna = risorius.load(GOLDEN / "core.dna")
    first = risorius.Rig(dna).control_count  # behind the correctives
    pose_count = max(poses) + 1
    dna.rbf_behavior = risorius.RbfBehavior(
        lod_solver_mapping=[range(count)] * dna.lod_count,
        solvers=[
            risorius.RbfSolver(
                name=f"s{i}", raw_control_indices=[first, 1, 2, 3], pose_indices=poses,
                raw_control_values=np.tile(np.float32([0, 0, 0, 1]), len(poses)),
                radius=1.0, weight_threshold=0.001,
            )
            for i in range(count)
        ],
        poses=[risorius.RbfPose(name=f"p{i}", scale=1.0) for i in range(pose_count)],
    )  # fmt: skip
    dna.rbf_behavior_ext = risorius.RbfBehaviorExt(
        pose_control_names=[f"c{i}" for i in range(outputs)],
        poses=[
            risorius.RbfPoseControls(
                input_control_indices=[],
                output_control_indices=first + np.arange(outputs),
                output_control_weights=np.ones(outputs, np.float32),
            )
            for _ in range(pose_count)
        ],
    )
    return dna


def rbf_product(path: Path) -> None:
    """A DNA file with a solver that names a pose 20,000 times; the pose writes 20,000 controls."""
    _solvers(1, [0] * 20_000, 20_000).save(path)


def graph(path: Path) -> None:
    """A DNA file with 12,000 solvers that all read and write the same control."""
    _solvers(12_000, [0], 1).save(path)


def gui_rows(path: Path) -> None:
    """A DNA file with a GUI table of a million rows, each with another range of values."""
    dna = risorius.load(GOLDEN / "core.dna")
    rows = 1_000_000
    begin = np.linspace(0, 0.5, rows, dtype=np.float32)
    dna.gui_to_raw = risorius.Conditionals(
        input_indices=np.zeros(rows, np.uint16), output_indices=np.zeros(rows, np.uint16),
        from_values=begin, to_values=begin + np.float32(0.5),
        slope_values=np.ones(rows, np.float32), cut_values=np.zeros(rows, np.float32),
    )  # fmt: skip
    dna.save(path)


def counts(path: Path) -> None:
    """A DNA file in whose second half huge numbers are written every 4096 bytes."""
    data = bytearray((GOLDEN / "core.dna").read_bytes())
    for at in range(len(data) // 2, len(data) - 4, 4096):
        data[at : at + 4] = b"\xff\xff\xff\xfe"
    path.write_bytes(data)


def wav(path: Path) -> None:
    """A WAV file whose header states a length of 4 GiB."""
    form = struct.pack("<HHIIHH", 1, 1, 16000, 32000, 2, 16)
    path.write_bytes(
        b"RIFF\xff\xff\xff\xffWAVEfmt " + struct.pack("<I", 16) + form + b"data\xff\xff\xff\xff"
    )


Bomb = tuple[str, Callable[[Path], None], list[str]]
# (name of the file, function that writes it, arguments of the command); FILE, OUT and CORE are
# replaced by paths.
BOMBS: list[Bomb] = [
    ("zip40.fbx", fbx_arrays, ["clip", "info", "FILE"]),
    ("keys.fbx", fbx_curve, ["clip", "info", "FILE"]),
    ("channels.glb", glb_channels, ["clip", "info", "FILE"]),
    ("gap.csv", gap, ["clip", "convert", "FILE", "-o", "OUT.csv", "--fill-gaps"]),
    ("gap_rate.csv", gap, ["clip", "convert", "FILE", "-o", "OUT.csv", "--rate", "60"]),
    ("gap_year.csv", gap_granted, ["clip", "convert", "FILE", "-o", "OUT.csv", "--rate", "60"]),
    ("fps0.json", slow_rate, ["clip", "info", "FILE"]),
    ("deep.json", deep_json, ["clip", "info", "FILE"]),
    ("deep_dna.json", deep_json, ["convert", "FILE", "OUT.dna"]),
    ("deep_mapping.toml", deep_toml, ["clip", "check", "FILE", "--rig", "CORE"]),
    ("deep_jobs.toml", deep_toml, ["batch", "FILE"]),
    ("laughs.xml", laughs, ["clip", "info", "FILE"]),
    ("order.dna", rotation_order, ["plot", "FILE", "-o", "OUT.png", "--dpi", "40"]),
    ("rbf_product.dna", rbf_product, ["eval", "FILE"]),
    ("graph.dna", graph, ["eval", "FILE"]),
    ("gui_rows.dna", gui_rows, ["eval", "FILE"]),
    ("counts.dna", counts, ["check", "FILE"]),
    ("long.wav", wav, ["speech", "FILE", "-o", "OUT.rzc"]),
]
