# SPDX-License-Identifier: MIT
"""Reads and checks a JOBS.toml, and expands it to a list of jobs."""

from __future__ import annotations

import glob
import os
import string
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple

from risorius import importing
from risorius.base import toml
from risorius.base.errors import RisoriusError
from risorius.base.given import shown

from ..baking.bake import DEFAULT_PARTS, KINDS
from ..baking.face import PARTS
from ..files.names import LONGEST, file_name, folded, is_file_name

FIELDS = ("clip", "character", "lod", "folder", "character_folder")
DEFAULT_NAME = "{character}/lod{lod}/{folder}/{clip}"
DEFAULT_SUMMARY = ("summary.csv", "summary.json")
_TOP_KEYS = ("output", "summary", "jobs")
_KEYS = (
    "clips", "characters", "lods", "name", "write", "what", "rate", "frames", "quaternions",
    "compress", "mapping",
)  # fmt: skip
MAX_JOBS = 200_000


class JobsError(RisoriusError):
    """An unusable JOBS.toml; the text has the file, the field, and the found and expected value."""

    code = "jobs"


@dataclass(frozen=True)
class Options:
    """Options that change the content of the outputs.

    Attributes:
        parts: parts of the pose to write: some of "joints", "shapes", "maps" and "controls".
        rate: frames per second to resample to; None: the rate of the clip.
        frames: first and end (exclusive) of the frames after resampling; None: to the clip's end.
        quaternions: True: rotations of joints are quaternions; False: Euler angles.
        compress: True: the .npz is compressed.
        mapping: name of the built-in mapping of curves to controls, or path of its TOML file;
            None: the mapping that fits a clip best.
    """

    parts: tuple[str, ...] = DEFAULT_PARTS
    rate: float | None = None
    frames: tuple[int | None, int | None] = (None, None)
    quaternions: bool = False
    compress: bool = False
    mapping: str | None = None
    """Name of a built-in mapping, or absolute path of a TOML file; None for the best fit."""


@dataclass(frozen=True)
class Job:
    """A clip to evaluate on a character at a LOD."""

    name: str
    """Path of its outputs below the output folder, without suffix; unique."""
    clip: Path
    character: Path
    lod: int
    outputs: tuple[tuple[str, Path], ...]
    """Kind and path of each output; empty if only the facts are wanted."""
    options: Options


@dataclass(frozen=True)
class Plan:
    """The content of a JOBS.toml, expanded to jobs.

    Attributes:
        source: path of the JOBS.toml.
        output: folder of the outputs and of the journal.
        summary: paths of the summary's files, .csv or .json.
        jobs: the jobs.
    """

    source: Path
    output: Path
    summary: tuple[Path, ...]
    jobs: tuple[Job, ...]
    """Sorted by table, character, clip and LOD, so that the same files give the same list."""

    @property
    def journal(self) -> Path:
        return self.output / f".{self.source.stem}.journal"


class _Found(NamedTuple):
    path: Path
    folder: str
    """Path below the pattern's folder without wildcards, with slashes; "" for this folder."""


class _Table:
    """A table of a JOBS.toml; its errors name the file and the field."""

    def __init__(self, source: Path, where: str, values: dict[str, Any], keys: tuple[str, ...]):
        self._source, self._where, self._values = source, where, values
        for key in values:
            if key not in keys:
                raise self.error(key, f"one of the keys {', '.join(keys)} was expected")

    def error(self, key: str, text: str) -> JobsError:
        return JobsError(f"{self._source}: {self._where}{key}: {text}")

    def take(self, key: str, expected: str, check: Callable[[Any], bool], default: Any) -> Any:
        """The value of a key, checked.

        Args:
            key: name of the key.
            expected: the expected value in words, for the error.
            check: function that says whether a value is valid.
            default: value of a missing key; None makes a missing key an error.

        Raises:
            JobsError: the value is invalid, or the key is missing and has no default.
        """
        if key not in self._values:
            if default is None:
                raise self.error(key, f"{expected} was expected, found nothing")
            return default
        value = self._values[key]
        if not check(value):
            raise self.error(key, f"{expected} was expected, found {shown(value)}")
        return value

    def texts(self, key: str, default: tuple[str, ...] | None) -> list[str]:
        """A list of strings; a single string counts as a list of one.

        Args:
            key: name of the key.
            default: value of a missing key; None makes a missing key an error.
        """
        value = self.take(
            key, "a string or a list of strings",
            lambda v: isinstance(v, str) or _all_of(v, str), default,
        )  # fmt: skip
        out = [value] if isinstance(value, str) else list(value)
        for text in out:
            if "\0" in text or not text:
                raise self.error(key, f"text was expected, found {shown(text)}")
            if out.count(text) > 1:
                raise self.error(key, f"each once was expected, found {shown(text)} twice")
        return out

    def choice(
        self, key: str, choices: tuple[str, ...], default: tuple[str, ...]
    ) -> tuple[str, ...]:
        """The elements of `choices` that the table names, in the order of `choices`.

        Args:
            key: name of the key.
            choices: the allowed strings.
            default: value of a missing key.
        """
        texts = self.texts(key, default)
        for text in texts:
            if text not in choices:
                raise self.error(
                    key, f"some of {', '.join(choices)} were expected, found {shown(text)}"
                )
        return tuple(choice for choice in choices if choice in texts)

    def flag(self, key: str) -> bool:
        return bool(self.take(key, "true or false", lambda v: isinstance(v, bool), False))


def _all_of(value: Any, kind: type) -> bool:
    return isinstance(value, list) and all(type(item) is kind for item in value)


def read_jobs(source: Path) -> Plan:
    """Read a JOBS.toml and find the clips and characters that it names.

    Args:
        source: path of the JOBS.toml; paths in it are relative to its folder.

    Raises:
        JobsError: the file cannot be read, a key or value is invalid, a pattern matches nothing,
            there are more than MAX_JOBS jobs, or a job would write a file of another job, an input
            or a file outside the output folder.
        ReadingError: the file is too large, or a device.
    """
    try:
        values = toml.parse(toml.text_of(source))
    except OSError as error:
        raise JobsError(f"{source}: cannot read it: {error.strerror}") from error
    except toml.TomlError as error:
        raise JobsError(f"{source}: not TOML: {error}") from error
    top = _Table(source, "", values, _TOP_KEYS)
    base = Path(os.path.abspath(source)).parent
    output = base / top.take("output", "a folder", _is_name, None)
    names = top.texts("summary", DEFAULT_SUMMARY)
    summary = tuple(_inside(top, "summary", output, text) for text in names)
    for path in summary:
        if path.suffix not in (".csv", ".json"):
            raise top.error(
                "summary", f"names ending in .csv or .json were expected, found {path.name!r}"
            )
    tables = top.take("jobs", "one or more tables [[jobs]]", lambda v: _all_of(v, dict) and v, None)
    jobs: list[Job] = []
    for i, table in enumerate(tables):
        jobs += _jobs_of(_Table(source, f"jobs[{i}].", table, _KEYS), base, output)
        if len(jobs) > MAX_JOBS:
            raise top.error("jobs", f"at most {MAX_JOBS:,} jobs were expected, found more")
    plan = Plan(source, output, summary, tuple(jobs))
    _refuse_collisions(plan)
    return plan


def _is_name(value: Any) -> bool:
    return isinstance(value, str) and value != "" and "\0" not in value


def _jobs_of(table: _Table, base: Path, output: Path) -> Iterator[Job]:
    clips = _find(table, "clips", base)
    characters = _find(table, "characters", base)
    lods = table.take(
        "lods", "a list of LODs (0 is the finest)",
        lambda v: _all_of(v, int) and v and min(v) >= 0 and max(v) < 1 << 16, [0],
    )  # fmt: skip
    if len(set(lods)) != len(lods):
        raise table.error("lods", f"each LOD once was expected, found {shown(lods)}")
    pattern = table.take("name", "a pattern", _is_name, DEFAULT_NAME)
    _check_pattern(table, pattern)
    kinds = table.choice("write", KINDS, ())
    options = _options(table, base)
    for character in characters:
        for clip in clips:
            for lod in lods:
                name = _fill(pattern, clip, character, lod)
                stem = _inside(table, "name", output, name)
                outputs = tuple((kind, stem.with_name(f"{stem.name}.{kind}")) for kind in kinds)
                name = stem.relative_to(output).as_posix()
                yield Job(name, clip.path, character.path, lod, outputs, options)


def _options(table: _Table, base: Path) -> Options:
    rate = table.take(
        "rate", "frames per second above 0",
        lambda v: type(v) in (int, float) and 0 < v <= 1e6, 0.0,
    )  # fmt: skip
    frames = table.take(
        "frames", "[first, end] with first below end",
        lambda v: _all_of(v, int) and len(v) == 2 and 0 <= v[0] < v[1] < 1 << 62, [],
    )  # fmt: skip
    parts = table.choice("what", PARTS, DEFAULT_PARTS)
    if not parts:
        raise table.error("what", f"some of {', '.join(PARTS)} were expected, found nothing")
    return Options(
        parts=parts,
        rate=float(rate) or None,
        frames=(frames[0], frames[1]) if frames else (None, None),
        quaternions=table.flag("quaternions"),
        compress=table.flag("compress"),
        mapping=_mapping(table, base),
    )


def _mapping(table: _Table, base: Path) -> str | None:
    name: str = table.take("mapping", "a mapping", lambda v: isinstance(v, str), "")
    if not name:
        return None
    if name not in importing.mapping_names():
        name = os.path.abspath(base / name)
    try:
        importing.load_mapping(name)
    except ValueError as error:
        raise table.error("mapping", str(error)) from error
    return name


def _find(table: _Table, key: str, base: Path) -> list[_Found]:
    """The files that match the patterns in `key`, sorted by path.

    Args:
        table: the table with the key.
        key: key of one pattern or a list of patterns.
        base: folder to which the patterns are relative.

    Raises:
        JobsError: a pattern has no match, or two patterns match the same file.
    """
    out: dict[Path, tuple[_Found, str]] = {}
    for pattern in table.texts(key, None):
        root = _root(base, pattern)
        found = _glob(base, pattern)
        if not found:
            raise table.error(key, f"files were expected, found none for {pattern!r}")
        for path in found:
            if path in out:
                raise table.error(
                    key,
                    (
                        f"each file once was expected, found {path} by the patterns "
                        f"{out[path][1]!r} and {pattern!r}"
                    ),
                )
            folder = os.path.relpath(path.parent, root).replace(os.sep, "/")
            out[path] = (_Found(path, "" if folder == "." else folder), pattern)
    return [out[path][0] for path in sorted(out, key=lambda p: p.as_posix())]


def _glob(base: Path, pattern: str) -> list[Path]:
    found = (base / name for name in glob.glob(pattern, root_dir=base, recursive=True))
    return [Path(os.path.abspath(path)) for path in found if path.is_file()]


def _root(base: Path, pattern: str) -> Path:
    """The folder of a pattern: the path before the first path part that has a wildcard."""
    root = base
    for part in Path(pattern).parts[:-1]:
        if glob.has_magic(part):
            break
        root /= part
    return Path(os.path.abspath(root))


def _check_pattern(table: _Table, pattern: str) -> None:
    """Check the pattern of job names: only plain fields, such as {clip}, are allowed.

    Other format strings could access attributes of objects.
    """
    expected = f"a pattern of {', '.join(f'{{{field}}}' for field in FIELDS)} was expected, "
    try:
        pieces = list(string.Formatter().parse(pattern))
    except ValueError as error:
        raise table.error("name", f"{expected}found {shown(pattern)}: {error}") from None
    for _, field, form, conversion in pieces:
        if field is not None and (field not in FIELDS or form or conversion):
            raise table.error("name", f"{expected}found {{{field}}} in {shown(pattern)}")


def _fill(pattern: str, clip: _Found, character: _Found, lod: int) -> str:
    """The name of a job. The clip and character names become valid file names on every system."""
    return pattern.format(
        clip=file_name(clip.path.stem),
        character=file_name(character.path.stem),
        lod=lod,
        folder=_folder_name(clip.folder),
        character_folder=_folder_name(character.folder),
    )


def _folder_name(folder: str) -> str:
    return "/".join(map(file_name, folder.split("/"))) if folder else ""


def _inside(table: _Table, key: str, output: Path, name: str) -> Path:
    """A path below the output folder. Empty path parts, as in "a//b", are dropped.

    Args:
        table: the table, for the error.
        key: the key, for the error.
        output: the output folder.
        name: path relative to the output folder.
    """
    parts = [part for part in name.replace("\\", "/").split("/") if part not in ("", ".")]
    rooted = name.startswith(("/", "\\")) or (parts and ":" in parts[0] and os.name == "nt")
    if not parts or ".." in parts or rooted:
        raise table.error(key, f"a name inside the output folder was expected, found {shown(name)}")
    for part in parts:
        if not is_file_name(part.lstrip(".")):
            raise table.error(
                key,
                f"names of files as every system takes them, of {LONGEST} bytes at most, were "
                f"expected, found {shown(part)}",
            )
    return output.joinpath(*parts)


def _refuse_collisions(plan: Plan) -> None:
    """Check that each file is written by one job and is no input.

    Names that differ only in case or in the spelling of an accent are the same file on some
    systems.
    """
    taken = {_folded(path): "the summary" for path in plan.summary}
    if len(taken) < len(plan.summary):
        raise JobsError(
            f"{plan.source}: summary: different files were expected in this list, found a "
            "file twice"
        )
    taken[_folded(plan.source)] = "this file itself"
    taken[_folded(plan.journal)] = "the journal"
    inputs = {path for job in plan.jobs for path in (job.clip, job.character)}
    taken |= {_folded(path): "an input" for path in inputs}
    for job in plan.jobs:
        paths = [path for _, path in job.outputs] or [plan.output / job.name]
        for path in paths:
            what = f"{job.clip.name} on {job.character.name} at LOD {job.lod}"
            if other := taken.get(_folded(path)):
                raise JobsError(
                    f"{plan.source}: name: a file of its own was expected for each job, found "
                    f"{path} for {what} and for {other}"
                )
            taken[_folded(path)] = what


def _folded(path: Path) -> str:
    return folded(os.path.abspath(path))
