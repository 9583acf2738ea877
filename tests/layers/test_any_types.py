# SPDX-License-Identifier: MIT
"""Tests that public types of the add-on contain no Any, except for types Blender lacks."""

import ast
from pathlib import Path

import pytest
from any_types import shown_any

ADDON = Path(__file__).resolve().parents[2] / "addon/risorius"
NAMED = {
    "scene/base/blender_types.py": "Node Attribute NodeTree Socket Values Override",
    "ui/blender_types.py": "UIList.draw_item UIList.filter_items",
}


def shown_in(path):
    return shown_any(ast.parse(path.read_text(encoding="utf-8")))


def test_only_the_named_exceptions_have_any():
    files = sorted(ADDON.rglob("*.py"))
    assert len(files) > 100
    found = {path.relative_to(ADDON).as_posix(): " ".join(shown_in(path)) for path in files}
    assert {path: names for path, names in found.items() if names} == NAMED


@pytest.mark.parametrize(
    ("source", "expected"),
    [
        ("def f(a: Any): pass", ["f"]),
        ("def f(*a: int, b: list[Any]) -> None: pass", ["f"]),
        ("def f() -> 'dict[str, Any]': pass", ["f"]),
        ("class C:\n    def __init__(self, a: typing.Any): pass", ["C.__init__"]),
        ("class C:\n    a: tuple[Any, ...]", ["C.a"]),
        ("Alias = dict[str, Any]\nkept: dict[int, Any] = {}", ["Alias", "kept"]),
        ("if TYPE_CHECKING:\n    class C:\n        def f(self, a: Any): pass", ["C.f"]),
        ("def f(a: int):\n    a: Any = 1\ndef _g(a: Any): pass\n_h: Any = 0", []),
        ("TEXT = 'Any colour'\ndef f(a: Company) -> 'Anything': pass", []),
    ],
)
def test_any_is_found_where_it_is_shown(source, expected):
    assert shown_any(ast.parse(source)) == expected
