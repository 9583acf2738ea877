# SPDX-License-Identifier: MIT
"""Finds mutable state of modules and classes of the add-on outside scene/base/session.py.

A name of a module may have these values:

- a result of session: `_found = session.table(...)`;
- an immutable value: a number, a string, a tuple of these, a frozenset, a pattern, a type;
- in UPPER_CASE, any table, list or set, if no code changes it.

The same rules hold for names of classes, except names with bl_, because Blender requires sets
there. `global`, `Class.name = ...` and `module.name = ...` must not rebind a name. Functions are
cached by `session.cached`. logic, language and native.py may not import session, so registration.py
passes their cached functions to `session.adopt`.
"""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator, Mapping
from functools import lru_cache
from pathlib import PurePosixPath
from typing import Any, NamedTuple

SESSION = "scene/base/session.py"
REGISTRATION = "registration.py"
WITHOUT_SESSION = ("logic/", "language/", "native.py")  # rooms that may not import scene
CONSTANT = re.compile(r"_?[A-Z][A-Z0-9_]+")
CACHES = {"cache", "lru_cache"}
# Types and functions whose objects change when they are read (such as an iterator), or exist to be
# changed (such as a queue). Not even a name in UPPER_CASE may have such a value.
ALWAYS_MUTABLE = {
    "deque", "defaultdict", "OrderedDict", "Counter", "ChainMap", "WeakKeyDictionary",
    "WeakValueDictionary", "WeakSet", "bytearray", "Queue", "SimpleQueue", "local", "iter", "count",
    "cycle",
}  # fmt: skip
FIXED = {
    "frozenset", "tuple", "MappingProxyType", "compile", "float", "int", "str", "len", "TypeVar",
    "NewType", "told", "partial", "field", "UUID", "Struct", "TypedDict", "namedtuple",
}  # fmt: skip
# Mutable classes whose objects are allowed as values of names in UPPER_CASE. A Lock is in the same
# state after each `with`.
VALUES = {"Lock", "Matrix", "Vector", "Quaternion", "Path"}
CHANGES = {
    "add", "append", "appendleft", "clear", "discard", "extend", "fill", "insert", "pop",
    "popitem", "popleft", "remove", "reverse", "setdefault", "sort", "update",
}  # fmt: skip


def _last(node: ast.expr) -> str:
    """The last word of a dotted name; "" for other expressions."""
    if isinstance(node, ast.Attribute):
        return node.attr
    return node.id if isinstance(node, ast.Name) else ""


def _first(node: ast.expr) -> str:
    while isinstance(node, ast.Attribute):
        node = node.value
    return node.id if isinstance(node, ast.Name) else ""


def _is_fixed(value: ast.expr, session: str) -> bool:
    """Whether an assigned value is immutable, or an expression that another rule checks.

    Args:
        value: the assigned expression.
        session: the file's name for the module session.
    """
    parts = {"Tuple": "elts", "IfExp": "body orelse", "Starred": "value"}
    if type(value).__name__ in parts:
        found = [getattr(value, name) for name in parts[type(value).__name__].split()]
        inner = found[0] if isinstance(found[0], list) else found
        return all(_is_fixed(part, session) for part in inner)
    if isinstance(value, ast.Call):
        return _last(value.func) in FIXED or _first(value.func) == session
    kinds = (
        ast.Constant, ast.JoinedStr, ast.Name, ast.Attribute, ast.Subscript, ast.BinOp,
        ast.UnaryOp, ast.BoolOp, ast.Compare, ast.Lambda,
    )  # fmt: skip
    return isinstance(value, kinds)


def _is_constant(value: ast.expr, frozen: set[str]) -> bool:
    """Whether a constant (name in UPPER_CASE) may have this value. frozen: names of classes whose
    objects cannot change.
    """
    if not isinstance(value, ast.Call):
        return not isinstance(value, (ast.GeneratorExp, ast.NamedExpr))
    name = _last(value.func)
    allowed = VALUES | frozen | FIXED
    made = name.lstrip("_")[:1].isupper() and not name.endswith("Property")  # a declaration
    owner = _first(value.func)  # Matrix in Matrix.Identity(4)
    return name not in ALWAYS_MUTABLE and (not made or name in allowed or owner in allowed)


class _File(NamedTuple):
    """A parsed file.

    Attributes:
        body: the statements of the module.
        nodes: type of syntax node -> all nodes of the type in the file.
    """

    body: list[ast.stmt]
    nodes: dict[type, list[Any]]

    def of(self, *kinds: type) -> list[Any]:
        """All syntax nodes of some types."""
        return [node for kind in kinds for node in self.nodes.get(kind, ())]


@lru_cache(maxsize=1000)
def _read(text: str) -> _File:
    nodes: dict[type, list[Any]] = {}
    tree = ast.parse(text)
    for node in ast.walk(tree):
        nodes.setdefault(type(node), []).append(node)
    return _File(tree.body, nodes)


def _frozen(file: _File) -> set[str]:
    """Names of the classes in a file whose objects cannot change."""
    found = set()
    for node in file.of(ast.ClassDef):
        heads = " ".join(map(ast.unparse, [*node.bases, *node.decorator_list]))
        if "NamedTuple" in heads or "frozen=True" in heads:
            found.add(node.name)
    return found


def _statements(body: list[ast.stmt], inside: str = "") -> Iterator[tuple[str, ast.stmt]]:
    """(prefix, statement) of each statement that runs on import; prefix: the classes around it."""
    for node in body:
        yield inside, node
        if isinstance(node, ast.ClassDef):
            yield from _statements(node.body, f"{inside}{node.name}.")
        elif not isinstance(node, (ast.FunctionDef, ast.AsyncFunctionDef)):
            for name in ("body", "orelse", "finalbody"):
                yield from _statements(getattr(node, name, []), inside)
            for handler in getattr(node, "handlers", []):
                yield from _statements(handler.body, inside)


def _names(target: ast.expr) -> list[str]:
    if isinstance(target, (ast.Tuple, ast.List)):
        return [name for part in target.elts for name in _names(part)]
    return [target.id] if isinstance(target, ast.Name) else []


def _registry(file: _File) -> str:
    """The name by which a file calls the module session; "" if it does not import it."""
    imports = file.of(ast.ImportFrom)
    names = (alias for node in imports for alias in node.names if alias.name == "session")
    return next((alias.asname or alias.name for alias in names), "")


def _of_names(file: _File) -> Iterator[tuple[int, str]]:
    """(line, message) of each name of a module or class that has a mutable value."""
    frozen, session = _frozen(file), _registry(file)
    for inside, node in _statements(file.body):
        if isinstance(node, ast.Assign):
            names = [name for target in node.targets for name in _names(target)]
        elif isinstance(node, ast.AnnAssign):
            names = _names(node.target)
        else:
            continue
        if node.value is None or _is_fixed(node.value, session):
            continue
        for name in names:
            by_blender = bool(inside) and name.startswith("bl_")
            constant = CONSTANT.fullmatch(name) and _is_constant(node.value, frozen)
            if not constant and not by_blender:
                yield node.lineno, f"{inside}{name} can change"


def _modules(path: str, file: _File, files: Mapping[str, str]) -> set[str]:
    """Names by which a file calls other modules of the add-on."""
    found = set()
    for node in file.of(ast.ImportFrom):
        if node.level:
            folder = PurePosixPath(path).parents[node.level - 1]
            folder /= (node.module or "").replace(".", "/")
            for alias in node.names:
                place = (folder / alias.name).as_posix()
                if f"{place}.py" in files or f"{place}/__init__.py" in files:
                    found.add(alias.asname or alias.name)
    return found


def _targets(node: ast.AST) -> list[ast.expr]:
    if isinstance(node, (ast.Assign, ast.Delete)):
        return [
            part for t in node.targets for part in (t.elts if isinstance(t, ast.Tuple) else [t])
        ]
    return [node.target] if isinstance(node, (ast.AugAssign, ast.AnnAssign)) else []


def _changed(node: ast.AST) -> ast.expr | None:
    """The object that a call or an assignment changes, for example x in x[0] = 1 or x.append(1).

    None if the statement only gives a name another value.
    """
    if isinstance(node, ast.Call) and isinstance(node.func, ast.Attribute):
        return node.func.value if node.func.attr in CHANGES else None
    for target in _targets(node):
        if isinstance(target, (ast.Subscript, ast.Attribute)):
            return target.value
        if isinstance(node, ast.AugAssign):
            return target
    return None


def _of_changes(file: _File, modules: set[str]) -> Iterator[tuple[int, str]]:
    """(line, message) of each place that changes a constant, a class or another module."""
    for node in file.of(ast.Global):
        yield node.lineno, f"global {', '.join(node.names)}"
    classes = {node.name for node in file.of(ast.ClassDef)}
    for node in file.of(ast.Call, ast.Assign, ast.AnnAssign, ast.AugAssign, ast.Delete):
        changed = _changed(node)
        if changed is not None and CONSTANT.fullmatch(_last(changed)):
            yield node.lineno, f"{_last(changed)} is changed"
        for target in _targets(node):
            if isinstance(target, ast.Attribute) and isinstance(target.value, ast.Name):
                owner = target.value.id
                by_blender = target.attr.startswith("bl_")
                if owner in classes | modules | {"cls"} and not by_blender:
                    yield node.lineno, f"{owner}.{target.attr} is rebound"


def _cached(file: _File) -> Iterator[tuple[int, str]]:
    """(line, name) of each function whose results functools caches."""
    for node in file.of(ast.FunctionDef, ast.AsyncFunctionDef):
        for decorator in node.decorator_list:
            call = decorator.func if isinstance(decorator, ast.Call) else decorator
            if _last(call) in CACHES:
                yield node.lineno, node.name


def _of_defaults(file: _File) -> Iterator[tuple[int, str]]:
    """(line, message) of each mutable default of an argument, which all calls share."""
    for arguments in file.of(ast.arguments):
        for value in [*arguments.defaults, *filter(None, arguments.kw_defaults)]:
            if isinstance(value, (ast.Dict, ast.List, ast.Set)):
                yield value.lineno, "a default can change"


def _adopted(text: str) -> set[str]:
    """`module.function` of each function that registration.py passes to session.adopt."""
    found = (call for call in _read(text).of(ast.Call) if ast.unparse(call.func) == "session.adopt")
    return {ast.unparse(value) for call in found for value in call.args}


def _of_caches(path: str, file: _File, adopted: set[str]) -> Iterator[tuple[int, str]]:
    for line, name in _cached(file):
        known = f"{PurePosixPath(path).stem}.{name}" in adopted
        if not (known and path.startswith(WITHOUT_SESSION)):
            yield line, f"{name} is cached without session"


def entries(files: Mapping[str, str]) -> list[str]:
    """The names of all entries that modules keep in the session, in the order of the files."""
    read = [_read(text) for path, text in files.items() if path != SESSION]
    return [
        ast.literal_eval(node.args[0])
        for file in read
        for node in file.of(ast.Call)
        if _last(node.func) in {"table", "keep", "value"}
        and _first(node.func) == (_registry(file) or None)
    ]


def found(files: Mapping[str, str]) -> list[str]:
    """`path:line: reason` for all mutable state that is not kept in the session.

    Args:
        files: path below addon/risorius -> text, for all Python files of the add-on.
    """
    adopted = _adopted(files.get(REGISTRATION, ""))
    rows: list[tuple[str, int, str]] = []
    for path, text in files.items():
        if path == SESSION:
            continue
        file = _read(text)
        uses = [
            *_of_names(file),
            *_of_changes(file, _modules(path, file, files)),
            *_of_defaults(file),
            *_of_caches(path, file, adopted),
        ]
        rows += [(path, line, what) for line, what in uses]
    return [f"{path}:{line}: {what}" for path, line, what in sorted(rows)]
