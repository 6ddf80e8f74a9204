"""What draws each figure of README and docs: the commands, and how their answers become text.

A figure is named in the texts by `<!-- flysim:NAME -->`, what it says, `<!-- /flysim -->`. tools/readme.py renews them.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

# What figures hang on, as globs from the root. Comments and docstrings of Python files do not count.
SEEING = tuple(f"flysim/{room}/**/*.py" for room in ("compute", "geometry", "products", "stereo", "flies", "engines"))
DRAWN = (
    *("flysim/sim/**/*.py", "flysim/render/**/*.py", "flysim/render/**/*.glsl", "flysim/sensors/**/*.py"),
    "flysim/calibration/**/*.py",
    *("flysim/worlds/**/*.py", "flysim/robots/**/*.py"),
    *("worlds/*/world.sdf", "worlds/*/textures/*", "robots/*/*.urdf", "runs/*.toml"),
)
JUDGED = tuple(f"flysim/{room}/**/*.py" for room in ("obstacles", "paths", "truth", "sources", "evaluate", "runs"))
DRIVE = (*SEEING, *DRAWN, *JUDGED)
AGENTS = (*DRIVE, "flysim/nav/**/*.py", "flysim/studies/nav/**/*.py", "policies/*/*.npz")

Answers = Sequence[Any]
Texts = Mapping[str, str]


@dataclass(frozen=True, slots=True, kw_only=True)
class Figure:
    """One thing to renew: runs, the texts they give, the pictures they draw.

    Attributes:
        commands: run one after another in one empty folder; each prints JSON, but for those that only draw.
        write: their answers to texts by the name of their region; `None` for who only draws.
        regions: the names that `write` gives.
        pictures: file from the root, and where the commands leave it in their folder.
        sources: globs of the files that the figure hangs on.
        cheap: seconds alone; a test holds it against a fresh run.
    """

    commands: tuple[str, ...]
    write: Callable[[Answers], Texts] | None = None
    regions: tuple[str, ...] = ()
    pictures: Mapping[str, str] = field(default_factory=dict)
    sources: tuple[str, ...] = DRIVE
    cheap: bool = False


def table(head: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    """A table in Markdown."""
    lines = ["| " + " | ".join(head) + " |", "|" + "---|" * len(head)]
    return "\n".join([*lines, *("| " + " | ".join(row) + " |" for row in rows)])


def cm(value: float | None, digits: int = 1) -> str:
    """A length [m] in centimetres; a dash where there is none."""
    return "-" if value is None else f"{100.0 * value:.{digits}f}"


def of_run(name: str) -> Callable[[Answers], Texts]:
    """The cells of README's results of one scenario."""

    def write(answers: Answers) -> Texts:
        ((report,),) = answers
        seen = [obstacle for obstacle in report["obstacles"] if obstacle["visible"]]
        found = sum(obstacle["detected"] for obstacle in seen)
        centre, size = (report[f"{key}_visible_error_m"] for key in ("center", "size"))
        cells = (
            f"{found} of {len(seen)}",
            str(report["false_obstacles"]),
            f"{cm(centre['median'])} / {cm(centre['max'])}",
            f"{cm(size['median'])} / {cm(size['max'])}",
            cm(report["surface"]["accuracy_median_m"], 2),
        )
        return {name: " | ".join(cells)}

    return write


def of_bench(answers: Answers) -> Texts:
    """The clock beside OpenCV's matchers."""
    (bench,) = answers
    rows = [
        (
            f"{size['width']}x{size['height']}",
            f"{size['flies_ms']:.0f} ms",
            f"{size['sgbm_ms']:.0f} ms",
            f"{size['flies_over_sgbm']:.2f}",
            f"{100.0 * size['flies_within_0_5px']:.1f} %",
            f"{100.0 * size['sgbm_within_0_5px']:.1f} %",
        )
        for size in bench["sizes"]
    ]
    faster = [cell["times_faster"] for cell in bench["cells"]]
    flies = [size["flies"] for size in bench["sizes"]]
    head = ("image", "flies, all", "SGBM", "flies / SGBM", "within 0.5 px: flies", "SGBM")
    return {
        "clock": table(head, rows),
        "faster": f"{min(faster):.0f} to {max(faster):.0f}",
        "places": f"{min(flies):.0f} to {max(flies):.0f}",
        "smallest": rows[0][3],
    }


def of_table1(answers: Answers) -> Texts:
    """What the paper's grid gives as a whole, and its favourite beside what beats it in no more time."""
    (data,) = answers
    cells = data["cells"]
    iterations = [cell["iterations_mean"] for cell in cells]
    wanted = {"set": "C", "population": 3000, "regions": 4, "stop": 90}
    (favourite,) = (cell for cell in cells if wanted.items() <= cell.items())
    as_cheap = [cell for cell in cells if cell["ms_mean"] <= 1.05 * favourite["ms_mean"]]
    best = max(as_cheap, key=lambda cell: cell["flies_on_object"])
    beaten = (
        f"is beaten: set {best['set']} ({best['population']} flies, {best['regions']} regions, {best['stop']} %) "
        f"brings {best['flies_on_object']:.0f} flies onto the object in {best['ms_mean']:.1f} ms, where set C brings "
        f"{favourite['flies_on_object']:.0f} in {favourite['ms_mean']:.1f} ms"
    )
    ranks = data["rank_correlation"]
    return {
        "ranks_ms": f"{ranks['ms']:.2f}",
        "ranks_iterations": f"{ranks['iterations']:.2f}",
        "generations": f"{min(iterations):.0f} to {max(iterations):.0f}",
        "favourite": "is not beaten" if best is favourite else beaten,
    }


ENGINES = {"flies": "flies", "sgbm": "SGBM", "bm": "BM"}
BESIDES = ("surface F, 2 cm", "time a stop", "missed > 15 cm")


def of_suite(answers: Answers) -> Texts:
    """README's columns, and the whole table of docs/compare.md."""
    (data,) = answers
    rows, short = [], []
    for key, name in ENGINES.items():
        found = data["engine"][key]
        ratio = found["ms_per_stop"] / data["engine"]["sgbm"]["ms_per_stop"]
        time = "1" if key == "sgbm" else f"{ratio:.2f} of SGBM's"
        centre, size = f"{cm(found['center_error_m'], 2)} cm", f"{cm(found['size_error_m'], 2)} cm"
        f1 = f"{found['f1']:.2f}"
        heights = " / ".join(cm(found[f"height_error_{end}_m"], 1) for end in ("p95", "max")) + " cm"
        short.append((name, f1, f"{found['well_f1']:.2f}", centre, size, heights, time))
        shares = (f"{found[share]:.2f}" for share in ("well_f1", "precision", "recall"))
        of_size = f"{size}, {100.0 * found['size_error_rel']:.1f} %"
        surface = next(value for tau, value in found["surface_f"].items() if float(tau) == 0.02)
        rows.append(
            (
                name,
                f1,
                *shares,
                centre,
                of_size,
                heights,
                f"{found['shape_accuracy']:.2f}",
                f"{surface:.2f}",
                time,
                str(found["missed_big"]),
            )
        )
    return {
        "random": table(
            ("engine", "F1", "well F1", "centre, median", "size, median", "height, 95 % / max", "time a stop"), short
        ),
        "random_all": table(
            (
                *("engine", "F1", "well F1", "precision", "recall", "centre", "size", "height, 95 % / max", "shape"),
                *BESIDES,
            ),
            rows,
        ),
        "random_obstacles": str(data["engine"]["flies"]["visible"]),
    }


def of_agents(answers: Answers) -> Texts:
    """Scores of the agents with their intervals."""
    (data,) = answers

    def cell(agent: Mapping[str, Any], name: str) -> str:
        low, high = agent[f"{name}_ci95"]
        return f"{agent[name]:.2f} [{low:.2f}, {high:.2f}]"

    rows = []
    for agent in data["agents"]:
        shares = (cell(agent, name) for name in ("success", "spl", "collision"))
        rows.append((f"`{agent['agent']}`", *shares, f"{agent['time_out']:.2f}"))
    return {"agents": table(("agent, seeing by flies", "success", "SPL", "collisions", "time-outs"), rows)}


def of_exact(answers: Answers) -> Texts:
    """The same on exact distances."""
    (data,) = answers
    (vfh,) = data["agents"]
    return {"exact_success": f"{vfh['success']:.2f}", "exact_spl": f"{vfh['spl']:.2f}"}


PARTS = {
    "none, but 5000 flies (as the files have it)": "flies.population=5000",
    "`obstacles.silhouettes=false`": "obstacles.silhouettes=false",
    "`obstacles.round=false`": "obstacles.round=false",
    "`flies.slant=0`": "flies.slant=0",
    "`flies.misfit=0`": "flies.misfit=0",
}
PART_SCENARIOS = ("paper_c", "corridor", "yard")


def of_parts(answers: Answers) -> Texts:
    """What each part of measuring is worth."""
    rows = []
    for part, reports in zip(PARTS, answers, strict=True):
        cells = [part]
        for report in reports:
            centre, size = (report[f"{key}_visible_error_m"] for key in ("center", "size"))
            f1 = "" if report["f1"] == 1.0 else f" (F1 {report['f1']:.2f})"
            cells.append(f"{cm(centre['median'])} / {cm(centre['max'])}{f1}")
            cells.append(f"{cm(size['median'], 2)} / {cm(size['max'])}")
        rows.append(cells)
    head = [each for name in PART_SCENARIOS for each in (f"`{name}` centre", "size")]
    return {"parts": table(("`--set`", *head), rows)}


STUDY_NAMES = (
    *("exposure", "offset", "contrast", "light", "glare", "noise", "jpeg", "blur", "defocus", "alignment", "roll"),
    *("calibration", "floor", "texture"),
)


def of_study(name: str) -> Callable[[Answers], Texts]:
    """The rows of one study in docs/disturbances.md, all levels of it."""

    def write(answers: Answers) -> Texts:
        (data,) = answers
        rows = []
        for level in sorted({entry["level"] for entry in data["levels"]}):
            by = {entry["engine"]: entry for entry in data["levels"] if entry["level"] == level}
            shares = [f"{by[engine][key]:.2f}" for key in ("f1", "well_f1") for engine in ENGINES]
            errors = [cm(by["flies"][f"{key}_error_max_m"]) for key in ("center", "size")]
            unit = f" [{data['unit']}]" if data["unit"] else ""
            title = "" if rows else f"`{name}`: {data['what']}{unit}"
            rows.append(" | ".join((title, f"{level:g}", *shares, *errors)))
        return {f"study_{name}": " |\n| ".join(rows)}

    return write


def of_env(answers: Answers) -> Texts:
    """Steps a second of the environment, and what a step is made of."""
    (data,) = answers
    rows = [(name, f"{rate:.0f}") for name, rate in data["steps_per_second"].items()]
    return {
        "env": table(("observation", "steps a second"), rows),
        "env_step": f"A step with flies takes {data['step_ms']:.1f} ms, {data['over_floor']:.2f} times its two images "
        f"({data['render_ms']:.1f} ms) and its physics ({data['physics_ms']:.1f} ms) alone; two processes make "
        f"{data['two_processes']:.2f} times the steps of one.",
    }


def scenario(name: str, *, cheap: bool = False, pictures: Mapping[str, str] | None = None) -> Figure:
    """A row of README's results."""
    command = f"flysim run {name} --json --out {name}"
    return Figure(commands=(command,), write=of_run(name), regions=(name,), cheap=cheap, pictures=pictures or {})


def study(name: str, pictures: Mapping[str, str] | None = None) -> Figure:
    """A study of docs/disturbances.md."""
    return Figure(
        commands=(f"flysim study {name} --scenarios paper_a,yard --seeds 100:102 --out study --json",),
        write=of_study(name),
        regions=(f"study_{name}",),
        pictures=pictures or {},
        sources=(*DRIVE, "flysim/studies/sweep/*.py"),
    )


FIGURES: dict[str, Figure] = {
    "paper_a": scenario("paper_a"),
    "paper_b": scenario("paper_b", pictures={"docs/paper_b.png": "paper_b/figures/flies_on_image.png"}),
    "paper_c": scenario("paper_c", cheap=True),
    "corridor": scenario("corridor"),
    "yard": scenario("yard"),
    "clock": Figure(
        commands=("flysim bench engine --repeats 3 --json --out bench",),
        write=of_bench,
        regions=("clock", "faster", "places", "smallest"),
        pictures={"docs/sizes.png": "bench/sizes.png"},
        sources=(*SEEING, *DRAWN, "flysim/studies/bench/*.py"),
    ),
    "table1": Figure(
        commands=("flysim table1 --json --out table1",),
        write=of_table1,
        regions=("ranks_ms", "ranks_iterations", "generations", "favourite"),
        pictures={"docs/cost_quality.png": "table1/figures/cost_quality.png"},
        sources=(*SEEING, *DRAWN, "flysim/studies/table1/*.py"),
    ),
    "random": Figure(
        commands=("flysim suite random-medium --seeds 0:20 --engines flies,sgbm,bm --json --out suite",),
        write=of_suite,
        regions=("random", "random_all", "random_obstacles"),
        sources=(*DRIVE, "flysim/studies/suite/*.py", "flysim/studies/compare/*.py"),
    ),
    "agents": Figure(
        commands=(
            "flysim nav straight warning vfh dwa ppo --worlds random-medium --episodes 50 --picture scores.png --json",
        ),
        write=of_agents,
        regions=("agents",),
        pictures={"docs/nav_scores.png": "scores.png"},
        sources=AGENTS,
    ),
    "exact": Figure(
        commands=("flysim nav vfh --worlds random-medium --episodes 50 --observation truth --json",),
        write=of_exact,
        regions=("exact_success", "exact_spl"),
        sources=AGENTS,
    ),
    "env": Figure(
        commands=("flysim bench env --json",),
        write=of_env,
        regions=("env", "env_step"),
        sources=(*AGENTS, "flysim/studies/bench/*.py"),
    ),
    "parts": Figure(
        commands=tuple(f"flysim run {' '.join(PART_SCENARIOS)} --set {one} --json" for one in PARTS.values()),
        write=of_parts,
        regions=("parts",),
    ),
    "sensors": Figure(
        commands=("flysim sensors yard --width 160 --out sensors.png",),
        pictures={"docs/sensors.png": "sensors.png"},
        sources=(*DRAWN, "flysim/studies/sensors/*.py", "flysim/cli/sensors.py"),
    ),
    **{
        f"study_{name}": study(name, {"docs/defocus.png": "study/figures/study.png"} if name == "defocus" else None)
        for name in STUDY_NAMES
    },
}
