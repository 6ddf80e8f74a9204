"""The command line as a process: exit codes, streams, signals, and a machine without room."""

import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
STOPPED = "flysim: stopped by Ctrl-C; nothing half-written is left.\n"
SIGNALS = {signal.SIGINT: "Ctrl-C", signal.SIGTERM: "SIGTERM", signal.SIGHUP: "SIGHUP"}
UNUSUAL = ("FORCE_COLOR", "PY_COLORS", "GITHUB_ACTIONS", "PYTHONUNBUFFERED")  # change what is written, or when


def started(arguments, folder, **more):
    path = os.pathsep.join(filter(None, (str(ROOT), os.environ.get("PYTHONPATH"))))
    environment = {key: value for key, value in os.environ.items() if key not in UNUSUAL} | {"PYTHONPATH": path}
    return subprocess.Popen(
        [sys.executable, *arguments],
        cwd=folder,
        env=environment,
        text=True,
        preexec_fn=usual_signals,
        **{"stdout": subprocess.PIPE, "stderr": subprocess.PIPE} | more,
    )


def usual_signals():
    """A shell that runs the tests in the background, or under nohup, has its children ignore some."""
    for one in SIGNALS:
        signal.signal(one, signal.SIG_DFL)


def flysim(*arguments, folder, **more):
    with started(["-m", "flysim", *map(str, arguments)], folder, **more) as process:
        out, err = process.communicate(timeout=200)
    return process.returncode, out, err


def test_what_is_asked_for_goes_to_stdout_and_complaints_to_stderr(tmp_path):
    code, out, err = flysim("list", "--json", folder=tmp_path)
    assert (code, err) == (0, "")
    assert "rover" in json.loads(out)["robots"]
    assert flysim("run", "papr_a", folder=tmp_path) == (
        2,
        "",
        "flysim: no scenario 'papr_a'. Did you mean 'paper_a'?\n",
    )
    assert not list(tmp_path.iterdir())


def test_stdout_holds_one_json_array_even_when_pybullet_has_something_to_say(tmp_path, short):
    robot = short.parent / "small.urdf"
    text = robot.read_text(encoding="utf-8")
    start, end = text.index("<inertial>", text.index('name="camera_left"')), "</inertial>"
    bare = text[:start] + text[text.index(end, start) + len(end) :]
    robot.write_text(bare, encoding="utf-8")  # pybullet warns of a link without inertia, on stdout
    code, out, err = flysim("run", short, "--json", "--out", "run", folder=tmp_path)
    assert (code, err) == (0, "")
    assert out.startswith("[\n")
    assert [report["scenario"] for report in json.loads(out)] == ["short"]


def test_the_completion_of_a_shell_is_a_script(tmp_path, monkeypatch):
    # As bash asks for it; --show-completion guesses the shell by its parent processes, which may be make's sh.
    monkeypatch.setenv("_FLYSIM_COMPLETE", "source_bash")
    code, out, err = flysim(folder=tmp_path)
    assert (code, err) == (0, "")
    assert "complete -o default -F" in out


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="there is no /dev/full here")
def test_an_output_that_takes_nothing_more(tmp_path):
    with Path("/dev/full").open("w") as full:
        code, _, err = flysim("list", folder=tmp_path, stdout=full)
    assert (code, err) == (2, "flysim: cannot read or write the output: No space left on device.\n")


def test_a_reader_that_goes_away_is_no_error_to_talk_about(tmp_path):
    read, write = os.pipe()
    os.close(read)
    _, _, err = flysim("list", folder=tmp_path, stdout=write)
    os.close(write)
    assert err == ""


@pytest.mark.parametrize("which", SIGNALS)
def test_what_stops_a_program_is_named_and_is_its_exit_code(tmp_path, which):
    body = f"os.kill(os.getpid(), {which:d}); time.sleep(0.2)"
    with started(
        ["-c", SCRIPT.format(before="", body="pass", after="").replace("pass\n", body + "\n", 1)], tmp_path
    ) as one:
        assert one.communicate(timeout=60) == ("", STOPPED.replace("Ctrl-C", SIGNALS[which]))
    assert one.returncode == 128 + which


def test_what_is_kept_is_told_in_the_same_line(tmp_path):
    body = """
    try:
        ctrl_c()
        time.sleep(3)
    except KeyboardInterrupt as stop:
        stop.add_note("3 of 8 runs are kept")
        sys.exit(130)
    """
    with started(["-c", SCRIPT.format(before="", body=body, after="")], tmp_path) as one:
        assert one.communicate(timeout=60) == ("", STOPPED.replace("left.", "left; 3 of 8 runs are kept."))


@pytest.mark.parametrize("which", [signal.SIGTERM, signal.SIGHUP])
def test_what_is_ignored_at_the_start_stays_ignored(tmp_path, which):
    before = f"signal.signal({which:d}, signal.SIG_IGN)"  # as nohup does
    with started(["-c", quick(before, f"os.kill(os.getpid(), {which:d})")], tmp_path) as one:
        assert one.communicate(timeout=60) == ("not interrupted\n", "")


def wait_for(what, process, limit=150.0):
    until = time.monotonic() + limit
    while not what():
        assert process.poll() is None, process.communicate()
        assert time.monotonic() < until
        time.sleep(0.02)


def loaded(process, library):
    def check():
        return library in Path(f"/proc/{process.pid}/maps").read_text(encoding="utf-8")

    return check


@pytest.mark.skipif(not Path("/proc/self/maps").exists(), reason="there is no /proc here")
@pytest.mark.parametrize("moment", ["loading", "driving", "writing"])
def test_ctrl_c_leaves_one_line_and_nothing_else(tmp_path, short, moment):
    folder = tmp_path / "here"
    folder.mkdir()
    process = started(["-m", "flysim", "run", str(short), "--out", "runs/mine"], folder)
    try:
        if moment == "writing":
            wait_for(lambda: list(folder.glob("runs/.mine.*.part/figures")), process)
        else:
            wait_for(loaded(process, "llvmlite" if moment == "loading" else "pybullet"), process)
            time.sleep(0.05 if moment == "loading" else 1.0)
        process.send_signal(signal.SIGINT)
        time.sleep(0.1)
        process.send_signal(signal.SIGINT)  # an impatient user does not cut the cleaning up short
        out, err = process.communicate(timeout=60)
    finally:
        process.kill()
    assert (process.returncode, out, err) == (130, "", STOPPED)
    assert not list(folder.iterdir())


SCRIPT = """
import os, signal, sys, time
from flysim.cli.interrupt import interruptible
def ctrl_c():
    os.kill(os.getpid(), signal.SIGINT)
    time.sleep(0.01)
{before}
with interruptible():
    {body}
    try:
        for _ in range(300):
            time.sleep(0.01)
    finally:
        for _ in range(20):
            time.sleep(0.01)  # cleaning up: what asks again meanwhile does not break it off
        {after}
print("not interrupted")
"""


LOST = {
    "raised": ("", "ctrl_c()"),
    "turned into an exit by typer": ("", "sys.exit(130)"),
    "in a finaliser": ("class Thing:\n    def __del__(self):\n        ctrl_c()", "thing = Thing(); del thing"),
    "in a callback from C": ("import ctypes\ncallback = ctypes.CFUNCTYPE(None)(ctrl_c)", "callback()"),
    "caught by somebody's except": (
        "def rude():\n    try:\n        ctrl_c()\n    except BaseException:\n        pass",
        "rude()",
    ),
}


@pytest.mark.parametrize("how", LOST)
def test_an_interrupt_is_never_lost(tmp_path, how):
    before, body = LOST[how]
    after = "sys.stdout.write('cleaned up')"
    with started(["-c", SCRIPT.format(before=before, body=body, after=after)], tmp_path) as process:
        out, err = process.communicate(timeout=60)
    assert (process.returncode, err) == (130, STOPPED)
    assert out in ("cleaned up", "")  # nothing to clean up where it came before the loop


def test_an_interrupt_waits_for_its_own_cleaning_up(tmp_path):
    script = SCRIPT.format(before="", body="pass", after="sys.stdout.write('cleaned up')")
    with started(["-c", script.replace("time.sleep(0.01)\n    finally", "ctrl_c()\n    finally")], tmp_path) as process:
        assert process.communicate(timeout=60) == ("cleaned up", STOPPED)
    assert process.returncode == 130


def test_the_import_system_is_not_interrupted(tmp_path):
    # An exception there would leave its lock held.
    before = "source = 'os.kill(os.getpid(), signal.SIGINT)\\nsys.stdout.write(\"whole\")\\nsys.stdout.flush()'"
    body = 'exec(compile(source, "<frozen importlib._bootstrap>", "exec"))'
    with started(["-c", SCRIPT.format(before=before, body=body, after="")], tmp_path) as process:
        assert process.communicate(timeout=60) == ("whole", STOPPED)
    assert process.returncode == 130


def quick(before, body):
    return SCRIPT.format(before=before, body=body, after="").replace("300", "3")


def test_where_ctrl_c_is_ignored_it_stays_ignored(tmp_path):
    with started(["-c", quick("signal.signal(signal.SIGINT, signal.SIG_IGN)", "ctrl_c()")], tmp_path) as process:
        assert process.communicate(timeout=60) == ("not interrupted\n", "")


def test_other_things_that_python_cannot_raise_are_still_printed(tmp_path):
    before = "class Thing:\n    def __del__(self):\n        raise ValueError('mine')"
    with started(["-c", quick(before, "thing = Thing(); del thing")], tmp_path) as process:
        out, err = process.communicate(timeout=60)
    assert "ValueError: mine" in err
    assert (process.returncode, out) == (0, "not interrupted\n")
