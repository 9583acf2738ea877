# SPDX-License-Identifier: MIT
"""Finds the regions of a face as soft masks, by the controls that move a vertex. The vertices of
the neck's, spine's and clavicles' joints also belong to the neck.

The masks of a vertex sum to 1. A rigid mesh (eye, teeth, tongue) belongs to one region; meshes on
the skin (lashes, clear films on the eyes) have the mask of the nearest skin.
"""

from __future__ import annotations

import functools
import re

import numpy as np

from .. import Dna, Mesh
from ..author.geometry import skeleton as sk
from ..author.geometry.motion import Mover, motions_of
from ..author.geometry.skeleton import Doubles
from ..base.budget import Budget
from ..controls.regions import region_of
from .hair import budget_of, nearest, without_hair

# Region of a mix -> regions of controls, as named in controls/regions.toml.
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
# region of vertices that no control moves: forehead above the brows, ears, back of the head
REST = "skull"
REGIONS = (*_CONTROLS, REST)
# fraction of a control's largest displacement; vertices that move less belong more to the skull
# than to the control's region
_LEAST = 0.15
_REACH = 0.03  # distance over which masks are smoothed, as a fraction of the mesh's size
_MOST_ROUNDS = 60
_RIGID = {
    re.compile(r"^eye_?(left|right|l|r)(_|$)", re.IGNORECASE): "eyes",
    re.compile(r"teeth|tongue", re.IGNORECASE): "mouth",
}


class Masks:
    """Soft masks of the regions on all meshes of a face, computed at first use.

    Attributes:
        meshes: float64[V, regions] of each mesh, without hair and beard meshes.
        skin: index of the face's skin: the largest mesh of LOD 0 that is not rigid.
    """

    def __init__(self, dna: Dna, budget: Budget | None = None) -> None:
        """Args:
        dna: the face.
        budget: limits the computation; None: a limit by the size of the face.
        """
        self._dna, self._budget = without_hair(dna), budget
        listed, count = self._dna.lod_mesh_mapping, len(self._dna.meshes)
        self._levels = [[int(m) for m in listed[lod] if m < count] for lod in range(len(listed))]
        self._skins: dict[int, int] = {}  # LOD -> the largest mesh that is not rigid
        for lod, rows in enumerate(self._levels):
            free = [m for m in rows if _rigid(self._dna.mesh_names[m]) is None]
            if free:
                self._skins[lod] = max(free, key=lambda m: len(self._dna.meshes[m].positions))
        self.skin = self._skins.get(0, 0)

    @functools.cached_property
    def meshes(self) -> list[Doubles]:
        """The masks of each mesh. Raises: BudgetError: too much work for the face's size."""
        dna, budget = self._dna, self._budget or budget_of(self._dna)
        skins = sorted(set(self._skins.values()))
        out = dict(
            zip(skins, _skin_masks(dna, [dna.meshes[m] for m in skins], budget), strict=True)
        )
        for lod, skin in self._skins.items():
            for m in self._levels[lod]:
                if m not in out:
                    out[m] = _others(dna, m, skin, out[skin], budget)
        rest = np.eye(len(REGIONS))[-1]
        return [
            # a mesh that no LOD lists belongs to the skull
            out[m] if m in out else np.tile(rest, (len(mesh.positions), 1))
            for m, mesh in enumerate(dna.meshes)
        ]

    def is_empty(self, region: str) -> bool:
        """Whether a region has no vertices with a mask above 0.5.

        Args:
            region: one of REGIONS.
        """
        at = REGIONS.index(region)
        return not any((masks[:, at] > 0.5).any() for masks in self.meshes)


def _others(dna: Dna, mesh: int, skin: int, masks: Doubles, budget: Budget) -> Doubles:
    """float64[V, regions]: masks of a rigid mesh, or of a mesh on the skin.

    Args:
        dna: the face.
        mesh: index of the mesh.
        skin: index of the skin mesh of the same LOD.
        masks: float64[n, regions], masks of the skin's vertices.
        budget: limits the computation.
    """
    positions = np.asarray(dna.meshes[mesh].positions, np.float64)
    region = _rigid(dna.mesh_names[mesh])
    if region is not None:
        return np.tile(np.eye(len(REGIONS))[REGIONS.index(region)], (len(positions), 1))
    others = np.asarray(dna.meshes[skin].positions, np.float64)
    return masks[nearest(positions, others, 1, budget)[:, 0]]


def _rigid(name: str) -> str | None:
    return next((region for word, region in _RIGID.items() if word.search(name)), None)


def _skin_masks(dna: Dna, meshes: list[Mesh], budget: Budget) -> list[Doubles]:
    """The masks of each skin mesh, float64[V, regions]."""
    regions = _regions_of_controls(dna)
    most = [np.zeros((len(mesh.positions), len(REGIONS))) for mesh in meshes]
    movers = [Mover(dna, mesh) for mesh in meshes]
    for rows in most:
        rows[:, -1] = _LEAST
    for motion in motions_of(dna, list(regions), budget):
        at = regions[motion.column]
        for mover, rows in zip(movers, most, strict=True):
            vertices, shifts = mover.moved(motion, budget)
            far = np.linalg.norm(shifts, axis=1)
            if far.max(initial=0) > 0:
                rows[vertices, at] = np.maximum(rows[vertices, at], far / far.max())
    below = np.zeros(len(dna.joint_names))
    below[_below_head(dna)] = 1
    out = []
    for mover, mesh, rows in zip(movers, meshes, most, strict=True):
        neck = mover.sums(below)[:, None]
        masks = _shares(rows) * (1 - neck) + neck * np.eye(len(REGIONS))[REGIONS.index("neck")]
        out.append(_evened(mesh, masks))
    return out


def _regions_of_controls(dna: Dna) -> dict[int, int]:
    """Index of a raw control -> index of its region, for controls with a region."""
    out = {}
    for number, control in enumerate(dna.raw_control_names):
        region = "cheek" if "cheek" in control.lower() else region_of(control)
        at = next((i for i, own in enumerate(_CONTROLS.values()) if region in own), None)
        if at is not None:
            out[number] = at
    return out


def _below_head(dna: Dna) -> list[int]:
    """Indices of the joints of neck, spine and clavicles, and of their descendants that are neither
    a head joint nor below one."""
    names, parents = [name.lower() for name in dna.joint_names], dna.joint_parents
    below = [False] * len(names)
    for joint in sk.parent_order(dna):
        parent = int(parents[joint])
        of_neck = _NECK.search(names[joint]) is not None
        hangs = "head" not in names[joint] and parent != joint and below[parent]
        below[joint] = of_neck or hangs
    return [joint for joint, is_below in enumerate(below) if is_below]


def _shares(amounts: Doubles) -> Doubles:
    squares = amounts**2
    return np.asarray(squares / squares.sum(axis=1, keepdims=True))


def _evened(mesh: Mesh, masks: Doubles) -> Doubles:
    """Smooths masks over neighbouring vertices, then sharpens them towards the main region.

    Args:
        mesh: the mesh.
        masks: float64[V, regions], rows sum to 1.
    """
    edges = sk.mesh_edges(mesh).astype(np.int64)
    if not len(edges):
        return masks
    count = np.bincount(edges.ravel(), minlength=len(masks))[:, None] + 1.0
    positions = np.asarray(mesh.positions, np.float64)
    length = np.linalg.norm(positions[edges[:, 0]] - positions[edges[:, 1]], axis=1).mean()
    reach = _REACH * np.ptp(positions, axis=0).max() / max(float(length), 1e-30)
    # `reach`, in mean edge lengths, is not finite if a vertex has no finite position. Then
    # nothing is smoothed.
    rounds = round(min(_MOST_ROUNDS, 1.5 * reach**2)) if np.isfinite(reach) else 0
    for _ in range(rounds):
        around = masks.copy()
        for column in range(masks.shape[1]):
            for a, b in ((0, 1), (1, 0)):
                around[:, column] += np.bincount(
                    edges[:, a], weights=masks[edges[:, b], column], minlength=len(masks)
                )
        masks = around / count
    return _shares(masks)
