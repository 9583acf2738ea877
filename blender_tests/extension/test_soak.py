# SPDX-License-Identifier: GPL-3.0-or-later
"""A short soak test, and checks that it notices wrong faces, tracebacks and crashes."""

import os
import sys
from pathlib import Path

import bpy
import limits
import pytest
import risorius

SOAK = Path(__file__).resolve().parents[1] / "soak.py"
ACTIONS = 300


def _soak(log, *given, **environment):
    """Run the soak test in a separate process. Returns its exit code and log."""
    program = [sys.executable, str(SOAK), "--log", str(log), *given]
    if bpy.app.binary_path:
        program += ["--blender", bpy.app.binary_path]
    kept = {k: v for k, v in os.environ.items() if k != "RISORIUS_TEST_USER"}
    # The child has its own user folder, and finds the package where this process found it.
    kept["RISORIUS_TEST_PATH"] = str(Path(risorius.__file__).parent.parent)
    done = limits.run(program, 400, env={**kept, **environment})
    text = log.read_text(encoding="utf-8") if log.is_file() else done.stderr
    return done.returncode, text


def test_hundreds_of_random_actions(tmp_path):
    code, text = _soak(tmp_path / "log", "--actions", str(ACTIONS), "--seed", "7", "--check", "25")
    assert code == 0, text[-3000:]
    assert f"{ACTIONS} of {ACTIONS} actions" in text
    assert "errors: 0" in text


@pytest.mark.parametrize(
    ("planted", "said"),
    [
        ("face", "is off by"),
        ("traceback", "planted traceback"),
        ("death", "last action: 5 "),
        ("hang", "it stood still for"),
    ],
)
def test_the_soak_sees(tmp_path, planted, said):
    given = ["--actions", "10", "--seed", "7", "--check", "5"]
    if planted == "hang":
        given += ["--still", "12"]
    code, text = _soak(tmp_path / "log", *given, RISORIUS_SOAK_PLANT=planted)
    assert code == 1
    assert "errors: 0" not in text
    assert said in text
