"""flysim where something is missing: room on the disk, a home, a writable package, an EGL driver, memory, quiet."""

from __future__ import annotations

import os
import resource
import shutil
import subprocess
import sys
from collections import Counter
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from tempfile import mkdtemp

from watch import ROOT, Room

FEW = ("--set", "flies.population=1000")
STOPS = ("--set", "stops=[{x = 1.629, y = -1.224, yaw_deg = 65}, {x = 1.735, y = -0.997, yaw_deg = 65}]")
RUN = ("run", "paper_c", *STOPS, *FEW)
COLUMNS = ("starts", "done", "refused", "crashes", "hangs", "tracebacks", "leftovers")
DROP = ("setpriv", "--reuid=65534", "--regid=65534", "--clear-groups", "--inh-caps=-all")  # a user of no rights
NO_EGL = {"__EGL_VENDOR_LIBRARY_FILENAMES": "/nonexistent"}


def starve(told: Callable[[int], None]) -> dict[str, Counter[str]]:
    """Starts flysim in every kind of want; a counter a kind."""
    found: dict[str, Counter[str]] = {}
    for number, (name, want) in enumerate(WANTS.items()):
        place = Path(mkdtemp(prefix="campaign-"))
        place.chmod(0o755)
        try:
            found[name] = want(Room(place))
        finally:
            shutil.rmtree(place, ignore_errors=True)
        told(number + 1)
    return found


def judged(room: Room, started: list[subprocess.Popen[str]], *, refusable: bool) -> Counter[str]:
    """What became of some starts: done, refused in one line, or worse."""
    found: Counter[str] = Counter(starts=len(started))
    for process in started:
        try:
            _, error = process.communicate(timeout=300.0)
        except subprocess.TimeoutExpired:
            process.kill()
            process.communicate()
            found["hangs"] += 1
            continue
        lines = error.splitlines()
        if process.returncode == 0:
            found["done"] += 1
        elif refusable and process.returncode == 2 and len(lines) == 1 and lines[0].startswith("flysim: "):
            found["refused"] += 1
        elif "Traceback" in error:
            found["tracebacks"] += 1
            found[f"! {error[-600:]}"] += 1
        else:
            found["crashes"] += 1
            found[f"! exit code {process.returncode}: {error[-600:]}"] += 1
    room.orphans()
    litter = room.litter()
    if litter:
        found["leftovers"] += len(litter)
        found[f"! left: {litter[:3]}"] += 1
    return found


@contextmanager
def small_disk(place: Path) -> Iterator[Path | None]:
    """A folder with room for 200 kB; None where this user may not mount one."""
    place.mkdir()
    mounted = subprocess.run(
        ["mount", "-t", "tmpfs", "-o", "size=200k", "none", place], capture_output=True, check=False
    )
    try:
        yield place if mounted.returncode == 0 else None
    finally:
        if mounted.returncode == 0:
            subprocess.run(["umount", "-l", place], check=False)


def little_room() -> None:
    """No file of more than 100 kB, which Python tells of as of a full disk."""
    resource.setrlimit(resource.RLIMIT_FSIZE, (100_000, 100_000))


def full_disk(room: Room) -> Counter[str]:
    """The run folder is on a full disk."""
    with small_disk(room.folder / "disk") as disk:
        before = None if disk else little_room
        return judged(room, [room.start((*RUN, "--out", "disk/run"), before=before)], refusable=True)


def full_temporary(room: Room) -> Counter[str]:
    """The folder for temporary files is on a full disk."""
    with small_disk(room.folder / "disk") as disk:
        if disk is None:
            return Counter()
        (disk / "full").write_bytes(bytes(150_000))
        return judged(room, [room.start((*RUN, "--renderer", "tiny"), TMPDIR=str(disk))], refusable=True)


def no_home(room: Room) -> Counter[str]:
    """HOME names nothing."""
    return judged(room, [room.start(RUN, HOME="/nonexistent", XDG_CACHE_HOME="")], refusable=False)


def other_user(room: Room) -> Counter[str]:
    """Somebody who may write neither the package nor a home: as in a container that root built."""
    if os.geteuid() != 0 or not shutil.which("setpriv"):
        return Counter()
    started = ("import subprocess, sys", "sys.exit(subprocess.run([sys.executable, '-c', '']).returncode)")
    if subprocess.run([*DROP, sys.executable, "-c", "; ".join(started)], capture_output=True, check=False).returncode:
        return Counter()  # an interpreter in somebody's home, which nobody else may run
    os.chown(room.folder, 65534, 65534)
    os.chown(room.temporary, 65534, 65534)
    program = (*DROP, sys.executable, "-m", "flysim")
    return judged(room, [room.start(RUN, program=program, HOME="/nonexistent", XDG_CACHE_HOME="")], refusable=False)


def no_egl(room: Room) -> Counter[str]:
    """No EGL driver: `auto` draws by `tiny`."""
    nav = ("nav", "straight", "--worlds", "yard", "--episodes", "1", "--observation", "flies")
    return judged(room, [room.start(words, **NO_EGL) for words in (RUN, nav)], refusable=False)


def little_memory(room: Room) -> Counter[str]:
    """An address space of 1.5 to 4 GB."""

    def limit(megabytes: int) -> Callable[[], None]:
        return lambda: resource.setrlimit(resource.RLIMIT_AS, (megabytes << 20, megabytes << 20))

    started = []
    for megabytes in (1500, 2000, 3000, 4000):
        started.append(room.start((*RUN, "--out", f"run-{megabytes}"), before=limit(megabytes)))
        started[-1].wait()
    return judged(room, started, refusable=True)


def side_by_side(room: Room) -> Counter[str]:
    """Runs of one second in a folder that is not there yet: each has a folder of its own."""
    found = judged(room, [room.start((*RUN, "--seed", str(seed % 2))) for seed in range(4)], refusable=False)
    folders = [path for path in (room.folder / "runs/out").glob("*") if (path / "report.json").is_file()]
    if len(folders) != 4:
        found["crashes"] += 1
        found[f"! {len(folders)} folders of 4 runs"] += 1
    return found


def long_path(room: Room) -> Counter[str]:
    """A folder of odd and long names."""
    deep = room.folder / ("ä b'c%n" * 12) / "[bold]" / ("d" * 150)
    deep.mkdir(parents=True)
    return judged(room, [room.start((*RUN, "--out", str(deep / "run")))], refusable=True)


WANTS: dict[str, Callable[[Room], Counter[str]]] = {
    "full disk": full_disk,
    "full temporary folder": full_temporary,
    "no home": no_home,
    "read-only package, other user": other_user,
    "no EGL": no_egl,
    "small address space": little_memory,
    "four runs at once": side_by_side,
    "odd and long folder": long_path,
}
assert ROOT.is_dir()
