# SPDX-License-Identifier: MIT
"""The bones of a humanoid: their names in programs and files, and the positions of bones that are
added to a face."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

Doubles = npt.NDArray[np.float64]

KINDS = ("minimal", "mixamo")
_HEAD_HEIGHT = 1.5  # metres: assumed height of a head's joint whose own height is not _STANDING
_STANDING = (0.8, 2.4)  # metres: a head's joint between these heights is above a ground at 0
_STRAIGHT = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))
# Axes of Mixamo's bones, because poses of the web player TalkingHead assume them. Columns: the
# bone's x axis, its y axis (along the bone) and its z axis, in the scene's axes (y up, z front).
_TURNS = {
    "": _STRAIGHT,
    "arm left": ((0, 1, 0), (0, 0, -1), (-1, 0, 0)),
    "arm right": ((0, -1, 0), (0, 0, -1), (1, 0, 0)),
    "leg": ((-1, 0, 0), (0, -1, 0), (0, 0, 1)),
    "foot": ((-1, 0, 0), (0, -0.5, 0.75**0.5), (0, 0.75**0.5, 0.5)),
}
# Parent, name in Mixamo, names in other files, whether VRM requires the bone, position as
# fractions of the height of the head's joint above the ground, key of _TURNS.
_Row = tuple[str, str, str, bool, tuple[float, float, float], str]
_MIDDLE: Mapping[str, _Row] = {
    "hips": ("", "Hips", "hips hip pelvis", True, (0, 0.60, 0), ""),
    "spine": ("hips", "Spine", "spine spine01", True, (0, 0.66, 0), ""),
    "chest": ("spine", "Spine1", "chest spine1 spine02 spine03", False, (0, 0.74, 0), ""),
    "upperChest": ("chest", "Spine2", "upperchest spine2 spine04 spine05", False, (0, 0.83, 0), ""),
    "neck": ("upperChest", "Neck", "neck neck01", False, (0, 0.935, 0), ""),
    "head": ("neck", "Head", "head", True, (0, 1, 0), ""),
    "jaw": ("head", "Jaw", "jaw", False, (0, 1.015, 0.02), ""),
}  # fmt: skip
_SIDED: Mapping[str, _Row] = {
    "Eye": ("head", "Eye", "eye faceeye", False, (0.0185, 1.025, 0.05), ""),
    "Shoulder": ("upperChest", "Shoulder", "shoulder clavicle", False, (0.02, 0.90, 0), "arm"),
    "UpperArm": ("Shoulder", "Arm", "upperarm arm uparm", True, (0.11, 0.895, 0), "arm"),
    "LowerArm": ("UpperArm", "ForeArm", "lowerarm forearm", True, (0.275, 0.895, 0), "arm"),
    "Hand": ("LowerArm", "Hand", "hand wrist", True, (0.43, 0.895, 0), "arm"),
    "UpperLeg": ("hips", "UpLeg", "upperleg thigh upleg", True, (0.055, 0.575, 0), "leg"),
    "LowerLeg": ("UpperLeg", "Leg", "lowerleg calf leg shin", True, (0.055, 0.31, 0), "leg"),
    "Foot": ("LowerLeg", "Foot", "foot ankle", True, (0.055, 0.05, -0.01), "foot"),
    "Toes": ("Foot", "ToeBase", "toes toe toebase ball", False, (0.055, 0.012, 0.075), "foot"),
}  # fmt: skip
_FINGERS = {"Thumb": 0.02, "Index": 0.015, "Middle": 0.005, "Ring": -0.005, "Little": -0.015}
_PARTS = ("Proximal", "Intermediate", "Distal")
_SIDES = {"left": 1.0, "right": -1.0}


@dataclass(frozen=True)
class Bone:
    """A bone of a humanoid: its names, parent, and position if the head's joint is at height 1.

    Attributes:
        name: VRM 1.0 name.
        parent: VRM 1.0 name of the parent, "" for the hips.
        node: name of its node, which is Mixamo's name of the bone.
        words: names of the bone in files of other programs, without separators and side.
        side: "left", "right", or "".
        is_needed: whether VRM requires the bone.
        at: position as fractions of the height of the head's joint above the ground: to the
            body's left, up, to the front.
        turn: key of the axes in _TURNS that Mixamo gives the bone.
    """

    name: str
    parent: str
    node: str
    words: frozenset[str]
    side: str
    is_needed: bool
    at: tuple[float, float, float]
    turn: str


def _bones() -> Iterator[Bone]:
    for name, (parent, node, words, needed, at, turn) in _MIDDLE.items():
        yield Bone(name, parent, node, frozenset(words.split()), "", needed, at, turn)
    for side, sign in _SIDES.items():
        for part, (above, node, words, needed, at, turn) in _SIDED.items():
            parent = side + above if above in _SIDED else above
            frame = f"arm {side}" if turn == "arm" else turn
            yield Bone(
                side + part, parent, side.capitalize() + node, frozenset(words.split()), side,
                needed, (sign * at[0], at[1], at[2]), frame,
            )  # fmt: skip
        for finger, forward in _FINGERS.items():
            yield from _finger(side, sign, finger, forward)


def _finger(side: str, sign: float, finger: str, forward: float) -> Iterator[Bone]:
    called = "Pinky" if finger == "Little" else finger
    parts = ("Metacarpal", "Proximal", "Distal") if finger == "Thumb" else _PARTS
    parent = f"{side}Hand"
    for number, part in enumerate(parts, 1):
        low = called.lower()
        words = {f"{low}0{number}", f"hand{low}{number}", (finger + part).lower()}
        out = (0.45 if finger == "Thumb" else 0.485) + 0.018 * number
        yield Bone(
            f"{side}{finger}{part}", parent, f"{side.capitalize()}Hand{called}{number}",
            frozenset(words), side, False, (sign * out, 0.895, forward), f"arm {side}",
        )  # fmt: skip
        parent = f"{side}{finger}{part}"


BONES = {bone.name: bone for bone in _bones()}
"""Bone name -> bone, parents before children."""
NEEDED = tuple(name for name, bone in BONES.items() if bone.is_needed)


def bone_of(joint: str) -> str:
    """The humanoid bone that a joint's name means, "" for none.

    Args:
        joint: a name such as upperarm_l, mixamorig:LeftArm, J_Bip_L_UpperArm, leftUpperArm.
    """
    plain, side = _plain(joint)
    for name, bone in BONES.items():
        if bone.side == side and plain in bone.words:
            return name
    return ""


def _plain(joint: str) -> tuple[str, str]:
    """A joint's name without separators and side, and its side."""
    # Some glTF loaders drop the colon, so mixamorigHips is accepted as well as mixamorig:Hips.
    name = re.sub(r"^(mixamorig\d*_?|j_(bip|adj)_(c_)?)", "", re.sub(r"^.*:", "", joint.lower()))
    for side in _SIDES:
        short = side[0]
        for pattern in (rf"^{side}", rf"{side}$", rf"^{short}[_.]", rf"[_.]{short}$"):
            plain, found = re.subn(pattern, "", name)
            if found:
                return re.sub(r"[^a-z0-9]", "", plain), side
    return re.sub(r"[^a-z0-9]", "", name), ""


def new_bone(name: str) -> str:
    """The VRM 1.0 name of a bone; only thumb bones are renamed. Args: name: name in VRM 0.x."""
    for old, new in (("ThumbProximal", "ThumbMetacarpal"), ("ThumbIntermediate", "ThumbProximal")):
        if name.endswith(old):
            return name.removesuffix(old) + new
    return name


def wanted(own: Iterable[str], kind: str) -> list[str]:
    """The names of a humanoid's bones, parents first.

    Args:
        own: bones that the face has.
        kind: "minimal" adds the bones that VRM requires, "mixamo" adds all bones but the jaw, ""
            adds no bones. Any kind adds a chest if the humanoid has an upper chest.
    """
    out = set(own)
    if kind == "mixamo":
        out |= BONES.keys() - {"jaw"}
    elif kind:
        out |= set(NEEDED)
    if "upperChest" in out:  # VRM requires a chest if there is an upper chest
        out.add("chest")
    return [name for name in BONES if name in out]


def parent_of(name: str, there: list[str]) -> str:
    """The nearest ancestor of a bone in `there`; "" if there is none, as for the hips.

    Args:
        name: name of the bone.
        there: names of the available bones.
    """
    above = BONES[name].parent
    while above and above not in there:
        above = BONES[above].parent
    return above


def place_of(name: str, head: Doubles, trunk: Doubles) -> Doubles:
    """float64[3]: position of an added bone, in metres.

    Args:
        name: name of the bone.
        head: float64[3], the head's joint, y up. If its height is not plausible above a ground at
            y = 0, as for a head near the origin, the ground is assumed 1.5 m below it.
        trunk: float64[3], the lowest trunk joint of the face; added bones of the body have their x
            and z relative to it.
    """
    height, low = float(head[1]), 0.0
    if not _STANDING[0] <= height <= _STANDING[1]:
        low, height = height - _HEAD_HEIGHT, _HEAD_HEIGHT
    at = np.array(BONES[name].at) * height
    from_ = head if BONES[name].parent == "head" else trunk
    return np.array([from_[0] + at[0], low + at[1], from_[2] + at[2]])


def turn_of(name: str) -> Doubles:
    """float64[3, 3]: rotation from Mixamo's axes of a bone to the scene's axes.

    Args: name: name of the bone.
    """
    return np.array(_TURNS[BONES[name].turn], np.float64)
