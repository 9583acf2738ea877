# SPDX-License-Identifier: GPL-3.0-or-later
"""New faces from some that go together: a preview that follows the sliders, and the file."""
