"""Jobs on a Ray cluster, told as `workers.finished` tells those of this machine's processes. The only user of Ray.

Ray does what a second machine needs: it finds workers, sends them jobs, notices when one dies and does its job again
elsewhere. A job and its result travel by value, so that no two machines need a folder in common.
"""

from __future__ import annotations

import contextlib
import importlib.util
import os
import socket
import sys
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Any

from flysim.common.workers import ONE_THREAD, Died, cores
from flysim.errors import FlysimError

LOCAL = "local"
KNOCK_S = 5.0  # [s] for a machine to answer
AGAIN = 3  # times that a job is done again whose worker died: a job that kills each worker ends all the same
QUIET = {  # Ray's, read when it is imported or started
    "RAY_ACCEL_ENV_VAR_OVERRIDE_ON_ZERO": "0",
    "RAY_USAGE_STATS_ENABLED": "0",
    "RAY_ENABLE_UV_RUN_RUNTIME_ENV": "0",
}


def refuse_without_ray() -> None:
    """Says at once what is missing.

    Raises:
        FlysimError: Ray is not installed.
    """
    if importlib.util.find_spec("ray") is None:
        raise FlysimError("--ray needs Ray: pip install 'flysim-testbed[cluster]'.")


@contextlib.contextmanager
def finished_on_ray(
    work: Callable[[Any], Any], jobs: Sequence[Any], *, address: str, processes: int | None = None
) -> Iterator[Iterator[tuple[int, Any]]]:
    """Yields what yields (index of a job, `work(job)`) as each is done, a `Died` where its workers died each time.

    At the end of the block Ray is left, and no job of it goes on.

    Args:
        work: a function of a module that the workers can import; it must not raise.
        jobs: what can be pickled.
        address: of a running cluster, as `ray.init` takes it ("auto", "10.0.0.1:6379"), or "local": one of this
            machine's own, which ends with the block.
        processes: workers of the local one; None takes one a core. A cluster has its own.

    Raises:
        FlysimError: no cluster at that address, or Ray is not installed.
    """
    refuse_without_ray()
    if not jobs:
        yield iter(())
        return
    os.environ.update({name: value for name, value in QUIET.items() if name not in os.environ})
    import ray

    _join(ray, address, processes)
    try:
        yield _results(ray, work, jobs)
    finally:
        ray.shutdown()


def _join(ray: Any, address: str, processes: int | None) -> None:
    # Workers import what this process can: flysim from a checkout, a user's own engine from the folder it is in.
    here = os.pathsep.join(
        dict.fromkeys(path or str(Path.cwd()) for path in sys.path if path == "" or Path(path).is_dir())
    )
    variables = {**ONE_THREAD}
    options: dict[str, Any] = {"log_to_driver": False, "configure_logging": False, "logging_level": "ERROR"}
    if address == LOCAL:
        options |= {"num_cpus": processes or cores(), "include_dashboard": False}
        variables["PYTHONPATH"] = here
    else:
        _refuse_unreachable(address)
        options["address"] = address
    try:
        ray.init(runtime_env={"env_vars": variables}, **options)
    except (ConnectionError, RuntimeError, ValueError, OSError) as error:
        first = str(error).strip().split("\n")[0]
        raise FlysimError(
            f"--ray {address}: no Ray cluster there: {first}. Start one by `ray start --head`."
        ) from error


def _refuse_unreachable(address: str) -> None:
    """Knocks at an address of the form host:port, where Ray itself would try for minutes."""
    host, colon, port = address.removeprefix("ray://").rpartition(":")
    if not colon:
        return
    try:
        with socket.create_connection((host.strip("[]"), int(port)), timeout=KNOCK_S):
            pass
    except (OSError, ValueError, OverflowError) as error:
        raise FlysimError(
            f"--ray {address}: no Ray cluster there: {error}. Start one by `ray start --head`."
        ) from error


def _results(ray: Any, work: Callable[[Any], Any], jobs: Sequence[Any]) -> Iterator[tuple[int, Any]]:
    task = ray.remote(num_cpus=1, max_retries=AGAIN)(work)
    index = {task.remote(job): k for k, job in enumerate(jobs)}
    left = list(index)
    while left:
        (done, *_), left = ray.wait(left, num_returns=1)
        k = index[done]
        try:
            result = ray.get(done)
        except ray.exceptions.RayTaskError:
            raise  # a fault of ours: `work` must not raise
        except ray.exceptions.RayError as error:
            result = Died(f"its workers died {AGAIN + 1} times: {str(error).strip().splitlines()[0]}")
        yield k, result
