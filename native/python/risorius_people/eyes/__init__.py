# SPDX-License-Identifier: MIT
"""Makes eyes: balls with a deep iris, corneas, lids that touch the balls, tear lines."""

from .eyeball import with_eyeballs
from .parts import eye_parts
from .person_eyes import Eyes

__all__ = ["Eyes", "eye_parts", "with_eyeballs"]
