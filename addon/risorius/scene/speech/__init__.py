# SPDX-License-Identifier: GPL-3.0-or-later
"""What voices say: words and phonemes beside the keys of an action, and corrections of both."""
