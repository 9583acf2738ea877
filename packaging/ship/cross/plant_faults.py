# SPDX-License-Identifier: MIT
"""Checks that inspect_wheel.py detects faults: plants each fault into a copy of a wheel.

plant_faults.py WHEEL --python PROGRAM --zig FOLDER    prints a line for each fault; exit code 1 if
                                                       inspect_wheel.py misses one
"""

from __future__ import annotations

import argparse
import random
import sys
import tempfile
from collections.abc import Callable, Iterator
from pathlib import Path

import inspect_wheel
import lief
from wheel.wheelfile import WheelFile

Files = dict[str, bytes]
NOISE = random.Random(1).randbytes(inspect_wheel.MOST_BYTES)  # random, so that it does not compress
Plant = Callable[[Files], Files]


def in_module(change: Callable[[bytes], bytes]) -> Plant:
    """A function that plants a fault into the compiled module of a wheel.

    Args:
        change: function from the module's bytes to changed bytes.
    """

    def plant(files: Files) -> Files:
        name = next(n for n in files if n.endswith((".so", ".pyd")))
        changed = change(files[name])
        if changed == files[name]:
            raise SystemExit(f"nothing to change in {name}")
        return {**files, name: changed}

    return plant


def other_bytes(old: bytes, new: bytes) -> Plant:
    return in_module(lambda data: data.replace(old, new))


def without_signature(data: bytes) -> bytes:
    binary = lief.MachO.parse(list(data)).at(0)
    binary.remove_signature()
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "module"
        binary.write(str(path))
        return path.read_bytes()


def without(part: str) -> Plant:
    return lambda files: {name: data for name, data in files.items() if part not in name}


def other_tag(files: Files) -> Files:
    name = next(n for n in files if n.endswith("/WHEEL"))
    return {**files, name: files[name].replace(b"Tag: cp", b"Tag: pp")}


def faults(platform: str) -> Iterator[tuple[str, Plant, str]]:
    """Yields (name of a fault, function that plants it, word expected in the error message)."""
    yield "a benchmark", lambda files: {**files, "risorius/rig_bench": b"x"}, "rig_bench"
    yield "a text", lambda files: {**files, "risorius/notes.txt": b"x"}, "notes.txt"
    yield "no licence", without("NOTICES"), "licences"
    yield "another tag", other_tag, "WHEEL"
    yield "too large", lambda files: {**files, "risorius/x.py": NOISE}, "bytes"
    yield "a name that Python lacks", other_bytes(b"PyTuple_New\0", b"PyTuple_Now\0"), "PyTuple_Now"
    if platform.startswith("win"):
        yield "another DLL", other_bytes(b"KERNEL32.dll", b"KERNEL3X.dll"), "KERNEL3X"
        yield "a MinGW DLL", other_bytes(b"api-ms-win-crt-heap", b"lib-ms-win-crt-heap"), "lib-ms"
    elif platform.startswith("macosx"):
        if platform.endswith("arm64"):
            yield "no signature", in_module(without_signature), "LC_CODE_SIGNATURE"
        yield "a name that macOS lacks", other_bytes(b"_memcpy\0", b"_memcpx\0"), "_memcpx"
    else:
        yield "a newer glibc", other_bytes(b"GLIBC_2.17\0", b"GLIBC_2.34\0"), "glibc 2.34"


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("wheel", type=Path)
    parser.add_argument("--python", type=Path, required=True)
    parser.add_argument("--zig", type=Path, required=True)
    args = parser.parse_args()
    with WheelFile(args.wheel) as archive:
        files = {n: archive.read(n) for n in archive.namelist() if not n.endswith("/RECORD")}
    unseen = 0
    for what, plant, word in faults(args.wheel.stem.rsplit("-", 1)[1]):
        with tempfile.TemporaryDirectory() as folder:
            copy = Path(folder) / args.wheel.name
            with WheelFile(copy, "w") as archive:
                for name, data in plant(files).items():
                    archive.writestr(name, data)
            try:
                list(inspect_wheel.inspect(copy, args.python, args.zig))
                said = "nothing"
            except inspect_wheel.Fault as fault:
                said = str(fault)
        unseen += word not in said
        print(f"{what}: {said}" + ("" if word in said else "   NOT SEEN"))
    return 1 if unseen else 0


if __name__ == "__main__":
    sys.exit(main())
