# SPDX-License-Identifier: MIT
"""Compares a .glb's sum of weighted morph targets, as a client computes it, with the rig."""

import json

import numpy as np
import risorius
from gltf_oracle import GlbFile
from risorius import importing
from risorius.controls import arkit
from risorius.gameface import Wishes, export
from risorius.gameface.targets import find_targets


def units_of(take):
    """For each frame of a Live Link Face recording: name of an ARKit shape -> value."""
    clip = importing.read(take).clip
    lower = {name.lower(): row for name, row in zip(clip.names, clip.curves, strict=True)}
    rows = {unit: lower[unit.lower()] for unit in arkit.mapping()}
    return [{u: float(row[i]) for u, row in rows.items()} for i in range(clip.frame_count)]


def driven(weights, table):
    """Weights of all targets; combination targets get the weights that combinations.js computes."""
    out = dict(weights)
    for row in table["combinations"]:
        a, b, c = (*np.clip([weights.get(name, 0.0) for name in row["of"]], 0, 1), 0.0, 0.0)[:3]
        kinds = {
            "product": a * b, "half": 4 * a * (1 - a), "below": 4 * a * (1 - b),
            "share": 4 * a * max(0, b - a), "cubic": 32 / 3 * a * (1 - a) * (1 - 2 * a),
            "early": 4 * a * (1 - a) * b, "late": 4 * a * b * (1 - b),
            "middle": 16 * a * b * (1 - a) * (1 - b), "triple": a * b * c,
            "shut": min(1.0, a / max(b, 0.02)) * (1 - b) * c,
        }  # fmt: skip
        out[row["target"]] = float(kinds[row["weight"]])
    return out


class Posed:
    """Vertices of a .glb for target weights, and the rig's vertices in the same order.

    Args:
        dna: the face.
        rig: its compiled rig.
        found: GlbFile of the exported face.
        lod: LOD of the rig's meshes.
        facing_back: True: the exported face is rotated by 180 degrees about y.
    """

    def __init__(self, dna, rig, found, lod, *, facing_back=False):
        self.rig, self.found = rig, found
        self._sides = np.array([-1.0, 1.0, -1.0]) if facing_back else np.ones(3)
        self._surface = risorius.Surface(dna, rig, lod)
        self._number = {name: i for i, name in enumerate(dna.mesh_names)}
        self._rest, self._deltas, self._where = {}, {}, {}
        for mesh in found.meshes():
            self._rest[mesh] = rest = found.positions(mesh)
            deltas = [found.positions(mesh, {name: 1.0}) - rest for name in found.names(mesh)]
            self._deltas[mesh] = np.array(deltas).reshape(-1, *rest.shape)
            self._where[mesh] = _nearest(self._own(mesh, rig.initial_raw_controls), rest)

    def targets(self, groups):
        """The morph targets that the export finds for these groups of shapes."""
        return find_targets(self.rig, groups, "the face")[0]

    def sum(self, weights):
        """Mesh -> vertices in metres, float64[V, 3]: the neutral face plus weighted targets."""
        out = {}
        for mesh, deltas in self._deltas.items():
            on = np.array([weights.get(name, 0.0) for name in self.found.names(mesh)])
            out[mesh] = self._rest[mesh] + np.tensordot(on, deltas, 1)
        return out

    def rig_at(self, raw):
        """Mesh -> vertices of the evaluated rig in metres, float64[V, 3]."""
        return {mesh: self._own(mesh, raw)[where] for mesh, where in self._where.items()}

    def raws_of(self, take):
        """float32[frames, R]: raw controls of a take, by the importer's mapping `arkit`."""
        clip, _ = importing.import_file(take, self.rig.raw_control_names, mapping="arkit")
        raws = np.tile(self.rig.initial_raw_controls, (clip.frame_count, 1))
        column = {name: i for i, name in enumerate(self.rig.raw_control_names)}
        for name, curve in zip(clip.names, clip.curves, strict=True):
            if name in column:
                raws[:, column[name]] = curve
        return raws

    def _own(self, mesh, raw):
        # The sample face has glTF's axes and is in cm: it is converted to metres, and rotated only
        # if facing_back.
        found = self._surface.positions(raw, self._number[mesh]).astype(np.float64)
        return found * self._sides / 100


def frames(path, take, *, lod, every):
    """Largest errors in mm, float64[n, 2], of the sum without and with combination targets.

    Args:
        path: path of the DNA file.
        take: path of a Live Link Face recording.
        lod: LOD that is exported and compared.
        every: step between compared frames; the result has one row for each of them.
    """
    dna, rig = risorius.load(path), risorius.compile_cached(path)
    made = export(dna, rig, path, "face.glb", Wishes(shapes=("arkit",), lod=lod, within=0.5))
    table = json.loads(made.files["face.combinations.json"])
    posed = Posed(dna, rig, GlbFile(made.files["face.glb"]), lod)
    units, raws, out = units_of(take), posed.raws_of(take), []
    for frame in range(0, len(units), every):
        own = posed.rig_at(raws[frame])
        sums = (posed.sum(units[frame]), posed.sum(driven(units[frame], table)))
        out.append([_apart(own, one) for one in sums])
    return np.array(out)


def _apart(a, b):
    return max(1000 * float(np.linalg.norm(a[n] - b[n], axis=1).max()) for n in a)


def _nearest(points, wanted):
    """For each wanted place, the index of the nearest of the points, int64[n]."""
    out = np.empty(len(wanted), np.int64)
    for begin in range(0, len(wanted), 256):
        part = wanted[begin : begin + 256]
        out[begin : begin + 256] = (
            np.square(points[None] - part[:, None]).sum(axis=2).argmin(axis=1)
        )
    return out
