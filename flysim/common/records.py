"""Records of settings: what of one is not at its default, and one made from a dict."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import fields
from typing import Any

from flysim.errors import did_you_mean


def changed(record: Any) -> dict[str, Any]:
    """The fields of a record of settings that are not at their defaults, by name."""
    default = type(record)()
    pairs = ((field.name, getattr(record, field.name)) for field in fields(record))
    return {name: value for name, value in pairs if value != getattr(default, name)}


def record_of(kind: type[Any], name: str, given: Any) -> Any:
    """A record of that kind from itself, from a dict of its fields, or from None, which is all defaults.

    Args:
        kind: of the record, a dataclass.
        name: of the setting, for errors.
        given: what was given for it.

    Raises:
        ValueError: a field that there is not, or a value that cannot be.
    """
    if given is None or isinstance(given, kind):
        return kind() if given is None else given
    if not isinstance(given, Mapping):
        raise ValueError(f"{name} must be a {kind.__name__} or a dict of its fields, got {given!r}")
    known = [field.name for field in fields(kind)]
    for key in given:
        if key not in known:
            raise ValueError(f"{name} has no '{key}'. {did_you_mean(str(key), known)}")
    try:
        return kind(**given)
    except (TypeError, ValueError) as error:
        raise ValueError(f"{name}: {error}") from None
