# SPDX-License-Identifier: MIT
"""Stores joints, weights and LODs of a joint rig for other faces of the same topology.

The joints are fitted once. For another person, only the motions of these joints are fitted. All
these people have the same joints, so that they can be mixed.
"""

from __future__ import annotations

import hashlib
import io
import json
from dataclasses import dataclass, field
from pathlib import Path
from typing import Protocol

import numpy as np
import numpy.typing as npt

from .. import Mesh, _native
from ..base.errors import ArgumentError
from ..base.npz import DAMAGED
from .fitting import fit_motions
from .geometry import skeleton as sk
from .geometry.blocks import LARGE
from .geometry.skeleton import Doubles, Ints
from .geometry.wanted import Wanted, joined_displacements
from .work import Joints, RigOptions, Work, given, joined_positions

_FORMAT = 2
Small = npt.NDArray[np.uint8] | npt.NDArray[np.uint16] | npt.NDArray[np.uint32]


@dataclass
class Reference:
    """A joint rig without the joints' motions, because each person has other motions."""

    face: dict[str, list[int]]  # mesh of the source -> [number of vertices, number of corners]
    joints: list[str]  # names of the source's joints
    expressions: list[str]
    names: list[str]  # names of the new joints
    parents: list[int]  # parents of the new joints
    mirrored: list[int]  # new joint -> new joint of the other side
    pivots: list[int | None]  # new joint -> index of its pivot
    levels: list[list[int]]  # level -> its new joints
    weights: dict[str, Doubles] = field(default_factory=dict)  # mesh -> [V, joints]
    # Coarse mesh -> triangles [n, 3] as indices of the fine mesh's vertex layouts.
    triangles: dict[str, Ints] = field(default_factory=dict)

    def check(self, work: Work) -> None:
        """Check that a face has the same joints, expressions, meshes and topology.

        Args:
            work: the face.

        Raises:
            ArgumentError: the face differs.
        """
        for what, own, other in (
            ("joints", list(work.source.joint_names), self.joints),
            ("expressions", work.names, self.expressions),
            ("meshes", list(work.source.mesh_names), list(self.face)),
        ):
            if own == other:
                continue
            missing = [n for n in other if n not in own] or [n for n in own if n not in other]
            named = f", such as {missing[0]}" if missing else " in another order"
            raise ArgumentError(
                f"the face has other {what} than the one whose joints it is to have{named}"
            )
        for name, mesh in zip(work.source.mesh_names, work.source.meshes, strict=True):
            found = _counts(mesh)
            if found != self.face[name]:
                raise ArgumentError(
                    f"{name}: {self.face[name][0]} vertices and {self.face[name][1]} corners were "
                    f"expected, as in the face given with like, found {found[0]} and "
                    f"{found[1]}"
                )

    def to_bytes(self) -> bytes:
        """The reference as bytes of an NPZ file, which from_bytes() reads."""
        arrays: dict[str, npt.NDArray[np.float32] | Small] = {}
        for name, rows in self.weights.items():
            vertex, joint = np.nonzero(rows)
            arrays[f"counts/{name}"] = _small(np.bincount(vertex, minlength=len(rows)))
            arrays[f"joints/{name}"] = _small(joint)
            arrays[f"weights/{name}"] = rows[vertex, joint].astype(np.float32)
        arrays |= {f"triangles/{name}": _small(rows) for name, rows in self.triangles.items()}
        named = {
            key: getattr(self, key)
            for key in self.__dataclass_fields__
            if key not in ("weights", "triangles")
        }
        text = json.dumps({"format": _FORMAT, **named}).encode()
        out = io.BytesIO()
        np.savez_compressed(out, about=np.frombuffer(text, np.uint8), **arrays)
        return out.getvalue()

    @staticmethod
    def from_bytes(data: bytes) -> Reference:
        """Read a reference.

        Args:
            data: bytes that to_bytes() wrote.

        Raises:
            ArgumentError: the bytes are no reference.
        """
        try:
            with np.load(io.BytesIO(data), allow_pickle=False) as file:
                about = json.loads(file["about"].tobytes())
                if about.pop("format") != _FORMAT:
                    raise ValueError("another format")
                out = Reference(**about)
                joints = len(out.joints) + len(out.names)
                for key in file.files:
                    kind, _, name = key.partition("/")
                    if kind == "triangles":
                        out.triangles[name] = file[key].astype(np.int64)
                    elif kind == "counts":
                        counts = file[key]
                        rows = np.zeros((len(counts), joints))
                        at = np.repeat(np.arange(len(counts)), counts), file[f"joints/{name}"]
                        rows[at] = file[f"weights/{name}"]
                        out.weights[name] = rows
        except DAMAGED as error:
            raise ArgumentError(f"no reference of a joint rig: {error}") from None
        return out

    @staticmethod
    def read(path: Path) -> Reference:
        """Read a reference from a file, as from_bytes() does.

        Args:
            path: the file.
        """
        return Reference.from_bytes(path.read_bytes())


def fingerprint() -> bytes:
    """32 bytes that change if the native module or the Python code of this folder changes."""
    known = hashlib.sha256(Path(_native.__file__ or "").read_bytes())
    for entry in sorted(Path(__file__).parent.rglob("*.py")):
        known.update(entry.read_bytes())
    return known.digest()


def _small(numbers: Ints) -> Small:
    """The numbers in the smallest unsigned integer type that holds them."""
    return numbers.astype(np.min_scalar_type(int(numbers.max(initial=0))))


def _counts(mesh: Mesh) -> list[int]:
    return [len(mesh.positions), len(mesh.face_layouts)]


class _Meshes(Protocol):
    names: list[str]
    meshes: list[Mesh]
    triangles: dict[str, Ints]


def reference_of(work: Work, fit: Joints, made: _Meshes) -> Reference:
    """The reference of a finished joint rig; it has no weights if the rig has a mesh of more than
    LARGE (60,000) vertices.

    Args:
        work: the face; the joints of its LODs are already chosen.
        fit: the fitted joints.
        made: the meshes of all LODs.
    """
    dna = work.dna
    first, before = len(given(work)), len(work.source.joint_names)
    points = [pivot.position for pivot in work.pivots]
    at = [
        next((k for k, point in enumerate(points) if np.allclose(point, p, atol=1e-6)), None)
        for p in fit.joints[first:]
    ]
    out = Reference(
        {n: _counts(m) for n, m in zip(work.source.mesh_names, work.source.meshes, strict=True)},
        list(work.source.joint_names),
        list(work.names),
        [str(n) for n in list(dna.joint_names)[before:]],
        [int(p) for p in work.parents],
        [int(m) for m in fit.mirrored[first:] - first],
        at,
        [[int(j) for j in level] for level in work.new],
        triangles=made.triangles,
    )
    if any(len(mesh.positions) > LARGE for mesh in made.meshes):
        return out
    for name, mesh in zip(made.names, made.meshes, strict=True):
        rows = sk.dense_weights(mesh, len(dna.joint_names))
        if rows[:, before:].any():
            out.weights[name] = rows
    return out


def refit(
    work: Work,
    reference: Reference,
    shaped: list[int],
    wanted: dict[int, Wanted],
    options: RigOptions,
) -> tuple[Joints, dict[int, Doubles]]:
    """Fit the motions of a reference's joints to another face.

    Args:
        work: the other face; gets the LODs and the joint parents of the reference.
        reference: the reference; check() has accepted the face.
        shaped: indices of the meshes to fit.
        wanted: index of a mesh -> displacements of the mesh in each expression.
        options: options of the fit.

    Returns: the joints, and mesh -> weights float64[V, joints] of the finest meshes.

    Raises:
        ArgumentError: expressions move a mesh that the reference has no weights for.
    """
    dna = work.source
    work.new = [np.array(level, np.int64) for level in reference.levels]
    work.parents = list(reference.parents)
    weights = {
        m: reference.weights[dna.mesh_names[m]]
        for m in shaped
        if dna.mesh_names[m] in reference.weights
    }
    if sorted(weights) != sorted(shaped):
        raise ArgumentError(
            "an expression moves a mesh that has no weights in the reference (argument 'like')"
        )
    used = given(work)
    own = np.concatenate([used, np.arange(len(reference.names)) + len(dna.joint_names)])
    edges, begin = [], 0
    for m in shaped:
        edges.append(sk.mesh_edges(dna.meshes[m]) + np.uint32(begin))
        begin += len(dna.meshes[m].positions)
    # The fit gets the weights of all joints that no expression moves (neck, spine) as weights of
    # the head, because it cannot distinguish these joints.
    rows = np.concatenate([weights[m] for m in shaped])
    others = np.setdiff1d(np.arange(rows.shape[1]), own)
    rows[:, work.head] += rows[:, others].sum(axis=1)
    found = fit_motions(
        joined_positions(work, shaped),
        joined_displacements(wanted, shaped).astype(np.float32),
        np.concatenate(edges),
        given=work.positions[used],
        motions=work.motions[:, used],
        weights=rows[:, own],
        pivots=work.pivots,
        at=reference.pivots,
        options=options.fit,
    )
    first = len(used)
    mirrored = np.concatenate([np.arange(first), first + np.array(reference.mirrored, np.int64)])
    joints = Joints(
        np.asarray(found.joints),
        np.asarray(found.rotations),
        np.asarray(found.translations),
        mirrored,
    )
    return joints, weights
