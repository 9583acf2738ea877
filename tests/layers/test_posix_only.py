# SPDX-License-Identifier: MIT
"""Tests that only files listed in posix_only.toml use functions that Windows does not have."""

from pathlib import Path

import pytest
from posix_only import POSIX, unmarked
from words import product_files

ROOT = Path(__file__).resolve().parents[2]
MARKED = {path: "import fcntl" for path in POSIX["marked"] if path.endswith(".py")} | {
    path: "#include <unistd.h>" for path in POSIX["marked"] if path.endswith(".cpp")
}


def test_what_only_posix_has_is_in_marked_files():
    assert unmarked(product_files(ROOT)) == []


@pytest.mark.parametrize(
    ("line", "what"),
    [
        ("import fcntl", "fcntl"),
        ("from os import kill", "os.kill"),
        ("mine = os.getuid()", "os.getuid"),
        ("signal.alarm(1)", "signal.alarm"),
        ("path.rename(other)", ".rename"),
        ("subprocess.Popen(words, start_new_session=True)", "start_new_session"),
        ("cache = Path('/tmp/risorius')", "/tmp/risorius"),
        ("text = path.read_text()", "read_text without an encoding"),
        ("file = open(path, 'w')", "open without an encoding"),
    ],
)
def test_a_planted_line_of_python_is_found(line, what):
    path = "addon/risorius/logic/planted.py"
    assert unmarked({**MARKED, path: f"\n{line}\n"}) == [f"{path}:2: {what}"]


@pytest.mark.parametrize(
    ("line", "what"),
    [
        ("#include <sys/stat.h>", "#include <sys/stat.h>"),
        ("const int file = ::open(name, 0);", "::open("),
        ("ssize_t n = 0;", "ssize_t"),
        ('const char* where = "/tmp/x";', '"/tmp/'),
    ],
)
def test_a_planted_line_of_cpp_is_found(line, what):
    path = "native/rig/planted.cpp"
    assert unmarked({**MARKED, path: f"// ::open(\n{line}\n"}) == [f"{path}:2: {what}"]


@pytest.mark.parametrize(
    "line",
    [
        "file = open(path, 'rb')",
        "file = open(path, encoding='utf-8')",
        "path.replace(other)",
        "note = 'in /tmp'",
    ],
)
def test_what_every_system_has_is_let_be(line):
    assert unmarked({**MARKED, "addon/risorius/logic/planted.py": line}) == []


def test_a_mark_that_nothing_needs_is_found():
    path = next(iter(MARKED))
    assert unmarked({**MARKED, path: ""}) == [f"{path}: marked, and uses nothing"]
