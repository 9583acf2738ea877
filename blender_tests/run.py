# SPDX-License-Identifier: GPL-3.0-or-later
"""Run the tests inside Blender, or inside the bpy module; the exit code is pytest's.

    python blender_tests/run.py [--extension ZIP] [pytest arguments]
    blender -b --factory-startup -noaudio --python-exit-code 1 \
        --python blender_tests/run.py -- [--extension ZIP] [pytest arguments]

With --extension, the package ZIP is installed as users install it, with the wheel in it. Without
--extension, the add-on is copied from the source folder, and Python must be able to import
`risorius`.
"""

import argparse
import os
import shutil
import sys
import tempfile
from pathlib import Path

HERE = Path(__file__).resolve().parent


def _arguments() -> tuple[argparse.Namespace, list[str]]:
    given = sys.argv[1:]
    if "--" in sys.argv:
        given = sys.argv[sys.argv.index("--") + 1 :]
    elif "bpy" in sys.modules:
        given = []  # Blender's own arguments
    parser = argparse.ArgumentParser(allow_abbrev=False)
    parser.add_argument("--extension", type=Path)
    return parser.parse_known_args(given)


def _install(package: Path) -> None:
    """Install the zip file of an extension through Blender's extension system."""
    import bpy  # noqa: F401  as a module it brings addon_utils onto the path

    sys.path.insert(0, str(HERE.parent / "packaging" / "check" / "blender"))
    from install_extension import install

    install(package.resolve())
    sys.path.pop(0)


def main() -> int:
    """Run pytest on the tests of the command line, or on this folder. Returns pytest's exit code.

    Before that, main makes a temporary user folder if BLENDER_USER_RESOURCES is not set, and
    installs the package of --extension.
    """
    made = None
    if "BLENDER_USER_RESOURCES" not in os.environ:
        # The bpy module reads this variable when it is imported, so it is set before.
        made = os.environ["BLENDER_USER_RESOURCES"] = tempfile.mkdtemp(prefix="risorius-blender-")
    os.environ["RISORIUS_TEST_USER"] = os.environ["BLENDER_USER_RESOURCES"]
    options, rest = _arguments()
    for folder in os.environ.get("RISORIUS_TEST_PATH", "").split(os.pathsep):
        if folder:
            sys.path.append(folder)
    if options.extension is not None:
        _install(options.extension)
        os.environ["RISORIUS_TEST_INSTALLED"] = str(options.extension.resolve())
    import pytest

    named = [a for a in rest if Path(a.split("::")[0]).exists()]
    places = [] if named else [str(HERE)]
    try:
        fixed = ["-q", "-p", "no:cacheprovider", "--rootdir", str(HERE)]
        return int(pytest.main([*places, *fixed, *rest]))
    finally:
        if made is not None:
            shutil.rmtree(made, ignore_errors=True)


if __name__ == "__main__":
    code = 1
    try:
        code = main()
    except BaseException:  # noqa: BLE001  printed, and the exit code says it
        import traceback

        traceback.print_exc()
    sys.stdout.flush()
    sys.stderr.flush()
    os._exit(code)  # Blender as a module sometimes hangs in its destructors
