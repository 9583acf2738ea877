# SPDX-License-Identifier: GPL-3.0-or-later
"""Panels and operators of an existing face: controls, level of detail, shapes, body, overdrive."""

from . import (
    body_operators,
    channel_preview,
    controls_panel,
    favourites_panel,
    hair_operators,
    lod_operators,
    operators,
    panel,
    paste_flipped,
    side_operators,
)

CLASSES = (
    *operators.CLASSES,
    *lod_operators.CLASSES,
    *body_operators.CLASSES,
    *side_operators.CLASSES,
    *hair_operators.CLASSES,
    *paste_flipped.CLASSES,
    *panel.CLASSES,
    *favourites_panel.CLASSES,
    *controls_panel.CLASSES,
    *channel_preview.CLASSES,
)
