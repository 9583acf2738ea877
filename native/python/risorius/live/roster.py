# SPDX-License-Identifier: MIT
"""Who is listened to: at most so many senders, and one that is silent makes room for a new one."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Hashable, Iterator
from typing import Generic, TypeVar

MOST = 32
_STREAM = 5  # times within a second that make a sender one that streams: it keeps its place
_FORGOTTEN = 60.0  # seconds of silence after which whoever comes next takes the place

Key = TypeVar("Key", bound=Hashable)
Item = TypeVar("Item")


class Roster(Generic[Key, Item]):
    """What is kept of each sender, in the order in which they were first heard."""

    def __init__(self, most: int = MOST) -> None:
        self._most = most
        self._items: dict[Key, Item] = {}
        self._heard: dict[Key, deque[float]] = {}

    def __iter__(self) -> Iterator[Item]:
        return iter(self._items.values())

    def hear(self, key: Key, now: float) -> Item | None:
        """What is kept of a sender that was heard just now; None for one that is not known.

        Args:
            key: of the sender.
            now: seconds, of a clock that does not run back.
        """
        if key not in self._items:
            return None
        self._heard[key].append(now)
        return self._items[key]

    def add(
        self,
        key: Key,
        item: Item,
        now: float,
        wanted: Callable[[Item], bool] = lambda _item: False,
    ) -> bool:
        """Keep a sender that was heard for the first time just now.

        Args:
            key, item: the sender and what is kept of it.
            now: seconds.
            wanted: whether an item stays however long it is silent.

        Returns:
            Whether there was room: not, where all others stream or are wanted.
        """
        for old in [k for k, heard in self._heard.items() if heard[-1] < now - _FORGOTTEN]:
            if not wanted(self._items[old]):
                self._drop(old)
        if len(self._items) >= self._most:
            found = [(self._rank(k, now), k) for k, i in self._items.items() if not wanted(i)]
            rank, least = min(found, key=lambda pair: pair[0], default=((_STREAM, now), None))
            if least is None or rank[0] >= _STREAM:
                return False
            self._drop(least)
        self._items[key] = item
        self._heard[key] = deque([now], maxlen=_STREAM)
        return True

    def _rank(self, key: Key, now: float) -> tuple[int, float]:
        """How often it was heard within the last second, at most _STREAM, and when last."""
        heard = self._heard[key]
        return sum(time > now - 1.0 for time in heard), heard[-1]

    def _drop(self, key: Key) -> None:
        del self._items[key], self._heard[key]
