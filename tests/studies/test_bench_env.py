"""`flysim bench env`: every observation is timed, and the parts of a step add up."""

import json

import pytest
from typer.testing import CliRunner

from flysim.cli.app import app
from flysim.studies.bench import env as bench_env


def test_the_command_prints_one_json_object(monkeypatch):
    monkeypatch.setattr(bench_env, "_together", lambda _steps: 1.8)
    result = CliRunner().invoke(app, ["bench", "env", "--steps", "20", "--json"])
    assert result.exit_code == 0, result.output
    data = json.loads(result.stdout)
    assert list(data["steps_per_second"]) == ["flies", "pixels", "truth", "sgbm"]
    assert all(rate > 0.0 for rate in data["steps_per_second"].values())
    assert all(rate > 0.0 for rate in data["steps_per_cpu_second"].values())
    assert data["render_share"] == pytest.approx(data["render_ms"] / data["step_ms"])
    assert data["over_floor"] == pytest.approx(data["step_ms"] / (data["render_ms"] + data["physics_ms"]))
