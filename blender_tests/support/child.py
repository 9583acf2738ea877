# SPDX-License-Identifier: GPL-3.0-or-later
"""Run code in a separate Blender: for other environments, and for code that may crash."""

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
    """Run lines of Python with the names `bpy` and `scene` in a separate Blender.

    Args:
        tmp_path: folder for the script.
        body: lines of Python.
        cpu: limit in seconds of CPU.
        environment: environment variables to set.

    Returns:
        Exit code, and the printed output.
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
