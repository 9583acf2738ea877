# SPDX-License-Identifier: MIT
"""Tests that the type stub of the native module has exactly the names of the module."""

import ast
import inspect
from pathlib import Path

import pytest
import risorius._native as native
from conftest import PROJECT

STUB = PROJECT / "native" / "python" / "risorius" / "_native.pyi"
# Attributes that Python adds to every class or module; pybind11 adds the last one.
GIVEN = {"__module__", "__doc__", "__weakref__", "__init__", "_pybind11_conduit_v1_"}
ERROR = {"code", "offset", "where"}  # set on each DnaError object, not on the class


def names_of(body: list[ast.stmt]) -> dict[str, ast.stmt]:
    """Public names and special methods that statements define: name -> statement."""
    found = {}
    for node in body:
        if isinstance(node, ast.ClassDef | ast.FunctionDef):
            found.setdefault(node.name, node)
        elif isinstance(node, ast.AnnAssign) and isinstance(node.target, ast.Name):
            found[node.target.id] = node
    return {n: v for n, v in found.items() if not n.startswith("_") or n.startswith("__")}


def settable_of(body: list[ast.stmt]) -> set[str]:
    """Attributes of a class that can be assigned: annotated names and properties with a setter."""
    found = set()
    for node in body:
        if isinstance(node, ast.AnnAssign) and isinstance(node.target, ast.Name):
            found.add(node.target.id)
        elif isinstance(node, ast.FunctionDef):
            for decorator in node.decorator_list:
                if isinstance(decorator, ast.Attribute) and decorator.attr == "setter":
                    found.add(node.name)
    return found


def differences(stub: str, module) -> list[str]:
    """A sentence for each name that only the stub or only the module has, or that differs in them.

    A name differs if it is a class in only one of them, or a property that can be set in only one.

    Args:
        stub: text of the type stub.
        module: the imported module.
    """
    top = names_of(ast.parse(stub).body)
    real = {n: v for n, v in vars(module).items() if not n.startswith("_")}
    out = [f"the stub lacks {n}" for n in real.keys() - top.keys()]
    out += [f"the module lacks {n}" for n in top.keys() - real.keys()]
    for name in real.keys() & top.keys():
        node, value = top[name], real[name]
        if inspect.isclass(value) != isinstance(node, ast.ClassDef):
            out.append(f"{name} is a class in one of them")
        elif isinstance(node, ast.ClassDef):
            theirs = {n for n in vars(value) if n not in GIVEN}
            theirs |= ERROR if issubclass(value, Exception) else set()
            ours = names_of(node.body).keys() - GIVEN
            out += [f"the stub lacks {name}.{n}" for n in theirs - ours]
            out += [f"the module lacks {name}.{n}" for n in ours - theirs]
            properties = {n: v for n, v in vars(value).items() if isinstance(v, property)}
            writable = {n for n, v in properties.items() if v.fset}
            out += [
                f"{name}.{n} may be set in one of them"
                for n in (settable_of(node.body) & properties.keys()) ^ writable
            ]
    return sorted(out)


def test_the_stub_names_what_the_module_has():
    assert differences(STUB.read_text(encoding="utf-8"), native) == []


def test_the_installed_stub_is_this_one():
    installed = Path(native.__file__).parent / "_native.pyi"
    assert installed.read_text(encoding="utf-8") == STUB.read_text(encoding="utf-8")


@pytest.mark.parametrize(
    ("old", "new", "line"),
    [
        ("class RbfPose:", "class RbfPoze:", "the stub lacks RbfPose"),
        ("class RbfPose:", "class RbfPoze:", "the module lacks RbfPoze"),
        ("def to_json(", "def to_text(", "the stub lacks Dna.to_json"),
        ("def to_json(", "def to_text(", "the module lacks Dna.to_text"),
        ("    @age.setter\n", "    @overload\n", "Dna.age may be set in one of them"),
        (
            "def available_simd() -> str",
            "class available_simd",
            "available_simd is a class in one of them",
        ),
    ],
)
def test_a_stub_that_is_wrong_is_seen(old, new, line):
    stub = STUB.read_text(encoding="utf-8")
    assert old in stub
    assert line in differences(stub.replace(old, new), native)
