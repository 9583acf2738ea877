# SPDX-License-Identifier: MIT
"""Which processor it is, only native/simd asks: the other folders need not be compiled for each."""

import re
from pathlib import Path

import pytest

NATIVE = Path(__file__).resolve().parents[2] / "native"
# As the manuals of gcc and MSVC name them.
PROCESSOR = re.compile(
    r"\b(__x86_64__|__i386__|__aarch64__|__arm__|__ARM_\w+|__SSE\w*|__AVX\w*|__F16C__|__FMA__"
    r"|_M_X64|_M_IX86|_M_ARM64|_M_AMD64|__amd64__|immintrin\.h|arm_neon\.h)\b"
)


def of_processors(sources):
    """Names of those sources (name: text) outside simd that ask for a processor."""
    elsewhere = {name: text for name, text in sources.items() if not name.startswith("simd/")}
    return sorted(name for name, text in elsewhere.items() if PROCESSOR.search(text))


def sources():
    files = [file for end in ("*.h", "*.cpp") for file in NATIVE.rglob(end)]
    return {file.relative_to(NATIVE).as_posix(): file.read_text() for file in files}


def test_only_simd_asks():
    assert of_processors(sources()) == []


@pytest.mark.parametrize(
    "line", ["#if defined(__x86_64__)", "#ifdef _M_ARM64", "#include <arm_neon.h>"]
)
def test_another_that_asks_is_found(line):
    assert of_processors({**sources(), "rig/planted.cpp": line}) == ["rig/planted.cpp"]
    assert of_processors({"simd/planted.cpp": line}) == []
