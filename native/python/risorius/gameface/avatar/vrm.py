# SPDX-License-Identifier: MIT
"""Makes the tables of a VRM: humanoid, expressions, look-at, first person, licence."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

from . import licence
from .springs import Springs, table_0

PRESETS = (
    "happy", "angry", "sad", "relaxed", "surprised", "neutral", "aa", "ih", "ou", "ee", "oh",
    "blink", "blinkLeft", "blinkRight", "lookUp", "lookDown", "lookLeft", "lookRight",
)  # fmt: skip
"""The preset expressions of VRM 1.0."""
FEELINGS = PRESETS[:5]
BLINKS = PRESETS[11:14]
KINDS = {"Blink": ("blink",), "LookAt": PRESETS[-4:], "Mouth": ("aa", "ih", "ou", "ee", "oh")}
"""Kinds of presets that an expression may override, and the presets of each kind."""
_OLD = {
    "happy": "joy", "angry": "angry", "sad": "sorrow", "relaxed": "fun", "neutral": "neutral",
    "aa": "a", "ih": "i", "ou": "u", "ee": "e", "oh": "o", "blink": "blink",
    "blinkLeft": "blink_l", "blinkRight": "blink_r", "lookUp": "lookup", "lookDown": "lookdown",
    "lookLeft": "lookleft", "lookRight": "lookright",
}  # fmt: skip
_OLD_TITLES = {
    "blink_l": "Blink_L", "blink_r": "Blink_R", "lookup": "LookUp", "lookdown": "LookDown",
    "lookleft": "LookLeft", "lookright": "LookRight",
}  # fmt: skip
_OLD_FIRST = {"auto": "Auto", "both": "Both", "thirdPersonOnly": "ThirdPersonOnly"}
# a straight line from (0, 0) to (1, 1) in Unity's curve format
_STRAIGHT = [0, 0, 0, 1, 1, 1, 1, 0]
# VRM 1.0 name of a thumb bone -> VRM 0.x name, in which the first bone is called proximal.
_OLD_THUMB = {"ThumbMetacarpal": "ThumbProximal", "ThumbProximal": "ThumbIntermediate"}


@dataclass(frozen=True)
class Manner:
    """Values of VRM expressions that are measured on the exported face.

    Attributes:
        look: preset lookLeft, lookRight, lookUp or lookDown -> rotation of the eyes in degrees;
            presets that do not turn the eyes are absent.
        held: preset -> kinds of other presets ("Blink", "LookAt" or "Mouth"); a VRM viewer fades
            out presets of these kinds while the preset is on.
    """

    look: Mapping[str, float] = field(default_factory=dict)
    held: Mapping[str, Sequence[str]] = field(default_factory=dict)


@dataclass(frozen=True)
class Shown:
    """A mesh of the file, its morph targets, and whether the avatar's wearer sees the mesh.

    Attributes:
        node, mesh: numbers of its node and mesh.
        targets: names of its morph targets.
        first: first-person flag: "auto", "both" or "thirdPersonOnly".
    """

    node: int
    mesh: int
    targets: Sequence[str]
    first: str


@dataclass(frozen=True)
class Avatar:
    """Input of the VRM tables.

    Attributes:
        bones: VRM name of a bone -> number of its node.
        eyes: offset in metres from the head's joint to the midpoint of the eyes.
        meshes: the meshes of the file.
        own: names of morph targets that become custom expressions.
        said: the licence fields, from `licence.checked`.
        manner: the measured values of expressions.
        plain: number of a material -> its row of VRM 0.x's materialProperties, for materials that
            have such a row in the body's file.
        springs: chains that swing, with their colliders.
    """

    bones: Mapping[str, int]
    eyes: Sequence[float]
    meshes: Sequence[Shown]
    own: Sequence[str]
    said: Mapping[str, Any]
    manner: Manner
    plain: Mapping[int, Mapping[str, Any]] = field(default_factory=dict)
    springs: Springs = field(default_factory=Springs)

    def binds(self, name: str) -> Iterator[tuple[Shown, int]]:
        """The meshes that have the morph target `name`, and its index in each of them."""
        for shown in self.meshes:
            if name in shown.targets:
                yield shown, shown.targets.index(name)


def extension(
    version: str, avatar: Avatar, materials: Sequence[Mapping[str, Any]]
) -> tuple[str, dict[str, Any]]:
    """The name and the table of the VRM extension.

    Args:
        version: "1.0" or "0.x".
        avatar: input of the tables.
        materials: material tables of the file.
    """
    return ("VRMC_vrm", _new(avatar)) if version == "1.0" else ("VRM", _old(avatar, materials))


def _new(avatar: Avatar) -> dict[str, Any]:
    presets = {name: _expression(avatar, name) for name in PRESETS if _is_there(avatar, name)}
    custom = {name: _expression(avatar, name) for name in avatar.own if name not in PRESETS}
    out: dict[str, Any] = {
        "specVersion": "1.0",
        "meta": licence.meta_1(avatar.said),
        "humanoid": {"humanBones": {name: {"node": n} for name, n in avatar.bones.items()}},
        "firstPerson": {
            "meshAnnotations": [{"node": s.node, "type": s.first} for s in avatar.meshes]
        },
        "expressions": {"preset": presets, **({"custom": custom} if custom else {})},
    }
    if avatar.manner.look:
        out["lookAt"] = {"offsetFromHeadBone": list(avatar.eyes), "type": "expression"}
        for key, degrees in _ranges(avatar.manner):
            out["lookAt"][f"rangeMap{key}"] = {"inputMaxValue": degrees, "outputScale": 1.0}
    return out


def _is_there(avatar: Avatar, name: str) -> bool:
    return name == "neutral" or any(True for _ in avatar.binds(name))


def _expression(avatar: Avatar, name: str) -> dict[str, Any]:
    held = avatar.manner.held.get(name, ())
    binds = [{"node": s.node, "index": i, "weight": 1.0} for s, i in avatar.binds(name)]
    out: dict[str, Any] = {"isBinary": False}
    out.update({f"override{kind}": "blend" if kind in held else "none" for kind in KINDS})
    return {**out, "morphTargetBinds": binds} if binds else out


def _ranges(manner: Manner) -> Iterator[tuple[str, float]]:
    """Name of each VRM look-at range, and the eye rotation in degrees that gives weight 1."""
    sideways = [manner.look[n] for n in ("lookLeft", "lookRight") if n in manner.look]
    if sideways:
        mean = sum(sideways) / len(sideways)
        yield from (("HorizontalInner", mean), ("HorizontalOuter", mean))
    for name, key in (("lookDown", "VerticalDown"), ("lookUp", "VerticalUp")):
        if name in manner.look:
            yield key, manner.look[name]


def _old(avatar: Avatar, materials: Sequence[Mapping[str, Any]]) -> dict[str, Any]:
    groups = [_group(avatar, n, _OLD[n]) for n in _OLD if _is_there(avatar, n)]
    more = [n for n in ("surprised", *avatar.own) if n not in _OLD and _is_there(avatar, n)]
    groups += [_group(avatar, name, "unknown") for name in dict.fromkeys(more)]
    eyes = avatar.eyes
    first: dict[str, Any] = {
        "firstPersonBone": avatar.bones["head"],
        # VRM 0.x uses Unity's z axis, which is opposite to glTF's.
        "firstPersonBoneOffset": {"x": eyes[0], "y": eyes[1], "z": -eyes[2]},
        "meshAnnotations": [
            {"mesh": s.mesh, "firstPersonFlag": _OLD_FIRST[s.first]} for s in avatar.meshes
        ],
        "lookAtTypeName": "BlendShape",
    }
    for key, degrees in _ranges(avatar.manner):
        first[f"lookAt{key}"] = {"curve": _STRAIGHT, "xRange": degrees, "yRange": 1.0}
    return {
        "exporterVersion": "Risorius",
        "specVersion": "0.0",
        "meta": licence.meta_0(avatar.said),
        "humanoid": {
            "humanBones": [
                {"bone": _old_bone(name), "node": node, "useDefaultValues": True}
                for name, node in avatar.bones.items()
            ]
        },
        "firstPerson": first,
        "blendShapeMaster": {"blendShapeGroups": groups},
        "secondaryAnimation": table_0(avatar.springs),
        "materialProperties": [
            avatar.plain.get(number) or _plain(material["name"])
            for number, material in enumerate(materials)
        ],
    }


def _group(avatar: Avatar, name: str, preset: str) -> dict[str, Any]:
    title = _OLD_TITLES.get(preset, preset.capitalize()) if preset != "unknown" else name
    title = "Surprised" if name == "surprised" else title
    return {
        "name": title,
        "presetName": preset,
        "binds": [{"mesh": s.mesh, "index": i, "weight": 100} for s, i in avatar.binds(name)],
        "materialValues": [],
        "isBinary": False,
    }


def _old_bone(name: str) -> str:
    for side in ("left", "right"):
        part = name.removeprefix(side)
        if part in _OLD_THUMB:
            return side + _OLD_THUMB[part]
    return name


def _plain(name: str) -> dict[str, Any]:
    """The VRM 0.x table of a material that is shown with its glTF properties."""
    tables = ("floatProperties", "vectorProperties", "textureProperties", "keywordMap", "tagMap")
    return {
        "name": name, "shader": "VRM_USE_GLTFSHADER", "renderQueue": 2000,
        **{table: {} for table in tables},
    }  # fmt: skip
