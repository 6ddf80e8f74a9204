import os
import subprocess
import sys
import threading
from pathlib import Path

from flysim.geometry.frames import Pose2
from flysim.sim.simulation import Simulation

ROOT = Path(__file__).resolve().parents[2]  # a checkout that is not installed runs from there


def run(source):
    return subprocess.run(
        [sys.executable, "-c", source], capture_output=True, text=True, cwd=ROOT, timeout=100, check=False
    )


def test_pybullet_comes_without_its_greeting_and_takes_nobody_elses_words_along():
    plain = run("import pybullet")
    assert "pybullet build time" in plain.stderr  # else there is nothing to drop
    done = run(
        "import os, threading\n"
        "done, lines = threading.Event(), [0]\n"
        "def talk():\n"
        "    while not done.is_set():\n"
        "        for stream in (1, 2):\n"
        "            os.write(stream, b'word\\n')\n"
        "        lines[0] += 1\n"
        "thread = threading.Thread(target=talk)\n"
        "thread.start()\n"
        "import flysim.sim.bullet\n"
        "done.set()\n"
        "thread.join()\n"
        "os.write(1, b'%d' % lines[0])\n"
    )
    words = done.stdout.splitlines()
    assert int(words[-1]) == len(words) - 1 > 10
    assert done.stderr == "word\n" * (len(words) - 1)


def test_a_process_without_streams_imports_it():
    done = run("import os\nos.close(1)\nos.close(2)\nimport flysim.sim.bullet\n")
    assert (done.returncode, done.stdout, done.stderr) == (0, "", "")


def test_simulations_in_threads_leave_the_output_where_it_was(made, capfd):
    before = [os.fstat(stream).st_ino for stream in (1, 2)]
    poses, errors = [], []

    def build():
        try:
            for _ in range(6):
                with Simulation(made.world(), made.rover, Pose2(0.0, 0.0, 0.0)) as simulation:
                    poses.append(simulation.T_world_base().tobytes())
        except BaseException as error:  # a thread's error is nobody's
            errors.append(error)

    threads = [threading.Thread(target=build) for _ in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert not errors
    assert len(poses) == 24
    assert len(set(poses)) == 1
    os.write(1, b"still here")
    assert [os.fstat(stream).st_ino for stream in (1, 2)] == before
    assert capfd.readouterr() == ("still here", "")
