# SPDX-License-Identifier: MIT
"""Live capture: receives faces over UDP from Live Link Face, VMC and other OSC senders.

    with Receiver("livelink", host=EVERYWHERE) as receiver:
        take = receiver.record()
        ...
        clip = receiver.finish(take).clip(Shaper())

The modules livelink and osc decode a packet to a frame of named values; a Shaper converts a frame
to raw controls.
"""

from __future__ import annotations

from .frame import Frame, LiveError, Packet
from .receiver import EVERYWHERE, PORTS, SOURCES, THIS_MACHINE, Receiver, Status, own_address
from .shaping import HEAD, Controls, Shaper
from .take import Take

__all__ = [
    "EVERYWHERE",
    "HEAD",
    "PORTS",
    "SOURCES",
    "THIS_MACHINE",
    "Controls",
    "Frame",
    "LiveError",
    "Packet",
    "Receiver",
    "Shaper",
    "Status",
    "Take",
    "own_address",
]
