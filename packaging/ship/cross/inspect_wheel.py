# SPDX-License-Identifier: MIT
"""Inspects the contents and dependencies of a wheel with independent tools.

    inspect_wheel.py wheel WHEEL --python PROGRAM --zig FOLDER   prints one line for each fact
    inspect_wheel.py exports DLL                                 prints its exports as a .def file
    inspect_wheel.py suffix TAG PLATFORM                         prints the suffix of the module's
                                                                 file name

pefile (Windows), LIEF (macOS) and auditwheel (Linux) read the module. `wheel` checks the hashes in
RECORD. repairwheel must find no library to copy into the wheel. PROGRAM is a Linux Python of the
wheel's version, also for wheels of other systems. FOLDER is zig's lib folder, which contains the
symbols of macOS.
If a check fails, prints one sentence and gives exit code 1.
"""

from __future__ import annotations

import argparse
import re
import subprocess
import sys
import tempfile
import zipfile
from collections.abc import Iterable, Iterator
from pathlib import Path

import lief
import pefile
from wheel.wheelfile import WheelFile

MOST_BYTES = 4 * 1000 * 1000
OLDEST_GLIBC = 28  # 2.28
OLDEST_MACOS = (11, 0)
LICENCES = {"LICENSE", "native/NOTICES.txt"}
# Files that the package may contain besides the module: sources, data of the self-test, web page.
OWN = re.compile(
    r"risorius/(.+\.(py|pyi|toml)|py\.typed|selftest/golden/\w+\.(dna|f32|sha256)"
    r"|web/page\.html)"
)
MACHINES = {"win_amd64": "AMD64", "win_arm64": "ARM64"}
PROCESSORS = {"macosx_11_0_arm64": "ARM64", "macosx_11_0_x86_64": "X86_64"}
# Symbols that a module may export on macOS. LINKED: zig defines them in each library. SHARED: type
# information and operators new and delete of zig's C++ library, which cannot be hidden. They are
# weak, so macOS uses one definition for all libraries of a process.
LINKED = re.compile(r"__mh_dylib_header|___dso_handle")
PYBIND11 = re.compile(r"__?Z\w*8pybind11")  # pybind11 exports its exceptions
SHARED = re.compile(r"__Z(n[aw]m|d[al]Pv|T[IS])\w*")
# DLLs that every Windows 10 has: the C library (UCRT) and the kernel.
WINDOWS_HAS = re.compile(r"(api-ms-win-crt-[\w-]+|kernel32)\.dll", re.IGNORECASE)


class Fault(Exception):  # noqa: N818
    """A failed check; the message is a sentence."""


def want(holds: bool, sentence: str) -> None:
    if not holds:
        raise Fault(sentence)


def suffix_of(tag: str, platform: str) -> str:
    """The file name suffix of extension modules.

    Args:
        tag: Python tag, for example cp311.
        platform: platform tag of the wheel.
    """
    version = tag.removeprefix("cp")
    if platform.startswith("win"):
        return f".{tag}-{platform}.pyd"
    return (
        f".cpython-{version}-" + ("darwin" if "macosx" in platform else "x86_64-linux-gnu") + ".so"
    )


def contents(wheel: Path) -> Iterator[str]:
    """Check file names, tags, licences and size. Yields a line with sizes."""
    name, version, tag, abi, platform = wheel.stem.split("-")
    with WheelFile(wheel) as archive:  # compares each file with its hash in RECORD
        files = {n: archive.read(n) for n in archive.namelist() if not n.endswith("/RECORD")}
    info = f"{name}-{version}.dist-info/"
    tags = re.findall(r"^Tag: (.+)$", files[info + "WHEEL"].decode(), re.MULTILINE)
    want(tag == abi, f"{tag} and {abi} differ")
    want(tags == [f"{tag}-{abi}-{platform}"], f"its WHEEL says {tags}")
    licences = {n.removeprefix(info + "licenses/") for n in files if "/licenses/" in n}
    want(licences == LICENCES, f"its licences are {sorted(licences)}")
    module = f"{name}/_native{suffix_of(tag, platform)}"
    package = {n for n in files if not n.startswith(info)}
    want(module in package, f"{module} is not there")
    others = sorted(n for n in package - {module} if not OWN.fullmatch(n))
    want(not others, f"it holds {', '.join(others)} too")
    size = wheel.stat().st_size
    want(size <= MOST_BYTES, f"it has {size} bytes")
    yield f"{size / 1e6:.2f} MB, {len(files) + 1} files, module {len(files[module]) / 1e6:.2f} MB"


def names_of_python(program: Path) -> set[str]:
    binary = lief.parse(program)
    return {str(s.name) for s in binary.dynamic_symbols} if binary else set()


def python_has(undefined: Iterable[str], program: Path) -> str:
    """Check that a Python exports all Python symbols that the module imports.

    Returns a line of the report on the wheel.

    Args:
        undefined: imported symbols of the module.
        program: a Python for Linux of the wheel's version.
    """
    asked = {n for n in undefined if re.match(r"_?Py[A-Z_]", n)}
    missing = sorted(asked - names_of_python(program))
    want(bool(asked), "it asks nothing of Python")
    want(not missing, f"{program.name} has no {', '.join(missing)}")
    return f"{len(asked)} names of Python"


def windows(module: Path, platform: str, tag: str, program: Path) -> Iterator[str]:
    """Check machine, DLLs, exports and security flags of a module for Windows. Yields lines."""
    image = pefile.PE(module)
    machine = pefile.MACHINE_TYPE[image.FILE_HEADER.Machine]
    want(machine == f"IMAGE_FILE_MACHINE_{MACHINES[platform]}", f"it is for {machine}")
    needed = [entry.dll.decode() for entry in image.DIRECTORY_ENTRY_IMPORT]
    own = f"python{tag.removeprefix('cp')}.dll"
    foreign = [d for d in needed if d.lower() != own and not WINDOWS_HAS.fullmatch(d)]
    want(not foreign, f"it needs {', '.join(foreign)}")
    want(own in [d.lower() for d in needed], f"it does not need {own}")
    of_python = next(e for e in image.DIRECTORY_ENTRY_IMPORT if e.dll.decode().lower() == own)
    yield python_has((symbol.name.decode() for symbol in of_python.imports), program)
    exported = [symbol.name.decode() for symbol in image.DIRECTORY_ENTRY_EXPORT.symbols]
    # Windows resolves an import in the named DLL only, so exports of pybind11 do no harm.
    ours = [name for name in exported if not PYBIND11.match(name)]
    want(ours == ["PyInit__native"], f"it exports {ours[:5]}")
    flags = image.OPTIONAL_HEADER
    for flag in ("DYNAMIC_BASE", "NX_COMPAT", "HIGH_ENTROPY_VA"):
        want(getattr(flags, f"IMAGE_DLLCHARACTERISTICS_{flag}"), f"it has no {flag}")
    crt = sum(d.lower().startswith("api-ms-win-crt-") for d in needed)
    others = [d for d in needed if not d.lower().startswith("api-ms-win-crt-")]
    yield f"DLLs: {', '.join(others)}, {crt} of the UCRT"


def macos(module: Path, platform: str, program: Path, zig: Path) -> Iterator[str]:
    """Check processor, system version, libraries, signature and symbols for macOS. Yields lines."""
    fat = lief.MachO.parse(module)
    want(fat is not None and fat.size == 1, "it is not of one processor")
    binary = fat.at(0)
    processor = binary.header.cpu_type.name
    want(processor == PROCESSORS[platform], f"it is for {processor}")
    system = binary.build_version
    want(tuple(system.minos[:2]) == OLDEST_MACOS, f"it wants macOS {system.minos}")
    libraries = [library.name for library in binary.libraries if library.command.name != "ID_DYLIB"]
    want(libraries == ["/usr/lib/libSystem.B.dylib"], f"it needs {libraries}")
    signed = binary.has_code_signature
    # Only Apple's processors require a signature, and zig's linker signs only for them.
    want(signed or processor == "X86_64", "it has no LC_CODE_SIGNATURE")
    weak = lief.MachO.ExportInfo.FLAGS.WEAK_DEFINITION
    exported = {str(s.name): s.export_info for s in binary.exported_symbols}
    shared = {n for n, info in exported.items() if weak in info.flags_list}
    ours = [n for n in exported if not LINKED.fullmatch(n) and not PYBIND11.match(n)]
    ours = [n for n in ours if not (n in shared and SHARED.fullmatch(n))]
    want(ours == ["_PyInit__native"], f"it exports {ours[:5]}")
    undefined = {str(s.name) for s in binary.imported_symbols}
    yield python_has((n.removeprefix("_") for n in undefined), program)
    known = set(re.findall(r"[\w$.]+", (zig / "libc/darwin/libSystem.tbd").read_text()))
    rest = {n for n in undefined if not re.match(r"__?Py[A-Z_]", n)}
    missing = sorted(rest - known)
    want(not missing, f"libSystem has no {', '.join(missing)}")
    minos = ".".join(map(str, OLDEST_MACOS))
    said = "LC_CODE_SIGNATURE" if signed else "not signed"
    yield f"minos {minos}, libSystem ({len(rest)} names), {said}"


def linux(wheel: Path, module: Path, program: Path) -> Iterator[str]:
    """Check the required version of glibc with auditwheel, and the exports. Yields lines."""
    show = [sys.executable, "-m", "auditwheel", "show", str(wheel)]
    said = subprocess.run(show, capture_output=True, text=True, check=True).stdout
    found = re.search(r'following platform tag:\s*"manylinux_2_(\d+)_x86_64"', said)
    want(found is not None, f"auditwheel: {' '.join(said.split())}")
    assert found
    want(int(found[1]) <= OLDEST_GLIBC, f"it needs glibc 2.{found[1]}")
    binary = lief.ELF.parse(module)
    exported = [str(s.name) for s in binary.exported_symbols]
    want(exported == ["PyInit__native"], f"it exports {exported[:5]}")
    undefined = (str(s.name) for s in binary.dynamic_symbols if s.shndx == 0)
    yield python_has(undefined, program)
    yield f"auditwheel: manylinux_2_{found[1]}; needs {', '.join(map(str, binary.libraries))}"


def stands_alone(wheel: Path) -> str:
    """Check that repairwheel finds no library to copy into the wheel. Returns a line."""
    with tempfile.TemporaryDirectory() as folder:
        command = [sys.executable, "-m", "repairwheel", str(wheel), "-o", folder]
        done = subprocess.run(command, capture_output=True, text=True, check=False)
        want(not done.returncode, f"repairwheel: {done.stderr.strip()[-300:]}")
        (repaired,) = Path(folder).glob("*.whl")
        with zipfile.ZipFile(wheel) as before, zipfile.ZipFile(repaired) as after:
            names = set(after.namelist()) - set(before.namelist())
            added = sorted(name for name in names if not name.endswith("/"))
    want(not added, f"repairwheel added {', '.join(added)}")
    return "repairwheel adds nothing"


def inspect(wheel: Path, program: Path, zig: Path) -> Iterator[str]:
    """Yields the facts of a wheel, one line each.

    Args:
        wheel: the wheel.
        program: a Python for Linux of the wheel's version.
        zig: zig's lib folder.

    Raises:
        Fault: a check fails.
    """
    _, _, tag, _, platform = wheel.stem.split("-")
    yield from contents(wheel)
    with tempfile.TemporaryDirectory() as folder, zipfile.ZipFile(wheel) as archive:
        name = f"risorius/_native{suffix_of(tag, platform)}"
        module = Path(archive.extract(name, folder))
        if platform.startswith("win"):
            yield from windows(module, platform, tag, program)
        elif platform.startswith("macosx"):
            yield from macos(module, platform, program, zig)
        else:
            yield from linux(wheel, module, program)
    yield stands_alone(wheel)


def definitions(library: Path) -> str:
    """The exports of a DLL as text of a .def file, from which dlltool makes import libraries."""
    image = pefile.PE(library)
    lines = [f"LIBRARY {library.name}", "EXPORTS"]
    for symbol in image.DIRECTORY_ENTRY_EXPORT.symbols:
        section = image.get_section_by_rva(symbol.address)
        code = section is not None and section.IMAGE_SCN_MEM_EXECUTE
        lines.append(symbol.name.decode() + ("" if code else " DATA"))
    return "\n".join(lines) + "\n"


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    commands = parser.add_subparsers(dest="command", required=True)
    one = commands.add_parser("wheel")
    one.add_argument("wheel", type=Path)
    one.add_argument("--python", type=Path, required=True)
    one.add_argument("--zig", type=Path, required=True)
    commands.add_parser("exports").add_argument("library", type=Path)
    suffix = commands.add_parser("suffix")
    suffix.add_argument("tag")
    suffix.add_argument("platform")
    args = parser.parse_args()
    if args.command == "suffix":
        print(suffix_of(args.tag, args.platform))
        return 0
    if args.command == "exports":
        print(definitions(args.library), end="")
        return 0
    try:
        for fact in inspect(args.wheel, args.python, args.zig):
            print(fact)
    except Fault as fault:
        print(f"{args.wheel.name}: {fault}")
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())
