"""References of docstrings, as ``:func:`gne_mj.run```, become links to their entries."""

import re

_ROLE = re.compile(r":(?:func|class|mod|meth|attr|data):<code>~?([\w.]+)</code>")


def with_links(html: str) -> str:
    """The page's HTML; a name that has no entry stays a name."""
    return _ROLE.sub(_link, html)


def _link(found: re.Match[str]) -> str:
    name = found[1]
    return f'<autoref identifier="{name}" optional><code>{name.split(".")[-1]}</code></autoref>'
