"""Small sound files of every kind that flysim reads: what a campaign's damaged inputs are made from."""

from __future__ import annotations

import io
import json
import shutil
from pathlib import Path

import numpy as np
from PIL import Image

from flysim.common import catalogue as assets

KINDS = (
    "sdf",
    "model",
    "urdf",
    "toml",
    "calibration",
    "obj",
    "stl",
    "png",
    "texture",
    "policy",
    "report",
    "baseline",
    "barn",
)
TEXT = ("sdf", "model", "urdf", "toml", "calibration", "obj", "report", "baseline")
# The file of each kind, in a folder that holds sound ones of all.
FILES = {
    "sdf": "world.sdf",
    "model": "models/crate/model.sdf",
    "urdf": "robot.urdf",
    "toml": "scenario.toml",
    "calibration": "calib.txt",
    "obj": "meshes/wedge.obj",
    "stl": "meshes/wedge.stl",
    "png": "left.png",
    "texture": "textures/dots.png",
    "policy": "policy.npz",
    "report": "run/report.json",
    "baseline": "baseline.json",
    "barn": "path_files/path_0.npy",
}
WORLD = """<?xml version="1.0"?>
<sdf version="1.9">
  <world name="seed">
    <gravity>0 0 -9.81</gravity>
    <include><uri>model://models/crate</uri><pose>2 1 0 0 0 0.3</pose><name>crate_1</name></include>
    <model name="floor">
      <static>true</static>
      <link name="floor">
        <collision name="c"><geometry><plane><normal>0 0 1</normal><size>8 8</size></plane></geometry></collision>
        <visual name="v"><geometry><plane><normal>0 0 1</normal><size>8 8</size></plane></geometry>
          <material><diffuse>0.5 0.4 0.3 1</diffuse></material></visual>
      </link>
    </model>
    <model name="can">
      <pose>1.5 -0.5 0.1 0 0 0</pose>
      <link name="body">
        <inertial><mass>2.0</mass>
          <inertia><ixx>0.01</ixx><iyy>0.01</iyy><izz>0.01</izz><ixy>0</ixy><ixz>0</ixz><iyz>0</iyz></inertia></inertial>
        <collision name="c">
          <geometry><cylinder><radius>0.1</radius><length>0.2</length></cylinder></geometry></collision>
        <visual name="v"><geometry><cylinder><radius>0.1</radius><length>0.2</length></cylinder></geometry>
          <material><pbr><metal><albedo_map>textures/dots.png</albedo_map></metal></pbr></material></visual>
      </link>
    </model>
    <model name="wedge">
      <static>true</static>
      <pose>0.5 0.2 0 0 0 0</pose>
      <link name="body">
        <collision name="c"><geometry><mesh><uri>meshes/wedge.stl</uri></mesh></geometry></collision>
        <visual name="v"><geometry><mesh><uri>meshes/wedge.obj</uri><scale>1 1 2</scale></mesh></geometry></visual>
        <collision name="ball"><pose>0 1 0.2 0 0 0</pose>
          <geometry><sphere><radius>0.2</radius></sphere></geometry></collision>
      </link>
    </model>
  </world>
</sdf>
"""
MODEL = """<?xml version="1.0"?>
<sdf version="1.9">
  <model name="crate">
    <static>true</static>
    <link name="body">
      <pose>0 0 0.15 0 0 0</pose>
      <collision name="c"><geometry><box><size>0.3 0.4 0.3</size></box></geometry></collision>
      <visual name="v"><geometry><box><size>0.3 0.4 0.3</size></box></geometry></visual>
    </link>
  </model>
</sdf>
"""
SCENARIO = """description = "Two stops."
world = "world.sdf"
robot = "robot.urdf"
stops = [{ x = 0.0, y = 0.0 }, { x = 0.05, y = 0.0, yaw_deg = 3, via = [[0.02, 0.0]] }]
[flies]
population = 200
operators = "A"
max_iterations = 3
settled_fitness = 1.5
[obstacles]
min_flies = 10
[truth]
merge_gap = 0.05
"""
CALIBRATION = "cam0=[60 0 32; 0 60 24; 0 0 1]\ncam1=[60 0 32; 0 60 24; 0 0 1]\nbaseline=100\nwidth=64\nheight=48\n"
CORNERS = np.array([[0, 0, 0], [0.4, 0, 0], [0, 0.3, 0], [0, 0, 0.3]], np.float32)
FACES = np.array([[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]])


def sow(folder: Path) -> None:
    """Writes a sound file of every kind, beside whatever it takes to read it, into an empty folder."""
    rng = np.random.default_rng(7)
    for name in FILES.values():
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
    for kind, text in {"sdf": WORLD, "model": MODEL, "toml": SCENARIO, "calibration": CALIBRATION}.items():
        (folder / FILES[kind]).write_text(text, encoding="utf-8")
    (folder / "models/crate/model.config").write_text(
        "<model><name>crate</name><sdf version='1.9'>model.sdf</sdf></model>", encoding="utf-8"
    )
    robot = assets.find_robot("rover").read_text(encoding="utf-8")
    small = robot.replace("<width>640<", "<width>80<").replace("<height>480<", "<height>60<")
    (folder / FILES["urdf"]).write_text(small, encoding="utf-8")
    lines = [f"v {x} {y} {z}" for x, y, z in CORNERS] + ["vt 0 0", "vt 1 0", "vt 0 1"]
    lines += [f"f {a + 1}/1 {b + 1}/2 {c + 1}/3" for a, b, c in FACES]
    (folder / FILES["obj"]).write_text("\n".join(lines) + "\n", encoding="utf-8")
    record = np.zeros(len(FACES), [("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("more", "<u2")])
    record["corners"] = CORNERS[FACES]
    (folder / FILES["stl"]).write_bytes(bytes(80) + np.uint32(len(FACES)).tobytes() + record.tobytes())
    for name, size in (("left.png", (48, 64)), ("right.png", (48, 64)), ("textures/dots.png", (32, 32))):
        Image.fromarray(rng.integers(0, 255, (*size, 3), np.uint8)).save(folder / name)
    shutil.copy(assets.find_policy("ppo"), folder / FILES["policy"])
    (folder / FILES["baseline"]).write_text(
        json.dumps(
            {
                **{
                    "scenario": "paper_c",
                    "engine": "flies",
                    "seed": 0,
                    "renderer": "tiny",
                    "stops": 2,
                    "overrides": [],
                },
                "figures": {"f1": {"value": 1.0, "tolerance": 0.0, "better": "higher"}},
                "updates": [{"date": "2026-01-01", "reason": "first"}],
            },
            indent=1,
        ),
        encoding="utf-8",
    )
    (folder / "world_0.world").write_text(WORLD, encoding="utf-8")
    whole = io.BytesIO()
    np.save(whole, np.array([[15, 0], [15, 20], [16, 40]]))
    (folder / FILES["barn"]).write_bytes(whole.getvalue())
    _run(folder)


def _run(folder: Path) -> None:
    """The report of a short run through the seeds' own world."""
    from flysim.runs.run import run

    report = run(str(folder / FILES["toml"]), renderer="tiny")
    (folder / FILES["report"]).write_text(json.dumps(report.to_json(), indent=1), encoding="utf-8")
