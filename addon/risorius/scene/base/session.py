# SPDX-License-Identifier: GPL-3.0-or-later
"""The one owner of everything that the add-on remembers between two calls.

A module that remembers something takes its table here and says by words when the table ends. The
handlers name the event, and all tables that end with it are emptied in place: a module holds its
table in a name of its own and reads it as fast as any other dict. A test of tests/layers finds
every other object of a module or class that changes.
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

# free: before undo, redo and load, which free what Blender's pointers point to.
# undo: after undo and redo. load: after a file was loaded. frame: before a frame is evaluated.
# rewrite: what was written is to be written anew, whatever is there.
# unregister: ends all but what has the word quit, which ends with Blender: work of the user's, and
# what is read from the extension's own files.
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
    """One value. Attributes: now  what it is; it is assigned anew."""

    __slots__ = ("now",)

    def __init__(self, start: Kept) -> None:
        self.now = start


class _Entry:
    """Attributes: ends  words; clear  begins anew; is_new  whether it is as at the beginning."""

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
    """A dict that is emptied when it ends.

    Args:
        name: says what it has; no other entry is called so.
        ends: the words of the events that end it; `unregister` does in any case but `quit`.

    Returns:
        The dict, which stays the same one.
    """
    return keep(name, dict, ends)


def keep(name: str, make: Callable[[], Kept], ends: Sequence[End]) -> Kept:
    """A dict, set, list, deque, weak dictionary or record that begins anew when it ends.

    Args:
        name, ends: see `table`.
        make: makes one as it is at the beginning. A record is a class without slots.

    Returns:
        One that make made, which stays the same.
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
        start: what it is at the beginning and after each end; nobody changes it in place.

    Returns:
        Slot.
    """
    slot = Slot(start)

    def clear() -> None:
        slot.now = start

    _add(name, ends, clear, lambda: slot.now is start or slot.now == start)
    return slot


def cached(ends: Sequence[End], most: int = 128) -> Callable[[Function], Function]:
    """Decorator: keep what a function returned by what it was given.

    Args:
        ends: see `table`.
        most: results that are kept; the oldest go.
    """

    def decorate(function: Function) -> Function:
        made = lru_cache(maxsize=most)(function)
        _adopt(made, ends)
        return cast("Function", made)

    return decorate


def adopt(ends: Sequence[End], *functions: Callable[..., object]) -> None:
    """Own the caches of functions whose modules know no session.

    Args:
        ends: see `table`.
        functions: with @cache of functools.
    """
    for function in functions:
        _adopt(cast("Cached", function), ends)


def at(*ends: End) -> Callable[[Function], Function]:
    """Decorator: call a function without arguments when something ends, to give back what it holds.

    Args:
        ends: see `table`.
    """

    def decorate(function: Function) -> Function:
        _add(_name(function), ends, function, lambda: True)
        return function

    return decorate


def end(word: End) -> None:
    """Begin everything anew that ends with an event. Args: word  the event."""
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
    """Make an object again what a fresh one is."""
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
