# SPDX-License-Identifier: MIT
"""Writes binary FBX in the layout of Autodesk's SDK, limited to the parts that the reader uses.

A file has a header and records of (end, count, length, name). Values begin with a type letter,
arrays from 128 bytes on are compressed with zlib, and an empty record ends each list. Offsets have
32 bits up to version 7.4, and 64 bits from 7.5 on. An animated user property belongs to its node;
its curve is linked to a curve node through "d|NAME", and the curve node to the node through "NAME",
as in float curves of Unreal's exporter. Key times are in units of 1/46186158000 s; the slopes after
a key and before the next key are per second.
"""

from __future__ import annotations

import struct
import zlib

import numpy as np

TICKS = 46186158000
LINEAR, CONSTANT, CUBIC = 0x4, 0x2, 0x8
USER, AUTO = 0x400, 0x100


class I64(int):
    """An integer that is written with 64 bits; other integers are written with 32 bits."""


def value(v) -> bytes:
    if isinstance(v, I64):
        return b"L" + struct.pack("<q", v)
    if isinstance(v, int):
        return b"I" + struct.pack("<i", v)
    if isinstance(v, float):
        return b"D" + struct.pack("<d", v)
    if isinstance(v, str):
        return b"S" + struct.pack("<I", len(v.encode())) + v.encode()
    if isinstance(v, bytes):
        return b"R" + struct.pack("<I", len(v)) + v
    letter = {"f4": b"f", "f8": b"d", "i8": b"l", "i4": b"i"}[v.dtype.str[1:]]
    raw = v.tobytes()
    packed = zlib.compress(raw) if len(raw) >= 128 else raw
    return letter + struct.pack("<III", v.size, len(raw) >= 128, len(packed)) + packed


def record(at: int, version: int, name: str, values=(), inner=()) -> bytes:
    form = "<QQQB" if version >= 7500 else "<IIIB"
    size = struct.calcsize(form)
    body = b"".join(map(value, values))
    start = at + size + len(name)
    rest = b""
    for child in inner:
        rest += record(start + len(body) + len(rest), version, *child)
    if inner:
        rest += bytes(size)
    end = start + len(body) + len(rest)
    return struct.pack(form, end, len(values), len(body), len(name)) + name.encode() + body + rest


def fbx(tops, version: int = 7400) -> bytes:
    out = b"Kaydara FBX Binary  \x00\x1a\x00" + struct.pack("<I", version)
    for top in tops:
        out += record(len(out), version, *top)
    return out + bytes(25 if version >= 7500 else 13)


def curve(identity: int, times, values, flags=LINEAR, slopes=None):
    """Record of an AnimationCurve.

    Args:
        identity: number of the object in the file.
        times: times of the keys in seconds.
        values: values of the keys.
        flags: attributes of all keys: LINEAR, CONSTANT or CUBIC, with USER or AUTO.
        slopes: float[keys, 2], per second: after the key and before the next key. None: all keys
            share one entry of attributes with slopes 0.
    """
    count = len(times)
    data = np.zeros((count if slopes is not None else 1, 4), "<f4")
    if slopes is not None:
        data[:, :2] = slopes
    runs = [1] * count if slopes is not None else [count]
    return (
        "AnimationCurve",
        (I64(identity), "\0\1AnimCurve", ""),
        [
            ("Default", (0.0,)),
            ("KeyVer", (4009,)),
            ("KeyTime", (np.round(np.array(times) * TICKS).astype("<i8"),)),
            ("KeyValueFloat", (np.array(values, "<f4"),)),
            ("KeyAttrFlags", (np.full(len(runs), flags, "<i4"),)),
            ("KeyAttrDataFloat", (data.ravel(),)),
            ("KeyAttrRefCount", (np.array(runs, "<i4"),)),
        ],
    )


def animation(tracks, *, version=7400, stacks=("Take 001",), time_mode=3):
    """Bytes of an FBX file with curves.

    Args:
        tracks: rows (kind, object, property, {component: curve record}, stack): class of the
            object with an optional subclass after a slash, name of the object, animated property,
            results of `curve`, index in `stacks`.
        version: version of the format, 7400 for 7.4.
        stacks: names of the animation stacks.
        time_mode: FBX's number for the frame rate of the scene.
    """
    objects, links, ids = [], [], iter(range(1000, 9999))
    layers, owners = [], {}
    for name in stacks:
        stack, layer = next(ids), next(ids)
        objects.append(("AnimationStack", (I64(stack), f"{name}\0\1AnimStack", "")))
        objects.append(("AnimationLayer", (I64(layer), "BaseLayer\0\1AnimLayer", "")))
        links.append(("C", ("OO", I64(layer), I64(stack))))
        layers.append(layer)
    for kind, owner, prop, components, stack in tracks:
        if owner not in owners:
            owners[owner] = next(ids)
            name, _, tag = kind.partition("/")
            objects.append(
                (name, (I64(owners[owner]), f"{owner}\0\1{name}", tag), [("Version", (232,))])
            )
        node = next(ids)
        objects.append(("AnimationCurveNode", (I64(node), f"{prop}\0\1AnimCurveNode", "")))
        links.append(("C", ("OO", I64(node), I64(layers[stack]))))
        links.append(("C", ("OP", I64(node), I64(owners[owner]), prop)))
        for component, made in components.items():
            objects.append(made)
            links.append(("C", ("OP", made[1][0], I64(node), component)))
    mode = ("P", ("TimeMode", "enum", "", "", time_mode))
    return fbx(
        [
            ("FBXHeaderExtension", (), [("FBXVersion", (version,))]),
            ("GlobalSettings", (), [("Version", (1000,)), ("Properties70", (), [mode])]),
            ("Objects", (), objects),
            ("Connections", (), links),
        ],
        version,
    )
