"""Which mutants `make mutants` draws from."""

import importlib.util
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
HERE = Path("room/it.py")


@pytest.fixture(scope="module")
def mutations():
    spec = importlib.util.spec_from_file_location("mutations", ROOT / "tools/mutations.py")
    assert spec is not None and spec.loader is not None
    sys.modules["mutations"] = module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def mutants(mutations, source):
    made = (mutations.mutant(HERE, source, place) for place in mutations.places(source))
    return {mutant.code: mutant for mutant in made if mutant is not None}


@pytest.mark.parametrize(
    ("source", "expected"),
    [
        ("a = b < 3\n", {"a = b <= 3\n", "a = b >= 3\n", "a = b < 4\n", "a = b < 2\n"}),
        ("a = 0.3 + b\n", {"a = 0.33 + b\n", "a = 0.27 + b\n", "a = 0.3 - b\n"}),
        ("a = 0.0 * b\n", {"a = 0.1 * b\n", "a = -0.1 * b\n", "a = 0.0 / b\n"}),
        ("a = b + 1e-9\n", {"a = b - 1e-9\n"}),  # a tenth of what keeps rounding away is nothing
        ("a += min(b, c)\n", {"a -= min(b, c)\n", "a += max(b, c)\n"}),
        ("a = b and not c\n", {"a = b or not c\n", "a = b and  c\n"}),
        ("if a:\n    b()\n", {"if not a:\n    b()\n"}),
        ("def f(a: int | None = None) -> int | None:\n    pass\n", set()),
        ("a: int | None = b\n", set()),
        ("@dataclass(frozen=True)\nclass A:\n    pass\n", set()),
        ("a = zip(b, strict=True)\n", set()),
    ],
)  # fmt: skip
def test_mutants_of_a_line(mutations, source, expected):
    assert {code.replace("=  ", "= ").replace("+  ", "+ ") for code in mutants(mutations, source)} == expected


def test_a_mutant_tells_where_it_differs(mutations):
    (mutant,) = mutants(mutations, "a = 1\n\nb = max(a, a)\nc = b\n".replace("1", "d")).values()
    assert (mutant.path, mutant.line, mutant.operator) == (HERE, 3, "Swap")
    assert mutant.diff == "-b = max(a, a)\n+b = min(a, a)"


def test_a_sample_is_the_same_for_a_seed_and_every_beginning_has_each_files_share(mutations, tmp_path):
    (tmp_path / "long.py").write_text("".join(f"a{k} = b + {k}\n" for k in range(9)), encoding="utf-8")
    (tmp_path / "short.py").write_text("".join(f"a{k} = b + {k}\n" for k in range(3)), encoding="utf-8")
    (tmp_path / "empty.py").write_text("", encoding="utf-8")
    paths = [Path(name) for name in ("long.py", "short.py", "empty.py")]
    first, again, other = ([m.code for m in mutations.sample(tmp_path, paths, seed)] for seed in (1, 1, 2))
    assert first == again != other
    assert len(first) == len(set(first)) == 3 * 12
    drawn = [m.path.name for m in mutations.sample(tmp_path, paths, 1)][:16]
    assert drawn.count("long.py") == pytest.approx(12, abs=1)
