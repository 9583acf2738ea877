# SPDX-License-Identifier: MIT
"""Measures how closely the primary board reproduces each expression of the library.

    python tests/bench/board_expressions.py man.dna

The handles are where a click on the expression brings them (least squares over the sliders); what
they do not lead to is at rest. Of each expression: how far it is from rest and how far the board's
pose is from it, in mm, on the mesh where that is most (head, tongue, teeth, eyes ...): root of the
mean square over the vertices that the expression moves by 0.1 mm. And how many handles are used.
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

import risorius

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "python"))
import test_primary_board as board


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("face", type=Path)
    found = board.primary_errors(risorius.load(parser.parse_args().face))
    print("| expression | way mm | off mm | handles |\n|---|---|---|---|")
    for name, near in sorted(found.items(), key=lambda row: -row[1].off):
        print(f"| {name} | {near.way:.2f} | {near.off:.2f} | {near.handles} |")
    within = sum(near.off <= 1.0 for near in found.values())
    print(f"within 1 mm: {within} of {len(found)}")


if __name__ == "__main__":
    main()
