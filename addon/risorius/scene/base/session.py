# SPDX-License-Identifier: GPL-3.0-or-later
"""The owner of all values that the add-on keeps between two calls.

A module gets its table here and names the events that empty it. The handlers report an event, and
all tables of this event are emptied in place. A module keeps its table in a variable and reads it
as fast as any dict. A test in tests/layers finds every other changing object of a module or class.
"""

from __future__ import annotations

from collections.abc import (
    Callable,
    MutableMapping,
    MutableSequence,
    MutableSet,
    Sequence,
    Sized,
)
from functools import lru_cache
from typing import Generic, Literal, Protocol, TypeVar, cast, get_args

# free: before undo, redo and load, which free what Blender's pointers point to. undo: after undo
# and redo. load: after a file was loaded. frame: before a frame is evaluated. rewrite: all values
# must be written again. unregister: empties all tables except those with quit. These end with
# Blender: work of the user, and data read from the extension's own files.
End = Literal["free", "undo", "load", "frame", "rewrite", "unregister", "quit"]

Kept = TypeVar("Kept")
Key = TypeVar("Key")
Value = TypeVar("Value")
Function = TypeVar("Function", bound=Callable[..., object])


class Cached(Protocol):
    """A function with a cache of functools."""

    def cache_info(self) -> tuple[int, int, int | None, int]: ...
    def cache_clear(self) -> None: ...


class Slot(Generic[Kept]):
    """One value. Attributes: now the current value, which code replaces."""

    __slots__ = ("now",)

    def __init__(self, start: Kept) -> None:
        self.now = start


class _Entry:
    """Attributes: ends events; clear restores the initial state; is_new whether it has that
    state."""

    def __init__(
        self, ends: Sequence[End], clear: Callable[[], object], is_new: Callable[[], bool]
    ) -> None:
        unknown = set(ends) - set(get_args(End))
        if unknown or not ends:
            raise ValueError(f"ends: {sorted(unknown)}, expected some of {get_args(End)}")
        self.ends = ends if "quit" in ends else (*ends, "unregister")
        self.clear, self.is_new = clear, is_new


_entries: dict[str, _Entry] = {}  # by name: a module that is loaded again takes its place again
_by_end: dict[str, list[_Entry]] = {}  # what a frame asks must be there already


def table(  # its types are those of the name that it is assigned to
    name: str, ends: Sequence[End]
) -> dict[Key, Value]:  # pyright: ignore[reportInvalidTypeVarUse]
    """A dict that events empty.

    Args:
        name: unique name of its content.
        ends: events that empty it; `unregister` always does, except with `quit`.

    Returns:
        The dict; it stays the same object.
    """
    return keep(name, dict, ends)


def keep(name: str, make: Callable[[], Kept], ends: Sequence[End]) -> Kept:
    """A dict, set, list, deque, weak dictionary or record that events reset.

    Args:
        name, ends: see `table`.
        make: makes the initial object. A record is a class without slots.

    Returns:
        The object of `make`; it stays the same object.
    """
    kept = make()
    empty = isinstance(kept, Sized) and not len(kept)
    # One that begins empty is emptied without more ado: it happens at each frame.
    clear: Callable[[], object] | None = getattr(kept, "clear", None) if empty else None
    _add(name, ends, clear or (lambda: _refill(kept, make())), lambda: _is_like(kept, make()))
    return kept


def value(name: str, start: Kept, ends: Sequence[End]) -> Slot[Kept]:
    """A single value.

    Args:
        name, ends: see `table`.
        start: initial value, also after each event; it is never changed in place.

    Returns:
        Slot.
    """
    slot = Slot(start)

    def clear() -> None:
        slot.now = start

    _add(name, ends, clear, lambda: slot.now is start or slot.now == start)
    return slot


def cached(ends: Sequence[End], most: int = 128) -> Callable[[Function], Function]:
    """Decorator: cache results of a function by its arguments.

    Args:
        ends: see `table`.
        most: most results to keep; the oldest are dropped.
    """

    def decorate(function: Function) -> Function:
        made = lru_cache(maxsize=most)(function)
        _adopt(made, ends)
        return cast("Function", made)

    return decorate


def adopt(ends: Sequence[End], *functions: Callable[..., object]) -> None:
    """Own the caches of functions in modules that do not use the session.

    Args:
        ends: see `table`.
        functions: with @cache of functools.
    """
    for function in functions:
        _adopt(cast("Cached", function), ends)


def at(*ends: End) -> Callable[[Function], Function]:
    """Decorator: call a function without arguments at events, to release its resources.

    Args:
        ends: see `table`.
    """

    def decorate(function: Function) -> Function:
        _add(_name(function), ends, function, lambda: True)
        return function

    return decorate


def end(word: End) -> None:
    """Reset everything that ends with an event. Args: word the event."""
    for entry in _by_end.get(word, ()):
        entry.clear()


def held() -> list[str]:
    """The names of the entries that are not as they were at the beginning."""
    return sorted(name for name, entry in _entries.items() if not entry.is_new())


def ends_of(name: str) -> tuple[str, ...]:
    """The words of an entry."""
    return tuple(_entries[name].ends)


def _add(
    name: str, ends: Sequence[End], clear: Callable[[], object], is_new: Callable[[], bool]
) -> None:
    _entries[name] = _Entry(ends, clear, is_new)
    _by_end.clear()
    for entry in _entries.values():
        for word in entry.ends:
            _by_end.setdefault(word, []).append(entry)


def _adopt(function: Cached, ends: Sequence[End]) -> None:
    _add(_name(function), ends, function.cache_clear, lambda: not function.cache_info()[-1])


def _name(function: object) -> str:
    module, name = (str(getattr(function, part)) for part in ("__module__", "__qualname__"))
    return f"{module.rpartition('risorius.')[2]}.{name}"


def _refill(kept: object, fresh: object) -> None:
    """Give an object the content of a fresh one."""
    if isinstance(kept, MutableMapping):
        kept.clear()
        kept.update(cast("MutableMapping[object, object]", fresh))
    elif isinstance(kept, MutableSequence):
        kept.clear()
        kept.extend(cast("MutableSequence[object]", fresh))
    elif isinstance(kept, MutableSet):
        kept.clear()
        for item in cast("MutableSet[object]", fresh):
            kept.add(item)
    else:
        vars(kept).clear()
        vars(kept).update(vars(fresh))


def _is_like(kept: object, fresh: object) -> bool:
    """Whether an object is as a fresh one; of lists only the length is compared."""
    if isinstance(kept, Sized) and isinstance(fresh, Sized) and len(kept) != len(fresh):
        return False
    if isinstance(kept, (MutableMapping, MutableSet)):
        return kept == fresh
    if isinstance(kept, MutableSequence):
        return True
    return vars(kept) == vars(fresh)
