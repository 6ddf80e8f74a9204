"""Suites of tiny scenarios: pooled, failures listed, folders of the worst kept."""

import json
import multiprocessing

import pytest

from flysim.common.growing import growing
from flysim.common.runner import runner
from flysim.errors import ScenarioError
from flysim.evaluate.report import Report
from flysim.runs.run import run
from flysim.runs.scenario import read_scenario
from flysim.studies.compare.figures_of import pooled
from flysim.studies.suite.suite import DIED, SUITE, run_suite
from flysim.studies.suite.suites import Case, cases


@pytest.fixture
def ran(short, tmp_path):
    todo = [Case(name="short", seed=seed, scenario=str(short)) for seed in range(2)]
    todo.insert(1, Case(name="gone", seed=5, world=str(tmp_path / "gone.world")))
    told, home = [], tmp_path / "home"
    with growing([home], SUITE, {}, len(todo), "runs") as folder:
        result = run_suite(
            "mine", todo, ("flies", "bm"), folder, renderer="tiny", run=runner(2),
            progress=lambda what, share: told.append((what, share)),
        )  # fmt: skip
    return result, home, told


def test_a_suite(ran):
    result, home, told = ran
    data = json.loads((home / SUITE).read_text(encoding="utf-8"))
    assert data == {**json.loads(json.dumps(result.to_json())), "asked": {}, "complete": True, "done": 3, "of": 3}
    assert {"suite", "seeds", "engine", "runs", "worst", "failed", "renderer"} <= data.keys()
    assert data["failed"] == 1
    assert list(data["engine"]) == ["flies", "bm"]
    for figures in data["engine"].values():
        assert {
            *("f1", "precision", "recall", "center_error_m", "size_error_m", "size_error_rel", "surface_f"),
            *("ms_per_stop", "missed_big", "ci95", "runs"),
        } <= figures.keys()
        assert figures["runs"] == 2
    rows = [(row["scenario"], row["seed"], row["engine"], row["status"]) for row in data["runs"]]
    assert rows == [
        *(("short", 0, engine, "ok") for engine in ("flies", "bm")),
        ("gone", 5, None, "failed"),
        *(("short", 1, engine, "ok") for engine in ("flies", "bm")),
    ]
    assert "gone.world" in data["runs"][2]["error"]
    assert told[-1] == ("3 of 3", 1.0)

    # The light run folders of the worst.
    assert {row["folder"] for row in data["worst"]} == {str(home / "runs" / f"short-s{seed}") for seed in (0, 1)}
    reports = []
    for seed in range(2):
        folder = home / "runs" / f"short-s{seed}"
        assert {path.name for path in folder.iterdir()} == {"compare.json", "scenario.json", "reports", "figures"}
        reports.append(Report.from_json(json.loads((folder / "reports/flies.json").read_text(encoding="utf-8"))))
    assert not (home / "runs" / "gone-s5").exists()
    again = pooled(reports)
    assert data["engine"]["flies"]["f1"] == again["f1"]
    assert data["engine"]["flies"]["size_error_m"] == pytest.approx(again["size_error_m"], abs=1e-6)

    engines, worst, failed = result.sheets()
    assert [row[0] for row in engines.rows] == ["flies", "bm"]
    assert len(worst.rows) == 2
    assert failed.rows[0][:2] == ("gone", "5")


def test_what_a_suite_keeps_runs_again_to_the_digit_wherever_it_is_moved_to(ran, tmp_path, monkeypatch):
    _, home, _ = ran
    moved = (home / "runs/short-s1").rename(tmp_path / "moved")
    (tmp_path / "elsewhere").mkdir()
    monkeypatch.chdir(tmp_path / "elsewhere")
    told = json.loads((moved / "reports/flies.json").read_text(encoding="utf-8"))
    again = run(moved / "scenario.json", renderer="tiny", out="again").to_json()
    third = run("again/config.json", renderer="tiny").to_json()
    assert told["seed"] == 1
    for report in (told, again, third):
        for one in (report, *report["stops"]):
            del one["time_s"]
    assert json.loads(json.dumps(again)) == told
    assert third == again


def test_a_kept_scenario_names_what_lies_beside_it_by_its_place_there(tmp_path):
    plan = Case(name="random-easy-4", seed=4, difficulty="easy").plan(tmp_path / "run")
    kept = plan.kept(tmp_path / "run", 4)
    assert (kept["world"], kept["robot"], kept["seed"]) == ("random-easy-4/world.sdf", "rover", 4)
    (tmp_path / "run/scenario.json").write_text(json.dumps(kept), encoding="utf-8")
    moved = (tmp_path / "run").rename(tmp_path / "moved")
    again = read_scenario(str(moved / "scenario.json"))
    assert again.world_path == moved / "random-easy-4/world.sdf"
    changes = {"folder": plan.folder, "world": plan.world, "robot": plan.robot, "seed": plan.seed}
    changes["planning_s"] = plan.planning_s  # what is kept has been planned
    assert again.model_copy(update=changes) == plan
    (moved / "scenario.json").write_text("[3]", encoding="utf-8")
    with pytest.raises(ScenarioError, match=r"no scenario. Give the scenario.json"):
        read_scenario(str(moved / "scenario.json"))


def small_suite(home, todo, resume=False, progress=None):
    with growing([home], SUITE, {}, len(todo), "runs", resume=resume) as folder:
        run_suite("mine", todo, ("chance",), folder, renderer="tiny", run=runner(1), progress=progress)
    return json.loads((home / SUITE).read_text(encoding="utf-8"))


def without_times(data):
    if isinstance(data, dict):
        return {key: without_times(value) for key, value in data.items() if key not in ("ms_per_stop", "folder")}
    return [without_times(value) for value in data] if isinstance(data, list) else data


def test_a_suite_that_was_stopped_goes_on_and_is_as_if_it_never_had_been(short, tmp_path, monkeypatch):
    (tmp_path / "tmp").mkdir()
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path / "tmp"))
    todo = [Case(name="short", seed=seed, scenario=str(short)) for seed in range(2)]
    todo.insert(1, Case(name="gone", seed=5, world=str(tmp_path / "gone.world")))
    home = tmp_path / "home"

    def stop(what, _share):
        if what == "2 of 3":
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt) as stopped:
        small_suite(home, todo, progress=stop)
    assert "2 of 3 runs are kept" in stopped.value.__notes__[0]
    half = json.loads((home / SUITE).read_text(encoding="utf-8"))
    assert (half["complete"], half["done"], half["of"], half["failed"]) == (False, 2, 3, 1)
    assert [path.name for path in (home / "runs").iterdir()] == ["short-s0"]
    assert not list((tmp_path / "tmp").iterdir()) and not multiprocessing.active_children()
    told = []
    resumed = small_suite(home, todo, resume=True, progress=lambda what, _share: told.append(what))
    assert told == ["2 of 3", "3 of 3"]
    assert without_times(resumed) == without_times(small_suite(tmp_path / "other", todo))
    assert {path.name for path in (home / "runs").iterdir()} == {"short-s0", "short-s1"}


def test_a_run_whose_process_was_killed_gets_another_chance(short, tmp_path):
    todo = [Case(name="short", seed=0, scenario=str(short)), Case(name="short", seed=1, scenario=str(short))]
    home = tmp_path / "home"
    with growing([home], SUITE, {}, 2, "runs") as folder:
        rows = [{"scenario": "short", "seed": 0, "error": f"{DIED}its process died with exit code -9"}]
        folder.keep({"runs": rows}, 1)
    data = small_suite(home, todo, resume=True)
    assert (data["failed"], [row["status"] for row in data["runs"]]) == (0, ["ok", "ok"])


def test_the_cases_of_each_suite(tmp_path, monkeypatch):
    assert [(c.scenario, c.seed) for c in cases("paper", range(2))] == [
        (name, seed) for name in ("paper_a", "paper_b", "paper_c") for seed in (0, 1)
    ]
    medium = cases("random-medium")
    assert [case.seed for case in medium] == list(range(20))
    assert {(case.difficulty, case.path) for case in medium} == {("medium", "orbit")}
    for name in ("world_10.world.gz", "world_2.world", "LICENSE"):
        (tmp_path / name).touch()
    monkeypatch.setenv("FLYSIM_BARN", str(tmp_path))
    barn = cases("barn")
    assert [case.name for case in barn] == ["barn-world_2", "barn-world_10"]
    assert {case.texture for case in barn} == {"speckle"}
    assert cases("barn", None, tmp_path) == barn


def test_a_suite_of_ones_own(tmp_path, monkeypatch):
    (tmp_path / "my_suites.py").write_text(
        "from flysim.studies.suite.suites import Case\n"
        "def two(seeds, data):\n"
        "    return [Case(name='mine', seed=seed, scenario='paper_a') for seed in seeds or (8, 9)]\n"
        "def none(seeds, data):\n"
        "    return ['paper_a']\n"
    )
    monkeypatch.chdir(tmp_path)
    monkeypatch.syspath_prepend(tmp_path)
    assert [(case.name, case.seed) for case in cases("my_suites:two")] == [("mine", 8), ("mine", 9)]
    assert [case.seed for case in cases("my_suites:two", range(3))] == [0, 1, 2]
    with pytest.raises(ScenarioError, match="suite 'my_suites:none' gave no"):
        cases("my_suites:none")


def test_a_suite_that_is_not_there(tmp_path):
    with pytest.raises(ScenarioError, match=r"no suite 'random_medium'. Did you mean 'random-medium'\?"):
        cases("random_medium")
    with pytest.raises(ScenarioError, match="--data DIR"):
        cases("barn", None, tmp_path)
    with pytest.raises(ScenarioError, match="needs a seed"):
        cases("paper", range(0))


def test_a_generated_world_is_written_and_a_path_planned_through_it(tmp_path, monkeypatch):
    monkeypatch.setattr("flysim.runs.planned.world_scenario", lambda world, **rest: (world, rest))
    world, rest = Case(name="random-easy-4", seed=4, difficulty="easy").plan(tmp_path)
    assert world.is_relative_to(tmp_path / "random-easy-4") and world.is_file()
    assert rest == {"robot": "rover", "path": "orbit", "texture": None, "overrides": ()}
