# SPDX-License-Identifier: MIT
"""Checks that folders (rooms) include and import only as rooms.toml allows."""

from __future__ import annotations

import ast
import re
import sys
import tomllib
from collections import Counter
from collections.abc import Iterator, Mapping
from fnmatch import fnmatch
from functools import lru_cache
from graphlib import CycleError, TopologicalSorter
from pathlib import Path, PurePosixPath
from typing import NamedTuple

ROOMS = tomllib.loads((Path(__file__).parent / "rooms.toml").read_text(encoding="utf-8"))
INCLUDE = re.compile(r'^[ \t]*#[ \t]*include[ \t]*(?:"([^"\n]+)"|<([^>\n]+)>|(\S+))', re.MULTILINE)
CODE_FROM_TEXT = {"exec", "eval", "run_module", "run_path"}


class Use(NamedTuple):
    """An import or include.

    It names a file of the same part of the project, or something outside this part, or its name
    cannot be read from the code.
    """

    kind: str  # "inside", "outside" or "unreadable"
    name: str  # the file's path, the outside name, or the line as it is written


def sources(root: Path, part: str) -> dict[str, str]:
    """Path below the part's folder -> text, for each source file of a part of the project."""
    plan = ROOMS[part]
    base = root / plan["folder"]
    found = {}
    for path in sorted(base.rglob("*")):
        name = path.relative_to(base)
        if path.suffix in plan["kinds"] and name.parts[0] not in plan.get("without", ()):
            found[name.as_posix()] = path.read_text(encoding="utf-8")
    return found


def room_of(path: str, rooms: Mapping[str, object]) -> str | None:
    """The room of a file: its path or the path of its folder, whichever is a key of `rooms`.

    None if neither is a key.
    """
    folder = PurePosixPath(path).parent.as_posix()
    return next((room for room in (path, folder) if room in rooms), None)


def included(path: str, text: str, files: frozenset[str]) -> Iterator[Use]:
    """Yields a C++ file's includes, except standard headers, which have no slash and no dot.

    Args:
        path: path of the file below the part's folder. Quoted names are searched in the file's
            folder first, then in the part's folder.
        text: content of the file.
        files: paths of all files of the part.
    """
    for quoted, angled, other in _includes(text):
        name = quoted or angled
        places = [_joined(PurePosixPath(path).parent, name)] if quoted else []
        inside = next(
            (place for place in [*places, _joined(PurePosixPath(), name)] if place in files), ""
        )
        if other or (quoted and not inside):
            yield Use("unreadable", f"#include {other or name}")
        elif inside:
            yield Use("inside", inside)
        elif "/" in name or "." in name:
            yield Use("outside", name)


@lru_cache(maxsize=1000)
def _includes(text: str) -> list[tuple[str, str, str]]:
    return INCLUDE.findall(text)


def _joined(folder: PurePosixPath, name: str) -> str:
    parts: list[str] = []
    for part in (folder / name).parts:
        if part == ".." and parts:
            parts.pop()
        else:
            parts.append(part)
    return "/".join(parts)


def imported(path: str, text: str, name: str, files: frozenset[str]) -> Iterator[Use]:
    """Yields imports of a Python file, including the ones in functions and by import_module.

    Imports of the standard library are omitted. A call that runs code from a string, such as eval,
    is an import whose name cannot be read.

    Args:
        path: path of the file below the package's folder.
        text: content of the file.
        name: name of the package.
        files: paths of all files of the package.
    """
    package = (name, *PurePosixPath(path).parts[:-1])
    for module, member in _imports(text, package):
        if module is None:
            yield Use("unreadable", member)
        elif module[0] == name:
            both = (*module[1:], *(member.split(".") if member else ()))
            found = _file_of(both, files) or _file_of(module[1:], files)
            yield Use("inside", found) if found else Use("unreadable", ".".join((*module, member)))
        elif module[0] not in sys.stdlib_module_names:
            yield Use("outside", module[0])


def _file_of(words: tuple[str, ...], files: frozenset[str]) -> str | None:
    stem = "/".join(words)
    places = (f"{stem}.py", f"{stem}.pyi", f"{stem}/__init__.py".lstrip("/"))
    return next((place for place in places if place in files), None)


@lru_cache(maxsize=1000)
def _imports(text: str, package: tuple[str, ...]) -> list[tuple[tuple[str, ...] | None, str]]:
    return list(_names(list(ast.walk(ast.parse(text))), package))


def _names(
    nodes: list[ast.AST], package: tuple[str, ...]
) -> Iterator[tuple[tuple[str, ...] | None, str]]:
    """(module, imported name) of each import; (None, code) if its module cannot be read.

    Calls of exec, eval, run_module and run_path count as imports that cannot be read.
    """
    importers = {"import_module", "__import__"}
    for node in nodes:
        if isinstance(node, ast.ImportFrom) and node.module == "importlib":
            importers |= {a.asname for a in node.names if a.name == "import_module" and a.asname}
    for node in nodes:
        if isinstance(node, ast.Import):
            yield from ((tuple(alias.name.split(".")), "") for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            module = _absolute("." * node.level + (node.module or ""), package)
            yield from ((module, alias.name) for alias in node.names)
        elif isinstance(node, ast.Call):
            called = getattr(node.func, "attr", getattr(node.func, "id", ""))
            if called in importers:
                text, whole = _literal([*node.args, *(k.value for k in node.keywords)][0])
                module = _absolute(text, package)
                known = whole or (module[0] != package[0] and "." in text)
                yield (module, "") if known else (None, ast.unparse(node))
            elif called in CODE_FROM_TEXT and not (called == "eval" and hasattr(node.func, "attr")):
                yield None, ast.unparse(node)


def _literal(node: ast.expr) -> tuple[str, bool]:
    """The literal text at the beginning of an expression, and whether it is the whole text."""
    if isinstance(node, ast.Constant) and isinstance(node.value, str):
        return node.value, True
    if isinstance(node, ast.JoinedStr) and isinstance(node.values[0], ast.Constant):
        return str(node.values[0].value), False
    return "", False


def _absolute(name: str, package: tuple[str, ...]) -> tuple[str, ...]:
    level = len(name) - len(name.lstrip("."))
    base = package[: len(package) - level + 1] if level else ()
    return (*base, *(word for word in name.lstrip(".").split(".") if word)) or ("",)


def uses(part: str, files: Mapping[str, str]) -> dict[str, list[Use]]:
    """Path of a file -> its imports or includes."""
    known = frozenset(files)
    out = {}
    for path, text in files.items():
        if path.endswith((".h", ".cpp")):
            out[path] = list(included(path, text, known))
        elif path.endswith((".py", ".pyi")):
            out[path] = list(imported(path, text, ROOMS[part]["name"], known))
    return out


def violations(part: str, files: Mapping[str, str]) -> list[str]:
    """A sentence for each file, import or folder of a part that contradicts rooms.toml."""
    plan = ROOMS[part]
    used = uses(part, files)
    found = [
        f"{path}: its folder is no room of the plan"
        for path in files
        if not room_of(path, plan["rooms"])
    ]
    for path, targets in used.items():
        found += [
            f"{path}: {reason}" for target in targets if (reason := _refused(path, target, plan))
        ]
    found += _circle(used) + _crowded(files, plan) + _disordered(plan["rooms"])
    return found + _stale(used, plan["rooms"])


def _refused(path: str, use: Use, plan: dict) -> str:
    room = room_of(path, plan["rooms"])
    if use.kind == "unreadable":
        allowed = path in plan.get("dynamic", {})
    elif use.kind == "outside":
        homes = next((plan["outside"][p] for p in plan["outside"] if fnmatch(use.name, p)), [])
        allowed = room is not None and any(fnmatch(room, home) for home in homes)
    else:
        target = room_of(use.name, plan["rooms"])
        allowed = target == room or target in plan["rooms"].get(room, ())
    if allowed:
        return ""
    if use.kind == "unreadable":
        return f"no one can read what this uses: {use.name}"
    return f"{room} may not use {use.name}"


def _circle(used: dict[str, list[Use]]) -> list[str]:
    graph = {
        path: {use.name for use in targets if use.kind == "inside"}
        for path, targets in used.items()
    }
    try:
        TopologicalSorter(graph).prepare()
    except CycleError as error:
        return ["files in a circle: " + " <- ".join(error.args[1])]
    return []


def _crowded(files: Mapping[str, str], plan: dict) -> list[str]:
    counts = Counter(
        PurePosixPath(path).parent.as_posix() for path in files if not path.endswith("__init__.py")
    )
    larger = plan.get("larger", {})
    most = {folder: larger.get(folder, {"files": plan["limit"]})["files"] for folder in counts}
    return [f"{f}: {n} files, and {most[f]} are the most" for f, n in counts.items() if n > most[f]]


def _disordered(rooms: Mapping[str, list[str]]) -> list[str]:
    order = list(rooms)
    return [
        f"{room}: {known} is not written above it in the plan"
        for room, below in rooms.items()
        for known in below
        if known not in order[: order.index(room)]
    ]


def _stale(used: Mapping[str, list[Use]], rooms: Mapping[str, list[str]]) -> list[str]:
    """A sentence for each import that rooms.toml allows but that no file needs."""
    needed = {
        (room_of(path, rooms), room)
        for path, targets in used.items()
        for use in targets
        if use.kind == "inside"
        for room in (room_of(use.name, rooms), PurePosixPath(use.name).parent.as_posix())
    }
    return [
        f"{room} does not use {target}: take it out of the plan"
        for room, below in rooms.items()
        for target in below
        if (room, target) not in needed
    ]
