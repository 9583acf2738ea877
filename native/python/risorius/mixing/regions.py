# SPDX-License-Identifier: MIT
"""Where on a face a region is, as soft masks: by which controls move a vertex; the neck is what
hangs on its joints.

The masks of a vertex sum to 1. Meshes that are rigid (eyes, teeth, tongue) have one mask as a
whole, what lies on the skin (lashes, films) that of the skin beside it.
"""

from __future__ import annotations

import re

import numpy as np

from .. import Dna, Mesh
from ..author.geometry import skeleton as sk
from ..author.geometry.skeleton import Doubles, Ints
from ..controls.regions import region_of
from .hair import without_hair

# Region -> regions of controls, see controls/regions.toml.
_CONTROLS = {
    "brow": ("brow",),
    "eyes": ("eye",),
    "nose": ("nose",),
    "cheeks": ("cheek",),
    "mouth": ("mouth", "tongue", "teeth"),
    "jaw": ("jaw",),
    "neck": ("neck", "head"),
}
_NECK = re.compile(r"neck|spine|clavicle")
REST = "skull"  # what no control moves: forehead above the brows, ears, the back
REGIONS = (*_CONTROLS, REST)
_LEAST = 0.15  # of a control's largest motion: where no control moves a vertex further, it is skull
_REACH = 0.03  # of the size of the mesh, over which masks are evened out
_MOST_ROUNDS = 60
_RIGID = {
    re.compile(r"^eye_?(left|right|l|r)(_|$)", re.IGNORECASE): "eyes",
    re.compile(r"teeth|tongue", re.IGNORECASE): "mouth",
}


class Masks:
    """Soft masks of the regions on all meshes of a face.

    Attributes:
        meshes: float64[V, regions] of each mesh, without those of hair_meshes.
        skin: the face's own mesh of the finest level.
    """

    def __init__(self, dna: Dna) -> None:
        dna = without_hair(dna)
        controls = len(dna.raw_control_names)
        motions = sk.column_motions(dna, sk.column_count(dna))[:controls]
        skins: dict[int, int] = {}  # level -> the largest mesh that moves by itself
        self.meshes: list[Doubles] = [np.zeros((0, len(REGIONS)))] * len(dna.meshes)
        listed = dna.lod_mesh_mapping
        for lod in range(len(listed)):
            rows = [int(m) for m in listed[lod]]
            free = [m for m in rows if _rigid(dna.mesh_names[m]) is None]
            if free:
                skins[lod] = max(free, key=lambda m: len(dna.meshes[m].positions))
        self.skin = skins[0] if skins else 0
        for m in set(skins.values()):
            self.meshes[m] = _skin_masks(dna, dna.meshes[m], motions)
        for lod, skin in skins.items():
            for m in (int(m) for m in listed[lod]):
                if not len(self.meshes[m]):
                    self.meshes[m] = self._others(dna, m, skin)
        for m, mesh in enumerate(dna.meshes):  # of no level
            if not len(self.meshes[m]):
                self.meshes[m] = np.tile(np.eye(len(REGIONS))[-1], (len(mesh.positions), 1))

    def _others(self, dna: Dna, mesh: int, skin: int) -> Doubles:
        positions = np.asarray(dna.meshes[mesh].positions, np.float64)
        region = _rigid(dna.mesh_names[mesh])
        if region is not None:
            return np.tile(np.eye(len(REGIONS))[REGIONS.index(region)], (len(positions), 1))
        near = _nearest(positions, np.asarray(dna.meshes[skin].positions, np.float64))
        return self.meshes[skin][near]

    def is_empty(self, region: str) -> bool:
        """Whether a region has no vertex.

        Args:
            region: one of REGIONS.
        """
        at = REGIONS.index(region)
        return not any((masks[:, at] > 0.5).any() for masks in self.meshes)


def _rigid(name: str) -> str | None:
    return next((region for word, region in _RIGID.items() if word.search(name)), None)


def _skin_masks(dna: Dna, mesh: Mesh, motions: Doubles) -> Doubles:
    """float64[V, regions] of the face's own mesh."""
    positions = np.asarray(mesh.positions, np.float64)
    weights = sk.dense_weights(mesh, len(dna.joint_names))
    shapes = sk.column_shapes(dna, mesh, len(motions))
    most = np.zeros((len(positions), len(REGIONS)))
    most[:, -1] = _LEAST
    for column, control in enumerate(dna.raw_control_names):
        region = "cheek" if "cheek" in control.lower() else region_of(control)
        at = next((i for i, own in enumerate(_CONTROLS.values()) if region in own), None)
        if at is None:
            continue
        moved = sk.skinned(positions + shapes.get(column, 0.0), weights, motions[column])
        far = np.linalg.norm(moved - positions, axis=1)
        if far.max(initial=0) > 0:
            most[:, at] = np.maximum(most[:, at], far / far.max())
    masks = _shares(most)
    neck = weights[:, _below_head(dna)].sum(axis=1, keepdims=True)
    return _evened(mesh, masks * (1 - neck) + neck * np.eye(len(REGIONS))[REGIONS.index("neck")])


def _below_head(dna: Dna) -> list[int]:
    """The joints that hang on a neck or a spine and on no head."""
    out = []
    for joint in range(len(dna.joint_names)):
        at, steps = joint, 0
        while steps < len(dna.joint_names):
            name = dna.joint_names[at].lower()
            if "head" in name or int(dna.joint_parents[at]) == at:
                break
            if _NECK.search(name):
                break
            at, steps = int(dna.joint_parents[at]), steps + 1
        if _NECK.search(dna.joint_names[at].lower()):
            out.append(joint)
    return out


def _shares(amounts: Doubles) -> Doubles:
    squares = amounts**2
    return np.asarray(squares / squares.sum(axis=1, keepdims=True))


def _evened(mesh: Mesh, masks: Doubles) -> Doubles:
    """Each vertex with its neighbours, again and again; what is mostly one region then is so."""
    edges = sk.mesh_edges(mesh).astype(np.int64)
    count = np.bincount(edges.ravel(), minlength=len(masks))[:, None] + 1.0
    positions = np.asarray(mesh.positions, np.float64)
    length = np.linalg.norm(positions[edges[:, 0]] - positions[edges[:, 1]], axis=1).mean()
    reach = _REACH * np.ptp(positions, axis=0).max() / max(float(length), 1e-30)
    for _ in range(min(_MOST_ROUNDS, round(1.5 * reach**2))):
        around = masks.copy()
        for column in range(masks.shape[1]):
            for a, b in ((0, 1), (1, 0)):
                around[:, column] += np.bincount(
                    edges[:, a], weights=masks[edges[:, b], column], minlength=len(masks)
                )
        masks = around / count
    return _shares(masks)


def _nearest(points: Doubles, others: Doubles) -> Ints:
    lengths = (others**2).sum(axis=1)
    rows = [
        (lengths - 2 * points[at : at + 256] @ others.T).argmin(axis=1)
        for at in range(0, len(points), 256)
    ]
    return np.concatenate(rows) if rows else np.zeros(0, np.int64)
