"""YAML that somebody else wrote, as plain data: no tag makes an object, no alias stands for something else.

PyYAML's safe loader calls itself for each level; what an alias stands for may hold aliases, and grows without end as it
is walked through. So depth is counted as it is read, and aliases are refused. Tags are passed over: OpenCV writes one
before each matrix, and what follows it is plain.
"""

from __future__ import annotations

import functools
from typing import Any

from flysim.foreign.data import MAX_DEPTH, check_data

_OPENCV = "%YAML:1."  # what OpenCV writes in place of a YAML header


def parse_yaml(text: str) -> Any:
    """The data of a YAML text of one document. Numbers without a dot before their exponent stay text, as in YAML 1.1.

    Raises:
        ValueError: it is none, or it has aliases, more than `MAX_DEPTH` levels, a whole number of more than 64 bits or
            a string of more than `MAX_TEXT` characters.
    """
    import yaml

    if text.startswith(_OPENCV):
        text = text.partition("\n")[2]
    try:
        data = yaml.load(text, Loader=_loader())  # a SafeLoader that takes less
    except yaml.MarkedYAMLError as refusal:
        line = f" at line {refusal.problem_mark.line + 1}" if refusal.problem_mark else ""
        raise ValueError(f"not YAML{line}: {refusal.problem or refusal.context}") from None
    except (yaml.YAMLError, ArithmeticError) as refusal:
        raise ValueError(f"not YAML: {str(refusal).splitlines()[0]}") from None
    check_data(data)
    return data


@functools.cache
def _loader() -> Any:
    import yaml

    class Plain(yaml.SafeLoader):
        depth = 0

        def compose_node(self, parent: Any, index: Any) -> Any:
            event = self.peek_event()
            if isinstance(event, yaml.AliasEvent) or getattr(event, "anchor", None) is not None:
                raise ValueError("anchors and aliases are not read: write out what they stand for")
            scalar = isinstance(event, yaml.ScalarEvent)
            if scalar:
                event.implicit = (event.style is None, True)
            event.tag = None  # type: ignore[union-attr]
            self.depth += 1
            if self.depth > MAX_DEPTH and not scalar:
                raise ValueError(f"lists or tables are nested deeper than {MAX_DEPTH}: flatten them")
            node = super().compose_node(parent, index)
            self.depth -= 1
            return node

    return Plain
