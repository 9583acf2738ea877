# SPDX-License-Identifier: MIT
"""Tests that docstrings of public functions explain their arguments; the check can fail."""

import ast
from pathlib import Path

import pytest
from docstrings import public_functions, unsaid

ROOT = Path(__file__).resolve().parents[2]
FOLDERS = [
    "native/python/risorius",
    "native/python/risorius_people",
    "addon/risorius/logic",
    "addon/risorius/scene",
    "addon/risorius/ui",
]


def found_in(source):
    return {name: unsaid(node) for name, node in public_functions(ast.parse(source))}


@pytest.mark.parametrize("folder", FOLDERS)
def test_docstrings_name_arguments_and_errors(folder):
    files = sorted((ROOT / folder).rglob("*.py"))
    assert len(files) > 10
    missing = {
        f"{path.relative_to(ROOT)}: {name}": words
        for path in files
        for name, words in found_in(path.read_text(encoding="utf-8")).items()
        if words
    }
    assert missing == {}


@pytest.mark.parametrize(
    ("source", "expected"),
    [
        ("def f(a, b): pass", {"f": ["a", "b"]}),
        ("def f(a, *, b):\n    '''A of b.'''", {"f": ["a"]}),
        ("def f(a, *b, **c):\n    '''Args:\n        a: 1.'''", {"f": ["b", "c"]}),
        ("class C:\n    def f(self, a, b):\n        '''Of a and b.'''", {"C.f": []}),
        ("class C:\n    def f(self, a, b):\n        '''Of ab.'''", {"C.f": ["a", "b"]}),
        ("def f(a, b):\n    '''a, b.'''\n    raise ValueError(a)", {"f": ["Raises"]}),
        ("def f(a, b):\n    '''a, b. Raises: E.'''\n    raise ValueError(a)", {"f": []}),
        ("class RISORIUS_OT_f:\n    def invoke(self, context, event): pass", {}),
        ("class RISORIUS_OT_f:\n    def g(self, a, b): pass", {"RISORIUS_OT_f.g": ["a", "b"]}),
        ("class C:\n    def invoke(self, a, b): pass", {"C.invoke": ["a", "b"]}),
        ("def f(a): pass\ndef _g(a, b): pass\nclass _C:\n    def f(self, a, b): pass", {"f": []}),
    ],
)
def test_a_docstring_that_leaves_something_out_is_found(source, expected):
    assert found_in(source) == expected
