# SPDX-License-Identifier: MIT
"""Writes all panels and operators of the add-on as JSON. Runs with the bpy of .venv.

blender_classes.py ZIP OUT.json    ZIP: the extension, which is installed into a temporary folder
"""

from __future__ import annotations

import inspect
import json
import os
import re
import sys
import tempfile
from pathlib import Path
from typing import Any

os.environ["BLENDER_USER_RESOURCES"] = tempfile.mkdtemp()
sys.path.insert(0, str(Path(__file__).resolve().parents[2] / "check" / "blender"))

import bpy
from install_extension import install


def options(rna: bpy.types.Struct) -> list[dict[str, Any]]:
    """The visible properties of an operator, one dictionary for each."""
    out = []
    for one in rna.properties:
        if one.identifier == "rna_type" or one.is_hidden:
            continue
        default = getattr(one, "default", "")
        if getattr(one, "is_array", False):
            default = list(one.default_array)
        items = [(i.identifier, i.name, i.description) for i in getattr(one, "enum_items", ())]
        out.append({"id": one.identifier, "label": one.name, "description": one.description,
                    "default": str(default), "items": items})  # fmt: skip
    return out


def buttons(cls: type) -> list[str]:
    """Markdown links to the operators that a panel's source code names, in its order."""
    text = inspect.getsource(cls)
    found = re.findall(r'operator\(\s*"risorius\.(\w+)"', text)
    known = [getattr(bpy.ops.risorius, name).get_rna_type() for name in dict.fromkeys(found)]
    return [
        f"[{rna.name}](risorius.{name}.md)"
        for rna, name in zip(known, dict.fromkeys(found), strict=True)
    ]


def rows(module: str) -> list[dict[str, Any]]:
    """A dictionary for each registered operator and panel.

    Args:
        module: name of the enabled add-on's module.
    """
    registration = sys.modules[f"{module}.registration"]
    labels = {
        c.__name__: c.bl_label for c in registration.CLASSES if issubclass(c, bpy.types.Panel)
    }
    out = []
    for cls in registration.CLASSES:
        if issubclass(cls, bpy.types.Operator):
            category, name = cls.bl_idname.split(".")
            rna = getattr(getattr(bpy.ops, category), name).get_rna_type()
            out.append({"kind": "operator", "id": cls.bl_idname, "label": cls.bl_label,
                        "description": rna.description, "parent": "", "buttons": [],
                        "properties": options(rna)})  # fmt: skip
        elif issubclass(cls, bpy.types.Panel):
            parent = getattr(cls, "bl_parent_id", "")
            own = inspect.cleandoc(cls.__dict__.get("__doc__") or "")
            out.append({"kind": "panel", "id": cls.__name__, "label": cls.bl_label,
                        "description": own, "parent": labels.get(parent, ""),
                        "buttons": buttons(cls), "properties": []})  # fmt: skip
    return out


if __name__ == "__main__":
    found = rows(install(Path(sys.argv[1]).resolve()))
    Path(sys.argv[2]).write_text(json.dumps(found, indent=1), encoding="utf-8")
    print(f"{len(found)} panels and operators")
    sys.stdout.flush()
    os._exit(0)  # Blender as a module sometimes hangs in its destructors
