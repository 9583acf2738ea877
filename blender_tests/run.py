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


def install(package: str) -> None:
    """Install the zip as the preferences do, before anything imports the wheel.

    Raises:
        RuntimeError: Blender refused it, or Python found another risorius than the zip's.
    """
    sys.path.insert(0, str(HERE.parent / "packaging"))
    import bpy
    import install_extension

    version = f"python{sys.version_info[0]}.{sys.version_info[1]}"
    folder = Path(bpy.utils.user_resource("EXTENSIONS"))
    wheels = folder / ".local" / "lib" / version / "site-packages"
    wheels.mkdir(parents=True, exist_ok=True)  # Python forgets a folder that was not there
    sys.path.insert(0, str(wheels))
    install_extension.install(package)
    import risorius

    if not Path(risorius.__file__ or "").is_relative_to(wheels):
        raise RuntimeError(f"{risorius.__file__} is not the zip's wheel")
    os.environ["RISORIUS_TEST_EXTENSION"] = package


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
        install(str(Path(arguments[at + 1]).resolve()))
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
