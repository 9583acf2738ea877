# SPDX-License-Identifier: MIT
"""Makes small valid inputs of all commands; mutants_of_inputs adds faults to them."""

from __future__ import annotations

import io
import json
import struct
import wave
from pathlib import Path
from typing import Any
from unittest import mock

import animation_files
import face_shapes
import fbx_files
import numpy as np
import risorius
from conftest import GOLDEN
from risorius import importing
from risorius.author.input import shape_face
from risorius.author.input.obj import ObjMesh


def _small_head() -> tuple[Any, Any, dict[str, Any]]:
    with mock.patch.multiple(face_shapes, ACROSS=7, DOWN=8):
        positions, faces = face_shapes.head()
        return positions, faces, face_shapes.expressions(positions)


def _face() -> risorius.Dna:
    positions, faces, moved = _small_head()
    uvs = (positions[:, :2] - positions[:, :2].min(axis=0)) / 30
    mesh = ObjMesh(positions, uvs, faces.tolist(), faces.tolist())
    shapes = shape_face.ShapeSet("egg", mesh, moved)
    return shape_face.make_shape_face(shapes, {name: [name] for name in moved})


def _npz(**arrays: Any) -> bytes:
    out = io.BytesIO()
    np.savez(out, **arrays)
    return out.getvalue()


def _glb(document: dict[str, Any], binary: bytes) -> bytes:
    text = json.dumps(document).encode()
    text += b" " * (-len(text) % 4)
    head = struct.pack("<4sII", b"glTF", 2, 28 + len(text) + len(binary))
    parts = struct.pack("<I4s", len(text), b"JSON") + text
    return head + parts + struct.pack("<I4s", len(binary), b"BIN\0") + binary


def _glb_head() -> bytes:
    """Bytes of a GLB: a small head with its expressions as morph targets."""
    positions, faces, moved = _small_head()
    triangles = np.concatenate([faces[:, [0, 1, 2]], faces[:, [0, 2, 3]]])
    arrays = [triangles.astype("<u2").reshape(-1, 1), positions.astype("<f4")]
    arrays += [delta.astype("<f4") for delta in moved.values()]
    binary, views, accessors = b"", [], []
    for number, array in enumerate(arrays):
        views.append({"buffer": 0, "byteOffset": len(binary), "byteLength": array.nbytes})
        accessors.append({
            "bufferView": number, "count": len(array), "componentType": 5126 if number else 5123,
            "type": "VEC3" if number else "SCALAR",
        })  # fmt: skip
        binary += array.tobytes() + bytes(-array.nbytes % 4)
    document = {
        "asset": {"version": "2.0"}, "buffers": [{"byteLength": len(binary)}],
        "bufferViews": views, "accessors": accessors,
        "nodes": [{"mesh": 0, "rotation": [0, 0, 0, 1], "scale": [1, 1, 1]}],
        "meshes": [{
            "name": "Egg", "extras": {"targetNames": list(moved)},
            "primitives": [{
                "attributes": {"POSITION": 1}, "indices": 0, "mode": 4,
                "targets": [{"POSITION": 2 + i} for i in range(len(moved))],
            }],
        }],
    }  # fmt: skip
    return _glb(document, binary)


def _glb_take() -> bytes:
    """Bytes of a GLB with animated weights of morph targets."""
    times = np.arange(8, dtype="<f4") / 30
    binary = times.tobytes() + np.linspace(0, 1, 16, dtype="<f4").tobytes()
    document = {
        "asset": {"version": "2.0"}, "buffers": [{"byteLength": len(binary)}],
        "bufferViews": [{"buffer": 0, "byteOffset": 0, "byteLength": 32},
                        {"buffer": 0, "byteOffset": 32, "byteLength": 64}],
        "accessors": [{"bufferView": i, "componentType": 5126, "count": n, "type": "SCALAR"}
                      for i, n in enumerate((8, 16))],
        "nodes": [{"mesh": 0, "name": "head"}],
        "meshes": [{"primitives": [{"attributes": {}, "targets": [{}, {}]}], "name": "head",
                    "extras": {"targetNames": ["jawOpen", "jawLeft"]}}],
        "animations": [{"name": "take", "samplers": [{"input": 0, "output": 1}],
                        "channels": [{"sampler": 0, "target": {"node": 0, "path": "weights"}}]}],
    }  # fmt: skip
    return _glb(document, binary)


def _wav() -> bytes:
    out = io.BytesIO()
    with wave.open(out, "wb") as file:
        file.setparams((1, 2, 16000, 0, "NONE", ""))
        file.writeframes((3000 * np.sin(np.arange(1600) / 20)).astype("<i2").tobytes())
    return out.getvalue()


def make_inputs(folder: Path) -> dict[str, bytes]:
    """Name -> bytes of the valid input files of all trials."""
    core = (GOLDEN / "core.dna").read_bytes()
    dna = risorius.load(core)
    names = dna.raw_control_names
    frames = 6
    curves = np.linspace(0, 1, len(names) * frames, dtype=np.float32).reshape(len(names), frames)
    clip = risorius.Clip(names, curves, 30.0)
    clip.save(folder / "clip.rzc")
    face = _face()
    positions, faces, moved = _small_head()
    cues = [(0.0, 0.2, "X"), (0.2, 0.4, "D"), (0.4, 0.6, "B")]
    rows = animation_files.capture(4)
    times = np.arange(4) / 30
    key = fbx_files.curve(1, np.arange(4) / 30, np.linspace(0, 1, 4, dtype="<f4"))
    track = ("Model/LimbNode", "jawOpen", "jawOpen", {"jawOpen": key}, 0)
    out = {
        "core.dna": core,
        "core.json": dna.to_json().encode(),
        "face.dna": face.to_bytes(),
        "clip.rzc": (folder / "clip.rzc").read_bytes(),
        "take.csv": importing.csv_text(clip).encode(),
        "take.json": importing.json_text(clip).encode(),
        "curves.json": animation_files.unreal_animation({"jawOpen": {0.0: 0.0, 1.0: 1.0}}).encode(),
        "table.json": animation_files.unreal_curve_table({"jawOpen": {0.0: 0.1, 1.0: 1}}).encode(),
        "a2f.json": animation_files.audio2face_json(rows, animation_files.COLUMNS).encode(),
        "a2f.csv": animation_files.audio2face_csv(rows, animation_files.COLUMNS, times).encode(),
        "mouth.tsv": animation_files.rhubarb_tsv(cues).encode(),
        "mouth.xml": animation_files.rhubarb_xml(cues).encode(),
        "mouth.json": animation_files.rhubarb_json(cues).encode(),
        "mouth.pgo": animation_files.papagayo_pgo().encode(),
        "pgo.json": animation_files.papagayo_pgo_json().encode(),
        "mouth.dat": animation_files.moho_dat().encode(),
        "take.glb": _glb_take(),
        "take.fbx": fbx_files.animation([track]),
        "map.toml": b'base = "arkit"\nprefix = "CTRL_expressions."\nmatching = "loose"\n'
        b'[rows]\njawOpen = { jawOpen = 1.0 }\nmouth = "aa"\n"eye*" = { "x*" = 0.5 }\n'
        b"[controls]\njawOpen = { gain = 1.5, offset = 0.1, curve = [[0, 0], [1, 2]] }\n",
        "jobs.toml": b'output = "out"\n[[jobs]]\nclips = "take.csv"\ncharacters = "core.dna"\n'
        b'lods = [0, 1]\nwrite = ["npz", "csv"]\nrate = 30\nframes = [0, 4]\n'
        b'mapping = "map.toml"\n',
        "person.toml": b'like = "man"\nname = "own"\nage = 30\nskin = [0.5, 0.4, 0.3]\n'
        b"muscle = 0.5\n[origin]\ncaucasian = 0.5\nafrican = 0.5\n[features]\n",
        "rig.toml": b"[joints]\ncount = 9\nrounds = 3\n[lods]\ncount = 2\n[correctives]\nmost = 2",
        "licence.toml": b'name = "Anna"\nauthors = ["Somebody"]\navatarPermission = "everyone"\n'
        b'allowExcessivelyViolentUsage = false\nallowExcessivelySexualUsage = false\n'
        b'commercialUsage = "corporation"\nallowPoliticalOrReligiousUsage = false\n'
        b'allowAntisocialOrHateUsage = false\ncreditNotation = "required"\n'
        b'allowRedistribution = true\nmodification = "prohibited"\n',
        "regions.json": json.dumps({"a": dna.joint_names[:2], "b": [2]}).encode(),
        "frames.npz": _npz(vertices=np.repeat(positions[None], 3, axis=0).astype("<f4"), rate=30.0),
        "voice.wav": _wav(),
        "said.txt": b"hum hum",
        "neutral.obj": b"", "shapes/jawOpen.obj": b"", "shapes/mouthSmileLeft.obj": b"",
        "head.glb": _glb_head(),
        "spec.toml": b'name = "egg"\n[source]\nneutral = "neutral.obj"\nexpressions = "shapes"\n'
        b"[joints]\ncount = 3\nrounds = 0\ninfluences = 2\nsmoothness = 1.0\nemphasis = 1.0\n"
        b"[shapes]\ntolerance_mm = 0.5\nkeep = true\n[lods]\ncount = 2\nvertices = [56, 30]\n"
        b'[controls]\njawOpen = "jawOpen"\n',
        "spec_glb.toml": b'[source]\nneutral = "head.glb"\nmesh = "Egg"\n[joints]\ncount = 3\n'
        b"rounds = 0\n",
        "spec_dna.toml": b'[source]\ndna = "face.dna"\n[joints]\ncount = 3\nrounds = 0\n',
    }  # fmt: skip
    for name, delta in {"neutral": 0, "shapes/jawOpen": moved["jawOpen"],
                        "shapes/mouthSmileLeft": moved["mouthSmileLeft"]}.items():  # fmt: skip
        path = folder / "mesh.obj"
        face_shapes.write_obj(path, positions + delta, faces)
        out[f"{name}.obj"] = path.read_bytes()
    return out
