"""Who does the jobs of a study, a suite or a trial: processes of this machine, or a Ray cluster's."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import AbstractContextManager
from functools import partial
from typing import Any, TypeAlias

from flysim.common.workers import cores, finished

# Takes a function of a module, which must not raise, and jobs that can be pickled. In a `with` block it yields what
# yields (index of a job, its result) as each is done, and a `workers.Died` in place of a result that was lost.
Runner: TypeAlias = Callable[[Callable[[Any], Any], Sequence[Any]], AbstractContextManager[Iterator[tuple[int, Any]]]]


def runner(processes: int | None = None, ray: str | None = None) -> Runner:
    """The runner that two options of a command ask for.

    Args:
        processes: that share the work on this machine; None takes one a core.
        ray: the address of a Ray cluster, or "local" for one of this machine's that lives as long as the work; None
            does without Ray.

    Raises:
        FlysimError: Ray is asked for and not installed.
    """
    if ray is None:
        return partial(finished, processes=processes or cores())
    from flysim.common.on_ray import finished_on_ray, refuse_without_ray

    refuse_without_ray()
    return partial(finished_on_ray, address=ray, processes=processes)
