# SPDX-License-Identifier: MIT
"""Writes a web page with a face, from the empty page that the package contains.

packaging/ship/web.sh makes the empty page: the C library as WebAssembly, the viewer and three.js.
"""

from __future__ import annotations

import base64
import gzip
import html
import json
import re
from importlib import resources
from typing import Any

import numpy as np

from .._native import Dna
from ..anim.clip import Clip
from ..base.errors import RisoriusError
from ..controls.regions import TITLES, region_of, short_name
from ..importing.mapping import load_mapping
from ..rigs.joint_controls import (
    ANGLES,
    JointControl,
    bone_turns,
    joint_controls,
    shared,
    turn_axes,
    turned_joints,
)
from ..rigs.load import load
from .geometry import pack
from .looks import Looks, find_looks

_EMPTY = "page.html"
_MARK = "<!--FACE-->"
# Matches the scripts of the empty page with the ids "library" and "viewer".
_ELEMENT = re.compile(r'<script[^>]* id="(library|viewer)"[^>]*>([^<]*)</script>')
_BOOT = re.compile(r"<script>(/\*BOOT\*/.*?)</script>", re.DOTALL)
# Layers of the DNA file that the evaluator needs. The geometry layer is not among them, because
# the page stores meshes in fewer bytes.
RIG = (
    "behavior",
    "machine_learned_behavior",
    "rbf_behavior",
    "joint_behavior_metadata",
    "twist_swing_behavior",
)
_CAPTURES = "live_link_face"  # mapping for tables that a user drops on the page
_SOUNDS = {".wav": "audio/wav", ".mp3": "audio/mpeg", ".ogg": "audio/ogg", ".m4a": "audio/mp4"}
SOUNDS = tuple(_SOUNDS)
Sound = tuple[bytes, str, float]


class WebError(RisoriusError):
    """A page that cannot be written."""

    code = "web"


def empty_page() -> str:
    """The HTML of the page without a face.

    Raises:
        WebError: the package was built without the page.
    """
    place = resources.files(__package__).joinpath(_EMPTY)
    if not place.is_file():
        raise WebError(
            "this build of Risorius has no web page: packaging/ship/web.sh makes it, "
            "then the wheel must be built again"
        )
    return place.read_text(encoding="utf-8")


def render(
    dna: Dna,
    title: str,
    *,
    looks: Looks | None = None,
    clip: Clip | None = None,
    sound: Sound | None = None,
) -> bytes:
    """Writes a page that needs no server; it shows the face with controls, LODs and a clip.

    Args:
        dna: face with behavior and geometry.
        title: title of the page.
        looks: materials and pictures from find_looks; None: plain materials by the meshes' names.
        clip: clip to play, with raw controls and angles of neck and head.
        sound: sound of the clip: bytes of a file, its suffix (one of SOUNDS), and the second of the
            clip at which it starts.

    Returns:
        The page as HTML in UTF-8.

    Raises:
        WebError: the face has no meshes, the clip moves nothing, or this build has no page.
        DnaError: the face cannot be written.
    """
    page = empty_page()
    table, files = _content(dna, title, looks, clip, sound)
    text = _json(table)
    parts = [f'<script type="application/json" id="face-table">{text}</script>']
    kind = 'type="application/octet-stream"'
    parts += [f'<script {kind} id="{name}">{data}</script>' for name, data in files.items()]
    page = page.replace("<title>Risorius</title>", f"<title>{html.escape(title)}</title>", 1)
    return page.replace(_MARK, "\n".join(parts), 1).encode()


def render_script(
    dna: Dna,
    name: str,
    *,
    looks: Looks | None = None,
    clip: Clip | None = None,
    sound: Sound | None = None,
) -> bytes:
    """Writes a script with the face and the viewer, for pages of the user's own.

    `<script src="face.js"></script>` and `<risorius-face></risorius-face>` show it.

    Args:
        dna: face with behavior and geometry.
        looks: materials and pictures from find_looks; None: plain materials by the meshes' names.
        clip: clip to play, with raw controls and angles of neck and head.
        sound: sound of the clip: bytes of a file, its suffix (one of SOUNDS), and the second of the
            clip at which it starts.
        name: name by which `<risorius-face name="...">` finds the face; the first face needs none.

    Returns:
        JavaScript as ASCII bytes.

    Raises:
        WebError: the face has no meshes, the clip moves nothing, or the page in this build is
            missing or outdated.
        DnaError: the face cannot be written.
    """
    page = empty_page()
    viewer, boot = dict(_ELEMENT.findall(page)), _BOOT.search(page)
    if boot is None or "viewer" not in viewer:
        raise WebError(
            "the web page in this build of Risorius is outdated: packaging/ship/web.sh renews it"
        )
    table, files = _content(dna, name, looks, clip, sound)
    face = f'{{"table":{_json(table)},"files":{_json({**files, **viewer})}}}'
    return (
        "// Made by Risorius (MIT), with three.js (MIT).\n"
        f"((globalThis.risoriusFaces ??= {{}})[{_json(name)}] = {face});\n{boot[1]}\n"
    ).encode("ascii")


def _json(value: Any) -> str:
    """JSON text without characters that could end the HTML element in which it is written."""
    return json.dumps(value, separators=(",", ":")).replace("<", "\\u003c")


def _content(
    dna: Dna, title: str, looks: Looks | None, clip: Clip | None, sound: Sound | None
) -> tuple[dict[str, Any], dict[str, str]]:
    """The JSON table of the page, and file name -> packed content as text."""
    if not any(len(mesh.positions) for mesh in dna.meshes):
        raise WebError("the file has no meshes: there is nothing to show")
    looks = looks or find_looks(dna)
    names = list(dna.raw_control_names)
    packed = pack(dna)
    for mesh in packed.about:
        mesh["material"] = looks.of_mesh[dna.mesh_names[mesh["index"]]]
    table: dict[str, Any] = {
        "title": title,
        "regions": _regions(names),
        "meshes": packed.about,
        "materials": looks.materials,
        "pictures": [[media, len(data)] for media, data in looks.pictures],
        "captures": _captures(names),
        "bones": _bones(dna),
        "clip": None,
    }
    files = {"face": _packed(_rig(dna)), "geometry": _packed(packed.data)}
    if looks.pictures:
        files["pictures"] = _packed(b"".join(data for _, data in looks.pictures), 0)
    if clip is not None:
        table["clip"], values = _clip(clip, names, dna)
        table["clip"]["sound"] = _sound(sound)
        files["clip"] = _packed(values)
    return table, files


def _rig(dna: Dna) -> bytes:
    """The bytes of the DNA file without its meshes."""
    return load(dna.to_bytes(), layers=RIG).to_bytes()


def _packed(data: bytes, level: int = 9) -> str:
    return base64.b64encode(gzip.compress(data, level, mtime=0)).decode()


def _captures(names: list[str]) -> dict[str, Any]:
    """The mapping with which the page reads tables of captures that a user drops on it.

    Returns:
        "rows": curve -> list of [control, weight], the control being a raw control's index or the
        name of an angle. "shares": list of [index of control A, index of control B]: the value of A
        is divided by the value of B, such as mouthClose by jawOpen.
    """
    mapping = load_mapping(_CAPTURES)
    index = {short_name(name): i for i, name in enumerate(names)}
    index |= {name: i for i, name in enumerate(names)}

    def place(control: str) -> int | str | None:
        if control in (angle for angles in ANGLES.values() for angle in angles):
            return control
        return index.get(control, index.get(short_name(control)))

    rows = {
        curve: [[place(c), weight] for c, weight in row.items() if place(c) is not None]
        for curve, row in mapping.rows.items()
    }
    shares = [[place(c), place(whole)] for c, whole in mapping.shares.items()]
    return {
        "rows": {curve: row for curve, row in rows.items() if row},
        "shares": [pair for pair in shares if None not in pair],
    }


def _bones(dna: Dna) -> list[dict[str, Any]]:
    """A table for each joint that rotates with the neck or head.

    The table contains the joint's fraction of the neck's or head's rotation, the matrix (9 numbers)
    from the face's axes to the joint's axes, and the raw controls of the joint's rotation.
    """
    controls = {item.joint: item for item in joint_controls(dna)[0]}
    return [
        {
            "joint": joint,
            "bone": bone,
            "share": share,
            "axes": np.asarray(turn_axes(dna, joint), float).ravel().tolist(),
            "controls": list(controls[joint].controls) if joint in controls else [],
        }
        for joint, (bone, share) in turned_joints(dna.joint_names).items()
    ]


def _regions(names: list[str]) -> list[dict[str, Any]]:
    """The raw controls of each region, in the order in which the page shows regions."""
    of: dict[str, list[int]] = {region: [] for region in TITLES}
    for index, name in enumerate(names):
        of[region_of(name)].append(index)
    return [{"title": TITLES[region], "controls": list_} for region, list_ in of.items() if list_]


def _clip(clip: Clip, names: list[str], dna: Dna) -> tuple[dict[str, Any], bytes]:
    """The page's table about the clip, and float32[frames, controls + 4 * turns] as bytes.

    `turns` is the number of joints of neck and head that the clip rotates. The columns are the
    controls that the clip moves, then for each of these joints its rotation from the rest pose, as
    a quaternion x, y, z, w in the joint's own axes.
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
    """Joint -> float64[frames, 4], its rotation from the rest pose as a quaternion x, y, z, w.

    The rotation comes from the joint's four raw controls if the clip has all of them, else from the
    angles of neck or head. Joints for which the clip has neither are left out.
    """
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
        raise WebError(
            f"a sound file with a name ending in {' or '.join(SOUNDS)} was expected, found "
            f"{ending!r}"
        )
    url = f"data:{_SOUNDS[ending.lower()]};base64,{base64.b64encode(data).decode()}"
    return {"url": url, "offset": offset}
