# SPDX-License-Identifier: MIT
"""Errors of the transfer of a rig to a head without expressions."""

from __future__ import annotations

from ..base.errors import RisoriusError


class AnyHeadError(RisoriusError):
    """A head or a template that cannot be used."""

    code = "any_head"


class Stopped(RisoriusError):  # noqa: N818  # nothing went wrong
    """The progress function of the caller returned False."""

    code = "cancelled"

    def __init__(self) -> None:
        super().__init__("stopped")
