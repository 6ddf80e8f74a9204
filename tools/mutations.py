"""Which one-line mutants of a source there are: cosmic-ray's operators that a reviewer would try, and two of our own.

Of the replacements of an operator the nearest are taken: `<` by `<=` and by its contrary, `+` by `-`. The absurd ones
(`+` by `>>`) any test kills, and would only flatter the score.
"""

from __future__ import annotations

import ast
import random
from collections.abc import Iterator
from dataclasses import dataclass
from difflib import unified_diff
from pathlib import Path
from typing import Any

from cosmic_ray.ast import ast_nodes, get_ast, is_number
from cosmic_ray.mutating import mutate_code
from cosmic_ray.operators.number_replacer import OFFSETS, NumberReplacer
from cosmic_ray.operators.operator import Operator
from cosmic_ray.plugins import get_operator
from parso.python.tree import Number

COMPARISONS = ("Lt_LtE", "Lt_GtE", "LtE_Lt", "LtE_Gt", "Gt_GtE", "Gt_LtE", "GtE_Gt", "GtE_Lt", "Eq_NotEq", "NotEq_Eq")
CALCULATIONS = ("Add_Sub", "Sub_Add", "Mul_Div", "Div_Mul", "FloorDiv_Mul", "Pow_Mul", "RShift_LShift", "BitAnd_BitOr")
CALCULATIONS += ("BitOr_BitAnd",)
CORE = (
    *(f"ReplaceComparisonOperator_{pair}" for pair in (*COMPARISONS, "Is_IsNot", "IsNot_Is")),
    *(f"ReplaceBinaryOperator_{pair}" for pair in CALCULATIONS),
    *("ReplaceUnaryOperator_USub_UAdd", "ReplaceUnaryOperator_Delete_Not", "ReplaceUnaryOperator_Delete_Invert"),
    *("ReplaceTrueWithFalse", "ReplaceFalseWithTrue", "ReplaceAndWithOr", "ReplaceOrWithAnd", "AddNot"),
    *("ReplaceBreakWithContinue", "ReplaceContinueWithBreak", "ZeroIterationForLoop"),
)
GUARD = 1e-6
SWAPPED = {
    "min": "max",
    "minimum": "maximum",
    "argmin": "argmax",
    "+=": "-=",
    "*=": "/=",
    "floor": "ceil",
    "any": "all",
}
SWAPPED |= {other: one for one, other in SWAPPED.items()}


class Nudge(Operator):
    """Whole numbers one more and one less, as cosmic-ray has it; others a tenth more and less, 0.0 likewise.

    Not those that only keep rounding or a division by zero away, of which a tenth changes nothing.
    """

    whole = NumberReplacer()

    def mutation_positions(self, node: Any) -> Iterator[Any]:
        """Two for each number."""
        if is_number(node) and not 0.0 < ast.literal_eval(node.value) <= GUARD:
            yield from self.whole.mutation_positions(node)

    def mutate(self, node: Any, index: int) -> Any:
        """The number, up for 0 and down for 1."""
        value = ast.literal_eval(node.value)
        if isinstance(value, int):
            return Number(f"{node.prefix}{value + OFFSETS[index]}", node.start_pos, "")
        change = 0.1 * OFFSETS[index] * (value if value else 1.0)
        return Number(f"{node.prefix}{value + change:.6g}", node.start_pos, "")

    @classmethod
    def examples(cls) -> Any:
        """None: tests/tools has them."""
        return ()


class Swap(Operator):
    """Names and signs that have a counterpart: `min` and `max`, `+=` and `-=`."""

    def mutation_positions(self, node: Any) -> Iterator[Any]:
        """One for each of them."""
        if getattr(node, "value", None) in SWAPPED:
            yield node.start_pos, node.end_pos

    def mutate(self, node: Any, index: int) -> Any:
        """The counterpart."""
        node.value = SWAPPED[node.value]
        return node

    @classmethod
    def examples(cls) -> Any:
        """None: tests/tools has them."""
        return ()


@dataclass(frozen=True, slots=True, kw_only=True)
class Mutant:
    """A source that differs in one place.

    Attributes:
        path: of the file, from the root of the checkout on.
        line: where it differs.
        operator: what made it.
        code: the whole file.
        diff: its changed lines.
    """

    path: Path
    line: int
    operator: str
    code: str
    diff: str


def operators() -> dict[str, Any]:
    """All of them, by name."""
    return {"Nudge": Nudge(), "Swap": Swap(), **{name: get_operator(f"core/{name}")() for name in CORE}}


def places(source: str) -> list[tuple[str, int, int]]:
    """(operator, its occurrence, line) of all that could be mutated, and of some that cannot: see `mutant`."""
    found, nodes = [], list(ast_nodes(get_ast(source)))
    for name, operator in operators().items():
        lines = [position[0][0] for node in nodes for position in operator.mutation_positions(node)]
        found += [(name, occurrence, line) for occurrence, line in enumerate(lines)]
    return found


def mutant(path: Path, source: str, place: tuple[str, int, int]) -> Mutant | None:
    """The mutant at one of `places`; None where it is no program, or the same one but for what `_told` leaves out."""
    name, occurrence, line = place
    code = mutate_code(source, operators()[name], occurrence)
    if code is None or (told := _told(code)) is None or told == _told(source):
        return None
    lines = unified_diff(source.splitlines(), code.splitlines(), lineterm="", n=0)
    diff = "\n".join(text for text in lines if not text.startswith(("---", "+++", "@@")))
    return Mutant(path=path, line=line, operator=name, code=code, diff=diff)


def sample(root: Path, paths: list[Path], seed: int) -> Iterator[Mutant]:
    """All mutants of some files in an order of chance, such that every beginning of it has each file's due share."""
    order = []
    for number, path in enumerate(sorted(paths)):
        rng = random.Random(f"{seed} {path}")
        source = (root / path).read_text(encoding="utf-8")
        found = places(source)
        rng.shuffle(found)
        start = rng.random()
        order += [((k + start) / len(found), number, path, source, place) for k, place in enumerate(found)]
    for *_, path, source, place in sorted(order, key=lambda entry: entry[:2]):
        made = mutant(path, source, place)
        if made is not None:
            yield made


def _told(code: str) -> str | None:
    """A program's tree; None where there is none.

    Without annotations, which are never run; decorators, whose arguments are the style of the house; and `strict`,
    which changes nothing where zip's lists are as long as we think they are.
    """
    try:
        tree = ast.parse(code)
    except SyntaxError:
        return None
    for node in ast.walk(tree):
        if isinstance(node, ast.FunctionDef):
            node.returns, node.decorator_list = None, []
        elif isinstance(node, ast.ClassDef):
            node.decorator_list = []
        elif isinstance(node, ast.Call):
            node.keywords = [keyword for keyword in node.keywords if keyword.arg != "strict"]
        elif isinstance(node, ast.arg):
            node.annotation = None
        elif isinstance(node, ast.AnnAssign):
            node.annotation = ast.Constant(None)
    return ast.dump(tree)
