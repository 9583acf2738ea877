# SPDX-License-Identifier: GPL-3.0-or-later
"""Names, errors and coordinate spaces that the other folders of `logic` share."""
