"""Jobs on processes that may die."""

import multiprocessing
import os

from flysim.common.workers import Died, finished


def double(job):
    if job == "die":
        os._exit(7)
    return os.environ["NUMBA_NUM_THREADS"], 2 * job


def test_a_process_that_dies_takes_its_own_job_alone():
    jobs = [1, "die", 3, "die", 5]
    with finished(double, jobs, 2) as found:
        results = dict(found)
    assert {i: results[i] for i in (0, 2, 4)} == {0: ("1", 2), 2: ("1", 6), 4: ("1", 10)}
    for i in (1, 3):
        assert isinstance(results[i], Died)
        assert "exit code 7" in str(results[i])
    with finished(double, [], 2) as found:
        assert list(found) == []


def test_whoever_stops_listening_leaves_no_process():
    with finished(double, list(range(8)), 2) as found:
        next(found)
    assert multiprocessing.active_children() == []
