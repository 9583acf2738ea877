# SPDX-License-Identifier: MIT
"""Receives faces on a thread: the latest frame of each subject, and recorded takes.

The thread shares its data under one lock, held only while a frame is handed over. Viewers may poll
at any time.
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
_SILENCE = 0.004  # seconds without a packet that end a face if its sender does not mark the end
_WINDOW = 0.05  # seconds of a window over which packets are counted
_MOST_PACKETS = {"livelink": 100, "osc": 1000}  # limit per window, far above the rate of phones
_BUSIEST = 0.02  # seconds per window that reading may take, because large packets take long
# Seconds: a packet that is at most this much older than the last one came late and is dropped. If
# it is older by more, the sender's clock was set back, and the packet is used.
_BACK = 1.0
_AHEAD = 2.0  # seconds that a sender's clock may get ahead of this machine's
_DRIFT = 0.001  # additional lead per second since its first face, because clocks differ in speed
_DAY = 86400.0


_Key = tuple[str, str, str]  # of a subject: address, device, subject name


class Status(NamedTuple):
    """Statistics of the reception, for a panel or a status line."""

    packets: int
    """Number of all packets since the start."""
    frames: int
    """Number of accepted faces of all subjects."""
    per_second: float
    """Accepted faces of the subject in the last second."""
    refused: int
    """Number of packets that could not be used."""
    reasons: tuple[tuple[str, int], ...]
    """(reason, number of refused packets), the most frequent first."""
    late: int
    """Number of faces dropped because they arrived after a newer one of their subject."""
    lost: int
    """Estimated number of lost faces, from gaps in the senders' times."""
    faceless: int
    """Number of packets from phones that saw no face."""
    floods: int
    """Number of times that packets arrived faster than they were read."""
    subjects: tuple[str, ...]
    subject: str
    """The subject that per_second and age belong to; "" if none was heard."""
    age: float | None
    """Seconds since the subject's last face."""
    recording: int
    """Number of faces in the running recordings."""


class _Subject:
    """The clock and the latest frame of one subject."""

    def __init__(self, label: str) -> None:
        self.label = label
        self.latest: Frame | None = None
        self.lost = 0
        self._offset = 0.0
        # the sender's time of the latest frame in seconds, plus a day for each midnight since
        # the first frame
        self._sent = 0.0
        self._days = 0.0
        self._began = (0.0, 0.0)  # (time, arrival) of the first frame, seconds
        self._steps: deque[float] = deque(maxlen=31)
        self.arrivals: deque[float] = deque(maxlen=512)

    def accept(self, packet: Packet, arrival: float) -> Frame | None:
        """The packet as the subject's next frame, or None if it came late.

        Args:
            packet: a decoded packet of this subject.
            arrival: time of arrival in seconds of perf_counter.
        """
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
        """The time of a frame: the sender's time with jumps of its clock removed.

        If the packet has no sender's time, the time is the time of arrival.

        Args:
            sent: the sender's time in seconds, or None.
            arrival: time of arrival in seconds of perf_counter.

        Returns:
            Seconds; None if the packet came late.
        """
        last = self.latest
        if sent is None:
            return arrival if last is None else max(arrival, last.time)
        if last is None:
            self._sent, self._offset = sent, 0.0
            return sent
        passed = arrival - last.arrival
        step, days = sent + self._days - self._sent, 0.0
        # The step is negative because the sender's time of day returned to 0 at midnight.
        if step < -_DAY / 2.0 and step + _DAY <= passed + _AHEAD:
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
        """Seconds by which the sender's clock gained on this machine's clock beyond the tolerance.

        The gain is measured from the first frame. A tolerance for each frame would add up and make
        a recording longer than the real time.

        Args:
            time: time of the frame by the sender's clock, in seconds.
            arrival: time of arrival in seconds of perf_counter.
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
    """Receives faces on a UDP port in a thread, from `start` to `stop`.

    Args:
        source: "livelink" or "osc".
        port: number of the port; 0 for any free port; None for the source's usual port.
        host: address to listen on: THIS_MACHINE, or EVERYWHERE for phones.

    Attributes:
        source: the source.
        host: the address to listen on.
        port: number of the port; after `start` the number that the system chose for 0.

    Raises:
        LiveError: an unknown source.
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
        """Starts to listen; no effect if it listens already.

        Raises:
            LiveError: the port is in use or no valid number, the address cannot be used, or
                python-osc is missing.
        """
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
        """Stops listening; the latest frames and takes are kept."""
        self._stop.set()
        if self._thread is not None:
            self._thread.join(2.0)
            self._thread = None
        if self._socket is not None:
            self._socket.close()
            self._socket = None

    def latest(self, subject: str = "") -> Frame | None:
        """The latest frame of a subject; for "", of the first subject. None if the subject
        has no frame yet."""
        with self._lock:
            found = self._find(subject)
            return found.latest if found else None

    def reserve(self, subjects: Iterable[str]) -> None:
        """Reserves places for subjects, so that other senders cannot displace them.

        A subject that is being recorded keeps its place without a reservation.

        Args:
            subjects: subject names in the app; they replace earlier reservations.
        """
        self._reserved = frozenset(subjects)

    def _kept(self, label: str) -> bool:
        """Whether a subject cannot lose its place: it is reserved or being recorded.

        A recording would jump in time if its subject lost the place and got a new one.
        """
        return label in self._reserved or any(take.subject == label for take in self._takes)

    def record(self, subject: str = "", limit: int = 108_000) -> Take:
        """Records a subject until `finish`.

        Args:
            subject: name of the subject; "": the first known one, or, before any frame, the one
                whose frame arrives first.
            limit: largest number of frames; the default is half an hour at 60 per second.
        """
        with self._lock:
            found = self._find(subject)
            take = Take(found.label if found else subject, limit)
            self._takes.append(take)
        return take

    def finish(self, take: Take) -> Take:
        """Ends a recording, and returns its take.

        Args:
            take: the take that `record` returned; this same object is returned.
        """
        with self._lock:
            if take in self._takes:
                self._takes.remove(take)
        return take

    def status(self, subject: str = "") -> Status:
        """The statistics of the reception, with the rate and age of a subject; for "", of the
        first subject."""
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
            except OSError:  # Windows reports here that a packet sent from this socket was refused
                continue
            now = perf_counter()
            if now - window >= _WINDOW:
                window, seen, spent = now, 0, 0.0
            self._take_in(data, sender[0], now)
            seen, spent = seen + 1, spent + perf_counter() - now
            if seen >= _MOST_PACKETS[self.source] or spent >= _BUSIEST:
                # The thread sleeps until the present time window of _WINDOW seconds ends, so that a
                # flood of packets does not slow the viewport. Meanwhile the system drops packets
                # when its buffer is full.
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
        """The subject of a packet; None if there is no room for a new one.

        Args:
            packet: a decoded packet.
            now: time of arrival in seconds of perf_counter.
            sender: address of the sender; for OSC the subject's name is the address.
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
        """A label for a new subject: its name, with additions if another subject has that label.

        Args:
            packet: the first packet of the subject.
            address: address of the sender.
        """
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
    """The address of this machine in its network; "" without a network."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        try:
            probe.connect(("192.0.2.1", 9))  # sends nothing, only looks up the route
        except OSError:
            return ""
        found = str(probe.getsockname()[0])
    return "" if found.startswith(("127.", "0.")) else found


def _bound(host: str, port: int) -> socket.socket:
    if not 0 <= port <= 65535:
        raise LiveError(f"a port of 0 to 65535 was expected, found {port}")
    listener = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    try:
        # SO_REUSEADDR is not set, because two programs could then share the port, and one would
        # lose the packets.
        listener.bind((host, port))
    except OSError as error:
        listener.close()
        if error.errno == errno.EADDRINUSE:
            raise LiveError(
                f"Port {port} is in use: close the program that listens there, or take another."
            ) from error
        raise LiveError(
            f"Risorius cannot listen at {host}, port {port}: {error.strerror}."
        ) from error
    return listener
