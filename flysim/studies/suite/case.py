"""One case of a suite, in a process of its own: what each engine made of it, or why it could not be run."""

from __future__ import annotations

import json
from dataclasses import dataclass, field, replace
from pathlib import Path

from flysim.common.scratch import Scratch
from flysim.errors import FlysimError
from flysim.evaluate.report import Report
from flysim.foreign.data import read_json
from flysim.record.run_folder import MAX_BYTES, report_file
from flysim.render.choose import RendererName
from flysim.studies.suite.suites import Case


@dataclass(frozen=True, slots=True, kw_only=True)
class Job:
    """A case, and who sees in it."""

    case: Case
    engines: tuple[str, ...]
    renderer: RendererName


@dataclass(frozen=True, slots=True, kw_only=True)
class Outcome:
    """The reports by engine; or the error, one line.

    Attributes:
        files: of the run's light folder, by their paths in it: they come from a process that may be on another machine.
    """

    reports: dict[str, Report]
    error: str | None = None
    files: dict[str, bytes] = field(default_factory=dict)


def run_case(job: Job) -> Outcome:
    """Runs a case; its files are `scenario.json`, the reports, the pictures, the generated world.

    Whatever goes wrong goes wrong for this case alone.
    """
    scratch = Scratch()
    try:
        return _run(job, Path(scratch.name))
    except FlysimError as error:
        return Outcome(reports={}, error=str(error))
    except Exception as error:  # a suite of hours does not end by one world
        return Outcome(reports={}, error=f"{type(error).__name__}: {error}")
    finally:
        scratch.cleanup()


def _run(job: Job, folder: Path) -> Outcome:
    from flysim.studies.compare.compare import compare
    from flysim.studies.compare.figures import write_comparison

    plan = job.case.plan(folder)
    comparison = compare(plan, job.engines, seed=job.case.seed, renderer=job.renderer)
    text = json.dumps(plan.kept(folder, job.case.seed), indent=1)
    (folder / "scenario.json").write_text(text + "\n", encoding="utf-8")
    write_comparison(folder, comparison)
    names = sorted(path.relative_to(folder).as_posix() for path in folder.rglob("*") if path.is_file())
    files = {name: folder.joinpath(name).read_bytes() for name in names}
    return replace(kept_outcome(folder, job.engines), files=files)


def kept_outcome(folder: Path, engines: tuple[str, ...]) -> Outcome:
    """What `run_case` gave, from the folder that it wrote: a suite's figures are those of its files, resumed or not.

    Raises:
        FlysimError: a report is missing or no JSON.
        ValueError: a report is damaged; a LookupError or TypeError likewise.
    """
    files = {name: folder / "reports" / report_file(name) for name in engines}
    return Outcome(
        reports={name: Report.from_json(read_json(file, "report", MAX_BYTES)) for name, file in files.items()}
    )
