# SPDX-License-Identifier: MIT
"""What a game face cannot be made of."""

from __future__ import annotations

from ..base.errors import RisoriusError


class GameFaceError(RisoriusError):
    """A face, or a wish, that no file can be made of."""

    code = "game_face"
