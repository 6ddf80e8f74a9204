"""YAML that somebody else wrote: plain values, no anchors, so deep and no more."""

from __future__ import annotations

from typing import Any

from flysim.plain import shown

MAX_DEPTH = 32  # lists and mappings within each other


def parse_yaml(text: str) -> Any:
    """The data of a YAML text: mappings, lists, texts, numbers.

    YAML 1.1 takes `1e-3` for a text: whoever asks for a number turns it into one.

    Raises:
        ValueError: it is none, has anchors (a few lines of them unfold to gigabytes) or tags, or is too deep.
    """
    import yaml

    try:
        depth = 0
        for event in yaml.parse(text, Loader=yaml.SafeLoader):
            if isinstance(event, yaml.AliasEvent):
                raise ValueError("it has aliases (*name), which are not read: write the values out")
            if isinstance(event, yaml.CollectionStartEvent):
                depth += 1
                if depth > MAX_DEPTH:
                    raise ValueError(f"it is nested deeper than {MAX_DEPTH}")
            elif isinstance(event, yaml.CollectionEndEvent):
                depth -= 1
        return yaml.safe_load(text)
    except yaml.YAMLError as refusal:
        mark = getattr(refusal, "problem_mark", None)
        line = f" at line {mark.line + 1}" if mark is not None else ""
        raise ValueError(f"it is no YAML{line}: {shown(str(getattr(refusal, 'problem', refusal)))}") from None
    except RecursionError:
        raise ValueError(f"it is nested deeper than {MAX_DEPTH}") from None
