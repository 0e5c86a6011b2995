"""Mathematics: LaTeX between dollars becomes MathML, which browsers draw by themselves."""

import html
import re

from latex2mathml.converter import convert

_INLINE = re.compile(r'<span class="arithmatex">\\\((.+?)\\\)</span>', re.S)
_DISPLAY = re.compile(r'<div class="arithmatex">\s*\\\[(.+?)\\\]\s*</div>', re.S)


def with_mathml(page: str) -> str:
    """The page's HTML, with all that pymdownx.arithmatex has marked drawn."""
    page = _INLINE.sub(lambda found: _drawn(found[1], "inline"), page)
    return _DISPLAY.sub(lambda found: _drawn(found[1], "block"), page)


def _drawn(latex: str, display: str) -> str:
    return convert(html.unescape(latex).strip(), display=display)
