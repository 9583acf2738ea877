# SPDX-License-Identifier: GPL-3.0-or-later
"""What controls do in plain words, what they are searched by, and both in other languages."""
