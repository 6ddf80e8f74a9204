"""A hook of tools/mkdocs.yml: where a page names another one, as `docs/nav.md`, the site links to it."""

import re
from typing import Any


def on_page_markdown(markdown: str, **_: Any) -> str:
    """The page with links; a name of a page that is not there becomes a dead one, and strict finds it."""
    return re.sub(r"`docs/(\w+\.md)`", r"[`docs/\1`](\1)", markdown)
