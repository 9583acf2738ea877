# SPDX-License-Identifier: GPL-3.0-or-later
"""Stores the words and phonemes of a voice with its action, and corrects the action's keys."""
