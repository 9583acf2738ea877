# SPDX-License-Identifier: MIT
"""Reads include and import lines against the allowed edges between folders."""

from __future__ import annotations

import ast
import re
from pathlib import Path

NATIVE = {
    "core": set(),
    "dna": {"core"},
    "simd": {"core"},
    "rig": {"core", "simd"},
    "compile": {"core", "dna", "simd", "rig"},
    "edit": {"core", "dna", "simd", "rig", "compile"},
    "author": {"core", "dna", "edit", "simd", "rig", "compile"},
    "clip": {"core"},
}
NATIVE["bindings"] = set(NATIVE)
ADDON = {"logic": set(), "scene": {"logic"}, "ui": {"logic", "scene"}}
INCLUDE = re.compile(r'^\s*#\s*include\s*([<"])([^>"]+)[>"]', re.MULTILINE)
INTRINSICS = re.compile(r"(immintrin|emmintrin|arm_neon|x86intrin|intrin)\.h$")


def native_violations(root: Path) -> list[str]:
    """One line for each include under root/native that its folder is not allowed."""
    found = []
    for path in sorted((root / "native").rglob("*")):
        if path.suffix not in (".h", ".cpp"):
            continue
        folder = path.relative_to(root / "native").parts[0]
        for mark, name in INCLUDE.findall(path.read_text(encoding="utf-8")):
            target = name.split("/")[0]
            local = mark == '"' and target in NATIVE
            bad = local and target != folder and target not in NATIVE[folder]
            bad |= name.startswith("pybind11/") and folder != "bindings"
            bad |= bool(INTRINSICS.search(name)) and folder != "simd"
            if bad:
                found.append(f"{path.relative_to(root)}: {folder} may not include {name}")
    return found


def imported(tree: ast.AST, package: tuple[str, ...]) -> list[str]:
    """Absolute dotted names of everything that a module imports."""
    out = []
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            out += [alias.name for alias in node.names]
        elif isinstance(node, ast.ImportFrom):
            base = package[: len(package) - node.level + 1] if node.level else ()
            stem = ".".join([*base, *((node.module or "").split(".") if node.module else [])])
            out += [f"{stem}.{alias.name}" for alias in node.names]
    return out


def addon_violations(root: Path) -> list[str]:
    """One line for each import under root/addon/risorius that its folder is not allowed."""
    found = []
    base = root / "addon" / "risorius"
    for path in sorted(base.rglob("*.py")):
        parts = path.relative_to(base).parts
        folder = parts[0] if len(parts) > 1 else ""
        package = ("addon", *parts[:-1])
        for name in imported(ast.parse(path.read_text(encoding="utf-8")), package):
            words = name.split(".")
            bad = words[0] == "risorius" and parts[-1] != "native.py"
            if folder == "logic":
                bad |= words[0] in ("bpy", "bmesh", "mathutils", "risorius")
                bad |= words[:2] == ["addon", "native"]
            if folder in ADDON and words[0] == "addon" and len(words) > 1 and words[1] in ADDON:
                bad |= words[1] != folder and words[1] not in ADDON[folder]
            if bad:
                found.append(f"{path.relative_to(root)}: may not import {name}")
    return found
