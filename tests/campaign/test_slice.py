"""A minute of the campaign: `make campaign` runs all of it."""

import json
import subprocess
import sys
from pathlib import Path

import pytest

CAMPAIGN = Path(__file__).parent


def ran(*arguments, tmp_path):
    command = [sys.executable, str(CAMPAIGN), "--json", "--kept", str(tmp_path / "kept"), *arguments]
    done = subprocess.run(command, capture_output=True, text=True, check=False, timeout=280)
    assert done.stdout, done.stderr
    return json.loads(done.stdout)


def test_damaged_inputs_are_read_or_refused_in_one_line(tmp_path):
    found = ran("--inputs", "200", "--kills", "0", "--resets", "0", "--no-want", tmp_path=tmp_path)
    assert found["faults"] == []
    counts = found["damaged inputs"].values()
    assert sum(one["inputs"] for one in counts) >= 200
    assert all(one["read"] for one in counts)  # the sound one at least
    assert sum(one["refused"] for one in counts) > 50


@pytest.mark.skipif(not Path("/proc/self/environ").exists(), reason="there is no /proc here")
def test_killed_commands_leave_nothing(tmp_path):
    arguments = ("--kills", "4", "--only", "run,suite", "--inputs", "0", "--resets", "0", "--no-want")
    assert ran(*arguments, tmp_path=tmp_path)["faults"] == []
