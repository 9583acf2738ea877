# SPDX-License-Identifier: GPL-3.0-or-later
"""Run the tests inside Blender, or inside the bpy module; the exit code is pytest's.

python blender_tests/run.py [--extension ZIP] [pytest arguments]
blender -b --factory-startup -noaudio --python-exit-code 1 --python blender_tests/run.py -- ...

With --extension the add-on and its wheel come from that zip, installed as a user would; without,
the add-on's folder is used as it stands, with the wheel that Python finds.
"""

import os
import shutil
import sys
import tempfile
from pathlib import Path

HERE = Path(__file__).resolve().parent


def main() -> int:
    """Install the add-on into a throw-away user folder and run pytest on this folder."""
    # Blender reads the user folder when it starts: set before bpy is first imported.
    user = Path(tempfile.mkdtemp(prefix="risorius-blender-"))
    os.environ["BLENDER_USER_RESOURCES"] = str(user)
    os.environ["RISORIUS_TEST_USER"] = str(user)
    arguments = sys.argv[1:]
    if "bpy" in sys.modules:
        arguments = sys.argv[sys.argv.index("--") + 1 :] if "--" in sys.argv else []
    if arguments[:1] == ["--"]:
        arguments = arguments[1:]
    if "--extension" in arguments:
        at = arguments.index("--extension")
        os.environ["RISORIUS_TEST_EXTENSION"] = str(Path(arguments[at + 1]).resolve())
        del arguments[at : at + 2]
    for folder in os.environ.get("RISORIUS_TEST_PATH", "").split(os.pathsep):
        if folder:
            sys.path.append(folder)
    import pytest

    named = [a for a in arguments if Path(a.split("::")[0]).exists()]
    try:
        return int(
            pytest.main(
                [
                    *([] if named else [str(HERE)]),
                    "-q",
                    "-p",
                    "no:cacheprovider",
                    "--rootdir",
                    str(HERE),
                    *arguments,
                ]
            )
        )
    finally:
        shutil.rmtree(user, ignore_errors=True)


if __name__ == "__main__":
    code = main()
    sys.stdout.flush()
    sys.stderr.flush()
    os._exit(code)  # Blender as a module sometimes hangs in its destructors
