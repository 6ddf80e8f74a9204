"""A window that follows an episode: opened where there is a screen, and ended with whoever opened it."""

import os
import sys

import numpy as np
import pytest
import rerun

from flysim.errors import RecordError
from flysim.geometry.frames import Pose2
from flysim.record import viewer
from flysim.record.live import LiveView


@pytest.fixture
def moment(findings):
    """What is shown of one moment."""
    return 0.0, findings.seen[0].frame.pair, np.zeros((3, 3)), np.ones((4, 2)), Pose2(0.0, 0.0, 0.0), (1.0, 2.0)


@pytest.fixture
def window(monkeypatch, tmp_path):
    """In place of a window a server without one, which writes down its process and its arguments."""
    program = tmp_path / "viewer"
    program.write_text(
        f'#!/bin/sh\necho $$ "$@" > {tmp_path}/started\nexec {viewer._program()} --serve-grpc "$@"\n', encoding="utf-8"
    )
    program.chmod(0o755)
    monkeypatch.setattr(viewer, "_program", lambda: str(program))
    monkeypatch.setattr(rerun, "get_global_data_recording", lambda: None)
    monkeypatch.setenv("DISPLAY", ":0")
    return tmp_path / "started"


def alive(pid):
    try:
        os.kill(pid, 0)
    except ProcessLookupError:
        return False
    return True


def test_a_window_ends_with_its_view_and_listens_here_alone(window, moment):
    first, second = LiveView(), None
    try:
        assert first.watched
        first.show(*moment)
        pid, *arguments = window.read_text().split()
        assert arguments[arguments.index("--bind") + 1] == "127.0.0.1"
        assert alive(int(pid))
        second = LiveView()  # another environment's, on a port of its own
        other, *_ = window.read_text().split()
        first.close()
        first.close()
        assert not alive(int(pid))
        assert not first.watched
        first.show(*moment)  # whose window is gone goes on driving
        assert second.watched and alive(int(other))
    finally:
        for view in (first, second):
            if view is not None:
                view.close()
    assert not alive(int(other))


def test_a_forgotten_view_leaves_no_window(window):
    view = LiveView()
    pid = int(window.read_text().split()[0])
    del view
    assert not alive(pid)


def test_a_viewer_that_ends_at_once_is_one_line(window, monkeypatch):
    monkeypatch.setattr(viewer, "_program", lambda: "/bin/false")
    with pytest.raises(RecordError, match="ended at once with status 1"):
        LiveView()


@pytest.mark.skipif(sys.platform != "linux", reason="only Linux tells by its environment")
def test_without_a_screen_nothing_is_opened(window, moment, monkeypatch):
    monkeypatch.delenv("DISPLAY")
    monkeypatch.delenv("WAYLAND_DISPLAY", raising=False)
    view = LiveView()
    assert not view.watched
    view.show(*moment)
    view.close()
    assert not window.exists()
