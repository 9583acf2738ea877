# SPDX-License-Identifier: MIT
"""Reads a character from glTF or VRM: skeleton, meshes and bones, in metres, facing along +z."""

from __future__ import annotations

from collections.abc import Mapping, Sequence, Set
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
import numpy.typing as npt

from ...base.budget import Budget
from ...base.words import joined
from ...controls import arkit
from ...importing import named_json
from ...importing.gltf import Document, is_glb, open_glb, open_gltf
from ...importing.source import decode, read_bytes, refuse_other_kinds
from ..avatar import humanoid
from ..avatar.vrm import PRESETS
from ..errors import GameFaceError
from .meshes import BodyMesh, Meshes
from .tree import Tree, bones_of, find_tree

Doubles = npt.NDArray[np.float64]

SUFFIXES = (".glb", ".gltf", ".vrm")
_TALLEST = 20.0  # units from feet to head: a taller body is in centimetres
_HANGING = 25.0  # degrees: an arm that hangs farther below the horizontal is not in a T-pose
# smallest number of morph targets named after expressions that makes a mesh a face
_OWN_FACE = 3

# Names of expressions in older ARKit rigs and in VRoid.
_OLDER = (
    "mouthSmile_L", "mouthSmile_R", "eyeBlink_L", "eyeBlink_R", "joy", "sorrow", "a", "i", "u", "e",
    "o", "Fcl_MTH_A", "Fcl_MTH_I", "Fcl_MTH_U", "Fcl_EYE_Close", "Fcl_ALL_Joy",
)  # fmt: skip


@dataclass
class Body:
    """A character's body; its scene is in metres and faces along +z.

    Attributes:
        document: the file.
        names: names of its n nodes.
        parents: index of each node's parent, -1 for a root; parents come before their children.
        places: float64[n, 3], positions of the nodes in metres.
        turns: float64[n, 3, 3], rotation from each node's axes to the scene's.
        of_node: number of a node in the file -> index in the lists above.
        bones: VRM 1.0 name of a bone -> index in the lists above.
        meshes: its meshes, whose joints are numbers of nodes in the file.
        scale: metres per unit of the file.
        to_scene: float64[4, 4], matrix from the file's scene to the body's scene.
        world: number of a node in the file -> float64[4, 4], from the node to the body's scene.
        others: names that the user excludes and that only meshes of the face have.
        notes: sentences for the user.
    """

    document: Document
    names: list[str]
    parents: list[int]
    places: Doubles
    turns: Doubles
    of_node: dict[int, int]
    bones: dict[str, int]
    meshes: list[BodyMesh]
    scale: float
    to_scene: Doubles
    world: Mapping[int, Doubles]
    others: list[str]
    notes: list[str] = field(default_factory=list)

    def above(self, name: str) -> int:
        """Index of the node to which a bone of the face is attached.

        It is the nearest ancestor bone that the body has; if there is none, the head's parent.

        Args:
            name: VRM 1.0 name of the bone.
        """
        bone = humanoid.parent_of(name, list(self.bones))
        return self.bones[bone] if bone else max(0, self.parents[self.bones["head"]])


def read_body(
    path: Path, *, scale: float | None, without: Sequence[str], faces: Set[str], needs_all: bool
) -> Body:
    """Read a body from a file.

    Args:
        path: path of a .glb, .gltf or .vrm.
        scale: metres per unit of the file; None: 0.01 if the body is taller than 20 units, else 1.
        without: names of meshes, or of their nodes, that are left out.
        faces: names of the face's meshes, which `without` may also contain.
        needs_all: True: all bones that VRM requires must exist; False: only the head.

    Raises:
        GameFaceError: no skeleton, bones are missing, or a name in `without` is unknown.
        AnimationFileError: the file is damaged; the error names the place in the file.
        BudgetError: the content is too large in proportion to the file.
    """
    document = _opened(path)
    tree = find_tree(document)
    raw = Meshes(document, tree.world)
    rows = document.json["nodes"]
    holders = [n for n in tree.order if "mesh" in rows[n]]
    holders, others = _kept(document, holders, without, faces)
    joints = {j for n in tree.order if "mesh" in rows[n] and "skin" in rows[n]
              for j in raw.joints(n)}  # fmt: skip
    if not joints:
        raise GameFaceError(f"{path}: a body with a skeleton was expected, no mesh has a skin")
    bones = bones_of(document, tree, joints)
    wanted = humanoid.NEEDED if needs_all else ("head",)
    if missing := [name for name in wanted if name not in bones]:
        raise GameFaceError(
            f"{path}: the body has no bone {joined(missing)}: name the bones in its VRM "
            "extension, or as in Unreal, Mixamo or VRM"
        )
    at = {name: tree.world[node][:3, 3] for name, node in bones.items()}
    scale = scale or _scale_of(at)
    turn = _facing(at, str(path))
    to_scene = np.diag([turn * scale, scale, turn * scale, 1.0])
    world = {number: to_scene @ matrix for number, matrix in tree.world.items()}
    meshes = Meshes(document, world)
    rigid = [n for n in holders if "skin" not in rows[n]]
    own = _Nodes(document, tree, world, bones, joints, rigid)
    body = Body(
        document, own.names, own.parents, own.places, own.turns, own.of_node,
        {name: own.of_node[node] for name, node in bones.items()},
        [meshes.read(n) for n in holders], scale, to_scene, world, others,
    )  # fmt: skip
    for mesh in body.meshes:  # a mesh without a skin turns with the node that it hangs on
        mesh.joints = [j if j in own.of_node else tree.above[j] for j in mesh.joints]
    body.notes += _notes(body, path)
    return body


def _opened(path: Path) -> Document:
    data = read_bytes(path, found=True)
    budget = Budget.of(len(data), str(path))
    if is_glb(data):
        return open_glb(path, data, budget)
    refuse_other_kinds(data, str(path))
    return open_gltf(path, named_json.parse(decode(data, str(path)), str(path)), budget=budget)


def _kept(
    document: Document, holders: list[int], without: Sequence[str], faces: Set[str]
) -> tuple[list[int], list[str]]:
    """The nodes whose meshes are exported, and the names in `without` that are face meshes.

    Args:
        document: the file.
        holders: numbers of the nodes that have a mesh.
        without: names of meshes or nodes that the user leaves out.
        faces: names of the face's meshes.

    Raises: GameFaceError: a name in `without` is no mesh of the body or the face.
    """
    rows, names = document.json["nodes"], dict[int, tuple[str, str]]()
    for number in holders:
        mesh = document.item("meshes", rows[number]["mesh"], f"nodes[{number}].mesh")
        also = str(mesh.get("name") or f"mesh{rows[number]['mesh']}")
        names[number] = (str(rows[number].get("name") or also), also)
    others = [wish for wish in without if not any(wish in pair for pair in names.values())]
    for wish in others:
        if wish not in faces:
            there = joined(sorted({pair[0] for pair in names.values()})) or "none"
            raise GameFaceError(
                f"{document.name}: --without {wish}: a mesh of the body was expected: {there}"
            )
    return [n for n in holders if not set(names[n]) & set(without)], others


def _scale_of(at: Mapping[str, Doubles]) -> float:
    """Metres per unit of the file: 0.01 if the head is more than 20 units above the lowest bone
    (nobody is 20 m tall, so the unit is a centimetre), else 1."""
    low = min(float(place[1]) for place in at.values())
    return 0.01 if float(at["head"][1]) - low > _TALLEST else 1.0


def _facing(at: Mapping[str, Doubles], name: str) -> float:
    """1 for a body that faces along +z or has no pair of bones that shows it, -1 for one that faces
    along -z, as VRM 0.x prescribes.

    Args:
        at: VRM name of a bone -> float64[3], its position in the file.
        name: name of the file for errors.

    Raises:
        GameFaceError: the head is not above the hips.
    """
    if "hips" in at and not at["head"][1] > at["hips"][1]:
        raise GameFaceError(
            f"{name}: a body that stands upright along y was expected, its head is not above its "
            "hips"
        )
    for part in ("UpperLeg", "UpperArm", "Eye", "Shoulder", "Hand"):
        left, right = at.get(f"left{part}"), at.get(f"right{part}")
        if left is not None and right is not None and left[0] != right[0]:
            return 1.0 if left[0] > right[0] else -1.0
    return 1.0


class _Nodes:
    """The nodes to export: bones, joints, and all nodes without a mesh or a camera.

    Parents of exported nodes and of meshes without a skin are exported too.
    """

    def __init__(
        self, document: Document, tree: Tree, world: Mapping[int, Doubles], bones: dict[str, int],
        joints: set[int], rigid: list[int],
    ) -> None:  # fmt: skip
        rows = document.json["nodes"]
        kept = {*bones.values(), *joints}
        kept |= {tree.above[n] if tree.above[n] >= 0 else n for n in rigid}
        for number in tree.order:
            if "mesh" not in rows[number] and "camera" not in rows[number]:
                kept.add(number)
        for number in reversed(tree.order):
            if number in kept and tree.above[number] >= 0:
                kept.add(tree.above[number])
        order = [number for number in tree.order if number in kept]
        self.of_node = {number: i for i, number in enumerate(order)}
        self.names = [str(rows[n].get("name") or f"Node{n}") for n in order]
        self.parents = [self.of_node.get(tree.above[n], -1) for n in order]
        self.places = np.array([world[n][:3, 3] for n in order])
        self.turns = np.array([_rotation(world[n][:3, :3]) for n in order])


def _rotation(matrix: Doubles) -> Doubles:
    """The rotation part of a matrix that rotates and scales; the identity for a singular matrix."""
    if not abs(np.linalg.det(matrix)) > 1e-30:
        return np.eye(3)
    left, _, right = np.linalg.svd(matrix)
    sign = np.sign(np.linalg.det(left @ right))
    out = np.asarray((left * [1.0, 1.0, sign]) @ right, np.float64)
    # Products of the parents' matrices leave rounding errors, which hide exact 0 and 1.
    return np.where(np.abs(out - np.rint(out)) < 1e-9, np.rint(out), out)


def _notes(body: Body, path: Path) -> list[str]:
    notes = list[str]()
    known = {name.lower() for name in (*arkit.mapping(), *PRESETS, *_OLDER)} - {"neutral"}
    faces, example, most = list[str](), "", 0
    for mesh in body.meshes:
        named = [name for name in mesh.targets if _plain(name) in known]
        if len(named) >= _OWN_FACE:
            faces.append(mesh.name)
            most = max(most, len(named))
            example = example or named[0]
    if faces:
        notes.append(
            f"{path.name}: the body has a face of its own, {joined(faces)}, with up to {most} "
            f"targets such as {example}: {' '.join(f'--without {_quoted(n)}' for n in faces)} "
            "leaves it out"
        )
    for side in ("left", "right"):
        pair = [body.bones.get(f"{side}{part}") for part in ("UpperArm", "LowerArm")]
        if pair[0] is not None and pair[1] is not None:
            along = body.places[pair[1]] - body.places[pair[0]]
            angle = float(np.degrees(np.arctan2(-along[1], abs(along[0]))))
            if angle > _HANGING:
                notes.append(
                    f"{path.name}: its arms hang {angle:.0f} degrees below a T-pose, which VRM "
                    "expects: motions of other bodies will look wrong"
                )
                break
    count = len(body.document.json.get("animations") or ())
    if count:
        notes.append(f"{path.name}: its animations are left out ({count})")
    return notes


def _quoted(name: str) -> str:
    return name if name.replace("_", "").isalnum() else f'"{name}"'


def _plain(name: str) -> str:
    """A target's name in lower case, without the text up to the last dot, such as "Face."."""
    return name.rpartition(".")[2].lower()
