# SPDX-License-Identifier: MIT
"""Measures how closely the primary board reproduces each expression of the library.

    python tests/bench/board_expressions.py man.dna

The primary board is the face board with few handles. Its handles are set as by a click on the
expression in the add-on (least squares over the raw controls). For each expression it prints *way*,
the distance of the expression from neutral, *off*, the distance of the board's pose from the
expression, and the number of used handles. Distances are root mean squares in mm over the vertices
that the expression moves by 0.1 mm, on the mesh with the largest error.
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
