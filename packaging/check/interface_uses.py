# SPDX-License-Identifier: MIT
"""Find where the extension shows a text, for readers who cannot see Blender's interface.

A use is the kind of the text (label, tooltip, message), with the names that a user sees around it:
the label of the operator, panel or property, and the panels that contain the button or the value.
The
descriptions of the class, the function and the file are added, because they explain in which
situation a user sees the text.
"""

import ast
from collections import defaultdict
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path

Use = tuple[str, str]  # kind of the text, names and descriptions around it
Function = ast.FunctionDef | ast.AsyncFunctionDef
_FUNCTION = (ast.FunctionDef, ast.AsyncFunctionDef)
_LABELS = {"name", "text", "title"}
_KINDS = {"OT": "operator", "PT": "panel", "MT": "menu", "UL": "list"}


@dataclass
class Source:
    """A parsed file of the extension.

    Attributes:
        tree: the module.
        parents: the node around each node.
    """

    tree: ast.Module
    parents: dict[ast.AST, ast.AST] = field(default_factory=dict)

    def __post_init__(self) -> None:
        for node in ast.walk(self.tree):
            self.parents.update((child, node) for child in ast.iter_child_nodes(node))

    def around(self, node: ast.AST) -> Iterator[ast.AST]:
        """The nodes around a node, from the innermost one."""
        while node in self.parents:
            node = self.parents[node]
            yield node


def uses_in(paths: list[Path], texts: set[str]) -> dict[str, list[Use]]:
    """The uses of each text.

    Args:
        paths: Python files of the extension.
        texts: the texts, with white space as in the interface.
    """
    sources = [Source(ast.parse(path.read_text(encoding="utf-8"))) for path in paths]
    panels = _panels(sources)
    found: dict[str, list[Use]] = defaultdict(list)
    for source in sources:
        for node in ast.walk(source.tree):
            if isinstance(node, ast.Constant) and isinstance(node.value, str):
                text = node.value if node.value in texts else " ".join(node.value.split())
                if text in texts:
                    found[text].append((_kind(source, node), _names(source, node, panels)))
    return found


def _panels(sources: list[Source]) -> dict[str, set[str]]:
    """Name of a property or an operator in the code -> labels of the panels that show it."""
    out: dict[str, set[str]] = defaultdict(set)
    for source in sources:
        for node in ast.walk(source.tree):
            if not isinstance(node, ast.Call) or not isinstance(node.func, ast.Attribute):
                continue
            if node.func.attr not in ("prop", "operator") or not node.args:
                continue
            name, owner = node.args[-1], _labelled(source, node)
            if isinstance(name, ast.Constant) and owner is not None:
                out[str(name.value)].add(_value(owner, "bl_label"))
    return out


def _kind(source: Source, node: ast.Constant) -> str:
    """The kind of a text, such as "label"; a tooltip also names its property or choice."""
    inner: ast.AST = node
    for outer in source.around(node):
        if isinstance(outer, ast.keyword) and outer.arg in _LABELS | {"description"}:
            return _kind_of_argument(source, outer)
        if isinstance(outer, ast.Tuple) and inner in outer.elts[1:3] and _is_choice(outer):
            if inner is outer.elts[2]:
                return f"tooltip of the choice {_shown(outer.elts[1])}"
            return "label of a choice"
        if isinstance(outer, ast.Expr):
            return "tooltip of an operator or panel"
        if isinstance(outer, ast.Assign):
            name = ast.unparse(outer.targets[0])
            kinds = {"bl_label": "label", "bl_description": "tooltip of an operator"}
            return kinds.get(name, "label or message")
        inner = outer
        if isinstance(outer, ast.Call) and not ast.unparse(outer.func).endswith("mark"):
            break
    return _kind_by_function(source, node)


def _is_choice(item: ast.Tuple) -> bool:
    """Whether a tuple is (identifier, label, description) of a Blender enumeration."""
    first = item.elts[0]
    is_word = isinstance(first, ast.Name) or (
        isinstance(first, ast.Constant) and " " not in str(first.value)
    )
    return is_word and len(item.elts) > 2


def _kind_of_argument(source: Source, argument: ast.keyword) -> str:
    """The kind of a label or description that is given to a call.

    Args:
        source: file of the call.
        argument: `name=`, `text=`, `title=` or `description=` of the call.
    """
    call = source.parents[argument]
    if argument.arg != "description" or not isinstance(call, ast.Call):
        return "label"
    labels = [_shown(other.value) for other in call.keywords if other.arg == "name"]
    outer = source.parents[call]
    if not labels and isinstance(outer, ast.AnnAssign):
        labels = [ast.unparse(outer.target).replace("_", " ")]
    value = [f", default {ast.unparse(k.value)}" for k in call.keywords if k.arg == "default"]
    return f"tooltip of the property {' '.join(labels)}{''.join(value)}".replace("  ", " ")


def _kind_by_function(source: Source, node: ast.AST) -> str:
    """The kind of a text, from the call or function around it, for example `poll`."""
    for outer in source.around(node):
        if isinstance(outer, ast.Raise):
            return "message"
        if isinstance(outer, ast.Call) and ast.unparse(outer.func).endswith((".report", "told")):
            return "message"
        if isinstance(outer, _FUNCTION) and "poll" in outer.name:
            return "reason in the tooltip of a button that is greyed out"
    return "text in a panel, dialog or message"


def _names(source: Source, node: ast.Constant, panels: dict[str, set[str]]) -> str:
    """The labels and descriptions around a literal, from the file to the innermost function.

    Args:
        source: file of the literal.
        node: the literal.
        panels: result of `_panels`.
    """
    outer = [n for n in source.around(node) if isinstance(n, (ast.ClassDef, *_FUNCTION))]
    parts = [_about(source.tree)]
    parts += [_described(each, node) for each in reversed(outer)]
    if not outer:
        parts += _constant(source, node)
    named = [name for each in source.around(node) for name in _code_names(each)]
    where = sorted({label for name in named for label in panels.get(name, ())})
    if where and len(where) < 4:
        parts.append("shown in the panel or dialog " + ", ".join(f'"{label}"' for label in where))
    return " | ".join(part for part in parts if part)


def _constant(source: Source, node: ast.Constant) -> Iterator[str]:
    """For a text in a constant: the texts beside it, and the classes and functions that use it."""
    lines = [each for each in source.around(node) if isinstance(each, (ast.Assign, ast.AnnAssign))]
    if not lines:
        return
    beside = [
        f'"{n.value}"'
        for n in ast.walk(lines[-1])
        if isinstance(n, ast.Constant) and isinstance(n.value, str) and " " in n.value
    ]
    if len(beside) > 1:
        yield "one of the texts " + ", ".join(beside[:8])
    line = lines[-1]
    name = ast.unparse(line.target if isinstance(line, ast.AnnAssign) else line.targets[0])
    for each in ast.walk(source.tree):
        if not isinstance(each, (ast.ClassDef, *_FUNCTION)) or not _about(each):
            continue
        if any(isinstance(n, ast.Name) and n.id == name for n in ast.walk(each)):
            yield "used " + _described(each, node)


def _code_names(node: ast.AST) -> list[str]:
    """The name of a property, or the bl_idname of an operator, by which panels refer to it.

    Empty for nodes that define neither.
    """
    if isinstance(node, ast.AnnAssign):
        return [ast.unparse(node.target)]
    return [_value(node, "bl_idname")] if isinstance(node, ast.ClassDef) else []


def _described(node: ast.ClassDef | Function, literal: ast.Constant) -> str:
    """A class or function, with its label or signature and the first sentence about it.

    Args:
        node: the class or function.
        literal: the text, which is not repeated if it is the docstring.
    """
    about = "" if _is_docstring(node, literal) else _about(node)
    if isinstance(node, ast.ClassDef):
        kind = _KINDS.get(node.name.partition("_")[2][:2], f"class {node.name}")
        label = _value(node, "bl_label")
        name = f'{kind} "{label}"' if label else kind
    elif node.name in ("execute", "invoke", "modal", "draw", "poll") and not about:
        return ""
    else:
        name = f"in {node.name}({', '.join(each.arg for each in node.args.args)})"
    return f"{name}: {about}" if about else name


def _labelled(source: Source, node: ast.AST) -> ast.ClassDef | None:
    """The class around a node, if users see its label."""
    for outer in source.around(node):
        if isinstance(outer, ast.ClassDef) and _value(outer, "bl_label"):
            return outer
    return None


def _value(node: ast.ClassDef, name: str) -> str:
    """The text that a class assigns to a name in its body, or ""."""
    for line in node.body:
        if isinstance(line, ast.Assign) and ast.unparse(line.targets[0]) == name:
            return _shown(line.value).strip('"')
    return ""


def _shown(node: ast.expr) -> str:
    """A label in quotation marks: a literal, also as an argument of a translating function."""
    literals = [n.value for n in ast.walk(node) if isinstance(n, ast.Constant)]
    return f'"{literals[0]}"' if literals else ast.unparse(node)


def _about(node: ast.Module | ast.ClassDef | Function) -> str:
    """The first sentence of the docstring, as one line."""
    return " ".join((ast.get_docstring(node) or "").split()).partition(". ")[0]


def _is_docstring(node: ast.ClassDef | Function, literal: ast.Constant) -> bool:
    first = node.body[0]
    return isinstance(first, ast.Expr) and first.value is literal
