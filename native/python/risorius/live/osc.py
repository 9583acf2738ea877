# SPDX-License-Identifier: MIT
"""Decodes faces over OSC: VMC, Face Cap and similar apps, and messages with a name and a value.

    /VMC/Ext/Blend/Val  name value      a blend shape; /VMC/Ext/Blend/Apply ends the face
    /VMC/Ext/Bone/Pos   name px py pz qx qy qz qw     Neck, Head, LeftEye and RightEye are used
    /W index value                      a unit by its index in FACE_CAP
    /HRQ x y z w, /HR x y z             the head, as a quaternion or in degrees
    /ELR x y, /ERR x y                  the eyes, in degrees
    /any/path/name value                any other value, by the last part of the path

Messages arrive singly or in bundles. A face is complete at its Apply message. If the sender sends
no Apply, a face is complete at the end of a bundle, when a message repeats one of its names, or
after a short silence.
"""

from __future__ import annotations

import math
import struct
from collections.abc import Callable, Iterable, Iterator
from time import perf_counter
from typing import Any

import numpy as np

from ..controls import arkit
from ..rigs.rotation import product
from .frame import LiveError, Packet, turn_angles, unit_name
from .roster import MOST, Roster

FACE_CAP = arkit.order("face_cap")
_BUNDLE = b"#bundle\0"
_DEEPEST = 8
_MOST_NAMES = 512
_LONGEST_NAME = 64
_LARGEST = 100.0
_NTP_EPOCH = 2208988800  # seconds from 1900 to 1970
_NEEDS = "OSC needs the package python-osc, which is not installed: pip install risorius[live]"


def messages(data: bytes, depth: int = 0) -> Iterator[tuple[str, list[Any]]]:
    """The messages of a packet and of its nested bundles, in order.

    Sizes of parts are checked here, because python-osc loops endlessly on a negative size.

    Args:
        data: bytes of the packet.
        depth: number of enclosing bundles.

    Raises:
        LiveError: the packet is not OSC.
    """
    if not data.startswith(_BUNDLE):
        yield _message(data)
        return
    if depth == _DEEPEST:
        raise LiveError("OSC bundles are nested too deep")
    place = 16
    while place < len(data):
        if len(data) < place + 4:
            raise LiveError("a complete OSC bundle was expected, found one that is cut short")
        (size,) = struct.unpack_from(">i", data, place)
        place += 4
        if size <= 0 or size % 4 or place + size > len(data):
            raise LiveError(f"a part of {size} bytes does not fit its bundle")
        yield from messages(data[place : place + size], depth + 1)
        place += size


def bundle_time(data: bytes) -> float | None:
    """Time tag of a bundle in seconds since 1970; None for "immediately" and for a message."""
    if not data.startswith(_BUNDLE) or len(data) < 16:
        return None
    whole, part = struct.unpack_from(">II", data, 8)
    return None if whole == 0 else whole - _NTP_EPOCH + part / 2**32


def require() -> None:
    """Raises LiveError if python-osc is missing, so that the error comes before any packet."""
    try:
        import pythonosc  # noqa: F401
    except ImportError as error:
        raise LiveError(_NEEDS) from error


def _message(data: bytes) -> tuple[str, list[Any]]:
    from pythonosc.osc_message import OscMessage, ParseError

    end = data.find(b"\0")
    tags = data[(end + 4) & ~3 :].split(b"\0", 1)[0]
    if not data.startswith(b"/") or end < 2 or tags.strip(b",ifhdsTF") or len(tags) > 64:
        raise LiveError("a message of OSC was expected")
    try:
        message = OscMessage(data)
        return message.address, message.params
    except (ParseError, ValueError, IndexError, struct.error) as error:
        raise LiveError(
            "a complete OSC message was expected, found one that is cut short"
        ) from error


class Decoder:
    """Combines the messages of each sender into faces.

    Args:
        wanted: function that returns for the address of a sender whether this sender always gets
            one of the limited places for senders.
    """

    def __init__(self, wanted: Callable[[str], bool] = lambda _sender: False) -> None:
        self._faces: Roster[str, _Face] = Roster(lambda face: wanted(face.sender))

    def feed(self, data: bytes, sender: str, now: float | None = None) -> list[Packet]:
        """Processes a packet.

        Args:
            data: bytes of the packet.
            sender: address of the sender, which becomes the subject of its faces.
            now: time of arrival in seconds of perf_counter; None: the present time.

        Returns:
            The faces that the packet completes.

        Raises:
            LiveError: not OSC, an impossible value (values of earlier messages are kept), or a new
                sender for which no place is free.
        """
        found = list(messages(data))
        now = perf_counter() if now is None else now
        face = self._faces.hear(sender, now)
        if face is None:
            face = _Face(sender)
            if not self._faces.add(sender, face, now, sender):
                raise LiveError(
                    f"{MOST} senders are received at once: there is no room for another that is "
                    "not named as the subject to follow"
                )
        time, done = bundle_time(data), []
        for address, values in found:
            if packet := face.take(address, values, time):
                done.append(packet)
        if data.startswith(_BUNDLE) and not face.applies and (packet := face.finish()):
            done.append(packet)
        return done

    def pending(self) -> bool:
        """Whether a sender without Apply messages has an incomplete face, which silence ends."""
        return any(face.fresh and not face.applies for face in self._faces)

    def flush(self) -> list[Packet]:
        """Completes the faces whose end only silence can mark, and returns them."""
        waiting = [face for face in self._faces if face.fresh and not face.applies]
        return [packet for face in waiting if (packet := face.finish())]


class _Face:
    """The latest values of one sender; a name that the sender omits keeps its value."""

    def __init__(self, sender: str) -> None:
        self.sender = sender
        self.values: dict[str, float] = {}
        self._age: dict[str, int] = {}  # name -> number of the last face that changed it
        self._number = 0
        self.bones: dict[str, tuple[float, ...]] = {}
        self.fresh: set[str] = set()
        self.applies = False
        self.time: float | None = None
        self.quaternion = False

    def take(self, address: str, values: list[Any], time: float | None) -> Packet | None:
        """Processes a message.

        Args:
            address: address of the message, such as /VMC/Ext/Blend/Val.
            values: arguments of the message.
            time: time tag of its bundle in seconds since 1970, or None.

        Returns:
            The face that this message completes, or None. For a sender without Apply messages, that
            is the face before the message if the message repeats one of its names.
        """
        if address == "/VMC/Ext/Blend/Apply":
            self.applies = True
            return self.finish()
        read = _READERS.get(address)
        if read is None:
            if address.startswith("/VMC/") or len(values) != 1:
                return None
            key, changes = _named(address.rpartition("/")[2], values[0])
        else:
            key, changes = read(self, values)
        done = self.finish() if key in self.fresh and not self.applies else None
        if not changes:
            return done
        self._make_room(changes)
        if not self.fresh:
            self.time = time
        self.fresh.add(key)
        self.values.update(changes)
        self._age.update(dict.fromkeys(changes, self._number))
        return done

    def _make_room(self, changes: dict[str, float]) -> None:
        """If there are too many names, drops the names that were not sent for the longest time."""
        if len(self.values.keys() | changes.keys()) <= _MOST_NAMES:
            return
        others = sorted(self._age.keys() - changes.keys(), key=self._age.__getitem__)
        for name in others[: len(others) + len(changes) - _MOST_NAMES]:
            del self.values[name], self._age[name]
            self.fresh.discard(name)

    def finish(self) -> Packet | None:
        """The face with the latest values, or None if no value is new."""
        if not self.fresh:
            return None
        self.fresh.clear()
        self._number += 1
        values = np.fromiter(self.values.values(), np.float32, len(self.values))
        return Packet(self.sender, "", self.time, tuple(self.values), values)


def _numbers(values: list[Any], count: int) -> tuple[float, ...]:
    """The first `count` values as floats. Raises: LiveError: too few, or not values of a face."""
    if len(values) < count:
        raise LiveError(f"{count} numbers were expected, found {len(values)}")
    numbers = tuple(float(v) if isinstance(v, int | float) else math.nan for v in values[:count])
    if not all(abs(v) <= _LARGEST * 10.0 for v in numbers):
        raise LiveError(
            f"numbers of a face were expected, found {numbers}: at most {_LARGEST * 10.0:g} in size"
        )
    return numbers


def _named(name: Any, value: Any) -> tuple[str, dict[str, float]]:
    if not isinstance(name, str) or not name or len(name) > _LONGEST_NAME:
        raise LiveError(f"a name of at most {_LONGEST_NAME} letters was expected")
    if isinstance(value, str):
        return name, {}
    (number,) = _numbers([value], 1)
    if abs(number) > _LARGEST:
        raise LiveError(
            f"{name}: a value of a face was expected, found {number}: at most {_LARGEST:g} in size"
        )
    unit = name if name.startswith("CTRL_") else unit_name(name)
    return unit, {unit: number}


def _blend(_face: _Face, values: list[Any]) -> tuple[str, dict[str, float]]:
    if len(values) < 2:
        raise LiveError("a name and a value were expected")
    return _named(values[0], values[1])


def _indexed(_face: _Face, values: list[Any]) -> tuple[str, dict[str, float]]:
    if len(values) < 2 or not isinstance(values[0], int) or not 0 <= values[0] < len(FACE_CAP):
        raise LiveError(f"an index below {len(FACE_CAP)} and a value were expected")
    return _named(FACE_CAP[values[0]], values[1])


def _bone(face: _Face, values: list[Any]) -> tuple[str, dict[str, float]]:
    if not values or not isinstance(values[0], str):
        raise LiveError("a bone's name and seven numbers were expected")
    name = values[0]
    if name not in ("Neck", "Head", "LeftEye", "RightEye"):
        return f"bone {name}"[:_LONGEST_NAME], {}
    face.bones[name] = _unit(_numbers(values[1:], 7)[3:])
    if name in ("Neck", "Head"):
        still = (0.0, 0.0, 0.0, 1.0)
        neck, head = (np.array(face.bones.get(bone, still)) for bone in ("Neck", "Head"))
        yaw, pitch, roll = _angles(product(neck, head))
        return name, {"head.yaw": yaw, "head.pitch": pitch, "head.roll": roll}
    yaw, pitch, _ = _angles(face.bones[name])
    side = name[0]
    return name, {f"eye{side}.yaw": yaw, f"eye{side}.pitch": pitch}


def _head_quaternion(face: _Face, values: list[Any]) -> tuple[str, dict[str, float]]:
    face.quaternion = True
    x, y, z, w = _unit(_numbers(values, 4))
    # ARKit's axes point to the head's own left, up and ahead, and `_angles` expects own right
    # instead of left. This negates y and z.
    yaw, pitch, roll = _angles((x, -y, -z, w))
    return "HRQ", {"head.yaw": yaw, "head.pitch": pitch, "head.roll": roll}


def _head_degrees(face: _Face, values: list[Any]) -> tuple[str, dict[str, float]]:
    x, y, z = (math.radians(v) for v in _numbers(values, 3))
    # If the sender also sends quaternions, these angles are the same rotation in an undefined
    # order, and are ignored.
    if face.quaternion:
        return "HR", {}
    return "HR", {"head.yaw": y, "head.pitch": -x, "head.roll": -z}


def _eye(side: str) -> Any:
    def read(_face: _Face, values: list[Any]) -> tuple[str, dict[str, float]]:
        x, y = (math.radians(v) for v in _numbers(values, 2))
        return f"E{side}R", {f"eye{side}.yaw": y, f"eye{side}.pitch": -x}

    return read


def _unit(q: tuple[float, ...]) -> tuple[float, ...]:
    length = math.hypot(*q)
    if length < 1e-6:
        raise LiveError("a rotation was expected, found a quaternion of zeros")
    return tuple(v / length for v in q)


def _angles(q: Iterable[float]) -> tuple[float, float, float]:
    """Yaw, pitch, roll in radians of a quaternion x, y, z, w; axes: own right, up, ahead."""
    x, y, z, w = q
    right = np.array([1 - 2 * (y * y + z * z), 2 * (x * y + z * w), 2 * (x * z - y * w)])
    up = np.array([2 * (x * y - z * w), 1 - 2 * (x * x + z * z), 2 * (y * z + x * w)])
    ahead = np.array([2 * (x * z + y * w), 2 * (y * z - x * w), 1 - 2 * (x * x + y * y)])
    return turn_angles(ahead, right, up)


_READERS: dict[str, Any] = {
    "/VMC/Ext/Blend/Val": _blend,
    "/VMC/Ext/Bone/Pos": _bone,
    "/W": _indexed,
    "/HRQ": _head_quaternion,
    "/HR": _head_degrees,
    "/ELR": _eye("L"),
    "/ERR": _eye("R"),
}
