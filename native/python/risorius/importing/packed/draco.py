# SPDX-License-Identifier: MIT
"""Reads glTF meshes packed with Draco (KHR_draco_mesh_compression); needs the package DracoPy.

Vertices are in the order of the packed data. Draco never packs morph targets; the glTF extension
requires that the vertices of morph targets are in the same order.
"""

from __future__ import annotations

import importlib
from typing import Any

import numpy as np
import numpy.typing as npt

from ...base.errors import RisoriusError
from ...base.given import GivenError

EXTENSION = "KHR_draco_mesh_compression"


class MissingDracoError(RisoriusError):
    """A mesh is packed with Draco, but the package DracoPy is not installed."""

    code = "missing_draco"


class DracoMesh:
    """The triangles and attributes of an unpacked mesh.

    Attributes:
        triangles: int64[n, 3], indices of vertices.
    """

    def __init__(self, packed: bytes) -> None:
        """Unpacks a mesh.

        Args:
            packed: the bytes of the buffer view.

        Raises:
            MissingDracoError: DracoPy is not installed.
            GivenError: not a Draco mesh.
        """
        try:
            package: Any = importlib.import_module("DracoPy")
        except ImportError:
            raise MissingDracoError(
                f"{EXTENSION}: `pip install DracoPy` reads it, or export the mesh without "
                "compression"
            ) from None
        try:
            self._mesh = package.decode(packed)
            faces = np.asarray(self._mesh.faces, np.int64).reshape(-1, 3)
        except (package.FileTypeException, ValueError, TypeError, MemoryError) as error:
            raise GivenError(f"{EXTENSION}: a mesh of Draco was expected: {error}") from None
        self.triangles: npt.NDArray[np.int64] = faces

    def rows(self, identity: object) -> npt.NDArray[np.float64]:
        """float64[V, n]: values of the attribute with this unique_id.

        Raises:
            GivenError: no such attribute.
        """
        found = [row for row in self._mesh.attributes if row["unique_id"] == identity]
        if not found or isinstance(identity, bool):
            known = ", ".join(str(row["unique_id"]) for row in self._mesh.attributes)
            raise GivenError(f"{EXTENSION}: an attribute of {known} was expected, found {identity}")
        values = np.asarray(found[0]["data"])
        return values.reshape(len(values), -1).astype(np.float64)
