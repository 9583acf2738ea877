# SPDX-License-Identifier: MIT
"""Commands that write HTML pages, pictures and exports of a face."""
