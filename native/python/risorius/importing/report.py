# SPDX-License-Identifier: MIT
"""What became of a file's curves; nothing is left out in silence."""

from __future__ import annotations

from dataclasses import dataclass, field
from textwrap import wrap

_WIDTH = 100


@dataclass
class Report:
    """Attributes:
    source: the file, or what else the curves came from.
    kind: of file, one of `importing.KINDS`.
    mapping: name of the mapping used.
    mapped: curve of the source -> controls it moves.
    unmapped: curves of the source that the mapping does not know.
    ignored: curves of the source that the mapping knows and leaves out on purpose.
    not_in_rig: controls that the mapping gives and the rig does not have; left out.
    always_zero: curves of the source that are 0 in every frame.
    bones: controls of the clip that no rig has, because bones turn by them: head and eyes.
    absent: rows of the mapping that the source has no curve for.
    notes: what the reading and the processing have to say.
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
        """(heading, names) of every list that is not empty, most important first."""
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
        """All of it for a person, in lines."""
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
    """A long line as several; no name is parted."""
    return wrap(
        text, _WIDTH, subsequent_indent="      ", break_long_words=False, break_on_hyphens=False
    )
