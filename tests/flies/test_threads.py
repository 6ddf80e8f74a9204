"""The engine in several threads of one program: nobody waits for ever, nobody changes another's number of lanes."""

import os
import threading

import numpy as np
import pytest

from flysim.flies.threads import lanes, limited, share


def side_by_side(works):
    threads = [threading.Thread(target=work, daemon=True) for work in works]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join(60.0)
    assert not any(thread.is_alive() for thread in threads), "a thread hangs"


def counted(lane, taken, total, lock):
    """A kernel: takes numbers until there are no more, and adds them up."""
    while True:
        with lock:
            if taken[0] >= 50:
                return
            taken[0] += 1
            total[lane] += taken[0]


def test_threads_that_share_work_at_once_each_get_all_of_theirs():
    failures = []

    def work(count):
        for k in range(300):
            with limited(1 + (count + k) % 3):
                total = np.zeros(lanes(), np.int64)
                share(counted, np.zeros(1, np.int64), total, threading.Lock())
                if total.sum() != 50 * 51 // 2:
                    failures.append(total)

    side_by_side([lambda count=count: work(count) for count in range(4)])
    assert not failures


def test_a_limit_is_that_of_its_own_thread():
    before, inside, out = lanes(), threading.Event(), threading.Event()
    seen = []

    def narrow():
        with limited(1):
            inside.set()
            out.wait(10.0)

    def beside():
        inside.wait(10.0)
        seen.append(lanes())
        with limited(3):
            out.set()
            seen.append(lanes())
        seen.append(lanes())

    side_by_side([narrow, beside])
    assert seen == [before, 3, before]
    assert lanes() == before


@pytest.mark.skipif(not hasattr(os, "fork"), reason="there is no fork here")
@pytest.mark.filterwarnings("ignore:.*fork.*:DeprecationWarning")
def test_a_forked_child_has_threads_of_its_own():
    def work():
        total = np.zeros(2, np.int64)
        share(counted, np.zeros(1, np.int64), total, threading.Lock())
        return int(total.sum())

    with limited(2):
        work()
        child = os.fork()
        if child == 0:
            os._exit(0 if work() == 1275 else 1)
        assert os.waitpid(child, 0)[1] == 0


def test_an_error_in_a_kernel_comes_back_to_whoever_asked():
    def fails(lane):
        raise RuntimeError(f"lane {lane}")

    with limited(2), pytest.raises(RuntimeError, match="lane"):
        share(fails)
