# SPDX-License-Identifier: MIT
"""Commands of the command line that make faces or solve their controls."""
