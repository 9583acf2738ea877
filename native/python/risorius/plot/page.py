# SPDX-License-Identifier: MIT
"""Writes the four drawings of a rig as one self-contained HTML page."""

from __future__ import annotations

import html
import io
import re
from collections.abc import Callable, Sequence

from matplotlib.backends.backend_svg import FigureCanvasSVG
from matplotlib.figure import Figure

from .content import words
from .content.facts import Facts, counts, descriptor
from .content.regions import COLORS
from .drawing import draw_face, draw_lods, draw_matrix, draw_sizes
from .drawing.paper import ACCENT, INK, MUTED, RULE, Canvas, settings
from .page_parts import SCRIPT, STYLE

_VARIABLES = {INK: "--ink", MUTED: "--muted", RULE: "--rule", ACCENT: "--accent"}
WIDTH = 12.4  # width of the drawings in inches


def render(facts: Facts, lod: int, dpi: int) -> bytes:
    """The HTML page in UTF-8.

    Args:
        facts: facts of the face.
        lod: number of the LOD to draw, from 0.
        dpi: resolution of bitmaps in dots per inch.
    """
    bars = 0.75 + 0.3 * len(facts.layers)
    with settings():
        sections = [
            section("face", words.FACE, words.face(lod), 8.1, dpi,
                     lambda canvas: draw_face.draw(canvas, facts, lod, dpi)),
            section("matrix", words.MATRIX, words.matrix(facts), 9.2, dpi,
                     lambda canvas: draw_matrix.draw(canvas, facts, 2 * dpi)),
            section("lods", words.LODS, words.lods(), 5.4, dpi,
                     lambda canvas: draw_lods.draw(canvas, facts)),
            section("sizes", words.SIZES, words.sizes(facts), bars, dpi,
                     lambda canvas: draw_sizes.draw(canvas, facts, with_counts=False),
                     after=_tables(facts)),
        ]  # fmt: skip
    links = [("face", "face"), ("matrix", "matrix"), ("lods", "levels"), ("sizes", "sizes")]
    return document(facts, "\n".join(sections), links).encode()


def section(
    name: str,
    title: str,
    caption: str,
    height: float,
    dpi: int,
    draw: Callable[[Canvas], None],
    after: str = "",
) -> str:
    """A section of the page as HTML: heading, caption, drawing, and optional HTML after it.

    Args:
        name: the section's id in the HTML.
        title: the heading.
        caption: a sentence or two below the heading.
        height: height of the drawing in inches.
        dpi: resolution of bitmaps in dots per inch.
        draw: function that draws on the canvas.
        after: HTML after the drawing.
    """
    figure = Figure(figsize=(WIDTH, height), dpi=dpi)
    FigureCanvasSVG(figure)
    draw(Canvas(figure, WIDTH, height))
    return (
        f'<section id="{name}"><h2>{html.escape(title)}</h2><p>{html.escape(caption)}</p>'
        f'<figure tabindex="0">{_svg(figure, name, title)}</figure>{after}</section>'
    )


def _svg(figure: Figure, name: str, title: str) -> str:
    """A figure as inline SVG that uses the page's colour variables."""
    out = io.StringIO()
    figure.savefig(out, format="svg", dpi=figure.dpi, metadata={"Date": None, "Creator": None})
    text = out.getvalue()
    text = text[text.index("<svg") :]
    text = re.sub(r"<metadata>.*?</metadata>", "", text, flags=re.DOTALL)
    for ink, variable in _VARIABLES.items():
        text = text.replace(ink, f"var({variable})")
    # Drawings on one page must not share ids.
    text = re.sub(r'\bid="', f'id="{name}-', text)
    text = re.sub(r'href="#', f'href="#{name}-', text)
    text = text.replace("url(#", f"url(#{name}-")
    # The page sets the size; the viewBox keeps the aspect ratio.
    text = re.sub(r'(<svg[^>]*?) width="[^"]*"', r"\1", text, count=1)
    text = re.sub(r'(<svg[^>]*?) height="[^"]*"', r"\1", text, count=1)
    return text.replace("<svg", f'<svg role="img" aria-label="{html.escape(title)}"', 1)


def _tables(facts: Facts) -> str:
    total = max(facts.file_size, 1)
    layers = "".join(
        f"<tr><td>{html.escape(layer.title)}</td><td><code>{html.escape(layer.key)}</code></td>"
        f"<td>{layer.size:,}</td><td>{layer.size / total:.2%}</td></tr>"
        for layer in facts.layers
    )
    numbers = "".join(
        f"<tr><td>{html.escape(name)}</td><td>{value:,}</td></tr>" for name, value in counts(facts)
    )
    return (
        '<div class="tables"><table><thead><tr><th>part</th><th>key</th><th>bytes</th>'
        f"<th>share</th></tr></thead><tbody>{layers}</tbody><tfoot><tr><td>file</td><td></td>"
        f"<td>{facts.file_size:,}</td><td>100%</td></tr></tfoot></table>"
        "<table><thead><tr><th>count</th><th>number</th></tr></thead>"
        f"<tbody>{numbers}</tbody></table></div>"
    )


def document(facts: Facts, sections: str, links: Sequence[tuple[str, str]]) -> str:
    """The complete HTML page.

    Args:
        facts: facts of the face.
        sections: HTML from `section`.
        links: (id of a section, text of its link at the top of the page) for each section.
    """
    title = html.escape(facts.title)
    legend = "".join(
        f'<li><i style="background:{COLORS[region]}"></i>{region} <b>{count}</b></li>'
        for region, count in facts.region_counts().items()
    )
    return f"""<!DOCTYPE html>
<html lang="en">
<head>
<meta charset="utf-8">
<meta name="viewport" content="width=device-width, initial-scale=1">
<title>{title}</title>
<style>{STYLE}</style>
</head>
<body>
<header>
<h1>{title}</h1>
<p>{html.escape(facts.file_name)} | {html.escape(descriptor(facts))}</p>
<nav>{" ".join(f'<a href="#{name}">{word}</a>' for name, word in links)}</nav>
</header>
<ul class="legend" aria-label="Face regions and their joints">{legend}</ul>
<main>
{sections}
</main>
<footer>Click a picture to enlarge it; then the wheel zooms, dragging moves, Esc closes.
Made by risorius plot.</footer>
<dialog id="zoom"><div></div><button aria-label="Close">&times;</button></dialog>
<script>{SCRIPT}</script>
</body>
</html>
"""
