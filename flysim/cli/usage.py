"""What typer refuses of a command line, in one line: what was wrong, what was got, what to type."""

from __future__ import annotations

import re
from typing import Any

import typer

from flysim.errors import did_you_mean
from flysim.plain import shown

Usage: Any = next(kind for kind in typer.BadParameter.__mro__ if kind.__name__ == "UsageError")
_KINDS = {"integer": "a whole number", "number": "a number", "boolean": "true or false", "path": "a path"}
_QUOTED = re.compile(r"'([^']*)'")
_EXAMPLE = "Example: "


def is_help(error: Exception) -> bool:
    """Whether it is no mistake but a command without a word after it, whose help is what was asked for."""
    return type(error).__name__ == "NoArgsIsHelpError"


def usage_line(error: Any, ctx: typer.Context | None = None) -> str:
    """A line for a mistake that typer has found.

    Args:
        error: typer's `UsageError`.
        ctx: of the command, where the error does not bear it itself.
    """
    ctx = getattr(error, "ctx", None) or ctx
    command = getattr(ctx, "command", None)
    path = getattr(ctx, "command_path", "flysim")
    if getattr(error, "ctx", None) is None and getattr(ctx, "invoked_subcommand", None):
        path = f"{path} {ctx.invoked_subcommand}"  # type: ignore[union-attr]
    hint = _hint(path, command)
    kind, message = type(error).__name__, str(error.message or "").rstrip(".")
    option = getattr(error, "option_name", None)
    if kind == "NoSuchOption" and option is not None:
        return f"{path} has no option {shown(option)}. {_nearest(option, _options(command), path)}"
    if message.startswith("No such command"):
        name = next(iter(_QUOTED.findall(message)), "")
        return f"{path} has no command {shown(name)}. {did_you_mean(name, getattr(command, 'commands', ()))}"
    if kind == "MissingParameter":
        return f"{path} needs {_name(error.param).upper()}. {hint}"
    if kind == "BadParameter":
        return f"{_name(error.param)} {_wrong(error, message)}."
    if option is not None:  # a value that is missing, or one that is too much
        what = "takes no value" if "does not take" in message else "needs a value after it"
        return f"{option} {what}. {hint}"
    if "unexpected extra argument" in message:
        return f"{path} takes no {shown(message.partition('(')[2].removeprefix('s) (').rstrip(')'))}. {hint}"
    return f"{path}: {message[:1].lower()}{message[1:]}. {hint}"


def _hint(path: str, command: Any) -> str:
    """What to type in its place."""
    example = str(getattr(command, "epilog", None) or "")
    return example if example.startswith(_EXAMPLE) else f"See: {path} -h"


def _options(command: Any) -> list[str]:
    return [name for param in getattr(command, "params", ()) for name in (*param.opts, *param.secondary_opts)]


def _nearest(option: str, options: list[str], path: str) -> str:
    near = did_you_mean(option, [name for name in options if name.startswith("--")])
    return near if near.startswith("Did") else f"See: {path} -h"


def _name(param: Any) -> str:
    """As it is typed: `--seed` for an option, `scenarios` for an argument."""
    names = [name for name in getattr(param, "opts", ()) if name.startswith("--")]
    if names:
        return names[0]
    return str(getattr(param, "metavar", None) or getattr(param, "name", None) or "argument")


def _wrong(error: Any, message: str) -> str:
    """What a value should have been, and what it was."""
    cause = error.__cause__ or error.__context__
    faults = cause.errors() if hasattr(cause, "errors") else []
    if not faults:
        return f"is wrong: {message}"
    wanted = next((said for word, said in _KINDS.items() if word in message), message)
    return f"must be {wanted}, got {shown(str(faults[0].get('input')))}"
