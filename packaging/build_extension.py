# SPDX-License-Identifier: MIT
"""Makes the Blender extension: the add-on with wheels of the native module inside.

    python packaging/build_extension.py --wheels WHEEL [WHEEL ...] --out FOLDER

Prints the path of the zip. The wheels' version must equal the add-on's. The pure wheels that
extension_wheels.txt pins are fetched with pip, their hashes checked, and kept in OUT/pure.
"""

from __future__ import annotations

import argparse
import re
import shutil
import subprocess
import sys
import tempfile
import zipfile
from pathlib import Path

ADDON = Path(__file__).resolve().parents[1] / "addon" / "risorius"
PINNED = Path(__file__).with_name("extension_wheels.txt")
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


def name_inside(wheel: Path) -> str:
    """The wheel's file name in the zip: with a build number, unless it is for Python 3.11.

    Blender takes the wheels of its own Python. Only 4.2.0, which is Python 3.11, looked at the
    platform alone and then kept the wheel whose name sorts last: a number sorts before `cp311`.
    """
    parts = wheel.name.split("-")
    if len(parts) == 5 and parts[2] != "cp311":
        parts.insert(2, "1")
    return "-".join(parts)


def fetch_pinned(folder: Path) -> list[Path]:
    """The wheels of extension_wheels.txt, from the folder where they are there, else from PyPI.

    Raises SystemExit where they cannot be had, or are not those that were pinned.
    """
    folder.mkdir(parents=True, exist_ok=True)
    pip = [sys.executable, "-m", "pip", "download", "-q", "--no-deps", "--only-binary", ":all:"]
    pip += ["--require-hashes", "-r", str(PINNED), "-d", str(folder)]
    local = [*pip, "--no-index", "--find-links", str(folder)]
    if subprocess.run(local, capture_output=True, check=False).returncode:
        done = subprocess.run(pip, capture_output=True, text=True, check=False)
        if done.returncode:
            raise SystemExit(f"the wheels of {PINNED.name} cannot be had: {done.stderr.strip()}")
    names = re.findall(r"^([\w-]+)==([\w.]+)", PINNED.read_text(encoding="utf-8"), re.MULTILINE)
    found = (folder.glob(f"{name.replace('-', '_')}-{version}-*.whl") for name, version in names)
    return [wheel for wheels in found for wheel in wheels]


def build(wheels: list[Path], out: Path, pure: list[Path] | None = None) -> Path:
    """Write the zip. Raises SystemExit with a sentence when something does not fit together.

    Args:
        wheels: of ours, one for each Python and platform.
        out: folder of the zip.
        pure: wheels for every Python and platform, taken as they are.
    """
    pure = pure or []
    text = (ADDON / "blender_manifest.toml").read_text(encoding="utf-8")
    version = manifest_version(text)
    for wheel in wheels:
        if wheel.name.split("-")[1] != version:
            raise SystemExit(f"{wheel.name} is not version {version}, the add-on is")
    inside = [*map(name_inside, sorted(wheels)), *(w.name for w in sorted(pure))]
    names = ", ".join(f'"./wheels/{name}"' for name in inside)
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
            shutil.copy(wheel, root / "wheels" / name_inside(wheel))
        for wheel in pure:
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
    print(build(args.wheels, args.out, fetch_pinned(args.out / "pure")))
    return 0


if __name__ == "__main__":
    sys.exit(main())
