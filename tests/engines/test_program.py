"""Programs as engines: what they get, what becomes of what they leave, and that none of them is in the way for long."""

import os
import signal
import time
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from flysim.engines.choose import ENGINES, engine
from flysim.engines.disparity import disparity_swarm
from flysim.engines.engine import alone
from flysim.errors import EngineError, ScenarioError
from flysim.flies.parameters import FlyParams
from flysim.foreign.disparity import pfm, png16
from flysim.geometry.read_pair import read_pair
from flysim.products.tables import ply
from flysim.runs.scenario import make_scenario

PARAMS = FlyParams(population=500)


def program(folder, text, name="matcher"):
    path = folder / name
    path.write_text(f"#!/bin/sh\n{text}\n", encoding="ascii")
    path.chmod(0o755)
    return path


def see(scene, command, *, params=PARAMS):
    return alone(engine(f"exec:{command}"), scene.pair, params, rng=np.random.default_rng(0))


def asked(path):
    return f"{path} {{left}} {{right}} {{calib}} {{out}}"


def test_it_gets_the_pair_and_its_calibration(scene, tmp_path):
    kept = tmp_path / "kept"
    kept.mkdir()
    script = program(tmp_path, f'cp "$1" "$2" "$3" {kept}; echo "$5" > {kept}/ndisp; cp "{tmp_path}/map" "$4"')
    (tmp_path / "map").write_bytes(pfm(scene.disparity))
    see(scene, f"{asked(script)} {{ndisp}}")
    pair = read_pair(kept / "left.png", kept / "right.png", calib=kept / "calib.txt")
    assert np.array_equal(pair.left, scene.pair.left) and np.array_equal(pair.right, scene.pair.right)
    assert pair.rig.left == scene.pair.rig.left
    np.testing.assert_allclose(pair.rig.T_right_left, scene.pair.rig.T_right_left, rtol=1e-15)
    rig = scene.pair.rig
    assert int((kept / "ndisp").read_text()) == np.ceil(rig.left.fx * rig.baseline / PARAMS.min_depth) + 1


@pytest.mark.parametrize("kind", ["pfm", "npy", "png"])
def test_a_map_becomes_points_where_they_are(scene, tmp_path, kind):
    path = tmp_path / f"map.{kind}"
    known = np.where(np.isfinite(scene.disparity), scene.disparity, 0.0).astype(np.float32)
    if kind == "pfm":
        path.write_bytes(pfm(known))
    elif kind == "npy":
        np.save(path, known)
    else:
        png16(np.round(known * 256.0).astype(np.uint16)).save(path)
    script = program(tmp_path, f'cp "{path}" "$4.{kind}"')
    swarm = see(scene, asked(script))
    expected = disparity_swarm(scene.pair, PARAMS, np.where(known > 0.0, known, np.nan), name="the program")
    assert len(swarm.points) > 200
    if kind != "png":
        assert np.array_equal(swarm.points, expected.points)
    off = swarm.uv[:, 0] - swarm.uv_right[:, 0] - known[tuple(np.rint(swarm.uv).astype(int).T[::-1])]
    assert np.abs(off).max() <= 0.5 / 256.0 + 1e-4


def test_points_in_a_ply_do_as_well(scene, tmp_path):
    v, u = (at.ravel() for at in np.mgrid[2:238:3, 2:318:3])
    there = np.isfinite(scene.disparity[v, u])
    uv = np.stack([u, v], axis=1)[there]
    rig = scene.pair.rig
    points = rig.left.unproject(uv, rig.left.fx * rig.baseline / scene.disparity[uv[:, 1], uv[:, 0]])
    x, y, z = points.astype(np.float32).T
    (tmp_path / "points.ply").write_bytes(ply({"x": x, "y": y, "z": z}))
    swarm = see(scene, asked(program(tmp_path, f'cp "{tmp_path}/points.ply" "$4.ply"')))
    assert len(swarm.points) > 150
    assert (np.sum(swarm.normals * swarm.points, axis=1) < 0.0).all()
    assert np.linalg.norm(swarm.normals, axis=1) == pytest.approx(1.0, abs=1e-5)
    u, v = np.rint(swarm.uv).astype(int).T
    assert swarm.points[:, 2] == pytest.approx(rig.left.fx * rig.baseline / scene.disparity[v, u], rel=1e-3)
    floor = scene.link[v, u] == scene.link[-10, 160]
    assert np.median(-swarm.normals[floor][:, 1]) > 0.9


SAYS_NO = {
    "exit 3": "ended with code 3",
    "echo one; echo the model is missing >&2; exit 1": "ended with code 1: the model is missing",
    "kill -11 $$": "was ended by SIGSEGV",
    "true": "left no file at {out}",
    'echo a > "$4"; echo b > "$4.pfm"': "left 2 files at {out}",
    'echo nonsense > "$4"': "it is no PFM, no 16-bit PNG and no .npy",
    'printf "Pf\\n9 9\\n-1.0\\nxxxx" > "$4"': "it holds 4 bytes, not 9x9 numbers",
    'printf "Pf\\n1 1\\n-1.0\\nxxxx" > "$4"': "left a map of 1x1 px for a pair of 320x240 px",
    'printf "ply\\nformat ascii 1.0\\nelement vertex 2\\nproperty float x\\n" > "$4"': "its PLY header has no end",
}


@pytest.mark.parametrize("does", SAYS_NO)
def test_what_goes_wrong_is_one_line(scene, tmp_path, does):
    with pytest.raises(EngineError) as refused:
        see(scene, asked(program(tmp_path, does)))
    assert SAYS_NO[does] in str(refused.value) and "\n" not in str(refused.value)


def test_no_number_at_all_is_a_picture_without_points(scene, tmp_path):
    (tmp_path / "map").write_bytes(pfm(np.full((240, 320), np.nan, np.float32)))
    assert len(see(scene, asked(program(tmp_path, f'cp "{tmp_path}/map" "$4"'))).points) == 0


def test_one_that_hangs_is_ended_with_all_that_it_started(scene, tmp_path):
    script = program(tmp_path, f"sleep 300 & echo $! > {tmp_path}/child; echo working; wait")
    began = time.monotonic()
    with pytest.raises(EngineError, match=r"had not ended after 0.5 s. Mend it"):
        see(scene, f"timeout=0.5 {asked(script)}")
    assert time.monotonic() - began < 20.0
    child = int((tmp_path / "child").read_text())
    for _ in range(100):
        status = Path(f"/proc/{child}/stat")
        if not status.exists() or status.read_text().rpartition(")")[2].split()[0] == "Z":
            break
        time.sleep(0.02)
    else:
        os.kill(child, signal.SIGKILL)
        raise AssertionError("what it started outlived it")


def test_nothing_of_it_stays_and_no_shell_reads_it(scene, tmp_path, monkeypatch):
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path / "scratch"))
    (tmp_path / "scratch").mkdir()
    (tmp_path / "map").write_bytes(pfm(scene.disparity))
    script = program(tmp_path, f'echo "$5" > {tmp_path}/word; cp "{tmp_path}/map" "$4"')
    see(scene, f"{asked(script)} '$(touch {tmp_path}/touched) ; *'")
    assert (tmp_path / "word").read_text() == f"$(touch {tmp_path}/touched) ; *\n"
    assert not (tmp_path / "touched").exists()
    assert not list((tmp_path / "scratch").iterdir())


@pytest.mark.parametrize(
    ("command", "why"),
    [
        ("", "it lacks {left}, {right}, {out}"),
        ("cp {left} {out}", "it lacks {right}. Write"),
        ("cp {left} {right} {cailb} {out}", "nothing fills '{cailb}'. Did you mean 'calib'?"),
        ("cp '{left} {right} {out}", "no closing quotation"),
        ("./no/such {left} {right} {out}", "no program './no/such'"),
        ("timeout=-1 cp {left} {right} {out}", "timeout must be from 0.001 to 86400, got '-1'"),
        ("timout=1 cp {left} {right} {out}", "has no setting 'timout'. Did you mean 'timeout'?"),
    ],
)
def test_a_command_is_checked_before_anything_runs(command, why):
    with pytest.raises(EngineError) as refused:
        engine(f"exec:{command}")
    assert why in str(refused.value)


def test_a_scenario_starts_no_program():
    assert ENGINES.check("exec:./anything") == "exec:./anything"
    for name in ("exec:./matcher {left} {right} {out}", "onnx:net.onnx"):
        with pytest.raises(ScenarioError, match="a scenario starts no program and loads no network: name it by --eng"):
            make_scenario({"world": "paper", "stops": [{"x": 0, "y": 0}], "engine": name})


def test_the_pictures_it_gets_are_8_bit_colour(scene, tmp_path):
    script = program(tmp_path, f'cp "$1" {tmp_path}/seen.png; exit 1')
    with pytest.raises(EngineError):
        see(scene, asked(script))
    with Image.open(tmp_path / "seen.png") as image:
        assert (image.mode, image.size) == ("RGB", (320, 240))
