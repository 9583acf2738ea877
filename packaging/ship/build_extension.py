# SPDX-License-Identifier: MIT
"""Makes the Blender extension: the add-on with wheels of the native module inside.

    build_extension.py --wheels WHEEL [WHEEL ...] --out FOLDER [--sample FOLDER]

Prints the path of the zip. The wheels' version must equal the add-on's. The wheel of the sample
people must be in the folder of the first wheel. pip downloads the pure wheels that
extension_wheels.txt pins to OUT/pure and checks their hashes. Equal input files give an identical
zip at any time.
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

ADDON = Path(__file__).resolve().parents[2] / "addon" / "risorius"
PINNED = Path(__file__).with_name("extension_wheels.txt")
SAMPLE = Path(__file__).with_name("sample")  # licence and origin of the sample face
PLATFORMS = {
    r"(many)?linux.*_x86_64": "linux-x64",
    r"win_amd64": "windows-x64",
    r"win_arm64": "windows-arm64",
    r"macosx_.*_arm64": "macos-arm64",
    r"macosx_.*_x86_64": "macos-x64",
}
DATE = (2026, 1, 1, 0, 0, 0)  # date of every file in a zip, so that zips are reproducible


def manifest_version(text: str) -> str:
    found = re.search(r'^version = "([^"]+)"', text, re.MULTILINE)
    if not found:
        raise SystemExit("blender_manifest.toml has no version")
    return found.group(1)


def platform_of(wheel: Path) -> str:
    tag = wheel.stem.rsplit("-", 1)[-1]
    # Of several tags, such as manylinux_2_27_x86_64.manylinux_2_28_x86_64, the first one counts.
    for pattern, platform in PLATFORMS.items():
        if re.fullmatch(pattern, tag.split(".")[0]):
            return platform
    raise SystemExit(f"{wheel.name}: no Blender platform for {tag}")


def name_inside(wheel: Path) -> str:
    """The wheel's file name in the zip. Wheels for other Pythons than 3.11 get a build number.

    Blender installs the wheels of its own Python version. Blender 4.2.0 (Python 3.11) compares the
    platform only, and keeps the wheel whose name sorts last. The build number makes the other
    wheels sort before `cp311`.
    """
    parts = wheel.name.split("-")
    if len(parts) == 5 and parts[2] != "cp311":
        parts.insert(2, "1")
    return "-".join(parts)


def fetch_pinned(folder: Path) -> list[Path]:
    """The wheels of extension_wheels.txt, taken from the folder if present, otherwise from PyPI.

    Args:
        folder: folder of the downloaded wheels.

    Raises:
        SystemExit: pip cannot download the wheels, or their hashes differ from the pinned ones.
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


def people_wheel(wheels: list[Path]) -> Path:
    """Path of the wheel of the sample people.

    Args:
        wheels: wheels of risorius, all of one version; the wheel of the sample people has the same
            version and is in the folder of the first of them.

    Raises:
        SystemExit: the file is missing.
    """
    version = wheels[0].name.split("-")[1]
    found = wheels[0].with_name(f"risorius_people-{version}-py3-none-any.whl")
    if not found.is_file():
        raise SystemExit(f"{found} was expected: build it with build_people_wheel of setup.sh")
    return found


def copy_sample(sample: Path, target: Path) -> None:
    """Copy the sample face, its textures, and the files on its licence and origin.

    Args:
        sample: folder with the output of `risorius sample build`.
        target: new folder.
    """
    shutil.copytree(sample, target, ignore=shutil.ignore_patterns(".*"))
    for path in sorted(SAMPLE.iterdir()):
        shutil.copy(path, target)


def write_zip(root: Path, target: Path) -> None:
    """Write all files below a folder as a zip whose bytes depend only on names and contents.

    Args:
        root: the folder.
        target: the zip.
    """
    with zipfile.ZipFile(target, "w", zipfile.ZIP_DEFLATED) as archive:
        for path in sorted(root.rglob("*")):
            if path.is_file():
                about = zipfile.ZipInfo(path.relative_to(root).as_posix(), DATE)
                about.compress_type = zipfile.ZIP_DEFLATED
                about.external_attr = 0o644 << 16
                archive.writestr(about, path.read_bytes())


def make_tree(
    wheels: list[Path], root: Path, pure: list[Path], sample: Path | None, website: str = ""
) -> str:
    """Write the extension as a folder that Blender's extension tool can build. Returns its version.

    Args:
        wheels: wheels of risorius, one for each Python and platform.
        root: new folder.
        pure: wheels for every Python and platform; their names are kept.
        sample: folder with the sample face, or None.
        website: address of the documentation; empty if there is none.

    Raises:
        SystemExit: a wheel's version differs from the add-on's, or its platform is unknown.
    """
    text = (ADDON / "blender_manifest.toml").read_text(encoding="utf-8")
    version = manifest_version(text)
    for wheel in wheels:
        if wheel.name.split("-")[1] != version:
            raise SystemExit(f"{wheel.name} is not version {version}, the add-on is")
    inside = [*map(name_inside, sorted(wheels)), *(w.name for w in sorted(pure))]
    names = ", ".join(f'"./wheels/{name}"' for name in inside)
    platforms = ", ".join(f'"{p}"' for p in sorted({platform_of(w) for w in wheels}))
    head, mark, tail = text.partition("\n[permissions]")
    head += f'\nwebsite = "{website}"' if website else ""
    text = f"{head}\nplatforms = [{platforms}]\nwheels = [{names}]\n{mark}{tail}"
    ignored = shutil.ignore_patterns("__pycache__", "*.pyc", ".*")
    shutil.copytree(ADDON, root, ignore=ignored)
    (root / "blender_manifest.toml").write_text(text, encoding="utf-8")
    (root / "wheels").mkdir()
    for wheel in wheels:
        shutil.copy(wheel, root / "wheels" / name_inside(wheel))
    for wheel in pure:
        shutil.copy(wheel, root / "wheels")
    if sample is not None:
        copy_sample(sample, root / "sample")
    return version


def build(
    wheels: list[Path], out: Path, pure: list[Path] | None = None, sample: Path | None = None
) -> Path:
    """Write the zip with all wheels into the folder `out`. Returns the path of the zip.

    Args:
        wheels: wheels of risorius, one for each Python and platform.
        out: folder of the zip, which is made if it is missing.
        pure: wheels for every Python and platform.
        sample: folder with the sample face, or None.

    Raises:
        SystemExit: a wheel's version differs from the add-on's, or its platform is unknown.
    """
    out.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory() as folder:
        root = Path(folder) / "risorius"
        version = make_tree(wheels, root, pure or [], sample)
        target = out / f"risorius-{version}.zip"
        write_zip(root, target)
    return target


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--wheels", nargs="+", type=Path, required=True)
    parser.add_argument("--out", type=Path, required=True)
    parser.add_argument("--sample", type=Path, help="folder with the sample face")
    args = parser.parse_args()
    pure = [people_wheel(args.wheels), *fetch_pinned(args.out / "pure")]
    print(build(args.wheels, args.out, pure, args.sample))
    return 0


if __name__ == "__main__":
    sys.exit(main())
