# SPDX-License-Identifier: MIT
"""How far sums of morph targets are from the rig on the frames of a take."""

import json

import numpy as np
import risorius
from gltf_oracle import GlbFile
from risorius import importing
from risorius.controls import arkit
from risorius.gameface import Wishes, export


def units_of(take):
    """The 52 units of each frame, {name: value}, of a take of Live Link Face."""
    clip = importing.read(take).clip
    lower = {name.lower(): row for name, row in zip(clip.names, clip.curves, strict=True)}
    rows = {unit: lower[unit.lower()] for unit in arkit.mapping()}
    return [{u: float(row[i]) for u, row in rows.items()} for i in range(clip.frame_count)]


def driven(weights, table):
    """Weights with those of the combinations, as combinations.js sets them."""
    out = dict(weights)
    for row in table["combinations"]:
        inside = np.clip([weights[name] for name in row["of"]], 0, 1)
        half = row["weight"] == "half"
        out[row["target"]] = float(4 * inside[0] * (1 - inside[0]) if half else np.prod(inside))
    return out


def frames(path, take, folder, *, lod=1, every=100, wishes=None):
    """For each looked-at frame: its number, mm of the sum and of the driven sum against the rig."""
    dna, rig = risorius.load(path), risorius.compile_cached(path)
    wishes = wishes or Wishes(shapes=("arkit",), lod=lod, within=0.5)
    result = export(dna, rig, path, "face.glb", wishes)
    for name, data in result.files.items():
        (folder / name).write_bytes(data)
    table = json.loads(result.files["face.combinations.json"])
    found = GlbFile(result.files["face.glb"])
    clip, _ = importing.import_file(take, rig.raw_control_names, mapping="arkit")
    surface = risorius.Surface(dna, rig, lod)
    of_name = {name: i for i, name in enumerate(dna.mesh_names)}
    deltas, where, rest = {}, {}, {}
    for mesh in found.meshes():
        names = found.names(mesh)
        if names:
            rest[mesh] = found.positions(mesh)
            deltas[mesh] = np.stack([found.positions(mesh, {n: 1.0}) - rest[mesh] for n in names])
            own = surface.positions(rig.initial_raw_controls, of_name[mesh]).astype(float) / 100
            where[mesh] = nearest(own, rest[mesh])
    out, column = [], {n: i for i, n in enumerate(rig.raw_control_names)}
    units = units_of(take)
    for frame in range(0, len(units), every):
        raw = rig.initial_raw_controls.copy()
        for name, curve in zip(clip.names, clip.curves, strict=True):
            if name in column:
                raw[column[name]] = curve[frame]
        row = {"frame": frame}
        for key, weights in (("sum", units[frame]), ("driven", driven(units[frame], table))):
            worst = 0.0
            for mesh, delta in deltas.items():
                on = np.array([weights.get(n, 0.0) for n in found.names(mesh)])
                client = rest[mesh] + np.tensordot(on, delta, 1)
                own = surface.positions(raw, of_name[mesh]).astype(float)[where[mesh]] / 100
                worst = max(worst, 1000 * float(np.linalg.norm(client - own, axis=1).max()))
            row[key] = worst
        out.append(row)
    return out


def nearest(points, wanted):
    """int64[n]: of each wanted place the point that is there; points of one place move alike."""
    out = np.empty(len(wanted), np.int64)
    for begin in range(0, len(wanted), 256):
        part = wanted[begin : begin + 256]
        out[begin : begin + 256] = (
            np.square(points[None] - part[:, None]).sum(axis=2).argmin(axis=1)
        )
    return out
