import io
import os
import shutil
import signal
import socket
import subprocess
import sys
import time
import urllib.error
import urllib.parse
import urllib.request

import numpy as np
import pytest
from PIL import Image

from flysim.errors import RecordError
from flysim.record.recording import write_recording
from flysim.record.viewer import open_viewer, view_command


@pytest.fixture(scope="module")
def folder(tmp_path_factory, findings, truth, report):
    folder = tmp_path_factory.mktemp("run")
    write_recording(folder / "recording.rrd", findings, truth, report)
    return folder


def test_a_folder_without_a_recording_is_one_line(tmp_path):
    with pytest.raises(RecordError, match="has no recording") as error:
        view_command(tmp_path, web=True)
    assert "\n" not in str(error.value)


def test_a_window_needs_a_screen(folder, monkeypatch):
    if sys.platform != "linux":
        pytest.skip("only Linux tells by its environment")
    monkeypatch.delenv("DISPLAY", raising=False)
    monkeypatch.delenv("WAYLAND_DISPLAY", raising=False)
    with pytest.raises(RecordError, match="--web"):
        view_command(folder)
    monkeypatch.setenv("DISPLAY", ":0")
    command, url = view_command(folder)
    assert command[-1].endswith("recording.rrd") and "--serve-web" not in command and url is None
    assert command[command.index("--bind") + 1] == "127.0.0.1"


def test_a_taken_port_is_one_line(folder):
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        taken.listen()
        port = taken.getsockname()[1]
        with pytest.raises(RecordError, match=f"port {port} cannot be used"):
            view_command(folder, web=True, web_port=port)
    with pytest.raises(RecordError, match="port 99999 cannot be used"):
        view_command(folder, web=True, web_port=99999)


def test_the_page_is_served_on_this_machine_alone_and_ends_with_the_block(folder, tmp_path, monkeypatch):
    monkeypatch.setenv("HOME", str(tmp_path))
    monkeypatch.delenv("XDG_CONFIG_HOME", raising=False)
    with open_viewer(folder, web=True) as viewer:
        assert viewer.url is not None and viewer.url.startswith("http://127.0.0.1:")
        with urllib.request.urlopen(viewer.url, timeout=10) as page:
            assert b"<canvas" in page.read()
        data = urllib.parse.parse_qs(urllib.parse.urlsplit(viewer.url).query)["url"][0]
        with urllib.request.urlopen(data, timeout=10) as file:
            assert file.headers["Access-Control-Allow-Origin"] == viewer.url.split("/?")[0]
            assert file.read() == (folder / "recording.rrd").read_bytes()
        with pytest.raises(urllib.error.HTTPError, match="404"):
            urllib.request.urlopen(data.replace("recording.rrd", "report.json"), timeout=10)
    assert viewer.process.poll() is not None
    for gone in (viewer.url, data):
        with pytest.raises(urllib.error.URLError):
            urllib.request.urlopen(gone, timeout=2)
    assert list(tmp_path.rglob("*")) == []  # no usage statistics were set up


@pytest.mark.parametrize("which", [signal.SIGINT, signal.SIGKILL])
def test_whatever_ends_us_ends_the_viewer_too(folder, which):
    code = "import signal, sys; from pathlib import Path; from flysim.record.viewer import open_viewer\n"
    code += "signal.signal(signal.SIGINT, signal.default_int_handler)\n"  # ignored by whatever a shell runs behind it
    code += "with open_viewer(Path(sys.argv[1]), web=True) as v: print(v.process.pid, flush=True); v.wait()"
    ours = subprocess.Popen(
        [sys.executable, "-c", code, str(folder)],
        stdout=subprocess.PIPE,
        stderr=subprocess.DEVNULL,
        text=True,
    )
    assert ours.stdout is not None
    viewer = int(ours.stdout.readline())
    os.killpg(viewer, 0)
    ours.send_signal(which)
    ours.wait(timeout=10)
    ours.stdout.close()
    until = time.monotonic() + (30.0 if which == signal.SIGKILL else 0.0)
    while is_there(viewer) and time.monotonic() < until:
        time.sleep(0.05)
    assert not is_there(viewer)


def is_there(group):
    try:
        os.killpg(group, 0)
    except ProcessLookupError:
        return False
    return True


def started(webdriver, options, driver):
    """Chrome under its driver. The driver's port is chosen before it is taken: somebody may have come first."""
    exceptions = pytest.importorskip("selenium.common.exceptions")
    for attempt in range(3):
        try:
            return webdriver.Chrome(options=options, service=webdriver.ChromeService(executable_path=driver))
        except exceptions.WebDriverException:
            if attempt == 2:
                raise
    raise AssertionError


def test_a_browser_shows_the_recording(folder):
    """The one test that sees what a user sees. Software WebGL takes 20 s on two idle cores."""
    webdriver = pytest.importorskip("selenium.webdriver")
    browser, driver = shutil.which("chromium") or shutil.which("google-chrome"), shutil.which("chromedriver")
    if browser is None or driver is None:
        pytest.skip("chromium and chromedriver are not installed")
    options = webdriver.ChromeOptions()
    options.binary_location = browser
    for flag in ("--headless=new", "--no-sandbox", "--disable-dev-shm-usage", "--window-size=640,480"):
        options.add_argument(flag)
    options.add_argument("--use-angle=swiftshader")
    options.add_argument("--enable-unsafe-swiftshader")
    with open_viewer(folder, web=True) as viewer, started(webdriver, options, driver) as chrome:
        chrome.get(viewer.url)
        until = time.monotonic() + 180.0
        colours, picture = 0, np.zeros((1, 1, 3), int)
        while colours < 4000 and time.monotonic() < until:
            time.sleep(1.0)
            picture = np.asarray(Image.open(io.BytesIO(chrome.get_screenshot_as_png())).convert("RGB"), int)
            colours = len(np.unique(picture @ (1, 256, 65536)))
        # The loading page has a dozen colours; images, flies and shaded bodies have thousands.
        assert colours >= 4000, f"{colours} colours after 180 s"
        background = (np.abs(picture - 247).max(axis=2) <= 2).mean()
        assert background > 0.02  # the world's view is up, on the light ground the blueprint gives it
