# SPDX-License-Identifier: MIT
"""A simulated phone: a program that sends faces to a port of this machine.

    python face_sender.py PORT < STEPS

Each line of the standard input is a list [kind, arguments...] in JSON:

    ["v6", device, subject, frame, sub_frame, rate, denominator, [values]]   Live Link Face
    ["v5", device, subject, [hours, minutes, seconds, frames], rate, [values]]
    ["v1", subject, seconds, frame, [values]]
    ["none", device, subject]              a phone that sees no face
    ["hex", digits]                        any bytes
    ["osc", address, [arguments]]          one message
    ["bundle", [[address, [arguments]], ...]]
    ["wait", seconds]

The packets of Live Link Face are packed here by hand, as the app packs them; OSC is python-osc's.
After the last step it sends nothing, and ends.
"""

import json
import socket
import struct
import sys
import time


def text(words):
    data = words.encode()
    return struct.pack("!I", len(data)) + data


def floats(values):
    return struct.pack("!B", len(values)) + b"".join(struct.pack("!f", v) for v in values)


def v6(device, subject, frame, sub_frame, rate, denominator, values):
    head = bytes([6]) + text(device) + text(subject)
    return head + struct.pack("!ifii", frame, sub_frame, rate, denominator) + floats(values)


def v5(device, subject, timecode, rate, values):
    head = bytes([5]) + text(device) + text(subject)
    return head + struct.pack("!4iI", *timecode, rate) + floats(values)


def v1(subject, seconds, frame, values):
    return bytes([1]) + text(subject) + struct.pack("!dI", seconds, frame) + floats(values)


def none(device, subject):
    return bytes([6]) + text(device) + text(subject)


def osc(address, arguments):
    from pythonosc.osc_message_builder import OscMessageBuilder

    builder = OscMessageBuilder(address)
    for argument in arguments:
        builder.add_arg(argument)
    return builder.build()


def bundle(messages):
    from pythonosc.osc_bundle_builder import IMMEDIATELY, OscBundleBuilder

    builder = OscBundleBuilder(IMMEDIATELY)
    for address, arguments in messages:
        builder.add_content(osc(address, arguments))
    return builder.build().dgram


def message(address, arguments):
    return osc(address, arguments).dgram


PACKERS = {"v6": v6, "v5": v5, "v1": v1, "none": none, "osc": message, "bundle": bundle}


def main():
    target = ("127.0.0.1", int(sys.argv[1]))
    sender = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    for line in sys.stdin:
        kind, *arguments = json.loads(line)
        if kind == "wait":
            time.sleep(arguments[0])
        elif kind == "hex":
            sender.sendto(bytes.fromhex(arguments[0]), target)
        else:
            sender.sendto(PACKERS[kind](*arguments), target)


if __name__ == "__main__":
    main()
