# SPDX-License-Identifier: MIT
"""Writes the meshes, skins and materials of a body into the exported glTF."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np
import numpy.typing as npt

from ..avatar.springs import Springs
from ..avatar.vrm import Shown
from ..glb import Glb
from .looks import Looks
from .meshes import BodyMesh, Piece
from .reading import Body
from .springs import springs_of

Doubles = npt.NDArray[np.float64]

_FLIP = np.array([-1.0, 1.0, -1.0])


@dataclass
class Put:
    """The meshes, materials and springs of a body in the exported file.

    Attributes:
        meshes: the meshes, with the numbers of their nodes and meshes.
        plain: number of an exported material -> its row of VRM 0.x's materialProperties.
        springs: swinging chains; none if the body is no VRM.
    """

    meshes: list[Shown] = field(default_factory=list)
    plain: dict[int, dict[str, Any]] = field(default_factory=dict)
    springs: Springs = field(default_factory=Springs)


def frames(body: Body, version: str) -> tuple[Doubles, Doubles]:
    """Positions of the exported nodes in metres, and rotations from their axes to the scene's.

    Args:
        body: the body, facing along +z.
        version: VRM version; in "0.x" the body faces along -z, and no node is rotated.

    Returns:
        float64[n, 3] and float64[n, 3, 3].
    """
    if version == "0.x":
        return body.places * _FLIP, np.tile(np.eye(3), (len(body.names), 1, 1))
    return body.places, body.turns


def put_meshes(body: Body, glb: Glb, names: list[str], version: str, below: list[int]) -> Put:
    """Add the meshes of a body to a file whose first nodes are the nodes of the body.

    Args:
        body: the body to write.
        glb: the file, to which nodes, skins, meshes and materials are added.
        names: for each mesh, the name of its node.
        version: VRM version; "" for a plain glTF.
        below: list to which the numbers of the meshes' nodes are added.

    Raises:
        AnimationFileError: a material refers to a texture that does not exist.
    """
    looks = Looks(body.document, glb, is_old=version == "0.x")
    places, turns = frames(body, version)
    flip = _FLIP if version == "0.x" else np.ones(3)
    writer = _Writer(body, glb, looks, places, turns, flip)
    springs = springs_of(body, places, turns, flip) if version else Springs()
    out, nodes = Put(springs=springs), glb.table["nodes"]
    for mesh, name in zip(body.meshes, names, strict=True):
        if not mesh.pieces:
            continue
        meshes = glb.table.setdefault("meshes", [])
        meshes.append({"name": mesh.also, **writer.mesh(mesh)})
        below.append(len(nodes))
        out.meshes.append(Shown(len(nodes), len(meshes) - 1, mesh.targets, "auto"))
        nodes.append({"name": name, "mesh": len(meshes) - 1, "skin": writer.skin(mesh.joints)})
    if version == "0.x":
        out.plain = _plain(body, glb, looks)
    return out


def _plain(body: Body, glb: Glb, looks: Looks) -> dict[int, dict[str, Any]]:
    """Number of an exported material -> its row of materialProperties; empty unless the body's
    file is a VRM 0.x.
    """
    extensions = body.document.json.get("extensions")
    own = extensions.get("VRM") if isinstance(extensions, dict) else None
    rows = own.get("materialProperties") if isinstance(own, dict) else None
    out = dict[int, dict[str, Any]]()
    for number, new in looks.materials().items():
        if isinstance(rows, list) and number < len(rows) and isinstance(rows[number], dict):
            place = f"VRM.materialProperties[{number}]"
            row = looks.renumbered(rows[number], place)
            out[new] = {**row, "name": glb.table["materials"][new]["name"]}
    return out


class _Writer:
    def __init__(
        self, body: Body, glb: Glb, looks: Looks, places: Doubles, turns: Doubles, flip: Doubles
    ) -> None:
        self._body, self._glb, self._looks, self._flip = body, glb, looks, flip
        self._inverse = np.tile(np.eye(4), (len(places), 1, 1))
        back = np.swapaxes(turns, 1, 2)
        self._inverse[:, :3, :3] = back
        self._inverse[:, :3, 3] = -np.einsum("nij,nj->ni", back, places)
        self._skins = dict[tuple[int, ...], int]()
        self._lists = dict[int, dict[str, int]]()
        self._targets = dict[int, list[dict[str, int]]]()

    def skin(self, joints: list[int]) -> int:
        """The number of the exported skin with these joints; it is added if there is none. Args:
        joints: numbers of nodes in the body's file."""
        own = tuple(self._body.of_node[joint] for joint in joints)
        skins = self._glb.table.setdefault("skins", [])
        if own not in self._skins:
            self._skins[own] = len(skins)
            matrices = self._glb.matrices(self._inverse[list(own)])
            skins.append({"joints": list(own), "inverseBindMatrices": matrices})
        return self._skins[own]

    def mesh(self, mesh: BodyMesh) -> dict[str, Any]:
        made = {"primitives": [self._piece(piece) for piece in mesh.pieces]}
        return {**made, "extras": {"targetNames": mesh.targets}} if mesh.targets else made

    def _piece(self, piece: Piece) -> dict[str, Any]:
        key = id(piece.values)  # primitives that share their lists
        if key not in self._lists:
            self._lists[key] = {n: self._list(n, rows) for n, rows in piece.values.items()}
            self._targets[key] = [
                {
                    n: self._glb.changes(self._turned(rows), bounds=n == "POSITION")
                    for n, rows in target.items()
                }
                for target in piece.targets
            ]
        out: dict[str, Any] = {"attributes": self._lists[key]}
        if piece.indices is not None and piece.mode == 4:
            out["indices"] = self._glb.corners(piece.indices, len(piece.values["POSITION"]))
        elif piece.indices is not None:  # lines and points, which no packer knows
            flat = piece.indices.astype("<u4")[:, None]
            out["indices"] = self._glb.plain(flat)
        if piece.mode != 4:
            out["mode"] = piece.mode
        if piece.material >= 0:
            out["material"] = self._looks.material(piece.material)
        if self._targets[key]:
            out["targets"] = self._targets[key]
        return out

    def _list(self, name: str, rows: npt.NDArray[Any]) -> int:
        if name.startswith("JOINTS_"):
            rows = rows.astype("u1") if rows.max(initial=0) < 256 else rows
        elif name in ("POSITION", "NORMAL", "TANGENT"):
            rows = self._turned(rows)
        return self._glb.vertices(rows, bounds=name == "POSITION")

    def _turned(self, rows: npt.NDArray[Any]) -> npt.NDArray[Any]:
        """Vectors, one in each row, converted from the axes of the body to the axes of the exported
        file."""
        flip = np.r_[self._flip, 1.0][: rows.shape[1]]
        return np.ascontiguousarray(rows * flip, "<f4")
