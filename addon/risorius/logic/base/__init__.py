# SPDX-License-Identifier: GPL-3.0-or-later
"""Names, errors, sentences, face regions, heat colours and coordinate spaces for all packages."""
