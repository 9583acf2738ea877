# SPDX-License-Identifier: GPL-3.0-or-later
"""A head takes expressions from a face, or a face takes a head's form: the work beside Blender."""

from __future__ import annotations

from collections.abc import Callable
from typing import Generic, NamedTuple, TypeVar

from ... import native
from ..base.task import Task, telling
from ..file import shape_key_head
from . import finding

Result = TypeVar("Result")
Progress = Callable[[float], None]
Cancelled = Callable[[], bool]

FIND, FIT, JOINTS = "FIND", "FIT", "JOINTS"  # what is done now
# What of the whole time each takes.
_SHARES = {FIND: (0.0, 0.1), FIT: (0.1, 0.5), JOINTS: (0.5, 1.0)}


class HeadTask(Task[Result], Generic[Result]):
    """Something that takes seconds in several stages. Attributes: stage  FIND, FIT or JOINTS."""

    stage = FIND

    def part(self, stage: str, last: float = 0.0) -> Progress:
        """A progress for a stage, from its own 0 to 1.

        Args:
            stage: FIND, FIT or JOINTS.
            last: the share of the whole at its end; 0: as for a rig.
        """
        self.stage = stage
        begin, end = _SHARES[stage]
        end = last or end

        def tell(share: float) -> None:
            self.share = begin + (end - begin) * share

        return tell


class Template(NamedTuple):
    """The face that lends its expressions: a DNA file, or a face of the scene.

    Attributes:
        dna: of a face of the scene; None: the file's.
        path: of the file; "": none.
    """

    dna: native.Dna | None = None
    path: str = ""

    def load(self) -> native.Dna:
        """The face.

        Raises:
            DnaError, OSError: the file is none, or cannot be read.
        """
        if self.dna is not None:
            return self.dna
        found: native.Dna = native.module().load(self.path)
        return found


class Transfer(NamedTuple):
    """What is to be carried over. Attributes: strength  1: as on the template; repair  of contacts
    that the transfer breaks: lids, lips, teeth."""

    strength: float = 1.0
    repair: bool = True


class Made(NamedTuple):
    """What became of a head.

    Attributes:
        finding: its landmarks.
        shapes: what the face was made from; None where landmarks are missing.
        rigged: the face; None where landmarks are missing.
    """

    finding: finding.Finding
    shapes: native.ShapeSet | None
    rigged: shape_key_head.Rigged | None


def rig_task(
    head: finding.Head, template: Template, transfer: Transfer, wishes: shape_key_head.RigWishes
) -> HeadTask[Made]:
    """The way from a head without expressions to a DNA file; a cancelled one leaves none.

    Args:
        head: of finding.read.
        template: lends its expressions.
        transfer: how they are carried over.
        wishes: what the rig is to be.
    """

    def work(_progress: Progress, cancelled: Cancelled) -> Made:
        dna = template.load()
        marks, found = finding.find(head, telling(task.part(FIND), cancelled))
        if found.missing:
            return Made(found, None, None)
        shapes = _carry_over(head, dna, marks, transfer, telling(task.part(FIT), cancelled))
        rigged = shape_key_head.make_rig(shapes, wishes, None, task.part(JOINTS), cancelled)
        return Made(found, shapes, rigged)

    task = HeadTask(work)
    return task


def _carry_over(
    head: finding.Head,
    dna: native.Dna,
    marks: native.Landmarks,
    transfer: Transfer,
    progress: Callable[[float], bool],
) -> native.ShapeSet:
    onto = native.part("anyhead.onto")
    options = onto.OntoOptions(strength=transfer.strength, repair=transfer.repair)
    shapes: native.ShapeSet = onto.onto(head.parts, dna, marks, options, progress)
    return shapes


class Conformed(NamedTuple):
    """What became of a face.

    Attributes:
        finding: the landmarks of the head; None where it has the face's own topology.
        dna: the face in its new form; None where landmarks are missing.
        notes: sentences.
    """

    finding: finding.Finding | None
    dna: native.Dna | None
    notes: list[str]


def conform_task(head: finding.Head, template: Template, path: str) -> HeadTask[Conformed]:
    """A face takes a head's form and is written; a cancelled one leaves no file.

    Args:
        head: of finding.read, or a sculpt of the face with its own vertices.
        template: keeps its topology, names and counts.
        path: of the new file.
    """

    def work(_progress: Progress, cancelled: Cancelled) -> Conformed:
        made = _conform(head, template.load(), telling(task.part(FIT, 1.0), cancelled))
        if made.dna is not None and not cancelled():
            made.dna.save(path)
        return made

    task = HeadTask(work)
    return task


def _conform(head: finding.Head, dna: native.Dna, progress: Callable[[float], bool]) -> Conformed:
    module = native.part("anyhead.conform")
    found, marks = None, None
    if not module.is_same_topology(dna, head.parts[0].mesh):
        marks, found = finding.find(head, progress)
        if found.missing:
            return Conformed(found, None, [])
    made = module.conform_face(dna, head.parts, marks, progress)
    return Conformed(found, made.dna, list(made.notes))
