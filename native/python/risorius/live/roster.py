# SPDX-License-Identifier: MIT
"""A list of senders with limited places, and the rule by which a new sender takes a place.

A flood of forged senders must not displace a phone. A sender that is silent for a minute loses its
place when the next new sender arrives, unless it is wanted. If all places are taken:
    a wanted sender (named or recorded) always gets a place and keeps it
    a sender that has never streamed gives its place to any newcomer
    the first sender of an address, once it has streamed, gives its place only to a wanted sender
    any other sender gives its place if its address has at least two more places than the
    newcomer's address; if its address has as many places or one more, the sender gives its place
    only while it does not stream
"""

from __future__ import annotations

from collections import Counter, deque
from collections.abc import Callable, Hashable, Iterator
from dataclasses import dataclass, field
from typing import Generic, TypeVar

MOST = 32
_STREAM = 5  # messages within a second that make a sender a streaming one
_FORGOTTEN = 60.0  # seconds of silence after which a place is freed when a new sender arrives

Key = TypeVar("Key", bound=Hashable)
Item = TypeVar("Item")


@dataclass
class _Place(Generic[Item]):
    """A sender's place in the roster.

    Attributes:
        item: the caller's record of the sender.
        address: network address of the sender.
        heard: times of the sender's last messages, in seconds.
        streamed: whether it ever sent _STREAM messages within a second.
    """

    item: Item
    address: str
    heard: deque[float] = field(default_factory=lambda: deque(maxlen=_STREAM))
    streamed: bool = False

    def hear(self, now: float) -> None:
        self.heard.append(now)
        self.streamed = self.streamed or self.times(now) == _STREAM

    def times(self, now: float) -> int:
        """Number of messages within the last second, at most _STREAM."""
        return sum(time > now - 1.0 for time in self.heard)


class Roster(Generic[Key, Item]):
    """The records of senders, in the order of their first packets.

    Args:
        wanted: whether the sender of a record has priority for a place and keeps it.
        most: number of places.
    """

    def __init__(
        self, wanted: Callable[[Item], bool] = lambda _item: False, most: int = MOST
    ) -> None:
        self._most = most
        self._wanted = wanted
        self._places: dict[Key, _Place[Item]] = {}

    def __iter__(self) -> Iterator[Item]:
        return (place.item for place in self._places.values())

    def hear(self, key: Key, now: float) -> Item | None:
        """Counts a message of a sender, and returns its record; None for an unknown sender.

        Args:
            key: key of the sender.
            now: time of the message in seconds of a monotonic clock.
        """
        place = self._places.get(key)
        if place is None:
            return None
        place.hear(now)
        return place.item

    def move(self, key: Key, same: Callable[[Key], bool], now: float, address: str) -> None:
        """Moves the place of a sender whose messages arrive under a new key to that key.

        Args:
            key: the new key; nothing changes if the key has a place.
            same: whether another key belongs to the same sender; that key must have been silent for
                a second.
            now: present time in seconds.
            address: the sender's new network address.
        """
        if key in self._places:
            return
        for old, place in self._places.items():
            if same(old) and place.times(now) == 0:
                place.address = address
                # The order is kept, because it shows which sender came first.
                self._places = {key if k == old else k: p for k, p in self._places.items()}
                return

    def add(self, key: Key, item: Item, now: float, address: str = "") -> bool:
        """Adds a sender after its first message.

        Args:
            key, item: key of the sender and its record.
            now: time of the message in seconds.
            address: network address of the sender.

        Returns:
            Whether the sender got a place.
        """
        for old, place in list(self._places.items()):
            if place.heard[-1] < now - _FORGOTTEN and not self._wanted(place.item):
                del self._places[old]
        if len(self._places) >= self._most:
            leaving = self._leaving(item, address, now)
            if leaving is None:
                return False
            del self._places[leaving]
        self._places[key] = _Place(item, address)
        self._places[key].hear(now)
        return True

    def _leaving(self, newcomer: Item, address: str, now: float) -> Key | None:
        """Key of the sender that a newcomer displaces, or None.

        Args:
            newcomer: record of the new sender.
            address: network address of the new sender.
            now: present time in seconds.
        """
        shares = Counter(place.address for place in self._places.values())
        firsts: dict[str, Key] = {}
        for key, place in self._places.items():
            firsts.setdefault(place.address, key)

        def gives_way(key: Key, place: _Place[Item]) -> bool:
            if self._wanted(place.item):
                return False
            if self._wanted(newcomer) or not place.streamed:
                return True
            if firsts[place.address] == key:
                return False
            more = shares[place.address] - shares[address]
            return more >= 2 or (more >= 0 and place.times(now) < _STREAM)

        def order(key: Key) -> tuple[bool, bool, int, int, float]:
            place = self._places[key]
            is_first = place.streamed and firsts[place.address] == key
            share = shares[place.address]
            return is_first, place.streamed, -share, place.times(now), place.heard[-1]

        found = [key for key, place in self._places.items() if gives_way(key, place)]
        return min(found, key=order, default=None)
