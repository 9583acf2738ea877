# SPDX-License-Identifier: MIT
"""Receives faces on a thread: the latest frame of each subject, and recorded takes.

The thread uses only its own data, under one lock that is held just while a frame is handed over.
Viewers poll whenever they like.
"""

from __future__ import annotations

import errno
import itertools
import socket
import threading
from collections import Counter, deque
from collections.abc import Iterable
from importlib import resources
from statistics import median
from time import perf_counter
from typing import NamedTuple

from ..base import toml
from . import livelink, osc
from .frame import Frame, LiveError, Packet
from .roster import MOST, Roster
from .take import Take

_TEXT = resources.files(__package__).joinpath("sources.toml").read_text(encoding="utf-8")
PORTS: dict[str, int] = {name: row["port"] for name, row in toml.parse(_TEXT).items()}
SOURCES = tuple(PORTS)
THIS_MACHINE, EVERYWHERE = "127.0.0.1", "0.0.0.0"
_SILENCE = 0.004  # seconds without a packet that end a face whose sender does not mark its end
_WINDOW = 0.05  # seconds over which packets are counted
_MOST_PACKETS = {"livelink": 100, "osc": 1000}  # per window: far more than phones send
_BUSIEST = 0.02  # seconds per window for reading packets, because large packets take long
_BACK = 1.0  # seconds; an older packet by less came late, by more: the sender's clock was set back
_AHEAD = 2.0  # seconds that a sender's clock may get ahead of ours
_DRIFT = 0.001  # plus this share of the time since its first face, because clocks differ in speed
_DAY = 86400.0


_Key = tuple[str, str, str]  # of a subject: address, device, name


class Status(NamedTuple):
    """Values for a panel or a status line."""

    packets: int
    """All packets since the start."""
    frames: int
    """Accepted faces of all subjects."""
    per_second: float
    """Accepted faces of the subject over the last second."""
    refused: int
    """Packets that could not be used."""
    reasons: tuple[tuple[str, int], ...]
    """The reasons, the most frequent first."""
    late: int
    """Dropped faces that arrived after a newer one of their subject."""
    lost: int
    """Lost faces, estimated from the sender's times."""
    faceless: int
    """Packets of phones that saw no face."""
    floods: int
    """Number of times that packets arrived faster than they were read."""
    subjects: tuple[str, ...]
    subject: str
    """The subject of these values; "" if none was heard."""
    age: float | None
    """Seconds since its last face."""
    recording: int
    """Faces in the running recordings."""


class _Subject:
    """One subject: its clock and its latest frame."""

    def __init__(self, label: str) -> None:
        self.label = label
        self.latest: Frame | None = None
        self.lost = 0
        self._offset = 0.0
        self._sent = 0.0  # the sender's time of the latest frame, including days
        self._days = 0.0
        self._began = (0.0, 0.0)  # time and arrival of the first frame
        self._steps: deque[float] = deque(maxlen=31)
        self.arrivals: deque[float] = deque(maxlen=512)

    def accept(self, packet: Packet, arrival: float) -> Frame | None:
        """The packet as a frame, or None if it came late."""
        time = self._own_time(packet.time, arrival)
        if time is None:
            return None
        number = self.latest.sequence + 1 if self.latest else 1
        packet.values.flags.writeable = False
        if self.latest is None:
            self._began = (time, arrival)
        self.latest = Frame(self.label, time, arrival, number, packet.names, packet.values)
        self.arrivals.append(arrival)
        return self.latest

    def _own_time(self, sent: float | None, arrival: float) -> float | None:
        """The sender's time without jumps; the time of arrival if it sends none."""
        last = self.latest
        if sent is None:
            return arrival if last is None else max(arrival, last.time)
        if last is None:
            self._sent, self._offset = sent, 0.0
            return sent
        passed = arrival - last.arrival
        step, days = sent + self._days - self._sent, 0.0
        if step < -_DAY / 2.0 and step + _DAY <= passed + _AHEAD:  # midnight
            step, days = step + _DAY, _DAY
        if -_BACK <= step < 0.0:
            return None
        if step < -_BACK or self._lead(last.time + step, arrival) > 0.0:
            self._days, self._sent = 0.0, sent
            self._offset = last.time + passed - sent
            return last.time + passed
        self._days += days
        self._count_lost(step)
        self._sent = sent + self._days
        return self._sent + self._offset

    def _lead(self, time: float, arrival: float) -> float:
        """Seconds by which the sender's clock would be ahead of ours beyond the tolerance.

        Counted from the first frame and not from the last one, because tolerances of single packets
        would add up and make a recording longer than it took.
        """
        passed = arrival - self._began[1]
        return time - self._began[0] - passed - _AHEAD - _DRIFT * passed

    def _count_lost(self, step: float) -> None:
        if len(self._steps) >= 5:
            usual = median(self._steps)
            if usual > 0.0 and step > 1.5 * usual:
                self.lost += min(round(step / usual) - 1, 10_000)
        if step > 0.0:
            self._steps.append(step)

    def per_second(self, now: float) -> float:
        return float(sum(arrival > now - 1.0 for arrival in self.arrivals))


class Receiver:
    """Listens on a UDP port.

    Args:
        source: "livelink" or "osc".
        port: 0 for any free one; None for the source's own.
        host: the address to listen on: THIS_MACHINE, or EVERYWHERE for phones.
    """

    def __init__(
        self, source: str = "livelink", port: int | None = None, host: str = THIS_MACHINE
    ) -> None:
        if source not in SOURCES:
            raise LiveError(f"a source of {' or '.join(SOURCES)} was expected, found {source!r}")
        self.source = source
        self.host = host
        self.port = PORTS[source] if port is None else port
        self._lock = threading.Lock()
        self._subjects: Roster[_Key, _Subject] = Roster(lambda s: self._kept(s.label))
        self._takes: list[Take] = []
        self._reserved: frozenset[str] = frozenset()
        self._reasons: Counter[str] = Counter()
        self._counts: Counter[str] = Counter()
        self._decoder = osc.Decoder(self._kept)
        self._stop = threading.Event()
        self._socket: socket.socket | None = None
        self._thread: threading.Thread | None = None

    def __enter__(self) -> Receiver:
        self.start()
        return self

    def __exit__(self, *_error: object) -> None:
        self.stop()

    def start(self) -> None:
        """Start listening. Raises: LiveError: the port is not available or a package is missing."""
        if self._thread is not None:
            return
        if self.source == "osc":
            osc.require()
        self._socket = _bound(self.host, self.port)
        self.port = int(self._socket.getsockname()[1])
        self._stop.clear()
        self._thread = threading.Thread(target=self._run, name="risorius live", daemon=True)
        self._thread.start()

    def stop(self) -> None:
        """Stop listening; the latest frames and takes stay."""
        self._stop.set()
        if self._thread is not None:
            self._thread.join(2.0)
            self._thread = None
        if self._socket is not None:
            self._socket.close()
            self._socket = None

    def latest(self, subject: str = "") -> Frame | None:
        """The latest frame of a subject; by default of the known subject that was heard first."""
        with self._lock:
            found = self._find(subject)
            return found.latest if found else None

    def reserve(self, subjects: Iterable[str]) -> None:
        """Reserve places for these subjects, independent of other senders.

        A subject that is being recorded has a place anyway.

        Args:
            subjects: names in the app; they replace earlier reservations.
        """
        self._reserved = frozenset(subjects)

    def _kept(self, label: str) -> bool:
        """Whether a subject keeps its place: a take would jump if its clock restarted."""
        return label in self._reserved or any(take.subject == label for take in self._takes)

    def record(self, subject: str = "", limit: int = 108_000) -> Take:
        """Record a subject, by default the one heard first, until `finish`.

        Args:
            limit: largest number of frames, by default half an hour at 60 per second.
        """
        with self._lock:
            found = self._find(subject)
            take = Take(found.label if found else subject, limit)
            self._takes.append(take)
        return take

    def finish(self, take: Take) -> Take:
        """End a recording. Returns: the take."""
        with self._lock:
            if take in self._takes:
                self._takes.remove(take)
        return take

    def status(self, subject: str = "") -> Status:
        """The state of the reception."""
        now = perf_counter()
        with self._lock:
            found = self._find(subject)
            count = self._counts
            return Status(
                packets=count["packets"],
                frames=count["frames"],
                per_second=found.per_second(now) if found else 0.0,
                refused=sum(self._reasons.values()),
                reasons=tuple(self._reasons.most_common(5)),
                late=count["late"],
                lost=sum(s.lost for s in self._subjects),
                faceless=count["faceless"],
                floods=count["floods"],
                subjects=tuple(s.label for s in self._subjects),
                subject=found.label if found else "",
                age=now - found.latest.arrival if found and found.latest else None,
                recording=sum(len(take) for take in self._takes),
            )

    def _find(self, label: str) -> _Subject | None:
        for subject in self._subjects:
            if not label or subject.label == label:
                return subject
        return None

    def _run(self) -> None:
        listener = self._socket
        assert listener is not None
        window, seen, spent = perf_counter(), 0, 0.0
        while not self._stop.is_set():
            listener.settimeout(_SILENCE if self._decoder.pending() else 0.1)
            try:
                data, sender = listener.recvfrom(65536)
            except TimeoutError:
                self._keep(self._decoder.flush(), perf_counter())
                continue
            except OSError:  # Windows reports here that a packet we sent was refused
                continue
            now = perf_counter()
            if now - window >= _WINDOW:
                window, seen, spent = now, 0, 0.0
            self._take_in(data, sender[0], now)
            seen, spent = seen + 1, spent + perf_counter() - now
            if seen >= _MOST_PACKETS[self.source] or spent >= _BUSIEST:
                # Further packets wait in the system's buffer and are dropped when it is full, so
                # that a flood takes no time from the viewport.
                self._counts["floods"] += 1
                self._stop.wait(max(0.0, window + _WINDOW - perf_counter()))
        self._keep(self._decoder.flush(), perf_counter())

    def _take_in(self, data: bytes, sender: str, now: float) -> None:
        try:
            if self.source == "livelink":
                packets = [livelink.decode(data)]
            else:
                packets = self._decoder.feed(data, sender, now)
        except livelink.NoFace:
            self._counts["faceless"] += 1
        except LiveError as error:
            self._refuse(str(error))
        except Exception as error:  # noqa: BLE001  no packet may end the thread
            self._refuse(f"{type(error).__name__}: {error}")
        else:
            self._keep(packets, now, sender)
        self._counts["packets"] += 1

    def _refuse(self, reason: str) -> None:
        with self._lock:
            known = reason in self._reasons or len(self._reasons) < 50
            self._reasons[reason[:200] if known else "other reasons"] += 1

    def _keep(self, packets: list[Packet], now: float, sender: str = "") -> None:
        for packet in packets:
            subject = self._subject_of(packet, now, sender)
            if subject is None:
                self._refuse(
                    f"{MOST} subjects are heard at once: there is no room for another that is not "
                    "named as the subject to follow"
                )
                continue
            with self._lock:
                frame = subject.accept(packet, now)
                if frame is None:
                    self._counts["late"] += 1
                    continue
                self._counts["frames"] += 1
                for take in self._takes:
                    take.add(frame)

    def _subject_of(self, packet: Packet, now: float, sender: str) -> _Subject | None:
        """The subject of a face; None if there is no room for a new one.

        Args:
            packet: a face.
            now: seconds.
            sender: its address; for OSC the subject is the address.
        """
        key = (sender or packet.subject, packet.device, packet.subject)
        with self._lock:
            if packet.device:  # a phone that changed its address and is silent at the old one
                self._subjects.move(key, lambda other: other[1:] == key[1:], now, key[0])
            subject = self._subjects.hear(key, now)
            if subject is not None:
                return subject
            subject = _Subject(self._free_label(packet, key[0]))
            added = self._subjects.add(key, subject, now, key[0])
        return subject if added else None

    def _free_label(self, packet: Packet, address: str) -> str:
        """The label of a new subject: its name, or a variant if another subject has that."""
        name, taken = (
            packet.subject or packet.device or "unnamed",
            {s.label for s in self._subjects},
        )
        labels = itertools.chain(
            (name, f"{name} ({packet.device[:8] or address})", f"{name} ({address})"),
            (f"{name} ({address} {number})" for number in itertools.count(2)),
        )
        return next(label for label in labels if label not in taken)


def own_address() -> str:
    """The address under which devices in the network find this machine; "" without a network."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        try:
            probe.connect(("192.0.2.1", 9))  # nothing is sent, only the route is looked up
        except OSError:
            return ""
        found = str(probe.getsockname()[0])
    return "" if found.startswith(("127.", "0.")) else found


def _bound(host: str, port: int) -> socket.socket:
    if not 0 <= port <= 65535:
        raise LiveError(f"a port of 0 to 65535 was expected, found {port}")
    listener = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    try:
        # SO_REUSEADDR is not set, because two programs could then share the port and one lose the
        # packets.
        listener.bind((host, port))
    except OSError as error:
        listener.close()
        if error.errno == errno.EADDRINUSE:
            raise LiveError(
                f"Port {port} is in use: close the program that listens there, or take another."
            ) from error
        raise LiveError(
            f"Port {port} at {host} cannot be listened to: {error.strerror}."
        ) from error
    return listener
