# SPDX-License-Identifier: MIT
"""Tests that all options exist which commands name in their messages."""

import argparse
import ast
import re
from pathlib import Path

import pytest
import risorius.cli

ROOT = Path(risorius.cli.__file__).parent
OPTION = re.compile(r"(?<![\w-])--[a-z][a-z-]+")
# Module whose name is no command -> the commands that use it.
PARTS = {
    "eval_clip": ["eval"],
    "diff": ["info"],
    "authoring": ["author"],
    "ranges": ["clip"],
    "files": ["convert", "edit"],
    "onto": ["author"],
    "conform": ["author"],
}


@pytest.fixture(scope="module")
def options(monkeypatch_module):
    """Command -> all its options, including options of its subcommands."""
    parsers = []
    monkeypatch_module.setattr(
        argparse.ArgumentParser, "parse_known_args", lambda self, _: parsers.append(self)
    )
    with pytest.raises(TypeError):
        risorius.cli.parse([])
    return {name: set(_options(parser)) for name, parser in _parts(parsers[0]).items()}


@pytest.fixture(scope="module")
def monkeypatch_module():
    with pytest.MonkeyPatch.context() as patch:
        yield patch


def _parts(parser):
    return next(
        (a.choices for a in parser._actions if isinstance(a, argparse._SubParsersAction)), {}
    )


def _options(parser):
    for action in parser._actions:
        yield from action.option_strings
    for part in _parts(parser).values():
        yield from _options(part)


def _named(path):
    """Yields the options that are named in the raise statements of a module."""
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Raise):
            for text in ast.walk(node):
                if isinstance(text, ast.Constant) and isinstance(text.value, str):
                    yield from OPTION.findall(text.value)


def test_errors_name_options_that_their_command_has(options):
    assert {"--lods", "--force"} <= options["convert"]
    found = {}
    for path in sorted(ROOT.rglob("*.py")):
        commands = PARTS.get(path.stem, [path.stem])
        if path.stem == "__init__":
            continue
        known = [options[name] for name in commands if name in options] or list(options.values())
        wrong = set(_named(path)) - set.intersection(*known)
        if wrong:
            found[path.name] = sorted(wrong)
    assert found == {}
