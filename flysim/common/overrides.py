"""`--set KEY=VALUE`: one value written into a table of parameters, as it would stand in a TOML file."""

from __future__ import annotations

from tomllib import TOMLDecodeError
from typing import Any

from flysim.errors import ScenarioError
from flysim.foreign.data import MAX_DEPTH, parse_toml

MAX_OVERRIDE = 10_000  # characters of one KEY=VALUE


def override(data: dict[str, Any], text: str) -> None:
    """Writes one `KEY=VALUE` into plain data: `flies.population=3000` sets `data["flies"]["population"]`.

    A value is TOML's, or else a bare word, which is a string.

    Raises:
        ScenarioError: there is no "=", the key leads into a value, or one of the two is too long.
    """
    key, equals, given = text.partition("=")
    keys = key.strip().split(".")
    if not equals or not all(keys):
        raise ScenarioError(f"--set {text}: write KEY=VALUE, as in --set flies.population=3000.")
    if len(text) > MAX_OVERRIDE or len(keys) > MAX_DEPTH:
        raise ScenarioError(f"--set {key}: it is too long. Write it into a file.")
    try:
        value = parse_toml(f"value = {given}")["value"]
    except TOMLDecodeError:
        value = given.strip()  # a bare word is a string
    except ValueError as error:
        raise ScenarioError(f"--set {key}: {error}.") from error
    table = data
    for name in keys[:-1]:
        table = table.setdefault(name, {})
        if not isinstance(table, dict):
            raise ScenarioError(f"--set {text}: '{name}' is a value, not a table.")
    table[keys[-1]] = value
