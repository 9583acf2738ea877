# SPDX-License-Identifier: MIT
"""Copies a release under another version number, so that a trial can update from it.

older.py ZIP VERSION OUT    writes the extension ZIP as VERSION into the folder OUT; prints its path
"""

from __future__ import annotations

import base64
import hashlib
import re
import sys
import tempfile
import zipfile
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

import build_extension


def wheel_as(wheel: Path, old: str, new: str) -> Path:
    """Replace a wheel of risorius by a copy with another version. Returns the path of the copy.

    Args:
        wheel: path of the wheel, which is deleted.
        old: version of the wheel.
        new: version of the copy.
    """
    target = wheel.with_name(wheel.name.replace(f"-{old}-", f"-{new}-", 1))
    record = []
    with (
        zipfile.ZipFile(wheel) as source,
        zipfile.ZipFile(target, "w", zipfile.ZIP_DEFLATED) as out,
    ):
        for about in source.infolist():
            name = about.filename.replace(f"-{old}.dist-info", f"-{new}.dist-info")
            data = source.read(about)
            if name.endswith("dist-info/METADATA"):
                data = data.replace(
                    f"\nVersion: {old}\n".encode(), f"\nVersion: {new}\n".encode(), 1
                )
            if name.endswith("base/version.py"):
                data = data.replace(f'"{old}"'.encode(), f'"{new}"'.encode(), 1)
            if name.endswith("dist-info/RECORD"):
                rows = "".join(record) + f"{name},,\n"
                data = rows.encode()
            else:
                digest = base64.urlsafe_b64encode(hashlib.sha256(data).digest()).rstrip(b"=")
                record.append(f"{name},sha256={digest.decode()},{len(data)}\n")
            out.writestr(name, data)
    wheel.unlink()
    return target


def extension_as(package: Path, new: str, out: Path) -> Path:
    """Write the extension under another version. Returns the path of the new zip.

    Args:
        package: zip of the extension.
        new: the new version.
        out: folder of the new zip.
    """
    with tempfile.TemporaryDirectory() as folder:
        root = Path(folder)
        with zipfile.ZipFile(package) as archive:
            archive.extractall(root)
        manifest = root / "blender_manifest.toml"
        text = manifest.read_text(encoding="utf-8")
        old = build_extension.manifest_version(text)
        text = re.sub(rf'^version = "{re.escape(old)}"', f'version = "{new}"', text, flags=re.M)
        manifest.write_text(
            re.sub(rf"/(risorius(?:_people)?)-{re.escape(old)}-", rf"/\1-{new}-", text),
            encoding="utf-8",
        )
        for name in ("risorius", "risorius_people"):
            for wheel in list((root / "wheels").glob(f"{name}-{old}-*.whl")):
                wheel_as(wheel, old, new)
        target = out / package.name.replace(old, new)
        build_extension.write_zip(root, target)
    return target


if __name__ == "__main__":
    print(extension_as(Path(sys.argv[1]), sys.argv[2], Path(sys.argv[3])))
