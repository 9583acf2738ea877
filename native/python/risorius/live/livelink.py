# SPDX-License-Identifier: MIT
"""Decodes Live Link Face over UDP, in the app's ARKit mode.

A packet is big-endian and has one of these versions:

    1, 2   version u8, subject, seconds f64, frame u32, count u8, count x f32
    5      version u8, device, subject, hours i32, minutes i32, seconds i32, frames i32,
           [drop frame u8,] rate u32, count u8, count x f32
    6      version u8, device, subject, frame i32, sub-frame f32, rate i32, denominator i32,
           count u8, count x f32

A text is a u32 length and that number of UTF-8 bytes, without a final zero. Version 6 counts frames
from midnight. While the app sees no face, the packet ends after the subject or the time, or
has the count 0. Values are in the order of NAMES; packets of 51 or 52 values have no rotations.
"""

from __future__ import annotations

import struct
from math import isfinite

import numpy as np

from ..controls import arkit
from .frame import LiveError, Packet

_TURNS = ("yaw", "pitch", "roll")
_ANGLES = [f"{part}.{turn}" for part in ("head", "eyeL", "eyeR") for turn in _TURNS]
NAMES = (*arkit.order("live_link_face_packet"), *_ANGLES)
_SHAPES = 52
# Signs found in a recording of the app: pitch is positive for an eye that looks down, yaw for an
# eye that looks to the person's right. The app's axes therefore point out of the back of the head,
# to the person's left and up; the head's rotation uses the same axes.
_SIGNS = np.array([1.0] * _SHAPES + [-1.0, -1.0, 1.0] * 3, np.float32)
_COUNTS = (len(NAMES), _SHAPES, _SHAPES - 1)
_LONGEST_TEXT = 256
_LARGEST = 100.0  # larger values are no blend shapes or angles of a face


class NoFace(LiveError):  # noqa: N818  not an error of the sender
    """A valid packet without values, because the phone sees no face."""


def decode(data: bytes) -> Packet:
    """Decodes a packet.

    Args:
        data: bytes of the packet.

    Raises:
        NoFace: the packet has no values.
        LiveError: not a packet of Live Link Face, or a value that is no blend shape or angle.
    """
    if not data:
        raise LiveError("an empty packet")
    version = data[0]
    if version not in _HEADS:
        raise LiveError(f"packet version 1, 2, 5 or 6 was expected, found {version}")
    place, device = 1, ""
    if version >= 5:
        device, place = _text(data, place, "device")
    subject, place = _text(data, place, "subject")
    if place == len(data):
        raise NoFace(f"{subject}: no face is seen")
    time, place = _HEADS[version](data, place)
    count = data[place]
    if count == 0 and len(data) == place + 1:
        raise NoFace(f"{subject}: no face is seen")
    if count not in _COUNTS:
        raise LiveError(f"61, 52 or 51 values were expected, found {count}")
    if len(data) != place + 1 + 4 * count:
        raise LiveError(f"{4 * count} bytes of values were expected, found {len(data) - place - 1}")
    values = np.frombuffer(data, ">f4", count, place + 1).astype(np.float32) * _SIGNS[:count]
    if not (np.abs(values) <= _LARGEST).all():  # also false for NaN
        worst = values[_worst(values)]
        raise LiveError(
            f"a value of a face was expected, found {worst}: at most {_LARGEST:g} in size"
        )
    return Packet(subject, device, time, NAMES[:count], values)


def _worst(values: np.ndarray) -> int:  # type: ignore[type-arg]
    return int(np.argmin(np.abs(values) <= _LARGEST))


def _text(data: bytes, place: int, what: str) -> tuple[str, int]:
    if len(data) < place + 4:
        raise LiveError(f"the packet ends before its {what}")
    (length,) = struct.unpack_from(">I", data, place)
    end = place + 4 + length
    if length > _LONGEST_TEXT or end > len(data):
        raise LiveError(f"a {what} of {length} bytes does not fit the packet")
    text = data[place + 4 : end].decode("utf-8", "replace").rstrip("\0")
    shown = "".join(c if c.isprintable() else "?" for c in text)
    return shown, end


def _of_timestamp(data: bytes, place: int) -> tuple[float | None, int]:
    _need(data, place, 13)
    (seconds, _frame) = struct.unpack_from(">dI", data, place)
    return (seconds if isfinite(seconds) and abs(seconds) < 1e12 else None), place + 12


def _of_timecode(data: bytes, place: int) -> tuple[float | None, int]:
    _need(data, place, 21)
    hours, minutes, seconds, frames = struct.unpack_from(">4i", data, place)
    # Some engines send the drop-frame byte, others do not: the length of the packet shows
    # whether it is there.
    place += 16 if _fits(data, place + 20) or not _fits(data, place + 21) else 17
    _need(data, place, 5)
    (rate,) = struct.unpack_from(">I", data, place)
    if not (0 < rate <= 1000 and 0 <= frames < rate):
        return None, place + 4
    return hours * 3600.0 + minutes * 60.0 + seconds + frames / rate, place + 4


def _fits(data: bytes, place: int) -> bool:
    return place < len(data) and len(data) == place + 1 + 4 * data[place]


def _of_frame_time(data: bytes, place: int) -> tuple[float | None, int]:
    if len(data) == place + 16:
        raise NoFace("no face is seen")
    _need(data, place, 17)
    frame, part, rate, denominator = struct.unpack_from(">ifii", data, place)
    if not (rate > 0 and denominator > 0 and 0.0 <= part <= 1.0 and rate <= 1000 * denominator):
        return None, place + 16
    return (frame + part) * denominator / rate, place + 16


def _need(data: bytes, place: int, count: int) -> None:
    if len(data) < place + count:
        raise LiveError("the packet ends before its values")


_HEADS = {1: _of_timestamp, 2: _of_timestamp, 5: _of_timecode, 6: _of_frame_time}
