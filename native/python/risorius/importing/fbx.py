# SPDX-License-Identifier: MIT
"""Reads binary FBX: animated properties, blend shape channels, and sliders of a face board."""

from __future__ import annotations

import struct
import zlib
from collections import defaultdict
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np
import numpy.typing as npt

from ..base.budget import Budget
from .errors import AnimationFileError
from .keys import CONSTANT, CUBIC, LINEAR, Keys, on_one_clock
from .source import Take, keep_ascending, make_clip

Doubles = npt.NDArray[np.float64]

MAGIC = b"Kaydara FBX Binary  \x00\x1a\x00"
# Keyframe times are stored in ticks. TICKS: ticks per second in files of FBX versions below 8000.
# TICKS_8000: ticks per second in files of version 8000 and later.
TICKS = 46186158000
TICKS_8000 = 141120000
# Value of the property TimeMode in the record GlobalSettings -> frames per second.
TIME_MODES = {
    0: 30.0, 1: 120.0, 2: 100.0, 3: 60.0, 4: 50.0, 5: 48.0, 6: 30.0, 7: 30.0, 8: 30000 / 1001,
    9: 30000 / 1001, 10: 25.0, 11: 24.0, 12: 1000.0, 13: 24000 / 1001, 15: 96.0, 16: 72.0,
    17: 60000 / 1001, 18: 120000 / 1001,
}  # fmt: skip
_TOP = {"GlobalSettings", "Objects", "Connections"}
# Records whose content is skipped, because they are most of a file.
_BULK = frozenset(("Geometry", "Video", "Texture", "Material", "Pose", "Implementation"))
_SCALARS = {"Y": "<h", "C": "<?", "B": "<?", "I": "<i", "F": "<f", "D": "<d", "L": "<q"}
_ARRAYS = {"f": "<f4", "d": "<f8", "l": "<i8", "i": "<i4", "b": "<u1", "c": "<u1"}
_DEEPEST = 32
# Memory in bytes per record, per value of a record and per keyframe of a curve, rounded up.
_NODE_BYTES, _VALUE_BYTES, _KEY_BYTES = 300, 48, 120
# Bits of KeyAttrFlags: interpolation and tangents of a keyframe.
_CONSTANT, _CUBIC, _AUTO, _TCB, _CLAMP, _WEIGHTED = 0x2, 0x8, 0x100, 0x200, 0x5000, 0x3000000


@dataclass(slots=True)
class Packed:
    """An array of a record, still in its stored form; `unfold` unpacks it."""

    parser: Parser
    dtype: np.dtype[Any]
    count: int
    is_packed: bool
    at: int
    size: int

    def unfold(self) -> npt.NDArray[Any]:
        """Unpacks the array. Raises: AnimationFileError: damaged bytes. BudgetError: too large."""
        wanted = self.count * self.dtype.itemsize
        data = memoryview(self.parser.data)[self.at : self.at + self.size]
        if self.is_packed:
            self.parser.budget.hold(3 * wanted, f"byte {self.at}: an array of {self.count}")
            try:
                data = memoryview(zlib.decompressobj().decompress(data, wanted + 1))
            except zlib.error as error:
                raise self.parser.fail(
                    self.at, f"an array packed with zlib was expected: {error}"
                ) from error
        if len(data) != wanted:
            raise self.parser.fail(
                self.at, f"{wanted} bytes of an array were expected, found {len(data)}"
            )
        return np.frombuffer(data, self.dtype)


@dataclass(slots=True)
class Node:
    """A record of the file: name, values, nested records."""

    name: str
    values: list[Any]
    inner: list[Node] = field(default_factory=list)

    def first(self, name: str) -> Node | None:
        return next((node for node in self.inner if node.name == name), None)

    def array(self, name: str) -> npt.NDArray[Any]:
        """The unpacked array of a nested record; empty if there is none."""
        node = self.first(name)
        value = node.values[0] if node is not None and node.values else None
        return value.unfold() if isinstance(value, Packed) else np.zeros(0)

    def length(self, name: str) -> int:
        """The length that the file states for the array of a nested record, before the array is
        unpacked; 0 if there is none."""
        node = self.first(name)
        value = node.values[0] if node is not None and node.values else None
        return value.count if isinstance(value, Packed) else 0


def is_fbx(data: bytes) -> bool:
    return data[:20] == MAGIC[:20]


def is_text_fbx(text: str) -> bool:
    """Whether a text is an FBX file in text form, which this module cannot read."""
    head = text[:2000]
    return "FBXHeaderExtension:" in head or head.lstrip().startswith("; FBX")


class Parser:
    """Parses the records of a file.

    Args:
        data: the whole file.
        name: the file's name in errors.
        budget: limits memory and work.
        skipped: kinds of objects whose nested records are not read.
    """

    def __init__(
        self, data: bytes, name: str, budget: Budget, skipped: frozenset[str] = _BULK
    ) -> None:
        self.data = data
        self.name = name
        self.budget = budget
        self.skipped = skipped
        if len(data) < 27:
            raise self.fail(len(data), "a header of 27 bytes was expected")
        self.version = struct.unpack_from("<I", data, 23)[0]
        if not 7100 <= self.version < 9000:
            raise self.fail(23, f"FBX 7.1 to 8.x was expected, found {self.version}")
        # Since FBX 7.5 offsets have 64 bits.
        self.head = struct.Struct("<QQQB" if self.version >= 7500 else "<IIIB")

    def fail(self, at: int, message: str) -> AnimationFileError:
        """Makes an AnimationFileError that names the file and the byte.

        Args:
            at: offset in the file, bytes.
            message: the expected and the found value.
        """
        return AnimationFileError(self.name, f"byte {at}: {message}")

    def top(self) -> dict[str, Node]:
        """The records GlobalSettings, Objects and Connections, by name, if the file has them."""
        return {node.name: node for node in self._records(27, len(self.data), 0)}

    def _records(self, at: int, end: int, depth: int) -> Iterator[Node]:
        while at + self.head.size <= end:
            stop, count, length, name_length = self.head.unpack_from(self.data, at)
            if stop == 0:
                return  # the empty record that closes a list
            start = at + self.head.size + name_length
            if not start + length <= stop <= end:
                raise self.fail(at, f"a record that ends by byte {end} was expected, found {stop}")
            name = self.data[at + self.head.size : start].decode("utf-8", "replace")
            if depth > 0 or name in _TOP:
                yield self._record(name, start, count, start + length, stop, depth)
            at = stop

    def _record(self, name: str, at: int, count: int, end: int, stop: int, depth: int) -> Node:
        node = Node(name, [])
        if depth >= _DEEPEST:
            raise self.fail(at, f"at most {_DEEPEST} levels of nested records were expected")
        if count > end - at:
            raise self.fail(
                at, f"a record of {count} values was expected, its {end - at} bytes are too few"
            )
        self.budget.hold(_NODE_BYTES + count * _VALUE_BYTES, f"byte {at}: a record {name[:40]}")
        for _ in range(count):
            value, at = self._value(at, end)
            node.values.append(value)
        if not (depth == 1 and name in self.skipped):
            node.inner = list(self._records(end, stop, depth + 1))
        return node

    def _value(self, at: int, end: int) -> tuple[Any, int]:
        kind = chr(self.data[at]) if at < end else ""
        at += 1
        if kind in _SCALARS and kind:
            form = struct.Struct(_SCALARS[kind])
            if at + form.size > end:
                raise self.fail(at, "a value was expected, the record is cut short")
            return form.unpack_from(self.data, at)[0], at + form.size
        if kind in ("S", "R"):
            length = self._length(at, end, 4)[0]
            if at + 4 + length > end:
                raise self.fail(at, f"{length} bytes were expected, the record is cut short")
            text = self.data[at + 4 : at + 4 + length]
            return (text.decode("utf-8", "replace") if kind == "S" else text), at + 4 + length
        if kind in _ARRAYS and kind:
            return self._array(np.dtype(_ARRAYS[kind]), at, end)
        raise self.fail(at - 1, f"a value's type was expected, found {kind!r}")

    def _length(self, at: int, end: int, size: int) -> tuple[int, ...]:
        if at + size > end:
            raise self.fail(at, "a length was expected, the record is cut short")
        return struct.unpack_from(f"<{size // 4}I", self.data, at)

    def _array(self, dtype: np.dtype[Any], at: int, end: int) -> tuple[Packed, int]:
        count, encoding, size = self._length(at, end, 12)
        start = at + 12
        if start + size > end or encoding not in (0, 1):
            raise self.fail(
                at, f"an array of {count} values in {size} bytes does not fit its record"
            )
        return Packed(self, dtype, count, encoding == 1, start, size), start + size


@dataclass
class Scene:
    """The settings, objects and connections of a file.

    Attributes:
        name: the file's name in errors.
        ticks: units of the key times per second.
        settings: GlobalSettings, or None.
        objects: id -> record.
        parents: id -> (parent's id, connected property or "") of each connection, in file order.
        budget: budget of the file.
        notes: sentences for the user about dropped or assumed data.
    """

    name: str
    budget: Budget
    ticks: int
    settings: Node | None
    objects: dict[int, Node]
    parents: dict[int, list[tuple[int, str]]]
    notes: list[str] = field(default_factory=list)
    _keys: dict[int, Keys] = field(default_factory=dict)

    def keys(self, curve: int) -> Keys:
        """A curve's keyframes, unpacked at first use. Args: curve: id of the AnimationCurve."""
        if curve not in self._keys:
            self._keys[curve] = _keys(self, self.objects[curve], self.notes)
        return self._keys[curve]

    @cached_property
    def children(self) -> dict[int, list[int]]:
        """Parent id -> ids of its children in file order; each child once."""
        out: dict[int, list[int]] = {}
        for child, links in self.parents.items():
            self.budget.work(len(links), "connections")
            for parent in dict.fromkeys(at for at, _ in links):
                out.setdefault(parent, []).append(child)
        return out

    def of_kind(self, kind: str) -> dict[int, Node]:
        return {i: node for i, node in self.objects.items() if node.name == kind}


def read(data: bytes, name: str, take: str | None = None, budget: Budget | None = None) -> Take:
    """The curves of one animation stack, which FBX software shows as a take or clip.

    A file without stacks gives all its curves.

    The curve of a blend shape channel has the channel's name, with its percentage as a fraction.
    The curve of a property has the property's name, whichever node has it, because exporters of
    rigs put such properties on any node. A node whose name begins with CTRL_ is a slider of a face
    board: its location gives CTRL_C_jaw.tx, .ty, .tz.

    Args:
        data: the whole file.
        name: the file's name in errors.
        take: name of a stack, or its number from 0; None: the first stack with curves of these
            three kinds.
        budget: limits memory and work; None: a limit by the size of the file.

    Raises:
        AnimationFileError: not a readable FBX, no such stack, or no curves of these kinds.
        BudgetError: the file unpacks to far more than its size.
    """
    scene = read_scene(Parser(data, name, budget or Budget.of(len(data))))
    stacks, components = scene.of_kind("AnimationStack"), _components(scene)
    channels = {object_name(node) for node in scene.of_kind("Deformer").values()}
    notes = scene.notes
    for stack in _chosen(scene, stacks, take):
        curves = _curves(scene, stack, components, channels)
        if not curves:
            continue
        title = object_name(scene.objects[stack]) if stack in scene.objects else ""
        if len(stacks) > 1:
            names = ", ".join(object_name(node) for node in stacks.values())
            notes.append(f"animation {title} is taken of {len(stacks)}: {names[:200]}")
        times, rows = on_one_clock(list(curves.values()), _rate(scene), scene.budget)
        keep = keep_ascending(times, notes, name)
        clip = make_clip(list(curves), rows[:, keep], times[keep], metadata={"take": title})
        return Take(clip, "fbx", "", notes)
    raise AnimationFileError(
        name, "animated properties, blend shapes or CTRL_ nodes were expected, found none"
    )


def read_scene(parser: Parser) -> Scene:
    """Reads the objects of a file and their connections.

    Raises:
        AnimationFileError: a damaged file; the message names the byte.
        BudgetError: more memory or work than a file of its size may need.
    """
    top = parser.top()
    objects = {
        node.values[0]: node
        for node in (top["Objects"].inner if "Objects" in top else [])
        if node.values and isinstance(node.values[0], int)
    }
    parents: dict[int, list[tuple[int, str]]] = defaultdict(list)
    for link in top["Connections"].inner if "Connections" in top else []:
        values = link.values
        if len(values) >= 3 and isinstance(values[1], int) and isinstance(values[2], int):
            way = str(values[3]) if values[0] == "OP" and len(values) > 3 else ""
            parents[values[1]].append((values[2], way))
    ticks = TICKS_8000 if parser.version >= 8000 else TICKS
    return Scene(parser.name, parser.budget, ticks, top.get("GlobalSettings"), objects, parents)


def properties(node: Node | None) -> dict[str, list[Any]]:
    """Name -> values of the properties in Properties70; the file omits properties at default."""
    table = node.first("Properties70") if node is not None else None
    rows = [p for p in (table.inner if table else []) if len(p.values) > 4]
    return {str(p.values[0]): p.values[4:] for p in rows}


def _rate(scene: Scene) -> float:
    """Frames per second of the scene's time mode; 30 if unknown."""
    rows = {name: values[-1] for name, values in properties(scene.settings).items()}
    custom = rows.get("CustomFrameRate")
    if rows.get("TimeMode") == 14 and isinstance(custom, int | float) and 0 < custom < 1e4:
        return float(custom)
    mode = rows.get("TimeMode")
    return TIME_MODES.get(mode, 30.0) if isinstance(mode, int) else 30.0


def object_name(node: Node) -> str:
    """The name of an object without its class and namespace."""
    text = str(node.values[1]) if len(node.values) > 1 else ""
    return text.partition("\0")[0].rpartition(":")[2]


def _chosen(scene: Scene, stacks: dict[int, Node], take: str | None) -> Sequence[int]:
    if take is None:
        return list(stacks) or [0]
    for number, (identity, node) in enumerate(stacks.items()):
        if take in (object_name(node), str(number)):
            return [identity]
    raise AnimationFileError(
        scene.name, f"an animation {take!r} was expected, found none with this name or number"
    )


def _curves(
    scene: Scene, stack: int, components: dict[int, list[tuple[str, int]]], channels: set[str]
) -> dict[str, Keys]:
    """Name -> keyframes of the curves that a stack animates; all curves if `stack` is 0.

    Args:
        scene: the file; its notes get sentences about curves that are left out.
        stack: id of the animation stack, or 0.
        components: id of an AnimationCurveNode -> (component, id of the curve) per curve.
        channels: names of the blend shape channels.
    """
    out: dict[str, Keys] = {}
    bones = 0
    for identity, parts in components.items():
        links = scene.parents.get(identity, [])
        scene.budget.work(1 + sum(len(scene.parents.get(i, [])) for i, way in links if not way),
                          "connections")  # fmt: skip
        if stack and not any(_in_stack(scene, parent, stack) for parent, way in links if not way):
            continue
        for owner, way in _owners(scene, links):
            if owner.name == "Geometry" and way in channels:
                # This is a copy of the blend shape's percentage, which exporters add for other
                # software.
                continue
            scene.budget.work(len(parts), "connections")
            named = _named(scene, owner, way, parts)
            bones += not named
            for name, keys in named:
                if name not in out:
                    out[name] = keys
                    continue
                scene.budget.work(keys.times.size, name)
                if not np.array_equal(out[name].values, keys.values):
                    scene.notes.append(
                        f"{name}: another node moves it differently, the first one is taken"
                    )
    if bones:
        scene.notes.append(f"{bones} track(s) move nodes, not shapes or properties: left out")
    return {name: keys for name, keys in out.items() if keys.times.size}


def _components(scene: Scene) -> dict[int, list[tuple[str, int]]]:
    """Id of an AnimationCurveNode -> (component such as "d|X", id of the curve) per curve."""
    out: dict[int, list[tuple[str, int]]] = defaultdict(list)
    for identity in scene.of_kind("AnimationCurve"):
        for parent, way in scene.parents.get(identity, []):
            owner = scene.objects.get(parent)
            if owner is not None and owner.name == "AnimationCurveNode":
                out[parent].append((way, identity))
    return out


def _owners(scene: Scene, links: Sequence[tuple[int, str]]) -> list[tuple[Node, str]]:
    """(object, property) for each of `links` that ends at a property of an object.

    Args:
        scene: the file.
        links: (parent's id, connected property or "") of each connection.
    """
    return [(scene.objects[i], way) for i, way in links if way and i in scene.objects]


def _in_stack(scene: Scene, layer: int, stack: int) -> bool:
    return any(parent == stack for parent, _ in scene.parents.get(layer, []))


def _named(
    scene: Scene, owner: Node, way: str, parts: Sequence[tuple[str, int]]
) -> list[tuple[str, Keys]]:
    """(name of a curve, its keyframes) for an animated property.

    The list is empty for location, rotation and scale of a node, except the location of a node
    whose name begins with CTRL_.

    Args:
        scene: the file.
        owner: the object with the property.
        way: name of the property.
        parts: (component such as "d|X", id of the curve) of each component.
    """
    name = object_name(owner)
    if way == "DeformPercent":
        return [(name, _scaled(scene, scene.keys(curve), 0.01)) for _, curve in parts[:1]]
    if way == "Lcl Translation" and name.startswith("CTRL_"):
        axes = [(c.rpartition("|")[2].lower(), scene.keys(curve)) for c, curve in parts]
        return [(f"{name}.t{axis}", keys) for axis, keys in axes]
    if way.startswith("Lcl "):
        return []
    last = way.rpartition("|")[2].rpartition(":")[2]
    if len(parts) == 1:
        return [(last, scene.keys(parts[0][1]))]
    return [(f"{last}.{c.rpartition('|')[2]}", scene.keys(curve)) for c, curve in parts]


def _scaled(scene: Scene, keys: Keys, factor: float) -> Keys:
    scene.budget.hold(keys.times.size * 24, "a blend shape's curve")
    return Keys(
        keys.times, keys.values * factor, keys.kinds, keys.leave * factor, keys.arrive * factor
    )


def _keys(scene: Scene, node: Node, notes: list[str]) -> Keys:
    """Reads the keyframes of an AnimationCurve.

    Args:
        scene: the file.
        node: record of the AnimationCurve.
        notes: receives a sentence if weighted tangents are read as unweighted ones.

    Raises:
        AnimationFileError: numbers of times and values differ, a value is not finite, or times do
            not ascend.
    """
    ticks = node.array("KeyTime")
    scene.budget.hold(ticks.size * _KEY_BYTES, f"{ticks.size} keys")
    times = ticks.astype(np.float64) / scene.ticks
    values = node.array("KeyValueFloat").astype(np.float64)
    place = f"animation curve {node.values[0]}"
    if times.size != values.size:
        raise AnimationFileError(
            scene.name, f"{place}: {times.size} values were expected, found {values.size}"
        )
    if not (np.isfinite(values).all() and np.isfinite(times).all()):
        raise AnimationFileError(scene.name, f"{place}: finite values were expected")
    if (np.diff(times) <= 0.0).any():
        raise AnimationFileError(scene.name, f"{place}: key times that ascend were expected")
    flags, slopes = _attributes(node, times.size)
    if (flags & _WEIGHTED).any() and (flags & _CUBIC).any():
        note = "weighted tangents are read as unweighted ones"
        notes += [note] if note not in notes else []
    kinds = np.full(times.size, LINEAR, np.uint8)
    kinds[(flags & _CONSTANT) != 0] = CONSTANT
    kinds[(flags & _CUBIC) != 0] = CUBIC
    if not (kinds == CUBIC).any():
        return Keys(times, values, kinds)
    arrive = np.concatenate([[0.0], slopes[:-1, 1]])
    leave, arrive = _auto(times, values, flags, slopes[:, 0].copy(), arrive)
    return Keys(times, values, kinds, leave, arrive)


def _attributes(node: Node, count: int) -> tuple[npt.NDArray[np.int64], Doubles]:
    """int64[count] and float64[count, 2]: the flags of each keyframe, and two slopes.

    The slopes are the one after the keyframe and the one before the next keyframe. The file stores
    flags and slopes once for each run of consecutive keyframes that share them. If the runs are
    damaged or do not sum to `count`, all keyframes are linear.

    Args:
        node: record of the AnimationCurve.
        count: number of keyframes.
    """
    flags = node.array("KeyAttrFlags").astype(np.int64)
    runs = node.array("KeyAttrRefCount").astype(np.int64)
    data = node.array("KeyAttrDataFloat").astype(np.float64)
    good = 0 < flags.size <= count and flags.size == runs.size
    # Each run is checked on its own, because the sum of very large runs could overflow.
    if not good or (runs < 0).any() or (runs > count).any() or runs.sum() != count:
        return np.full(count, 4, np.int64), np.zeros((count, 2))
    table = np.zeros((flags.size, 4))
    if data.size == table.size and np.isfinite(data).all():
        table = data.reshape(-1, 4)
    return np.repeat(flags, runs), np.repeat(table[:, :2], runs, axis=0)


def _auto(
    times: Doubles, values: Doubles, flags: npt.NDArray[np.int64], leave: Doubles, arrive: Doubles
) -> tuple[Doubles, Doubles]:
    """Sets the slopes of keyframes with automatic tangents.

    The slope is that of the line through the two neighbouring keyframes (at the ends: through the
    keyframe and its only neighbour), or 0 at a clamped extreme.

    Args:
        times, values: float64[keys], seconds and values of the keys.
        flags: int64[keys], KeyAttrFlags.
        leave, arrive: float64[keys], slopes after and before each keyframe; keyframes with other
            tangents keep them.
    """
    automatic = ((flags & _AUTO) != 0) & ((flags & _TCB) == 0)
    if times.size < 2 or not automatic.any():
        return leave, arrive
    slope = np.zeros(times.size)
    slope[1:-1] = (values[2:] - values[:-2]) / (times[2:] - times[:-2])
    slope[0] = (values[1] - values[0]) / (times[1] - times[0])
    slope[-1] = (values[-1] - values[-2]) / (times[-1] - times[-2])
    extreme = np.zeros(times.size, bool)
    extreme[1:-1] = (values[1:-1] - values[:-2]) * (values[2:] - values[1:-1]) <= 0.0
    slope[extreme & ((flags & _CLAMP) != 0)] = 0.0
    return np.where(automatic, slope, leave), np.where(automatic, slope, arrive)
