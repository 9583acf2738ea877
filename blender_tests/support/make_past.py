# SPDX-License-Identifier: GPL-3.0-or-later
"""Make .blend files with an old build of the extension, and record their animation.

    python blender_tests/support/make_past.py ZIP FOLDER [--record]

Run the script with a Python that has bpy. ZIP is the old build of the extension. Without --record,
the script makes the .blend files in FOLDER. With --record, it uses the existing files of FOLDER. In
both cases it writes the values of the played animation to FOLDER/values.npz.
"""

import argparse
import os
import shutil
import sys
import tempfile
from pathlib import Path

HERE = Path(__file__).resolve()


def _start(package):
    """Install the zip file of an extension in a temporary user folder, for this process."""
    os.environ["BLENDER_USER_RESOURCES"] = tempfile.mkdtemp(prefix="risorius-past-")
    import bpy

    bpy.ops.wm.read_factory_settings(use_empty=True)
    packaging = HERE.parents[2] / "packaging"
    sys.path[:0] = [str(HERE.parents[1]), str(packaging / "check" / "blender")]
    from install_extension import install

    install(package.resolve())


def main():
    """Make the files, unless --record is given, and record their animation."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("zip", type=Path)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--record", action="store_true")
    options = parser.parse_args()
    _start(options.zip)
    from support import past, past_scenes

    # A .blend file contains its path, so the files are saved in a folder whose path does not name
    # the user.
    work = Path(tempfile.gettempdir()) / "risorius-past"
    shutil.rmtree(work, ignore_errors=True)
    if options.record:
        shutil.copytree(options.folder, work)
    work.mkdir(exist_ok=True)
    with past.scalar():
        if not options.record:
            past_scenes.make_all(work)
        past.record(work)
    shutil.copytree(work, options.folder, dirs_exist_ok=True)
    shutil.rmtree(work)


if __name__ == "__main__":
    code = 1
    try:
        main()
        code = 0
    except BaseException:  # noqa: BLE001  printed, and the exit code says it
        import traceback

        traceback.print_exc()
    sys.stdout.flush()
    sys.stderr.flush()
    os._exit(code)  # Blender as a module sometimes hangs in its destructors
