# SPDX-License-Identifier: MIT
"""Checks the internal links of the finished pages: the file and the anchor in it must exist.

links.py HTML    prints broken links; exit code 1 if there are any, or no links at all
"""

from __future__ import annotations

import sys
from html.parser import HTMLParser
from pathlib import Path
from urllib.parse import unquote, urlsplit


class Page(HTMLParser):
    """The links and the anchors (`places`) of a page."""

    def __init__(self, path: Path) -> None:
        super().__init__()
        self.links: set[str] = set()
        self.places: set[str] = set()
        self.feed(path.read_text(encoding="utf-8"))

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        for name, value in attrs:
            if name in ("id", "name") and value:
                self.places.add(value)
            if name in ("href", "src") and value:
                self.links.add(value)


def broken(root: Path) -> tuple[list[str], int]:
    """Returns sentences on the broken links, and the number of checked links.

    Args:
        root: folder of the site.
    """
    pages = {path: Page(path) for path in sorted(root.rglob("*.html"))}
    bad, count = [], 0
    for path, page in pages.items():
        for link in sorted(page.links):
            parts = urlsplit(link)
            if parts.scheme or parts.netloc or link.startswith("/") or path.name == "404.html":
                continue
            count += 1
            target = (path.parent / unquote(parts.path)).resolve() if parts.path else path
            target = target / "index.html" if target.is_dir() else target
            place = unquote(parts.fragment)
            if not target.is_file():
                bad.append(f"{path.relative_to(root)}: {link}: no such page")
            elif place and target in pages and place not in pages[target].places:
                bad.append(f"{path.relative_to(root)}: {link}: no such place")
    return bad, count


def main() -> int:
    """Print the broken links."""
    bad, count = broken(Path(sys.argv[1]).resolve())
    print("\n".join([*bad, f"{count} links followed, {len(bad)} lead nowhere"]))
    return 1 if bad or not count else 0


if __name__ == "__main__":
    sys.exit(main())
