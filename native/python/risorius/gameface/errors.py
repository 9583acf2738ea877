# SPDX-License-Identifier: MIT
"""The error of the glTF export of game faces."""

from __future__ import annotations

from ..base.errors import RisoriusError


class GameFaceError(RisoriusError):
    """A face, or a combination of options, that cannot be exported as glTF."""

    code = "game_face"
