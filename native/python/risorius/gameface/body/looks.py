# SPDX-License-Identifier: MIT
"""Copies materials, textures and pictures of a body unchanged into the exported file."""

from __future__ import annotations

import copy
from collections.abc import Mapping
from typing import Any

from ...importing.gltf import Document
from ..glb import Glb

_ENDING = "texture"  # a key of a material with this ending, in any case, refers to a texture
_DEEPEST = 32
_OF_VRM_1 = "VRMC_materials_"


class Looks:
    """Copies the materials that meshes use, and the textures of these materials.

    Attributes:
        textures: number of a texture in the body's file -> its number in the exported file.
    """

    def __init__(self, document: Document, glb: Glb, *, is_old: bool) -> None:
        """Copy nothing yet; `material` copies a material when it is first requested.

        Args:
            document: the file of the body.
            glb: the exported file, which receives the materials.
            is_old: whether the exported file is a VRM 0.x; then VRM 1.0's extensions of materials
                are left out, because programs for VRM 0.x do not read them.
        """
        self._document, self._glb, self._is_old = document, glb, is_old
        self._materials = dict[int, int]()
        self._images = dict[int, int]()
        self._samplers = dict[int, int]()
        self.textures = dict[int, int]()
        required = document.json.get("extensionsRequired")
        self._required = set(map(str, required)) if isinstance(required, list) else set()

    def material(self, number: int) -> int:
        """The number of a material in the exported file, to which the first call copies it.

        Args:
            number: number of the material in the body's file.

        Raises:
            AnimationFileError: the material refers to a texture or picture that does not exist.
        """
        if number not in self._materials:
            at = f"materials[{number}]"
            made = copy.deepcopy(self._document.item("materials", number, at))
            made["name"] = str(made.get("name") or f"Material{number}")
            if self._is_old and isinstance(made.get("extensions"), dict):
                for name in [n for n in made["extensions"] if n.startswith(_OF_VRM_1)]:
                    del made["extensions"][name]
            self._renumber(made, at, 0)
            self._materials[number] = self._put("materials", made)
        return self._materials[number]

    def renumbered(self, properties: Mapping[str, Any], place: str) -> dict[str, Any]:
        """A row of VRM 0.x's materialProperties, with numbers of textures in the exported file.

        Args:
            properties: the row in the body's file.
            place: name of the row for errors.
        """
        out = copy.deepcopy(dict(properties))
        named = out.get("textureProperties")
        if isinstance(named, dict):
            out["textureProperties"] = {
                key: self._texture(index, f"{place}.textureProperties.{key}")
                for key, index in named.items()
            }
        return out

    def materials(self) -> dict[int, int]:
        """Number of a copied material in the body's file -> its number in the exported file."""
        return dict(self._materials)

    def _renumber(self, table: dict[str, Any], at: str, depth: int) -> None:
        """Replace the numbers of textures in a material's table and all tables nested in it."""
        if depth > _DEEPEST:
            raise self._document.fail(
                at, f"a material of at most {_DEEPEST} nested tables was expected, found more"
            )
        for key, value in table.items():
            if not isinstance(value, dict):
                continue
            if key.lower().endswith(_ENDING) and "index" in value:
                value["index"] = self._texture(value["index"], f"{at}.{key}")
            if key == "extensions":
                self._use(value)
            self._renumber(value, f"{at}.{key}", depth + 1)

    def _use(self, extensions: Mapping[str, Any]) -> None:
        for name in extensions:
            self._glb.uses(name, required=name in self._required)

    def _texture(self, index: object, at: str) -> int:
        row = self._document.item("textures", index, at)
        number = int(index)  # type: ignore[call-overload]  # item says it is one
        if number not in self.textures:
            made = copy.deepcopy(row)
            place = f"textures[{number}]"
            if "sampler" in made:
                made["sampler"] = self._sampler(made["sampler"], place)
            extensions = made.get("extensions")
            tables = [made]
            if isinstance(extensions, dict):
                self._use(extensions)
                tables += [table for table in extensions.values() if isinstance(table, dict)]
            for table in tables:
                if "source" in table:
                    table["source"] = self._image(table["source"], place)
            self.textures[number] = self._put("textures", made)
        return self.textures[number]

    def _sampler(self, index: object, at: str) -> int:
        row = self._document.item("samplers", index, at)
        number = int(index)  # type: ignore[call-overload]  # item says it is one
        if number not in self._samplers:
            self._samplers[number] = self._put("samplers", copy.deepcopy(row))
        return self._samplers[number]

    def _image(self, index: object, at: str) -> int:
        document = self._document
        row = document.item("images", index, at)
        number = int(index)  # type: ignore[call-overload]  # item says it is one
        if number not in self._images:
            place = f"images[{number}]"
            if "uri" in row:
                data = document.linked(row["uri"], f"{place}.uri")
            else:
                data = document.view_bytes(row.get("bufferView"), place)
            media = row.get("mimeType")
            if not isinstance(media, str):
                media = "image/png" if data[:4] == b"\x89PNG" else "image/jpeg"
            made = {"name": str(row.get("name") or f"Image{number}"), "mimeType": media}
            self._images[number] = self._put("images", {**made, "bufferView": self._glb.view(data)})
        return self._images[number]

    def _put(self, kind: str, row: dict[str, Any]) -> int:
        rows = self._glb.table.setdefault(kind, [])
        rows.append(row)
        return len(rows) - 1
