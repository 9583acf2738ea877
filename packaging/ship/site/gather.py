# SPDX-License-Identifier: MIT
"""Gathers the pages of the site: copies written pages, and makes pages from code.

gather.py PAGES CLASSES.json    PAGES: a folder whose content is deleted first; CLASSES.json: the
                                output of blender_classes.py
"""

from __future__ import annotations

import contextlib
import io
import json
import re
import shutil
import sys
from collections.abc import Iterable
from pathlib import Path
from types import ModuleType
from typing import Any

PROJECT = Path(__file__).resolve().parents[3]
LINK = re.compile(r"\]\(([^)#\s]+)(#[^)\s]*)?\)")
FENCE = re.compile(r"^```.*?^```", re.MULTILINE | re.DOTALL)


def listed(nav: str) -> list[str]:
    """The pages in the navigation that are files of the project; generated pages are left out.

    Args:
        nav: text of mkdocs.yml.
    """
    names = re.findall(r"- ([\w./-]+\.md)$", nav, re.MULTILINE)
    return [n for n in names if n != "index.md" and not n.startswith("reference/")]


def copy_page(name: str, pages: Path) -> set[str]:
    """Copy a page of the project to the site. A link to a folder becomes a link to its README.md.

    Args:
        name: path of the page, relative to the project's folder.
        pages: the site's folder.

    Returns:
        Paths of the project's files to which the page links, relative to the project's folder.

    Raises:
        SystemExit: a link leads to a folder without a README.md or to a missing file.
    """
    source, linked = PROJECT / name, set()

    def other(match: re.Match[str]) -> str:
        target = match.group(1)
        if "://" in target or target.startswith("mailto:"):
            return match.group(0)
        path = (source.parent / target).resolve()
        if path.is_file() and path.is_relative_to(PROJECT):
            linked.add(path.relative_to(PROJECT).as_posix())
            return match.group(0)
        return f"]({place_of(path)})"

    def place_of(path: Path) -> str:
        inside = path / "README.md"
        if inside.is_file():
            linked.add(inside.relative_to(PROJECT).as_posix())
            up = "../" * len(Path(name).parent.parts)
            return f"{up}{inside.relative_to(PROJECT).as_posix()}"
        raise SystemExit(f"{name} links to {path}, which is not there.")

    text = LINK.sub(other, source.read_text(encoding="utf-8"))
    target = pages / name
    target.parent.mkdir(parents=True, exist_ok=True)
    target.write_text(text, encoding="utf-8")
    return linked


def copy_pages(pages: Path, names: Iterable[str]) -> None:
    """Copy pages, and recursively all files to which they link."""
    wanted, done = set(names), set()
    while wanted - done:
        name = min(wanted - done)
        done.add(name)
        if name.endswith(".md"):
            wanted |= copy_page(name, pages)
        else:
            (pages / name).parent.mkdir(parents=True, exist_ok=True)
            shutil.copy(PROJECT / name, pages / name)


def commands() -> str:
    """The page on the command line, with the text that each command prints for --help."""
    from risorius import cli

    def said(*words: str) -> str:
        out = io.StringIO()
        with contextlib.redirect_stdout(out), contextlib.suppress(SystemExit):
            cli.parse([*words, "--help"])
        return out.getvalue()

    def kinds(text: str) -> list[str]:
        found = re.search(r"^\s+\{([\w,]+)\}", text, re.MULTILINE)
        return found.group(1).split(",") if found else []

    parts = ["# Commands\n\nWhat each command says with `--help`.\n"]
    stack = [[name] for name in kinds(said())]
    while stack:
        words = stack.pop(0)
        text = said(*words)
        inner = [[*words, name] for name in kinds(text)] if len(words) == 1 else []
        stack = inner + stack
        parts.append(
            f"{'#' * (1 + len(words))} risorius {' '.join(words)}\n\n"
            f"```text\n{text.rstrip()}\n```\n"
        )
    return "\n".join(parts)


def python_item(module: ModuleType, name: str) -> str:
    """The Markdown entry of a public name.

    For a class or function it is a line "::: NAME", which mkdocstrings replaces by the docstring;
    for a value, it is the value as text.

    Args:
        module: the module that exports the name.
        name: the name.
    """
    item = getattr(module, name)
    if hasattr(item, "__qualname__"):
        return f"::: {item.__module__}.{item.__qualname__}\n"
    return f"### {module.__name__}.{name}\n\n`{str(item)[:200]}`\n"


def python_api() -> str:
    """The page on the Python API: the names of `risorius`, then the names of single modules."""
    import risorius

    parts = [
        "# Python\n\nWhat `import risorius` gives; then modules that are imported by name.\n\n"
        "## risorius\n"
    ]
    parts += [f"::: risorius.{name}\n" for name in risorius.__all__]
    for name in ("importing", "live", "speech", "baking", "batch", "sample", "selftest"):
        module = __import__(f"risorius.{name}", fromlist=["__all__"])
        parts.append(f"## risorius.{name}\n\n{(module.__doc__ or '').strip()}\n")
        parts += [python_item(module, item) for item in getattr(module, "__all__", ())]
    return "\n".join(parts)


def cpp_api() -> str:
    """The page on the C++ API: the text of the headers, folder by folder."""
    parts = [
        "# C++\n\nThe headers themselves, from the ground up; what a folder is for: "
        "[native](../native/README.md).\n"
    ]
    folders = "core dna dna/file dna/convert rig compile edit clip clip/file clip/mixer api".split()
    for folder in folders:
        headers = sorted((PROJECT / "native" / folder).glob("*.h"))
        if headers:
            parts.append(f"## native/{folder}\n")
        for header in headers:
            text = header.read_text(encoding="utf-8").replace(
                "// SPDX-License-Identifier: MIT\n", ""
            )
            parts.append(f"### {folder}/{header.name}\n\n```cpp\n{text.strip()}\n```\n")
    return "\n".join(parts)


def cell(text: str) -> str:
    """Escape text for a cell of a Markdown table."""
    return text.replace("|", "\\|").replace("\n", " ")


def blender_page(row: dict[str, Any]) -> str:
    """The page of a panel or operator.

    Args:
        row: dictionary of the panel or operator, from blender_classes.py.
    """
    lines = [f"# {row['label'] or row['id']}", ""]
    if row["description"]:
        lines += [row["description"].rstrip(".") + ".", ""]
    if row["kind"] == "operator":
        lines += [f"In Python: `bpy.ops.{row['id']}()`", ""]
    else:
        where = (
            f"below *{row['parent']}*"
            if row["parent"]
            else "in the sidebar of the 3D view, tab *Risorius*"
        )
        lines += [f"Where: {where}.", ""]
    if row["buttons"]:
        lines += ["Buttons: " + ", ".join(row["buttons"]) + ".", ""]
    if row["properties"]:
        lines += ["| Option | Name in Python | Default | What it does |", "|---|---|---|---|"]
        for one in row["properties"]:
            words = [
                one["label"],
                f"`{one['id']}`",
                f"`{one['default']}`" if one["default"] else "",
                one["description"],
            ]
            lines.append("| " + " | ".join(cell(word) for word in words) + " |")
        for one in row["properties"]:
            for item in one["items"]:
                lines += [
                    "",
                    f"- *{one['label']}: {item[1]}* (`{item[0]}`)"
                    + (f": {item[2]}" if item[2] else ""),
                ]
    return "\n".join(lines) + "\n"


def blender_pages(
    pages: Path, rows: list[dict[str, Any]]
) -> list[tuple[str, list[tuple[str, str]]]]:
    """Write the pages of panels and operators. Returns (heading, [(title, file) of each page])."""
    folder = pages / "reference" / "blender"
    folder.mkdir(parents=True)
    nav = []
    index = ["# Panels and operators", "", "Made from the classes that the add-on registers.", ""]
    for kind, heading in (("panel", "Panels"), ("operator", "Operators")):
        index += [f"## {heading}", "", "| Name | What it does |", "|---|---|"]
        mine = sorted((r for r in rows if r["kind"] == kind), key=lambda r: (r["label"], r["id"]))
        group = []
        for row in mine:
            name = f"{row['id']}.md"
            (folder / name).write_text(blender_page(row), encoding="utf-8")
            words = row["description"] or ", ".join(row["buttons"])
            index.append(f"| [{row['label'] or row['id']}]({name}) | {cell(words)} |")
            group.append((row["label"] or row["id"], f"reference/blender/{name}"))
        index.append("")
        nav.append((heading, group))
    (folder / "index.md").write_text("\n".join(index), encoding="utf-8")
    return nav


def write_nav(text: str, nav: list[tuple[str, list[tuple[str, str]]]]) -> str:
    """The text of mkdocs.yml, with the pages of panels and operators added to the navigation."""
    lines = ["      - reference/blender/index.md"]
    for heading, group in nav:
        lines.append(f"      - {heading}:")
        lines += [f"          - {json.dumps(title)}: {name}" for title, name in group]
    mark = ": reference/blender/\n"
    return text.replace(mark, ":\n" + "\n".join(lines) + "\n")


def main() -> int:
    """Make all pages and the site's mkdocs.yml. Prints the number of pages."""
    pages, classes = Path(sys.argv[1]), Path(sys.argv[2])
    shutil.rmtree(pages, ignore_errors=True)
    pages.mkdir(parents=True)
    own = Path(__file__).parent
    text = (own / "mkdocs.yml").read_text(encoding="utf-8")
    shutil.copy(own / "index.md", pages / "index.md")
    copy_pages(pages, [*listed(text), "docs/images/first_look.jpg"])
    nav = blender_pages(pages, json.loads(classes.read_text(encoding="utf-8")))
    for name, content in (("commands", commands()), ("python", python_api()), ("cpp", cpp_api())):
        (pages / "reference" / f"{name}.md").write_text(content, encoding="utf-8")
    more = sorted(
        p.relative_to(pages).as_posix() for p in pages.rglob("*.md")
        if p.relative_to(pages).as_posix() not in text and "reference/blender" not in p.as_posix()
    )  # fmt: skip
    if more:  # pages that are only linked from other pages
        text = text.rstrip("\n") + "\n" + "\n".join(f"      - {name}" for name in more) + "\n"
    text = (
        write_nav(text, nav)
        .replace("../../../build/site/", "")
        .replace("../../../native", str(PROJECT / "native"))
    )
    (pages.parent / "mkdocs.yml").write_text(text, encoding="utf-8")
    print(f"{len(list(pages.rglob('*.md')))} pages")
    return 0


if __name__ == "__main__":
    sys.exit(main())
