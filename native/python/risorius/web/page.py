# SPDX-License-Identifier: MIT
"""The page: the empty one that comes with the package, and a face put into it.

packaging/ship/web.sh makes the empty page: the C library as WebAssembly, the viewer and three.js.
"""

from __future__ import annotations

import base64
import gzip
import html
import json
from importlib import resources
from typing import Any

import numpy as np

from .._native import Dna
from ..anim.clip import Clip
from ..base.errors import RisoriusError
from ..controls.regions import TITLES, region_of
from ..rigs.joint_controls import (
    JointControl,
    bone_turns,
    joint_controls,
    shared,
    turn_axes,
    turned_joints,
)
from .pictures import Pictures

_EMPTY = "page.html"
_MARK = "<!--FACE-->"
_SOUNDS = {".wav": "audio/wav", ".mp3": "audio/mpeg", ".ogg": "audio/ogg", ".m4a": "audio/mp4"}
SOUNDS = tuple(_SOUNDS)
Sound = tuple[bytes, str, float]


class WebError(RisoriusError):
    """A page that cannot be made."""

    code = "web"


def empty_page() -> str:
    """The page without a face.

    Raises:
        WebError: the package was built without it.
    """
    place = resources.files(__package__).joinpath(_EMPTY)
    if not place.is_file():
        raise WebError(
            "this build of Risorius has no web page in it: packaging/ship/web.sh makes it, and the "
            "next wheel that is built has it"
        )
    return place.read_text(encoding="utf-8")


def render(
    dna: Dna,
    title: str,
    *,
    pictures: Pictures | None = None,
    clip: Clip | None = None,
    sound: Sound | None = None,
) -> bytes:
    """A page that opens from a file: sliders, levels of detail, a clip.

    Args:
        dna: with behavior and geometry.
        title: of the page.
        pictures: of the meshes, of find_pictures.
        clip: that plays on it, of its raw controls and the angles of neck and head.
        sound: what is heard with the clip: the bytes of a file, its ending (one of SOUNDS), and
            at which second of the clip it begins.

    Returns:
        The page as HTML in UTF-8.

    Raises:
        WebError: there is nothing to show or to play, or no page in this build.
        DnaError: the face cannot be written.
    """
    page = empty_page()
    if not any(len(mesh.positions) for mesh in dna.meshes):
        raise WebError("the file has no meshes: there is nothing to show")
    names = list(dna.raw_control_names)
    table: dict[str, Any] = {
        "title": title,
        "regions": _regions(names),
        "pictures": pictures or {},
        "clip": None,
    }
    parts = [_element("face", dna.to_bytes())]
    if clip is not None:
        table["clip"], values = _clip(clip, names, dna)
        table["clip"]["sound"] = _sound(sound)
        parts.append(_element("clip", values))
    # Nothing in it may end the element that it stands in.
    text = json.dumps(table, separators=(",", ":")).replace("<", "\\u003c")
    parts.insert(0, f'<script type="application/json" id="face-table">{text}</script>')
    page = page.replace("<title>Risorius</title>", f"<title>{html.escape(title)}</title>", 1)
    return page.replace(_MARK, "\n".join(parts), 1).encode()


def _element(name: str, data: bytes) -> str:
    packed = base64.b64encode(gzip.compress(data, 6, mtime=0)).decode()
    kind = 'type="application/octet-stream" data-packed="gzip"'
    return f'<script {kind} id="{name}">{packed}</script>'


def _regions(names: list[str]) -> list[dict[str, Any]]:
    """Raw controls by region, in the order in which regions are shown."""
    of: dict[str, list[int]] = {region: [] for region in TITLES}
    for index, name in enumerate(names):
        of[region_of(name)].append(index)
    return [{"title": TITLES[region], "controls": list_} for region, list_ in of.items() if list_]


def _clip(clip: Clip, names: list[str], dna: Dna) -> tuple[dict[str, Any], bytes]:
    """What the player needs, and float32[frames, controls + 4 * turns].

    First the controls that the clip moves, then the turns of the joints of neck and head as
    quaternions (x, y, z, w) against rest, about the joint's own axes, in the file's space.
    """
    even = clip if clip.times is None else clip.resampled(clip.rate)
    curves = np.nan_to_num(even.curves, nan=0.0, posinf=1.0, neginf=0.0)
    given = dict(zip(even.names, curves, strict=True))
    known = [name for name in even.names if name in set(names)]
    turns = _turns(given, dna) if even.frame_count else {}
    if not (known or turns) or even.frame_count == 0:
        raise WebError("the clip moves no raw control of this face")
    index = {name: i for i, name in enumerate(names)}
    about = {
        "rate": even.rate,
        "frames": even.frame_count,
        "controls": [index[name] for name in known],
        "turns": list(turns),
    }
    columns = [*(given[name][:, None] for name in known), *turns.values()]
    return about, np.ascontiguousarray(np.concatenate(columns, axis=1), "<f4").tobytes()


def _turns(given: dict[str, Any], dna: Dna) -> dict[int, Any]:
    """Joint -> float64[frames, 4]: as its raw controls say, else as the angles of its bone."""
    controls = {item.joint: item for item in joint_controls(dna)[0]}
    raw = dna.raw_control_names
    found = {}
    for joint, (bone, share) in turned_joints(dna.joint_names).items():
        item = controls.get(joint)
        own = [raw[control] for control in item.controls] if item else []
        rows = [given[name] for name in own if name in given]
        turn = bone_turns(bone, given)
        if rows and len(rows) == len(own):
            found[joint] = np.stack(rows, axis=1)
        elif turn is not None:
            plain = JointControl(joint, "", (0, 0, 0, 0), turn_axes(dna, joint))
            found[joint] = plain.values(shared(turn, share))
    return found


def _sound(sound: Sound | None) -> dict[str, Any] | None:
    if sound is None:
        return None
    data, ending, offset = sound
    if ending.lower() not in _SOUNDS:
        raise WebError(f"a sound ending in {', '.join(SOUNDS)} was expected, found {ending!r}")
    url = f"data:{_SOUNDS[ending.lower()]};base64,{base64.b64encode(data).decode()}"
    return {"url": url, "offset": offset}
