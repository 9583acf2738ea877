# SPDX-License-Identifier: MIT
"""Tests which folders of `native` depend on the processor or the system.

Only simd depends on the processor, and only core, simd and bytes depend on the system, so that
packaging/check/cross.sh need not compile the other folders for each system. risorius.h also tests
for the system, because it is C for any compiler.
"""

import re
from pathlib import Path

import pytest

NATIVE = Path(__file__).resolve().parents[2] / "native"
# Macros and headers that exist for some processors only, from the manuals of gcc and MSVC.
PROCESSOR = re.compile(
    r"\b(__x86_64__|__i386__|__aarch64__|__arm__|__ARM_\w+|__SSE\w*|__AVX\w*|__F16C__|__FMA__"
    r"|_M_X64|_M_IX86|_M_ARM64|_M_AMD64|__amd64__|immintrin\.h|arm_neon\.h)\b"
)


# Macros that name systems and compilers, and headers outside the C++ standard.
SYSTEM = re.compile(
    r"\b(_WIN32|_WIN64|__APPLE__|__linux__|__unix__|_MSC_VER|__GLIBC__|__MINGW\w+|__ANDROID__)\b"
    r"|#include <[\w/]+\.h>"
)
# Headers of packages, which are the same on every system, so that SYSTEM must not match them.
PACKAGES = re.compile(r"#include <(pybind11/[\w/]+|meshoptimizer/meshoptimizer|xxhash)\.h>")


def that_ask(sources, words, folders):
    """Sorted names of the sources outside some folders that contain a pattern.

    Args:
        sources: name -> text.
        words: compiled regular expression.
        folders: tuple of beginnings of names.
    """
    elsewhere = {name: text for name, text in sources.items() if not name.startswith(folders)}
    return sorted(name for name, text in elsewhere.items() if words.search(PACKAGES.sub("", text)))


def of_processors(sources):
    return that_ask(sources, PROCESSOR, ("simd/",))


def of_systems(sources):
    return that_ask(sources, SYSTEM, ("core/", "simd/", "bytes/", "api/risorius.h"))


def sources():
    files = [file for end in ("*.h", "*.cpp") for file in NATIVE.rglob(end)]
    return {file.relative_to(NATIVE).as_posix(): file.read_text() for file in files}


def test_only_simd_asks():
    assert of_processors(sources()) == []


def test_only_core_simd_and_bytes_ask_for_the_system():
    assert of_systems(sources()) == []


@pytest.mark.parametrize(
    "line",
    ["#ifdef _WIN32", "#if defined(__APPLE__)", "#include <unistd.h>", "#include <sys/stat.h>"],
)
def test_another_that_asks_for_the_system_is_found(line):
    assert of_systems({**sources(), "rig/planted.cpp": line}) == ["rig/planted.cpp"]
    assert of_systems({"bytes/planted.cpp": line}) == []


@pytest.mark.parametrize(
    "line", ["#if defined(__x86_64__)", "#ifdef _M_ARM64", "#include <arm_neon.h>"]
)
def test_another_that_asks_is_found(line):
    assert of_processors({**sources(), "rig/planted.cpp": line}) == ["rig/planted.cpp"]
    assert of_processors({"simd/planted.cpp": line}) == []
