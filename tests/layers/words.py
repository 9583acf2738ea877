# SPDX-License-Identifier: MIT
"""Finds functions, constants and tables that must be defined only once, but are defined twice.

words.toml lists them: an entry (word) has a pattern of the definition, and the file that has it.
"""

from __future__ import annotations

import re
import tomllib
from collections.abc import Mapping
from pathlib import Path

WORDS = tomllib.loads((Path(__file__).parent / "words.toml").read_text(encoding="utf-8"))
FOLDERS = ("native", "addon")
KINDS = (".h", ".cpp", ".py", ".toml")


def product_files(root: Path) -> dict[str, str]:
    """Path below root -> text of each source file of native, the package and the add-on."""
    return {
        path.relative_to(root).as_posix(): path.read_text(encoding="utf-8")
        for folder in FOLDERS
        for path in sorted((root / folder).rglob("*"))
        if path.suffix in KINDS
    }


def defines(word: Mapping, path: str, text: str) -> bool:
    """Whether a file defines a word.

    Args:
        word: entry of words.toml.
        path, text: path and content of the file.
    """
    if not path.endswith(word.get("in", "")):
        return False
    if "words" in word:
        return sum(name in text for name in word["words"]) > word["most"]
    return re.search(word["is"], _code(path, text), re.MULTILINE) is not None


def _code(path: str, text: str) -> str:
    comment = r"//.*" if path.endswith((".h", ".cpp")) else r"^\s*#.*"
    return re.sub(comment, "", text, flags=re.MULTILINE)


def second_definitions(word: Mapping, files: Mapping[str, str]) -> list[str]:
    """Files that define a word but must not, and files that must define it but do not."""
    found = {path for path, text in files.items() if defines(word, path, text)}
    return sorted(found ^ {word["home"], *word.get("also", {})})
