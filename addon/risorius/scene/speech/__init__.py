# SPDX-License-Identifier: GPL-3.0-or-later
"""Words and phonemes of voices beside the keys of an action, and corrections of both."""
