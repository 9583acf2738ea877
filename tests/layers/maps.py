# SPDX-License-Identifier: MIT
"""Compares tables of files and folders in READMEs with the files and folders that exist.

A map is a table of a page; the first column of its rows has names in backquotes. `Map.wrong`
returns sentences on names that do not exist, and on names that the table does not contain.
"""

import re
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
_UNNAMED = {"README.md", "__init__.py", "CMakeLists.txt"}


def first_cells(text: str, head: str) -> list[str]:
    """The names in backquotes in the first column of a table.

    Args:
        text: Markdown text of the page.
        head: beginning of the first cell of the table's head.

    Returns:
        The first word of each name, without options; empty if the page has no such table.
    """
    found = re.search(rf"^\| {re.escape(head)}[^\n]*\n\|[-|]+\n((?:\|.*\n)+)", text, re.MULTILINE)
    cells = [row.split("|")[1] for row in found[1].splitlines()] if found else []
    names = [name.split()[0] for cell in cells for name in re.findall(r"`([^`]+)`", cell)]
    return [name for name in names if not name.startswith("-")]


def folders(path: Path) -> list[str]:
    """Names of the subfolders that contain a file, apart from Python's caches."""
    inside = (p for p in path.iterdir() if p.is_dir() and p.name != "__pycache__")
    return [p.name for p in inside if any(f.is_file() and f.suffix != ".pyc" for f in p.rglob("*"))]


def files(path: Path) -> list[str]:
    """Names of the files in a folder, except README.md, __init__.py and CMakeLists.txt."""
    return [p.name for p in path.iterdir() if p.is_file() and p.name not in _UNNAMED]


@dataclass(frozen=True)
class Map:
    """A table of a page that lists files or folders.

    Attributes:
        page: path of the page.
        head: beginning of the first cell of the table's head.
        there: names that the table must contain.
        places: folders; each name in the table must be a path below one of them.
    """

    page: str
    head: str
    there: tuple[str, ...]
    places: tuple[str, ...]

    def wrong(self, text: str) -> list[str]:
        """Sentences on listed names that do not exist, and on names of `there` that are missing."""
        named = [name.rstrip("/") for name in first_cells(text, self.head)]
        where = f"{self.page}, table {self.head}"
        lost = [n for n in named if not any((ROOT / place / n).exists() for place in self.places)]
        return [f"{where}: {name} is nowhere" for name in lost] + [
            f"{where}: {name} is missing" for name in sorted(set(self.there) - set(named))
        ]


def _all(*names: Iterable[str]) -> tuple[str, ...]:
    return tuple(sorted({name for group in names for name in group}))


def maps() -> list[Map]:
    """The tables of the project's READMEs, with the names that exist now."""
    at = ROOT.joinpath
    native = [f"native/{name}" for name in folders(at("native"))]
    others = ["addon/risorius", "tests", "blender_tests", "packaging", "docs"]
    package = "native/python/risorius"
    python = "tests/python"
    scene = "addon/risorius/scene"
    of_blender = [n for n in folders(at("blender_tests")) if n not in ("support", "data")]
    found = [
        Map("docs/development.md", "folder", _all(native, others), ("",)),
        Map("tests/README.md", "Folder |", _all(folders(at("tests"))), ("tests",)),
        Map("tests/README.md", "Folder of `python`", _all(folders(at(python))), (python,)),
        Map("blender_tests/README.md", "Folder of tests", _all(of_blender), ("blender_tests",)),
        Map("addon/README.md", "room of `scene`", _all(folders(at(scene))), (scene,)),
        Map("native/python/README.md", "room", _all(folders(at(package))), (package,)),
    ]
    for place in ("films", "check", "check/blender", "ship", "ship/cross"):
        inside = files(at("packaging", place))
        found.append(
            Map("packaging/README.md", f"`{place}/`", _all(inside), (f"packaging/{place}",))
        )
    top = files(at("packaging"))
    return [*found, Map("packaging/README.md", "At the top", _all(top), ("packaging",))]
