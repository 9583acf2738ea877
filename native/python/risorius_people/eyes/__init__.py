# SPDX-License-Identifier: MIT
"""Eyes that are alive: balls with an iris of depth, a cornea, lids that lie on them, tears."""

from .eyeball import with_eyeballs
from .parts import eye_parts
from .person_eyes import Eyes

__all__ = ["Eyes", "eye_parts", "with_eyeballs"]
