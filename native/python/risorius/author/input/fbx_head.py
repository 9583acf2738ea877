# SPDX-License-Identifier: MIT
"""Reads all meshes of a binary FBX at the places of their nodes, and their materials."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np

from ...importing.errors import AnimationFileError
from ...importing.fbx import Node, Scene, object_name, properties
from ...importing.source import read_bytes
from ..geometry.skeleton import Ints
from ..heads.islands import divided
from ..heads.parts import HeadPart, Material, as_stored
from . import fbx
from .obj import ShapeFileError

_SKIPPED = frozenset(("Pose", "Implementation"))
_ROLES = ((re.compile(r"normal|bump", re.IGNORECASE), "normal"),
          (re.compile(r"roughness", re.IGNORECASE), "roughness"),
          (re.compile(r"diffuse|base_?color", re.IGNORECASE), "color"))  # fmt: skip


def read_fbx_head(path: Path) -> list[HeadPart]:
    """Read the meshes of an FBX, in metres with y up.

    Args:
        path: the file.

    Raises:
        ShapeFileError: the file contains no mesh or is no binary FBX, or a mesh is inconsistent.
        AnimationFileError: the file is damaged; the message names the place.
        BudgetError: the file contains more numbers than its size allows.
    """
    scene = fbx.open_scene(path, _SKIPPED)
    out: list[HeadPart] = []
    known: dict[int, Material] = {}
    for number, name in fbx.meshes_of(scene):
        source, again = name or f"mesh{number}", 1
        while source in {part.source for part in out}:
            again += 1
            source = f"{name}.{again}"
        part = HeadPart(source, *fbx.mesh_of(scene, number), source=source)
        own = _by_materials(scene, path, number, part, known)
        own[0].groups = fbx.groups_of(scene, number)
        out.extend(own)
    if not out:
        raise ShapeFileError(f"{path}: a mesh with blend shapes was expected, found none")
    return out


def _by_materials(
    scene: Scene, path: Path, number: int, part: HeadPart, known: dict[int, Material]
) -> list[HeadPart]:
    """The parts of a mesh: each connected piece gets the material of most of its polygons, and the
    pieces of a material form a part, see islands.divided()."""
    owner = next((p for p, way in scene.parents.get(number, []) if not way), 0)
    listed = [i for i in scene.children.get(owner, []) if _is(scene, i, "Material")]
    for identity in listed:
        if identity not in known:
            known[identity] = _material(scene, path, identity)
    of_face = _of_faces(scene.objects[number], len(part.mesh.faces), len(listed))
    return divided(part, of_face, [known[identity] for identity in listed])


def _is(scene: Scene, number: int, kind: str) -> bool:
    node = scene.objects.get(number)
    return node is not None and node.name == kind


def _of_faces(mesh: Node, faces: int, materials: int) -> Ints:
    """int64[faces]: index of each polygon's material in the node's materials, 0 if unknown; an
    empty array if the node has no materials.

    Args:
        mesh: the mesh.
        faces: number of polygons of the mesh.
        materials: number of materials of its node.
    """
    layer = mesh.first("LayerElementMaterial")
    found = layer.array("Materials") if layer is not None else np.zeros(0)
    if materials < 1:
        return np.zeros(0, np.int64)
    if len(found) != faces:
        found = np.full(faces, found[0] if len(found) == 1 else 0)
    return np.clip(found.astype(np.int64), 0, materials - 1)


def _material(scene: Scene, path: Path, number: int) -> Material:
    """The name, the diffuse colour and the pictures of a material."""
    node = scene.objects[number]
    out = Material(object_name(node) or f"material{number}")
    values = properties(node).get("DiffuseColor", [])
    if len(values) >= 3 and all(isinstance(v, int | float) for v in values[:3]):
        out.color = as_stored([*values[:3], 1.0])
    for texture in scene.children.get(number, []):
        ways = [way for parent, way in scene.parents.get(texture, []) if parent == number]
        if not _is(scene, texture, "Texture"):
            continue
        role = next((role for word, role in _ROLES if any(word.search(w) for w in ways)), "")
        if role and role not in out.pictures:
            _add_picture(scene, path, texture, role, out)
    return out


def _add_picture(scene: Scene, path: Path, texture: int, role: str, out: Material) -> None:
    """Add the picture of a role to a material, or a note if the picture is not found.

    The picture is embedded in the FBX, or it is a file in one of three folders: the folder of the
    FBX, the folder next to the FBX with the FBX's name and the ending .fbm, and the folder
    "textures" next to the FBX.

    Args:
        scene: the open file.
        path: path of the FBX.
        texture: object number of the texture.
        role: color, normal or roughness.
        out: the material; changed.
    """
    for video in scene.children.get(texture, []):
        content = scene.objects[video].first("Content") if _is(scene, video, "Video") else None
        data = b"".join(v for v in (content.values if content else []) if isinstance(v, bytes))
        if data:
            out.pictures[role] = data
            return
    names = (scene.objects[texture].first(key) for key in ("RelativeFilename", "FileName"))
    files = [re.split(r"[/\\]", str(n.values[0]))[-1] for n in names if n is not None and n.values]
    for folder in (path.parent, path.with_suffix(".fbm"), path.parent / "textures"):
        for file in dict.fromkeys(f for f in files if f not in ("", ".", "..")):
            if (folder / file).is_file():
                try:
                    out.pictures[role] = read_bytes(folder / file, found=True)
                except AnimationFileError as error:
                    out.notes.append(f"{out.name}: its {role} texture is left out: {error}")
                return
    name = files[0] if files else "its file"
    out.notes.append(f"{out.name}: its {role} texture is left out: {name} was not found beside the "
                     f"FBX, in {path.stem}.fbm or in textures")  # fmt: skip
