"""Opening a recording in rerun's viewer, as a window or as a page in the browser."""

from __future__ import annotations

import contextlib
import http.server
import importlib.util
import os
import shutil
import signal
import socket
import subprocess
import sys
import threading
import time
import urllib.error
import urllib.parse
import urllib.request
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager
from dataclasses import dataclass, replace
from pathlib import Path

from flysim.common.lifeline import Lifeline
from flysim.errors import RecordError
from flysim.record.recorder import RECORDING

_HOST = "127.0.0.1"  # nobody else's machine
_START = 20.0  # [s] a viewer that does not answer by then has failed
_END = 5.0  # [s] to end politely


@dataclass(frozen=True, slots=True, kw_only=True)
class Viewer:
    """A viewer that runs.

    Attributes:
        process: its process: a guard that ends as the viewer does, and ends the viewer with us.
        url: the page to open, or where a window listens; None for a window on a file.
    """

    process: subprocess.Popen[bytes]
    url: str | None

    def wait(self) -> int:
        """Block until it ends, and return its exit status."""
        return self.process.wait()


def view_command(
    folder: Path, *, web: bool = False, web_port: int | None = None, data_port: int | None = None
) -> tuple[list[str], str | None]:
    """The command that opens a run's recording, and the page it serves (None for a window).

    Args:
        folder: the run folder.
        web: serve a page instead of opening a window.
        web_port: port of the page; any free one by default.
        data_port: port of the recording behind the page or the window; any free one by default.

    Raises:
        RecordError: there is no recording, no viewer, no screen, or a port is taken.
    """
    recording = (folder / RECORDING).resolve()
    if not web and not has_screen():
        raise RecordError("no screen to open a window on: use `--web` and open the page it names")
    if not recording.is_file():
        raise RecordError(f"{folder} has no {RECORDING}: give a folder that `flysim run` wrote")
    command, data_port = [_program(), "--bind", _HOST], _port(data_port)
    if not web:
        return [*command, "--port", str(data_port), str(recording)], None
    web_port = _port(web_port)
    # rerun 0.41 keeps a core busy while it serves a file: it serves the page, flysim the file.
    data = f"http://{_HOST}:{data_port}/{RECORDING}"
    command += ["--serve-web", "--web-viewer-port", str(web_port), data]
    return command, f"http://{_HOST}:{web_port}/?url={urllib.parse.quote(data, safe='')}"


@contextlib.contextmanager
def open_viewer(
    folder: Path, *, web: bool = False, web_port: int | None = None, data_port: int | None = None
) -> Iterator[Viewer]:
    """Run the viewer on a run's recording, and end it with everything it started when the block ends.

    A page is served when the block begins.

    Raises:
        RecordError: as `view_command`; or the viewer ended at once.
    """
    command, url = view_command(folder, web=web, web_port=web_port, data_port=data_port)
    with contextlib.ExitStack() as stack:
        if url is not None:
            stack.enter_context(_served(folder / RECORDING, url))
        yield stack.enter_context(_running(command, url))


@contextlib.contextmanager
def open_live() -> Iterator[Viewer]:
    """A window that shows what is logged to its `url`, until the block ends.

    Raises:
        RecordError: no viewer, or it ended at once.
    """
    port = _port(None)
    with _running([_program(), "--bind", _HOST, "--port", str(port)], None) as viewer:
        _await(viewer.process, f"port {port}", lambda: socket.create_connection((_HOST, port), timeout=1.0))
        yield replace(viewer, url=f"rerun+http://{_HOST}:{port}/proxy")


def has_screen() -> bool:
    """Whether there is a screen to open a window on, as far as one can tell."""
    return sys.platform != "linux" or bool({"DISPLAY", "WAYLAND_DISPLAY"} & os.environ.keys())


@contextlib.contextmanager
def _served(recording: Path, url: str) -> Iterator[None]:
    """Give the one file to the page at `url`, and to no other site that the browser has open."""
    page = urllib.parse.urlsplit(url)
    source = urllib.parse.urlsplit(urllib.parse.parse_qs(page.query)["url"][0])

    class Handler(http.server.BaseHTTPRequestHandler):
        def do_GET(self) -> None:
            if self.path != source.path:
                self.send_error(404)
                return
            data = recording.read_bytes()
            self.send_response(200)
            self.send_header("Access-Control-Allow-Origin", f"http://{page.netloc}")
            self.send_header("Content-Type", "application/octet-stream")
            self.send_header("Content-Length", str(len(data)))
            self.end_headers()
            self.wfile.write(data)

        def log_message(self, format: str, *args: object) -> None:
            """Say nothing: only the command line prints."""

    class Server(http.server.ThreadingHTTPServer):
        daemon_threads = True

        def handle_error(self, request: object, client_address: object) -> None:
            """A browser that goes away mid-file is no error."""

    try:
        server = Server((_HOST, source.port or 0), Handler)
    except OSError as error:
        raise RecordError(f"port {source.port} cannot be used: {error}. Try again") from error
    thread = threading.Thread(target=server.serve_forever, name="flysim-recording", daemon=True)
    thread.start()
    try:
        yield
    finally:
        server.shutdown()
        server.server_close()
        thread.join()


@contextlib.contextmanager
def _running(command: list[str], url: str | None) -> Iterator[Viewer]:
    # rerun sends no usage statistics where CI is set.
    quiet, line = {**os.environ, "CI": "1", "RUST_LOG": "error"}, Lifeline()
    process = line.start_guarded(command, env=quiet, stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL)
    try:
        if url is not None:
            _await(process, url, lambda: urllib.request.urlopen(url, timeout=1.0))
        yield Viewer(process=process, url=url)
    finally:
        _end(process)
        line.cut()


def _program() -> str:
    """The viewer itself. The `rerun` script beside it only starts it, and would not pass on the end."""
    package = importlib.util.find_spec("rerun_cli")
    for place in package.submodule_search_locations or () if package else ():
        program = Path(place) / "rerun"
        if os.access(program, os.X_OK):
            return str(program)
    program = shutil.which("rerun")
    if program is None:
        raise RecordError("the rerun viewer is not installed: `pip install rerun-sdk`")
    return program


def _port(port: int | None) -> int:
    """A port that is free now: the given one or any."""
    with socket.socket() as probe:
        probe.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        try:
            probe.bind((_HOST, port or 0))
        except (OSError, OverflowError) as error:
            raise RecordError(f"port {port} cannot be used: {error}. Give another, or none for a free one") from error
        return probe.getsockname()[1]


def _await(process: subprocess.Popen[bytes], what: str, ask: Callable[[], AbstractContextManager[object]]) -> None:
    """Waits until the viewer serves `what`, which opens by `ask`."""
    until = time.monotonic() + _START
    while time.monotonic() < until:
        if process.poll() is not None:
            raise RecordError(f"the rerun viewer ended at once with status {process.returncode}: see its words above")
        with contextlib.suppress(urllib.error.URLError, OSError), ask():
            return
        time.sleep(0.05)
    raise RecordError(f"the rerun viewer did not serve {what} within {_START:.0f} s: try again, or another port")


def _end(process: subprocess.Popen[bytes]) -> None:
    for word in (signal.SIGTERM, signal.SIGKILL):
        with contextlib.suppress(ProcessLookupError):
            os.killpg(process.pid, word)
        with contextlib.suppress(subprocess.TimeoutExpired):
            process.wait(timeout=_END)
            return
