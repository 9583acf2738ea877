# SPDX-License-Identifier: MIT
"""Writes baked animation as .npz and .csv while it is computed."""

from __future__ import annotations

import contextlib
import csv
import io
import json
import shutil
import tempfile
import zipfile
from collections.abc import Iterable, Iterator, Sequence
from typing import IO, Any

import numpy as np
import numpy.typing as npt

import risorius

from .face import FIELDS, Chunk, Face, Floats

_SPOOL_BYTES = 32 << 20


class NpzWriter:
    """Writes an .npz of poses chunk by chunk.

    A zip archive is written one member at a time. So only the largest array is written directly.
    The others wait in memory or, if large, in temporary files, and are written after it.
    """

    def __init__(
        self,
        file: IO[bytes],
        beside: dict[str, npt.NDArray[Any]],
        face: Face,
        parts: Sequence[str],
        compress: bool,
    ) -> None:
        """Open the archive.

        Args:
            file: binary file, open for writing.
            beside: arrays that do not depend on frames, from about().
            face: the character, from `load_face`.
            parts: parts of the pose to write, such as "joints".
            compress: True for a smaller file.
        """
        self._beside = beside
        frames = len(beside["times"])
        self._method = zipfile.ZIP_DEFLATED if compress else zipfile.ZIP_STORED
        self._stack = contextlib.ExitStack()
        self._zip = self._stack.enter_context(
            zipfile.ZipFile(file, "w", self._method, compresslevel=1 if compress else None)
        )
        self._parts = sorted(parts, key=lambda part: -face.rest(part).size)
        self._waiting: dict[str, IO[bytes]] = {}
        for part in self._parts[1:]:
            # The exit stack closes the temporary file, even after an exception.
            spool = tempfile.SpooledTemporaryFile(_SPOOL_BYTES)  # noqa: SIM115
            self._waiting[part] = self._stack.enter_context(spool)
        self._shapes = {part: (frames, *face.rest(part).shape) for part in self._parts}
        self._first = self._member(self._parts[0]) if self._parts else None

    def __enter__(self) -> NpzWriter:
        return self

    def __exit__(self, *error: object) -> None:
        try:
            if self._first is not None:
                self._first.close()
        finally:  # closing fails on a full disk, but the temporary files must be closed
            self._stack.close()

    def _member(self, part: str) -> IO[bytes]:
        """Open the zip member for the array of a part, and write the header of the array."""
        member = self._open(FIELDS[part])
        about = {"descr": "<f4", "fortran_order": False, "shape": self._shapes[part]}
        np.lib.format.write_array_header_1_0(member, about)  # type: ignore[no-untyped-call]
        return member

    def _open(self, name: str) -> IO[bytes]:
        # A fixed date (1980), so that the same animation gives the same bytes.
        info = zipfile.ZipInfo(f"{name}.npy")
        info.compress_type = self._method
        return self._zip.open(info, "w", force_zip64=True)

    def add(self, chunk: Chunk) -> None:
        for part in self._parts:
            values = np.ascontiguousarray(getattr(chunk.pose, FIELDS[part]), "<f4")
            file = self._waiting.get(part, self._first)
            assert file is not None
            try:
                file.write(values.data.cast("B") if values.size else b"")
            except OSError as error:
                if error.filename is None:  # a temporary file, whose name the user does not know
                    raise OSError(error.errno, error.strerror, tempfile.gettempdir()) from None
                raise

    def finish(self) -> None:
        """Write the parts that waited in temporary files, then the arrays of `beside`."""
        if self._first is not None:
            self._first.close()
            self._first = None
        for part, spool in self._waiting.items():
            spool.seek(0)
            with self._member(part) as member:
                shutil.copyfileobj(spool, member, 1 << 20)
        for name, array in self._beside.items():
            with self._open(name) as member:
                np.lib.format.write_array(  # type: ignore[no-untyped-call]
                    member, array, allow_pickle=False
                )


def about(
    clip: risorius.Clip, face: Face, lod: int, parts: Sequence[str]
) -> dict[str, npt.NDArray[Any]]:
    """The arrays of an .npz that do not depend on frames.

    Args:
        clip: the baked clip.
        face: the character, from `load_face`.
        lod: the baked LOD, from 0.
        parts: parts of the pose that are baked, such as "joints"; the arrays contain their names.

    Returns:
        Name in the .npz -> array; times are in seconds.
    """
    out: dict[str, Any] = {
        "times": clip.frame_times(),
        "rate": clip.rate,
        "lod": lod,
        "character": face.name,
        "translation_unit": face.translation_unit,
        "rotation_unit": face.rotation_unit,
        "event_times": np.array([e.time for e in clip.events], np.float64),
        "event_durations": np.array([e.duration for e in clip.events], np.float64),
        "event_names": np.array([e.name for e in clip.events], np.str_),
        "event_values": np.array([e.value for e in clip.events], np.str_),
        "metadata": json.dumps(clip.metadata, sort_keys=True),
        "risorius": risorius.__version__,
    }
    labels = {
        "joints": "joint_names",
        "shapes": "blend_shape_names",
        "maps": "animated_map_names",
        "controls": "control_names",
    }
    for part in parts:
        out[labels[part]] = np.array(face.names[part], np.str_)
    if "joints" in parts:
        out["joint_columns"] = np.array(face.columns, np.str_)
        out["neutral_joints"] = face.rig.neutral_joints
    return {name: np.asarray(value) for name, value in out.items()}


def find_moving(face: Face, chunks: Iterable[Chunk], parts: Sequence[str]) -> dict[str, Any]:
    """Find the components of each pose part that leave their rest value in some frame.

    Args:
        face: the character, from `load_face`.
        chunks: poses of all frames.
        parts: parts of the pose to examine, such as "joints".

    Returns:
        Part -> int64[moving], indices of these components in the flattened array face.rest(part).
    """
    rests = {part: face.rest(part) for part in parts}
    moving = {part: np.zeros(rest.shape, bool) for part, rest in rests.items()}
    for chunk in chunks:
        for part in parts:
            moving[part] |= (getattr(chunk.pose, FIELDS[part]) != rests[part]).any(axis=0)
    return {part: np.flatnonzero(array) for part, array in moving.items()}


class CsvWriter:
    """Writes a row per frame: the frame's time and the components that `find_moving` returned.

    Args:
        file: binary file, open for writing.
        face: the character, whose names become headings.
        times: float64[frames], seconds.
        moving: result of find_moving.
    """

    def __init__(
        self, file: IO[bytes], face: Face, times: npt.NDArray[np.float64], moving: dict[str, Any]
    ) -> None:
        self._text = io.TextIOWrapper(file, encoding="utf-8", newline="", write_through=True)
        self._times, self._moving = times, moving
        header = ["time"]
        for part, indices in moving.items():
            header += _headings(face, part, indices)
        csv.writer(self._text, lineterminator="\n").writerow(header)
        # Nine digits restore every float32, and "%.9g" is three times as fast as the shortest
        # digits.
        self._row = ",%.9g" * (len(header) - 1) + "\n"

    def add(self, chunk: Chunk) -> None:
        self._text.writelines(self._rows(chunk))

    def _rows(self, chunk: Chunk) -> Iterator[str]:
        columns: list[Floats] = []
        for part, indices in self._moving.items():
            values = getattr(chunk.pose, FIELDS[part])
            columns.append(values.reshape(len(values), -1)[:, indices])
        rows = np.concatenate(columns, axis=1).tolist() if columns else []
        for i, row in enumerate(rows):
            yield f"{float(self._times[chunk.first + i])!r}{self._row % tuple(row)}"

    def finish(self) -> None:
        """Detach the text writer from the binary file, which stays open."""
        self._text.detach()


def _headings(face: Face, part: str, indices: npt.NDArray[np.intp]) -> list[str]:
    """Column headings, e.g. joint:FACIAL_C_Jaw.rx, shape:jaw_open, map:wrinkle, control:jawOpen."""
    names = face.names[part]
    if part != "joints":
        return [f"{part[:-1]}:{names[i]}" for i in indices]
    columns = face.columns
    return [f"joint:{names[i // len(columns)]}.{columns[i % len(columns)]}" for i in indices]
