# SPDX-License-Identifier: MIT
"""Tests the documentation's site, which packaging/ship/site.sh builds: pages and links."""

import importlib.util
import sys
from pathlib import Path

import pytest

PROJECT = Path(__file__).resolve().parents[3]


def _part(name):
    path = PROJECT / "packaging" / "ship" / "site" / f"{name}.py"
    described = importlib.util.spec_from_file_location(f"site_{name}", path)
    module = importlib.util.module_from_spec(described)
    sys.modules[described.name] = module
    described.loader.exec_module(module)
    return module


def test_every_page_of_the_navigation_and_all_that_it_links_to_is_there(tmp_path):
    gather = _part("gather")
    nav = (PROJECT / "packaging" / "ship" / "site" / "mkdocs.yml").read_text(encoding="utf-8")
    names = gather.listed(nav)
    written = {p.relative_to(PROJECT).as_posix() for p in (PROJECT / "docs").rglob("*.md")}
    assert written <= set(names)
    gather.copy_pages(tmp_path, names)
    for name in names:
        text = (tmp_path / name).read_text(encoding="utf-8")
        # A > between menu names must not begin a line, because Markdown would make it a quotation.
        assert not [line for line in text.splitlines() if line.startswith("> ")], name


def test_a_link_to_a_folder_leads_to_its_page_and_one_to_nothing_stops(tmp_path, monkeypatch):
    gather = _part("gather")
    project, pages = tmp_path / "project", tmp_path / "pages"
    (project / "docs").mkdir(parents=True)
    (project / "tests").mkdir()
    (project / "tests" / "README.md").write_text("# Tests\n", encoding="utf-8")
    page = project / "docs" / "a.md"
    page.write_text("[t](../tests) [w](https://a.example/x) [p](#here)\n", encoding="utf-8")
    monkeypatch.setattr(gather, "PROJECT", project)
    gather.copy_pages(pages, ["docs/a.md"])
    text = (pages / "docs" / "a.md").read_text(encoding="utf-8")
    assert text == "[t](../tests/README.md) [w](https://a.example/x) [p](#here)\n"
    assert (pages / "tests" / "README.md").is_file()
    page.write_text("[t](../gone.md)\n", encoding="utf-8")
    with pytest.raises(SystemExit, match=r"docs/a\.md links to .*gone\.md, which is not there"):
        gather.copy_pages(pages, ["docs/a.md"])


def test_links_that_lead_nowhere_are_seen(tmp_path):
    links = _part("links")
    (tmp_path / "b").mkdir()
    (tmp_path / "b" / "index.html").write_text('<p id="here">', encoding="utf-8")
    (tmp_path / "a.html").write_text(
        '<a href="b/#here"><a href="b/index.html"><a href="https://a.example">'
        '<a href="#top" id="top">'
        '<a href="c.html"><img src="x.png"><a href="b/index.html#there">',
        encoding="utf-8",
    )
    assert links.broken(tmp_path) == (
        [
            "a.html: b/index.html#there: no such place",
            "a.html: c.html: no such page",
            "a.html: x.png: no such page",
        ],
        6,
    )


def test_the_page_of_an_operator_has_its_options():
    gather = _part("gather")
    option = {"id": "how", "label": "How", "default": "A", "description": "One | two",
              "items": [["A", "First", "as it is"], ["B", "Second", ""]]}  # fmt: skip
    row = {"kind": "operator", "id": "risorius.x", "label": "X", "description": "Does x",
           "parent": "", "buttons": [], "properties": [option]}  # fmt: skip
    text = gather.blender_page(row)
    assert text.startswith("# X\n\nDoes x.\n\nIn Python: `bpy.ops.risorius.x()`\n")
    assert "| How | `how` | `A` | One \\| two |" in text
    assert "- *How: First* (`A`): as it is" in text
    assert "- *How: Second* (`B`)\n" in text
