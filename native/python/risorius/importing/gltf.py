# SPDX-License-Identifier: MIT
"""Reads glTF and GLB: animated morph target weights, and properties animated by pointers."""

from __future__ import annotations

import base64
import binascii
import re
import struct
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, TypeGuard
from urllib.parse import unquote

import numpy as np
import numpy.typing as npt

from ..base.budget import Budget
from ..base.given import GivenError, finite, several, shown, whole
from . import named_json
from .errors import AnimationFileError
from .keys import CONSTANT, CUBIC, LINEAR, Keys, on_one_clock
from .packed import draco, meshopt
from .source import Take, keep_ascending, make_clip, read_bytes

Doubles = npt.NDArray[np.float64]

MAGIC = b"glTF"
# Samples per second into which smooth and stepped curves are converted.
RATE = 60.0
_TYPES = {5120: "<i1", 5121: "<u1", 5122: "<i2", 5123: "<u2", 5125: "<u4", 5126: "<f4"}
FLOATS = (5126,)
COORDINATES = (5120, 5121, 5122, 5123, 5126)
"""Component types of positions, deltas and texture coordinates, including quantised ones."""
INDICES = (5121, 5123, 5125)
_WIDTHS = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4, "MAT4": 16}
_KINDS = {"STEP": CONSTANT, "LINEAR": LINEAR, "CUBICSPLINE": CUBIC}


class Document:
    """A glTF document with its buffers, which are read when needed."""

    def __init__(
        self, path: Path, json: Mapping[str, Any], binary: bytes | None, budget: Budget
    ) -> None:
        self.path = path
        self.budget = budget
        self.name = str(path)
        self.json = json
        self._binary = binary
        self._buffers: dict[int, bytes] = {}
        self._unpacked: dict[int, bytes] = {}
        self._numbers: dict[int, Doubles] = {}

    def fail(self, place: str, message: str) -> AnimationFileError:
        """Makes an AnimationFileError that names the file and a place in its JSON.

        Args:
            place: place in the JSON.
            message: the expected and the found value.
        """
        return AnimationFileError(self.name, f"{place}: {message}")

    def item(self, kind: str, index: object, place: str) -> dict[str, Any]:
        """The table at an index of a list at the top of the JSON.

        Args:
            kind: a list at the top of the JSON, e.g. "accessors".
            index: position in that list, as in the file; may be of any type.
            place: place of the index, for errors.

        Raises:
            AnimationFileError: not an index, or no table at that index.
        """
        rows = self.json.get(kind)
        if not isinstance(rows, list) or isinstance(index, bool) or not isinstance(index, int):
            raise self.fail(place, f"an index of {kind} was expected, found {shown(index)}")
        if not 0 <= index < len(rows) or not isinstance(rows[index], dict):
            raise self.fail(place, f"{kind}[{shown(index)}] was expected, there are {len(rows)}")
        return rows[index]

    def whole(self, table: Mapping[str, Any], key: str, place: str, default: int = 0) -> int:
        """Reads a whole number of 0 or more from a table of the JSON.

        Args:
            table: the table.
            key: the key of the number.
            place: the table's name in errors.
            default: the number if the key is missing.

        Raises:
            AnimationFileError: the value is not a whole number of 0 or more.
        """
        value = table.get(key, default)
        try:
            return whole(value, 0)
        except GivenError as error:
            raise self.fail(f"{place}.{key}", str(error)) from None

    def numbers(self, index: object, place: str) -> Doubles:
        """float64[count]: the values of a scalar accessor; integers become fractions of the
        largest integer of their type.

        Repeated calls return the same array, because a thousand channels may share one.

        Args:
            index: index of the accessor, as in the file.
            place: place of the index, for errors.

        Raises:
            AnimationFileError: no such accessor, an unsupported kind, an accessor beyond its
                buffer, numbers that are not finite.
            BudgetError: more numbers than a file of this size may hold.
        """
        if isinstance(index, int) and not isinstance(index, bool) and index in self._numbers:
            return self._numbers[index]
        accessor = self.item("accessors", index, place)
        at = f"accessors[{index}]"
        kind = accessor.get("componentType")
        if not _is_key(kind, _TYPES) or accessor.get("type") != "SCALAR":
            raise self.fail(at, "numbers one by one were expected (an accessor of the type SCALAR)")
        if "sparse" in accessor:
            raise self.fail(at, "an accessor that is not sparse was expected")
        dtype = np.dtype(_TYPES[kind])
        count = self.whole(accessor, "count", at)
        view = self.item("bufferViews", accessor.get("bufferView"), at)
        view_at = f"bufferViews[{accessor['bufferView']}]"
        if self.whole(view, "byteStride", view_at, dtype.itemsize) != dtype.itemsize:
            raise self.fail(
                view_at,
                (
                    "numbers close together were expected, without the gaps of the "
                    f"byteStride {view['byteStride']}"
                ),
            )
        found = self._viewed(accessor, at, dtype, (count, 1))[:, 0]
        self.budget.hold(count * 3 * 8, at)
        out = found.astype(np.float64)
        if dtype.kind != "f":
            out = np.maximum(out / np.iinfo(dtype).max, -1.0)
        if not np.isfinite(out).all():
            raise self.fail(at, f"finite numbers were expected, found {out[~np.isfinite(out)][0]}")
        self._numbers[int(index)] = out  # type: ignore[call-overload]  # item says it is one
        return out

    def rows(
        self, index: object, place: str, kind: str, components: Sequence[int] = COORDINATES
    ) -> Doubles:
        """float64[count, n]: the values of a mesh accessor; n is 1, 2, 3, 4 or 16 by its kind.

        Supports strided, sparse, quantised and packed accessors. Integers stay integers unless the
        file declares them normalised.

        Args:
            index: index of the accessor, as in the file.
            place: place of the index, for errors.
            kind: "SCALAR", "VEC2", "VEC3", "VEC4" or "MAT4".
            components: allowed component types.

        Raises:
            AnimationFileError: no such accessor, another kind, an accessor beyond its buffer,
                damaged bytes, numbers that are not finite.
            BudgetError: more numbers than a file of this size may hold.
        """
        accessor = self.item("accessors", index, place)
        at = f"accessors[{index}]"
        if accessor.get("type") != kind:
            raise self.fail(at, f"{kind} was expected, found {shown(accessor.get('type'))}")
        component = accessor.get("componentType")
        if not _is_key(component, _TYPES) or component not in components:
            allowed = ", ".join(str(c) for c in components)
            raise self.fail(
                f"{at}.componentType", f"one of {allowed} was expected, found {shown(component)}"
            )
        width = _WIDTHS[kind]
        dtype = np.dtype(_TYPES[component])
        count = self.whole(accessor, "count", at)
        self.budget.hold(count * width * 8, at)
        out = np.zeros((count, width))
        sparse = accessor.get("sparse")
        with np.errstate(invalid="ignore"):  # NaNs may warn here, and are refused below
            if "bufferView" in accessor:
                out[:] = self._viewed(accessor, at, dtype, (count, width))
            if isinstance(sparse, dict):
                self._put_sparse(sparse, f"{at}.sparse", dtype, out)
        if accessor.get("normalized") is True and dtype.kind != "f":
            out = np.maximum(out / np.iinfo(dtype).max, -1.0)
        if not np.isfinite(out).all():
            raise self.fail(at, f"finite numbers were expected, found {out[~np.isfinite(out)][0]}")
        return out

    def _put_sparse(
        self, sparse: Mapping[str, Any], at: str, dtype: np.dtype[Any], out: Doubles
    ) -> None:
        """Writes the rows of a sparse accessor into `out`.

        Args:
            sparse: table `sparse` of the accessor.
            at: place of the table in the JSON, for errors.
            dtype: type of the stored components.
            out: float64[count, n], values of the accessor; changed.
        """
        count = self.whole(sparse, "count", at)
        parts = [sparse.get("indices"), sparse.get("values")]
        if not all(isinstance(part, dict) for part in parts):
            raise self.fail(at, "tables of indices and values were expected")
        indices, values = (part for part in parts if isinstance(part, dict))
        if indices.get("componentType") not in (5121, 5123, 5125):
            raise self.fail(
                f"{at}.indices",
                "indices of type 5121, 5123 or 5125 (unsigned integers) were expected",
            )
        kind = np.dtype(_TYPES[indices["componentType"]])
        self.budget.hold(count * (1 + out.shape[1]) * 8, at)
        rows = self._viewed(indices, f"{at}.indices", kind, (count, 1))[:, 0].astype(np.int64)
        if count and rows.max() >= len(out):
            raise self.fail(
                f"{at}.indices", f"row {rows.max()} was found, a row below {len(out)} was expected"
            )
        out[rows] = self._viewed(values, f"{at}.values", dtype, (count, out.shape[1]))

    def _viewed(
        self, table: Mapping[str, Any], at: str, dtype: np.dtype[Any], shape: tuple[int, int]
    ) -> npt.NDArray[Any]:
        """An array of `shape` at a table's bufferView and byteOffset, with the view's stride.

        Args:
            table: table with a bufferView and byteOffset: an accessor, or a part of a sparse one.
            at: place of the table in the JSON, for errors.
            dtype: type of the stored components.
            shape: number of rows, and of components per row.
        """
        number = table.get("bufferView")
        view = self.item("bufferViews", number, at)
        view_at = f"bufferViews[{number}]"
        row = dtype.itemsize * shape[1]
        stride = self.whole(view, "byteStride", view_at, row)
        if stride < row:
            raise self.fail(
                view_at, f"a stride of {row} bytes or more was expected, found {stride}"
            )
        data, start, size = self._part(number, at)
        inside = self.whole(table, "byteOffset", at)
        length = stride * (shape[0] - 1) + row if shape[0] else 0
        if inside + length > size:
            raise self.fail(
                at,
                f"{shown(length)} bytes from {shown(inside)} of {view_at} were expected, the "
                f"buffer is shorter: {size} bytes",
            )
        return np.ndarray(shape, dtype, data, start + inside, (stride, dtype.itemsize))

    def _part(self, index: object, place: str) -> tuple[bytes, int, int]:
        """(bytes, offset, length) of a buffer view's content, unpacked if it is packed.

        Args:
            index: index of the buffer view, as in the file.
            place: place of the index in the JSON, for errors.
        """
        view = self.item("bufferViews", index, place)
        view_at = f"bufferViews[{index}]"
        number = int(index)  # type: ignore[call-overload]  # item says it is one
        if number in self._unpacked:
            return self._unpacked[number], 0, len(self._unpacked[number])
        try:
            packing = meshopt.packing_of(view)
            if packing is None:
                return self._stored(view, view_at)
            self.budget.hold(packing.size, view_at)
            data, start, size = self._stored(packing.table, f"{view_at}.{packing.name}")
            out = meshopt.unpacked(data[start : start + size], packing)
        except GivenError as error:
            raise self.fail(view_at, str(error)) from None
        self._unpacked[number] = out
        return out, 0, len(out)

    def _stored(self, table: Mapping[str, Any], place: str) -> tuple[bytes, int, int]:
        """(buffer, byteOffset, byteLength) of a table.

        Args:
            table: table of the JSON that names a buffer and a range of its bytes.
            place: place of the table in the JSON, for errors.
        """
        data = self._buffer(table.get("buffer"), place)
        start, size = (self.whole(table, key, place) for key in ("byteOffset", "byteLength"))
        if start + size > len(data):
            raise self.fail(
                place,
                f"{shown(size)} bytes from {shown(start)} were expected, the buffer is shorter: "
                f"{len(data)} bytes",
            )
        return data, start, size

    def view_bytes(self, index: object, place: str) -> bytes:
        """The content of a buffer view, such as a picture.

        Args:
            index: index of the buffer view, as in the file.
            place: place of the index, for errors.

        Raises:
            AnimationFileError: no such view, or one that reaches beyond its buffer.
            BudgetError: more bytes than a file of this size may hold.
        """
        data, start, size = self._part(index, place)
        self.budget.hold(size, place)
        return data[start : start + size]

    def draco(self, table: Mapping[str, Any], place: str) -> draco.DracoMesh:
        """Unpacks the mesh in a primitive's Draco extension.

        Args:
            table: the primitive's extension.
            place: place of the extension, for errors.

        Raises:
            AnimationFileError: no such bytes, not a Draco mesh, or DracoPy is not installed.
        """
        packed = self.view_bytes(table.get("bufferView"), place)
        try:
            return draco.DracoMesh(packed)
        except (GivenError, draco.MissingDracoError) as error:
            raise self.fail(place, str(error)) from None

    def _buffer(self, index: object, place: str) -> bytes:
        table = self.item("buffers", index, place)
        number = int(index)  # type: ignore[call-overload]  # item says it is one
        if number not in self._buffers:
            self._buffers[number] = self._load(table.get("uri"), number)
        return self._buffers[number]

    def _load(self, uri: object, index: int) -> bytes:
        place = f"buffers[{index}]"
        if uri is None:
            if index or self._binary is None:
                raise self.fail(place, "a uri was expected, found none")
            return self._binary
        return self.linked(uri, place)

    def linked(self, uri: object, place: str) -> bytes:
        """The bytes that a uri contains in base64, or the bytes of the file that it names.

        The file must be in the folder of the glTF, or in a folder inside that folder.

        Args:
            uri: uri of a buffer or a picture, as in the file; may be of any type.
            place: place of the uri, for errors.

        Raises:
            AnimationFileError: not a uri, not base64, or no file in this folder.
            BudgetError: more bytes than a file of this size may hold.
        """
        if not isinstance(uri, str):
            raise self.fail(place, f"a uri was expected, found {shown(uri)}")
        if uri.startswith("data:"):
            try:
                return base64.b64decode(uri.partition(",")[2], validate=True)
            except (binascii.Error, ValueError) as error:
                raise self.fail(place, f"base64 was expected: {error}") from error
        file = unquote(uri)
        # Only files in the glTF's folder or below it are read, because a uri could name any file on
        # the disk.
        if re.match(r"[a-zA-Z]+:|[/\\]", file) or ".." in re.split(r"[/\\]", file):
            raise self.fail(
                place,
                "a file beside this one was expected, in the folder of the glTF, "
                f"found {uri[:80]!r}",
            )
        data = read_bytes(self.path.parent / file, found=True)
        # Each reference takes its bytes from the budget, because a short JSON may refer to one
        # large file many times.
        self.budget.hold(len(data), place)
        return data

    def finite(
        self, table: Mapping[str, Any], key: str, default: Sequence[float], place: str
    ) -> Doubles:
        """float64[n], a list of finite numbers in a table of the JSON.

        Args:
            table: the table.
            key: the key of the list.
            default: the list if the key is missing; n is its length.
            place: the table's name in errors.

        Raises:
            AnimationFileError: not a list of finite numbers, or a list of another length.
        """
        value = table.get(key, list(default))
        try:
            found = several(value, finite)
        except GivenError:
            found = ()
        if len(found) != len(default):
            raise self.fail(
                f"{place}.{key}",
                f"{len(default)} finite numbers were expected, found {shown(value)}",
            )
        return np.array(found, np.float64)

    def transform(self, node: Mapping[str, Any], place: str) -> Doubles:
        """float64[4, 4], the matrix from a node to its parent.

        Args:
            node: table of the node.
            place: name of the node for errors.

        Raises:
            AnimationFileError: a matrix, rotation, scale or translation is no list of numbers.
        """
        if "matrix" in node:
            return self.finite(node, "matrix", [0.0] * 16, place).reshape(4, 4).T
        x, y, z, w = self.finite(node, "rotation", [0.0, 0.0, 0.0, 1.0], place)
        out = np.eye(4)
        out[:3, :3] = [
            [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
            [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
            [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
        ]
        out[:3, :3] *= self.finite(node, "scale", [1.0, 1.0, 1.0], place)
        out[:3, 3] = self.finite(node, "translation", [0.0, 0.0, 0.0], place)
        return out


def _is_key(value: object, table: Mapping[Any, object]) -> TypeGuard[Any]:
    """Whether a value of the JSON, of any type, is a key of a table."""
    return isinstance(value, int | str) and value in table


def is_glb(data: bytes) -> bool:
    return data[:4] == MAGIC


def open_glb(path: Path, data: bytes, budget: Budget | None = None) -> Document:
    """Opens a GLB, the binary form of glTF.

    Args:
        path: path of the file; its buffers are in the same folder, and errors name it.
        data: the whole file.
        budget: limits memory and work; None: by the size of the file.

    Raises:
        AnimationFileError: not a GLB of version 2, a truncated file, or no valid JSON in it.
    """
    budget = budget or Budget.of(len(data))
    name = str(path)
    if len(data) < 20:
        raise AnimationFileError(name, f"a GLB's header was expected, found {len(data)} bytes")
    version, length = struct.unpack_from("<II", data, 4)
    if version != 2:
        raise AnimationFileError(name, f"a GLB of version 2 was expected, found {version}")
    if length > len(data):
        raise AnimationFileError(
            name, f"{length} bytes were expected, found {len(data)}: cut short"
        )
    chunks: dict[bytes, bytes] = {}
    at = 12
    while at + 8 <= length:
        size, kind = struct.unpack_from("<I4s", data, at)
        if at + 8 + size > length:
            raise AnimationFileError(
                name, f"a chunk of {size} bytes at byte {at} ends beyond the file"
            )
        chunks.setdefault(kind, data[at + 8 : at + 8 + size])
        at += 8 + size
    if b"JSON" not in chunks:
        raise AnimationFileError(name, "a JSON chunk was expected, found none")
    try:
        text = chunks[b"JSON"].decode()
    except UnicodeDecodeError as error:
        raise AnimationFileError(
            name, f"JSON in UTF-8 was expected, found a wrong byte (byte {error.start})"
        ) from error
    document = named_json.parse(text, name)
    return open_gltf(path, document, chunks.get(b"BIN\0"), budget)


def is_gltf(document: object) -> bool:
    """Whether parsed JSON has asset.version, which every glTF must have."""
    return (
        isinstance(document, dict)
        and isinstance(document.get("asset"), dict)
        and "version" in document["asset"]
    )


def open_gltf(
    path: Path, document: object, binary: bytes | None = None, budget: Budget | None = None
) -> Document:
    """Makes a Document from parsed JSON.

    Args:
        path: path of the file; its buffers are in the same folder, and errors name it.
        document: the parsed JSON.
        binary: the binary chunk of a GLB, or None.
        budget: limits memory and work; None: the budget of a small file.

    Raises:
        AnimationFileError: not a glTF of version 2.
    """
    if not is_gltf(document) or not isinstance(document, dict):
        raise AnimationFileError(str(path), "asset.version of a glTF was expected")
    version = str(document["asset"]["version"])
    if not version.startswith("2"):
        raise AnimationFileError(
            str(path), f"glTF of version 2 was expected, found {version[:20]!r}"
        )
    return Document(path, document, binary, budget or Budget.of(0))


def read(document: Document, take: str | None = None) -> Take:
    """The curves of one animation.

    The curve of a morph target has the target's name from extras.targetNames of its mesh, which
    exporters write, else "mesh.number". The curve of a custom property (in extras) that
    KHR_animation_pointer animates has the last name of its pointer. Meshes that share a target's
    name normally move together: only the first curve is taken.

    Args:
        document: from `open_glb` or `open_gltf`.
        take: name of an animation, or its number from 0; None: the first one that animates morph
            targets or such properties.

    Raises:
        AnimationFileError: no such animation, none that animates morph targets or such
            properties, or missing parts of it.
    """
    notes: list[str] = []
    animations = document.json.get("animations")
    if not isinstance(animations, list) or not animations:
        raise AnimationFileError(document.name, "an animation was expected, found none")
    found: list[tuple[str, dict[str, Keys]]] = []
    for index in _chosen(document, animations, take):
        animation = document.item("animations", index, "animations")
        curves = _curves(document, animation, f"animations[{index}]", notes)
        if curves:
            found.append((str(animation.get("name", index)), curves))
            break
    if not found:
        raise AnimationFileError(
            document.name, "animated morph targets or properties were expected, found none"
        )
    title, curves = found[0]
    if len(animations) > 1:
        names = ", ".join(
            str(a.get("name", i)) for i, a in enumerate(animations) if isinstance(a, dict)
        )
        notes.append(f"animation {title} is taken of {len(animations)}: {names[:200]}")
    times, rows = on_one_clock(list(curves.values()), RATE, document.budget)
    keep = keep_ascending(times, notes, document.name)
    clip = make_clip(list(curves), rows[:, keep], times[keep], metadata={"take": title})
    return Take(clip, "gltf", "", notes)


def _chosen(document: Document, animations: Sequence[Any], take: str | None) -> list[int]:
    if take is None:
        return list(range(len(animations)))
    for i, animation in enumerate(animations):
        if isinstance(animation, dict) and take in (animation.get("name"), str(i)):
            return [i]
    raise AnimationFileError(
        document.name, f"an animation {take!r} was expected, found none with this name or number"
    )


def _curves(
    document: Document, animation: Mapping[str, Any], place: str, notes: list[str]
) -> dict[str, Keys]:
    out: dict[str, Keys] = {}
    bones = 0
    channels = animation.get("channels")
    if not isinstance(channels, list):
        raise document.fail(place, "channels were expected")
    for i, channel in enumerate(channels):
        at = f"{place}.channels[{i}]"
        target = channel.get("target") if isinstance(channel, dict) else None
        if not isinstance(target, dict):
            raise document.fail(at, f"a target was expected, found {shown(target)}")
        names = _names(document, target, at)
        if not names:
            bones += 1
            continue
        document.budget.work(len(names), at)
        for name, keys in zip(names, _keys(document, animation, channel, names, at), strict=True):
            if name not in out:
                out[name] = keys
                continue
            document.budget.work(keys.times.size, at)
            if not _is_same(out[name], keys):
                notes.append(f"{name}: another mesh moves it differently, the first one is taken")
    if bones:
        notes.append(f"{bones} channel(s) move nodes, not shapes or properties: left out")
    return out


def _is_same(a: Keys, b: Keys) -> bool:
    return bool(np.array_equal(a.times, b.times) and np.array_equal(a.values, b.values))


def _names(document: Document, target: Mapping[str, Any], place: str) -> list[str]:
    """Names of the curves of an animation channel; empty if the channel animates neither morph
    targets nor custom properties, but for example a node's location.

    Args:
        document: the glTF.
        target: the table `target` of the channel.
        place: place of the channel in the JSON, for errors.
    """
    if target.get("path") == "weights":
        node = document.item("nodes", target.get("node"), f"{place}.target.node")
        return _target_names(document, node.get("mesh"), place)
    extensions = target.get("extensions")
    pointer = extensions.get("KHR_animation_pointer") if isinstance(extensions, dict) else None
    path = pointer.get("pointer") if isinstance(pointer, dict) else None
    if not isinstance(path, str):
        return []
    parts = [part.replace("~1", "/").replace("~0", "~") for part in path.split("/")[1:]]
    if len(parts) >= 3 and parts[0] in ("nodes", "meshes") and parts[2] == "weights":
        index = int(parts[1]) if parts[1].isdigit() else -1
        owner = document.item(parts[0], index, f"{place}.target")
        mesh = index if parts[0] == "meshes" else owner.get("mesh")
        names = _target_names(document, mesh, place)
        if len(parts) == 3:
            return names
        if not parts[3].isdigit() or int(parts[3]) >= len(names):
            raise document.fail(
                place,
                (f"a weight of {len(names)} was expected, found {path[:80]!r}"),
            )
        return [names[int(parts[3])]]
    # Custom properties of a rig are in "extras". Other animated properties, such as colours, are
    # no curves of a face.
    return [parts[-1]] if "extras" in parts and parts[-1] != "extras" else []


def _target_names(document: Document, mesh: object, place: str) -> list[str]:
    table = document.item("meshes", mesh, f"{place}, mesh")
    extras = table.get("extras")
    names = extras.get("targetNames") if isinstance(extras, dict) else None
    primitives = table.get("primitives")
    first = primitives[0] if isinstance(primitives, list) and primitives else {}
    targets = first.get("targets") if isinstance(first, dict) else None
    count = len(targets) if isinstance(targets, list) else 0
    if not isinstance(names, list) or (count and len(names) != count):
        return [f"{table.get('name', mesh)}.{i}" for i in range(count)]
    return [str(name) for name in names]


def _keys(
    document: Document,
    animation: Mapping[str, Any],
    channel: Mapping[str, Any],
    names: Sequence[str],
    place: str,
) -> list[Keys]:
    """The keyframes of each curve of an animation channel, in the order of `names`.

    Args:
        document: the glTF.
        animation: table of the animation.
        channel: table of the animation channel.
        names: names of the channel's curves.
        place: place of the channel in the JSON, for errors.
    """
    samplers, index = animation.get("samplers"), channel.get("sampler")
    if not isinstance(samplers, list) or not isinstance(index, int):
        raise document.fail(place, f"a sampler was expected, found {index!r}")
    sampler = samplers[index] if 0 <= index < len(samplers) else None
    if not isinstance(sampler, dict):
        raise document.fail(place, f"a sampler was expected, found {index!r}")
    way = sampler.get("interpolation", "LINEAR")
    if not _is_key(way, _KINDS):
        raise document.fail(place, f"one of {', '.join(_KINDS)} was expected, found {shown(way)}")
    times = document.numbers(sampler.get("input"), f"{place}, input")
    document.budget.work(times.size, place)
    if times.size == 0 or (np.diff(times) <= 0.0).any():
        raise document.fail(place, "key times that ascend were expected")
    values = document.numbers(sampler.get("output"), f"{place}, output")
    parts = 3 if way == "CUBICSPLINE" else 1
    if values.size != times.size * parts * len(names):
        raise document.fail(
            place,
            f"{times.size * parts * len(names)} values for {len(names)} targets and "
            f"{times.size} keys were expected, found {values.size}",
        )
    table = values.reshape(times.size, parts, len(names))
    document.budget.hold(times.size, place)
    kinds = np.full(times.size, _KINDS[way], np.uint8)
    if parts == 1:
        return [Keys(times, table[:, 0, i], kinds) for i in range(len(names))]
    return [
        Keys(times, table[:, 1, i], kinds, table[:, 2, i], table[:, 0, i])
        for i in range(len(names))
    ]
