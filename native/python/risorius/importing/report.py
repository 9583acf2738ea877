# SPDX-License-Identifier: MIT
"""Reports the use of each curve of a file in a mapping."""

from __future__ import annotations

from dataclasses import dataclass, field
from textwrap import wrap

_WIDTH = 100


@dataclass
class Report:
    """The use of each curve of a file.

    Attributes:
        source: name of the file, or of another source of the curves.
        kind: kind of file: one of `importing.KINDS`, "rzc" or "clip" for a clip file of Risorius,
            or "curves" without a file.
        mapping: name of the mapping used.
        mapped: curve of the source -> controls that it moves.
        unmapped: curves of the source that the mapping does not know.
        ignored: curves of the source that are left out on purpose: by an empty row of the mapping,
            because another curve has used their row, or because their angles are not kept.
        not_in_rig: controls of the mapping that the rig lacks and that are therefore dropped.
        always_zero: curves of the source that are 0 in every frame.
        bones: curves of the clip that rotate the bones of head and eyes and are no rig controls.
        absent: rows of the mapping without a curve in the source.
        notes: sentences about reading and processing.
    """

    source: str
    kind: str
    mapping: str
    mapped: dict[str, tuple[str, ...]] = field(default_factory=dict)
    unmapped: list[str] = field(default_factory=list)
    ignored: list[str] = field(default_factory=list)
    not_in_rig: list[str] = field(default_factory=list)
    always_zero: list[str] = field(default_factory=list)
    bones: list[str] = field(default_factory=list)
    absent: list[str] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)

    def lists(self) -> list[tuple[str, list[str]]]:
        """(heading, names) of each non-empty list, the most important first."""
        rows = [
            ("not mapped", self.unmapped),
            ("not in the rig", self.not_in_rig),
            ("not in the rig, for the bones of head and eyes", self.bones),
            ("left out on purpose", self.ignored),
            ("always 0", self.always_zero),
            ("rows of the mapping without a curve", self.absent),
        ]
        return [(heading, names) for heading, names in rows if names]

    def text(self) -> str:
        """The complete report as lines of text."""
        controls = {control for row in self.mapped.values() for control in row}
        out = [
            f"{self.source}: {self.kind}, mapping {self.mapping}",
            f"  mapped: {len(self.mapped)} curve(s) to {len(controls)} control(s)",
        ]
        for source, row in self.mapped.items():
            out += _lines(f"    {source} -> {', '.join(row)}")
        for head, names in self.lists():
            out += _lines(f"  {head}: {len(names)}: {', '.join(names)}")
        out += [f"  note: {note}" for note in self.notes]
        return "\n".join(out)


def _lines(text: str) -> list[str]:
    """Wraps a long line without splitting names."""
    return wrap(
        text, _WIDTH, subsequent_indent="      ", break_long_words=False, break_on_hyphens=False
    )
