"""Room for pictures: used again where nobody looks any more, and nowhere else."""

import threading
import weakref

import numpy as np
import pytest

from flysim.compute.rooms import MOST, room

SHAPE = (7, 13, 3)  # of no other test


def place(array):
    return array.__array_interface__["data"][0]


def test_what_somebody_holds_is_nobody_elses():
    held = [room(*SHAPE) for _ in range(2 * MOST)]
    assert len({place(array) for array in held}) == 2 * MOST


@pytest.mark.parametrize("part", [lambda a: a[2:, 1:], lambda a: a.reshape(-1), memoryview, lambda a: a.view(np.int8)])
def test_who_holds_a_part_holds_it_all(part):
    array = room(*SHAPE)
    array[:] = 5
    kept = part(array)
    del array
    others = [room(*SHAPE) for _ in range(3)]
    for other in others:
        other[:] = 9
    assert (np.asarray(kept) == 5).all()


def test_what_nobody_holds_is_handed_out_again():
    array = room(11, 17, 3)
    before = weakref.ref(array)
    del array
    assert before() is not None, "it is kept for whoever comes next"
    assert room(12, 17, 3).shape == (12, 17, 3)
    assert room(11, 17, 3) is before()


def test_no_more_is_kept_than_a_pair_needs():
    kept = [weakref.ref(room(3, 5 + k)) for k in range(MOST + 5)]
    assert [ref() is None for ref in kept] == [True] * 5 + [False] * MOST


def test_threads_never_get_the_same_room_at_once():
    failures = []

    def work(number):
        for _ in range(400):
            array = room(5, 3)
            array[:] = number
            if not (array == number).all():
                failures.append(number)
            del array

    threads = [threading.Thread(target=work, args=(number,)) for number in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert not failures
