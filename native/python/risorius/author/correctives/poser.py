# SPDX-License-Identifier: MIT
"""Poses a skin by combinations of raw controls, and finds the solids that it must not intersect."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from functools import reduce

import numpy as np

from ... import Dna, Mesh
from ..._native import SkinChecker, SkinFaults
from ...base.errors import ArgumentError
from ..geometry import skeleton as sk
from ..geometry.simplify import fan_triangles
from ..geometry.skeleton import Doubles
from ..work import MM, listed_meshes

Controls = tuple[int, ...]
SOLIDS = ("teeth", "eye")  # parts of the names of meshes that the skin must not intersect
_NO_SOLIDS = ("lash", "shell", "cornea", "edge", "cartilage", "saliva", "hair_", "brows_", "beard_")


class Poser:
    """Computes poses of a face's skin, and of the solids that it must not intersect, from raw
    controls."""

    def __init__(self, dna: Dna, skin: int, solids: Sequence[int]) -> None:
        self.dna = dna
        self.controls = len(dna.raw_control_names)
        self._columns = sk.column_count(dna)
        self._deltas = sk.column_deltas(dna, self._columns)
        neutral = np.zeros_like(self._deltas[0])
        self._rest = np.linalg.inv(sk.world_matrices(dna, neutral))
        self._meshes = [_Posed(dna, dna.meshes[m], self._columns) for m in (skin, *solids)]
        self.added: dict[Controls, Doubles] = {}
        self._psds = sk.psd_parts(dna)

    @property
    def neutral(self) -> list[Doubles]:
        return [mesh.positions for mesh in self._meshes]

    def motions(self, on: Controls) -> Doubles | None:
        """float64[joints, 3, 4]: matrices of the joints' motions from the rest pose to the pose
        with the controls `on` at 1.

        None if no joint moves.
        """
        deltas = self._deltas[self._active(on)].sum(axis=0)
        if not deltas.any():
            return None
        return (sk.world_matrices(self.dna, deltas) @ self._rest)[:, :3]

    def pose(self, on: Controls, *, corrected: bool = True) -> list[Doubles]:
        """The posed vertices float64[V, 3] of the skin and of each solid.

        Args:
            on: controls at 1.
            corrected: whether to add the new correctives that the search put into `added`.
        """
        motions, columns, out = self.motions(on), self._active(on), []
        for number, mesh in enumerate(self._meshes):
            shaped = mesh.positions + sum(
                (mesh.shapes[c] for c in columns if c in mesh.shapes), 0.0
            )
            if number == 0 and corrected:
                for parts, shape in self.added.items():
                    if set(parts) <= set(on):
                        shaped = shaped + shape
            out.append(shaped if motions is None else mesh.skin.bring(shaped, motions))
        return out

    def before_joints(self, on: Controls, displacement: Doubles) -> Doubles:
        """Convert displacements of the posed skin to displacements before skinning.

        Args:
            on: controls at 1.
            displacement: float64[V, 3], displacements of the posed skin.
        """
        motions = self.motions(on)
        if motions is None:
            return displacement
        weights = self._meshes[0].weights
        blended = (weights @ motions.reshape(len(motions), 12)).reshape(-1, 3, 4)[..., :3]
        return np.asarray(np.linalg.solve(blended, displacement[..., None])[..., 0])

    def _active(self, on: Controls) -> list[int]:
        return [*on, *(column for column, parts in self._psds.items() if parts <= set(on))]


class _Posed:
    def __init__(self, dna: Dna, mesh: Mesh, columns: int) -> None:
        self.positions = np.asarray(mesh.positions, np.float64)
        self.weights = sk.dense_weights(mesh, len(dna.joint_names))
        self.skin = sk.Influences(self.weights)
        self.shapes = sk.column_shapes(dna, mesh, columns)


def make_checker(dna: Dna, skin: int, solids: Sequence[int]) -> SkinChecker:
    """A checker of faults of a skin.

    Args:
        dna: the face.
        skin: index of the skin's mesh.
        solids: indices of the meshes that the skin must not intersect.

    Raises:
        DnaError: a vertex index is out of range, or a number is not finite.
    """
    mesh = dna.meshes[skin]
    layouts = np.asarray(mesh.layout_positions, np.int64)
    rows = []
    for m in solids:
        solid = dna.meshes[m]
        places = np.asarray(solid.layout_positions, np.int64)
        rows.append((places[fan_triangles(solid)].astype(np.uint32), len(solid.positions)))
    return SkinChecker(
        np.asarray(mesh.positions, np.float64),
        np.asarray(mesh.face_offsets, np.uint32),
        layouts[np.asarray(mesh.face_layouts, np.int64)].astype(np.uint32),
        rows,
        MM.get(dna.translation_unit, 10.0),
    )


def skin_and_solids(
    dna: Dna, solids: Sequence[str] = SOLIDS, lod: int = 0
) -> tuple[int, list[int]]:
    """Index of the skin, and indices of the solids. The skin is the largest mesh by vertex count.

    Args:
        dna: the face.
        solids: parts of the names of meshes that the skin must not intersect. A mesh whose name
            also contains "lash", "cornea" or a similar word (_NO_SOLIDS) is no solid.
        lod: index of the LOD.

    Raises:
        ArgumentError: the LOD has no meshes.
    """
    meshes = listed_meshes(dna, lod)
    if not meshes:
        raise ArgumentError("a face with meshes was expected")
    skin = max(meshes, key=lambda m: len(dna.meshes[m].positions))

    def is_solid(name: str) -> bool:
        lower = name.lower()
        return any(s in lower for s in solids) and not any(s in lower for s in _NO_SOLIDS)

    return skin, [m for m in meshes if m != skin and is_solid(dna.mesh_names[m])]


def worst(all_of: Iterable[SkinFaults]) -> SkinFaults:
    """For each vertex, face and edge, the worst depth, stretch and fold of all given faults."""
    return reduce(
        lambda a, b: SkinFaults(
            np.maximum(a.depth, b.depth),
            np.maximum(a.stretch, b.stretch),
            np.minimum(a.fold, b.fold),
        ),
        all_of,
    )
