# SPDX-License-Identifier: GPL-3.0-or-later
"""What the shape keys of a head are: by their names, by what the user says; their pictures."""
