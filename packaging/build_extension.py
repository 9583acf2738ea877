# SPDX-License-Identifier: MIT
"""Makes the Blender extension: the add-on with wheels of the native module inside.

    python packaging/build_extension.py --wheels WHEEL [WHEEL ...] --out FOLDER

Prints the path of the zip. The wheels' version must equal the add-on's.
"""

from __future__ import annotations

import argparse
import re
import shutil
import sys
import tempfile
import zipfile
from pathlib import Path

ADDON = Path(__file__).resolve().parents[1] / "addon" / "risorius"
PLATFORMS = {
    "linux_x86_64": "linux-x64",
    "manylinux": "linux-x64",
    "win_amd64": "windows-x64",
    "macosx_11_0_arm64": "macos-arm64",
    "macosx": "macos-x64",
}


def manifest_version(text: str) -> str:
    found = re.search(r'^version = "([^"]+)"', text, re.MULTILINE)
    if not found:
        raise SystemExit("blender_manifest.toml has no version")
    return found.group(1)


def platform_of(wheel: Path) -> str:
    tag = wheel.stem.rsplit("-", 1)[-1]
    for start, platform in PLATFORMS.items():
        if tag.startswith(start):
            return platform
    raise SystemExit(f"{wheel.name}: no Blender platform for {tag}")


def python_of(wheel: Path) -> tuple[int, int]:
    """The Python that a wheel is made for, e.g. (3, 11)."""
    found = re.match(r"cp(\d)(\d+)$", wheel.stem.split("-")[2])
    if not found:
        raise SystemExit(f"{wheel.name}: no Python version in its name")
    return int(found.group(1)), int(found.group(2))


def build(wheels: list[Path], out: Path) -> Path:
    """Write the zip. Raises SystemExit with a sentence when something does not fit together."""
    text = (ADDON / "blender_manifest.toml").read_text(encoding="utf-8")
    version = manifest_version(text)
    for wheel in wheels:
        if wheel.name.split("-")[1] != version:
            raise SystemExit(f"{wheel.name} is not version {version}, the add-on is")
    # Blender takes the wheels of its own Python, but 4.2.0 took all and kept the last: 3.11 is last.
    ordered = sorted(wheels, key=lambda w: (*python_of(w), w.name), reverse=True)
    names = ", ".join(f'"./wheels/{w.name}"' for w in ordered)
    platforms = ", ".join(f'"{p}"' for p in sorted({platform_of(w) for w in wheels}))
    head, mark, tail = text.partition("\n[permissions]")
    text = f"{head}\nplatforms = [{platforms}]\nwheels = [{names}]\n{mark}{tail}"
    out.mkdir(parents=True, exist_ok=True)
    target = out / f"risorius-{version}.zip"
    with tempfile.TemporaryDirectory() as folder:
        root = Path(folder) / "risorius"
        ignored = shutil.ignore_patterns("__pycache__", "*.pyc", ".*")
        shutil.copytree(ADDON, root, ignore=ignored)
        (root / "blender_manifest.toml").write_text(text, encoding="utf-8")
        (root / "wheels").mkdir()
        for wheel in wheels:
            shutil.copy(wheel, root / "wheels")
        with zipfile.ZipFile(target, "w", zipfile.ZIP_DEFLATED) as archive:
            for path in sorted(root.rglob("*")):
                if path.is_file():
                    archive.write(path, path.relative_to(root).as_posix())
    return target


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--wheels", nargs="+", type=Path, required=True)
    parser.add_argument("--out", type=Path, required=True)
    args = parser.parse_args()
    print(build(args.wheels, args.out))
    return 0


if __name__ == "__main__":
    sys.exit(main())
