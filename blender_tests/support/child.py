# SPDX-License-Identifier: GPL-3.0-or-later
"""Runs code in a separate Blender process, because it may crash or needs another environment."""

import os
import sys
from pathlib import Path

import bpy
import limits

HERE = Path(__file__).resolve().parents[1]
_START = """
import os, sys, traceback
sys.path.insert(0, {here!r})
sys.path += {path!r}
def main():
    import bpy, addon_utils
    from pathlib import Path
    import conftest
    bpy.ops.wm.read_factory_settings(use_empty=True)
    if not os.environ.get("RISORIUS_TEST_INSTALLED"):
        user = Path(os.environ["RISORIUS_TEST_USER"])
        conftest._repository(user / "extensions" / "user_default" / "risorius")
    assert addon_utils.enable(conftest.MODULE) is not None
    from support import scene
{body}
code = 1
try:
    main()
    code = 0
except BaseException:
    traceback.print_exc()
sys.stdout.flush()
sys.stderr.flush()
os._exit(code)
"""


def run(tmp_path, body, cpu=300, **environment):
    """Run lines of Python in a separate Blender process with the add-on enabled.

    The lines can use `bpy` and `support.scene` as `scene`.

    Args:
        tmp_path: folder for the script.
        body: the lines of Python.
        cpu: limit of CPU time in seconds.
        environment: environment variables to set.

    Returns:
        Exit code and printed text.
    """
    script = tmp_path / "child.py"
    indented = "\n".join(f"    {line}" for line in body.splitlines())
    path = [p for p in os.environ.get("RISORIUS_TEST_PATH", "").split(os.pathsep) if p]
    script.write_text(_START.format(here=str(HERE), path=path, body=indented), encoding="utf-8")
    program = [sys.executable, str(script)]
    if bpy.app.binary_path:
        program = [bpy.app.binary_path, "-b", "--factory-startup", "-noaudio"]
        program += ["--python-exit-code", "1", "--python", str(script)]
    done = limits.run(program, cpu, env={**os.environ, **environment})
    return done.returncode, done.stdout + done.stderr
