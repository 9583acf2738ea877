# SPDX-License-Identifier: MIT
"""Eyes: balls with a deep iris, corneas, lids that lie on the balls, tears."""

from .eyeball import with_eyeballs
from .parts import eye_parts
from .person_eyes import Eyes

__all__ = ["Eyes", "eye_parts", "with_eyeballs"]
