# SPDX-License-Identifier: GPL-3.0-or-later
"""Manages all caches and states that the add-on keeps between two calls.

A module creates its table here and names the events that empty it. When the handlers report an
event, all tables of this event are emptied in place. A module keeps its table in a variable and
reads it like any dict. A test in tests/layers finds mutable globals that are not created here.
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

# The events at which registered tables and values are reset.
# free: before undo, redo and load, which invalidate pointers to Blender's data. undo: after undo
# and redo. load: after a file was loaded. frame: before a frame is evaluated. rewrite: all values
# must be written again. unregister: empties all tables except those with quit. Tables with quit
# live until Blender quits: work of the user, and data read from the add-on's own files.
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
    """Holder of one value. Attributes: now  the current value; assign to it to change it."""

    __slots__ = ("now",)

    def __init__(self, start: Kept) -> None:
        self.now = start


class _Entry:
    """A registered value.

    Attributes:
        ends: events that reset the value.
        clear: function that restores the initial state.
        is_new: function that returns whether the value has its initial state.
    """

    def __init__(
        self, ends: Sequence[End], clear: Callable[[], object], is_new: Callable[[], bool]
    ) -> None:
        unknown = set(ends) - set(get_args(End))
        if unknown or not ends:
            raise ValueError(f"ends: {sorted(unknown)}, expected some of {get_args(End)}")
        self.ends = ends if "quit" in ends else (*ends, "unregister")
        self.clear, self.is_new = clear, is_new


_entries: dict[str, _Entry] = {}  # by name of the value: a reloaded module replaces its entry
_by_end: dict[str, list[_Entry]] = {}  # by event; prepared, because `end` runs at each frame


def table(  # the annotation of the assigned variable gives the types
    name: str, ends: Sequence[End]
) -> dict[Key, Value]:  # pyright: ignore[reportInvalidTypeVarUse]
    """Create a dict that events empty.

    Args:
        name: unique name of the table.
        ends: events that empty the table; `unregister` does too, unless `quit` is given.

    Returns:
        The dict; it stays the same object.
    """
    return keep(name, dict, ends)


def keep(name: str, make: Callable[[], Kept], ends: Sequence[End]) -> Kept:
    """Create a dict, set, list, deque, weak dictionary or record that events reset.

    Args:
        name: unique name of the object.
        ends: events that reset the object; `unregister` does too, unless `quit` is given.
        make: function that makes the initial object. A record is an instance without __slots__.

    Returns:
        The object of `make`; it stays the same object.
    """
    kept = make()
    empty = isinstance(kept, Sized) and not len(kept)
    # An object that is empty at the start needs only clear(), which is fast enough for each frame.
    clear: Callable[[], object] | None = getattr(kept, "clear", None) if empty else None
    _add(name, ends, clear or (lambda: _refill(kept, make())), lambda: _is_like(kept, make()))
    return kept


def value(name: str, start: Kept, ends: Sequence[End]) -> Slot[Kept]:
    """Create a holder of a single value that events reset.

    Args:
        name: unique name of the value.
        ends: events that reset the value; `unregister` does too, unless `quit` is given.
        start: initial value, also after each event; must not be changed in place.

    Returns:
        The holder; its attribute `now` is the value.
    """
    slot = Slot(start)

    def clear() -> None:
        slot.now = start

    _add(name, ends, clear, lambda: slot.now is start or slot.now == start)
    return slot


def cached(ends: Sequence[End], most: int = 128) -> Callable[[Function], Function]:
    """Decorator: cache results of a function by its arguments.

    Args:
        ends: events that empty the cache; `unregister` does too, unless `quit` is given.
        most: largest number of results; the least recently used are dropped.
    """

    def decorate(function: Function) -> Function:
        made = lru_cache(maxsize=most)(function)
        _adopt(made, ends)
        return cast("Function", made)

    return decorate


def adopt(ends: Sequence[End], *functions: Callable[..., object]) -> None:
    """Let events empty the caches of functions in modules that do not use this module.

    Args:
        ends: events that empty the caches; `unregister` does too, unless `quit` is given.
        functions: functions with the decorator functools.cache or lru_cache.
    """
    for function in functions:
        _adopt(cast("Cached", function), ends)


def at(*ends: End) -> Callable[[Function], Function]:
    """Decorator: call the decorated function at events, to release resources.

    Args:
        ends: events at which the function is called; at `unregister` too, unless `quit` is given.
    """

    def decorate(function: Function) -> Function:
        _add(_name(function), ends, function, lambda: True)
        return function

    return decorate


def end(word: End) -> None:
    """Reset all values that are registered for an event.

    Args:
        word: the event.
    """
    for entry in _by_end.get(word, ()):
        entry.clear()


def held() -> list[str]:
    """The names of the values that differ from their initial state, sorted."""
    return sorted(name for name, entry in _entries.items() if not entry.is_new())


def ends_of(name: str) -> tuple[str, ...]:
    """The events that reset a value.

    Args:
        name: name of the value.
    """
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
    """Replace the content of the object `kept` by the content of the object `fresh`."""
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
    """Whether the object `kept` equals `fresh`, a new object in its initial state.

    Only the lengths of lists are compared, not their contents.
    """
    if isinstance(kept, Sized) and isinstance(fresh, Sized) and len(kept) != len(fresh):
        return False
    if isinstance(kept, (MutableMapping, MutableSet)):
        return kept == fresh
    if isinstance(kept, MutableSequence):
        return True
    return vars(kept) == vars(fresh)
