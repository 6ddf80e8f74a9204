"""Disturbances reach whoever drives: a scenario, an override, a run, the environment; and the truth stays clean."""

import json

import cv2
import numpy as np
import pytest

import flysim as fs
from flysim.errors import FlysimError, ScenarioError
from flysim.evaluate.report import Report
from flysim.nav.env import FlyNavEnv
from flysim.runs.run import check, driven
from flysim.runs.scenario import make_scenario, read_scenario
from flysim.sensors.chip import stream


def plan_of(*overrides):
    plan = read_scenario("paper_a", ["engine=bm", *overrides])
    return plan.model_copy(update={"stops": plan.stops[:2]})


def frames_of(*overrides, seed=4):
    frames, truth = driven(plan_of(*overrides), seed=seed, renderer="tiny")
    return frames.of.frames, truth


@pytest.fixture(scope="module")
def clean():
    return frames_of()


def test_a_scenario_an_override_and_a_record_say_the_same(tmp_path):
    path = tmp_path / "noisy.toml"
    text = 'world = "paper"\nstops = [{ x = 0, y = 0 }]\n[sensors]\nnoise = 5\n[calibration]\nright_roll_deg = 0.3\n'
    path.write_text(text, encoding="utf-8")
    plan = read_scenario(str(path))
    assert plan.sensors == fs.SensorParams(noise=5.0)
    assert plan.calibration == fs.CalibrationParams(right_roll_deg=0.3)
    assert plan_of("sensors.noise=5").sensors == plan.sensors
    assert (
        make_scenario({"world": "paper", "stops": [{"x": 0, "y": 0}], "sensors": plan.sensors}).sensors == plan.sensors
    )


@pytest.mark.parametrize(
    ("override", "said"),
    [
        ("sensors.nois=5", "unknown key 'sensors.nois'. Did you mean 'noise'?"),
        ("sensors.noise=-5", "sensors: noise must be a number in [0, 255] grey levels, got -5.0."),
        (
            "sensors.jpeg_quality=1000",
            "sensors: jpeg_quality must be a whole number in [0, 100] (0: no JPEG), got 1000.",
        ),
        ("calibration.right_role_deg=5", "unknown key 'calibration.right_role_deg'. Did you mean 'right_roll_deg'?"),
        ("calibration.focal_error=99", "calibration: focal_error must be a number in [-0.9, 10] (a share), got 99.0."),
    ],
)
def test_nonsense_is_refused_in_one_line(override, said):
    with pytest.raises(ScenarioError) as caught:
        read_scenario("paper_a", [override])
    assert str(caught.value).endswith(said)
    assert "\n" not in str(caught.value)


def test_a_lens_that_folds_the_image_is_refused_before_the_drive():
    with pytest.raises(FlysimError, match="folds the image of 640x480 px"):
        check(plan_of("sensors.k1=-0.3"))


def test_noise_is_in_the_frames_and_not_in_the_truth(clean):
    frames, truth = frames_of("sensors.noise=5")
    for frame, stop, (perfect, known) in zip(
        frames, truth.stops, zip(*(clean[0], clean[1].stops), strict=True), strict=True
    ):
        for side, view, before in zip(("left", "right"), stop.views, known.views, strict=True):
            np.testing.assert_array_equal(view.rgb, before.rgb)
            np.testing.assert_array_equal(view.depth, before.depth)
            image = getattr(perfect.pair, side).astype(float)
            eye = ("left", "right").index(side)
            _, reading = stream(4, frame.index, eye).spawn(2)
            noise = np.float32(5.0) * reading.standard_normal(image.shape, dtype=np.float32)
            expected = np.clip(np.rint(image.astype(np.float32) + noise), 0, 255)
            np.testing.assert_array_equal(getattr(frame.pair, side), expected)
    assert truth.disturbed == {"sensors": {"noise": 5.0}} and clean[1].disturbed == {}


def test_a_distorted_drive_keeps_the_pinholes_truth_and_rig(clean):
    frames, truth = frames_of("sensors.k1=-0.2")
    image, before = frames[0].pair.left, clean[0][0].pair.left
    assert image.shape == before.shape and frames[0].pair.rig.rectified
    np.testing.assert_array_equal(truth.stops[0].views[0].depth, clean[1].stops[0].views[0].depth)
    # About the optical axis a lens does nothing; in the corner it shows what the pinhole's image had no room for.
    middle = np.abs(image[230:250, 310:330].astype(float) - before[230:250, 310:330]).mean()
    assert middle < 5.0 < np.abs(image[-60:, :60].astype(float) - before[-60:, :60]).mean()


def test_a_rolled_camera_draws_what_it_sees_from_there(clean):
    frames, truth = frames_of("calibration.right_roll_deg=3")
    np.testing.assert_array_equal(frames[0].pair.left, clean[0][0].pair.left)
    assert frames[0].pair.rig.rectified  # the robot knows of nothing
    ideal, rolled = clean[0][0].pair.right, frames[0].pair.right
    # A camera's turn about itself is a homography: K R K^-1 from the rolled image to the ideal one.
    a = np.radians(3.0)
    R = np.array([[np.cos(a), -np.sin(a), 0.0], [np.sin(a), np.cos(a), 0.0], [0.0, 0.0, 1.0]])
    K = frames[0].pair.rig.right.K
    warped = cv2.warpPerspective(ideal, np.linalg.inv(K @ R @ np.linalg.inv(K)), (640, 480))
    inner = np.s_[40:-40, 40:-40]
    off = np.abs(warped[inner].astype(float) - rolled[inner])
    assert np.median(off) <= 4.0 < np.median(np.abs(ideal[inner].astype(float) - rolled[inner]))
    assert rolled.min(axis=2)[[0, -1]].max() > 0 and (rolled.sum(axis=2) == 0).mean() < 0.001  # no black border
    assert not np.allclose(truth.stops[0].views[1].T_world_optical, clean[1].stops[0].views[1].T_world_optical)


def test_a_wrong_belief_changes_the_rig_and_no_image(clean):
    frames, truth = frames_of("calibration.focal_error=0.02", "calibration.baseline_error=0.01")
    np.testing.assert_array_equal(frames[0].pair.right, clean[0][0].pair.right)
    ideal, rig = clean[0][0].pair.rig, frames[0].pair.rig
    assert rig.left.fx == pytest.approx(1.02 * ideal.left.fx) and rig.baseline == pytest.approx(1.01 * ideal.baseline)
    assert truth.stops[0].views[0].camera == ideal.left


def test_a_dim_right_eye_is_no_matter_for_block_matching_and_the_report_says_so(tmp_path):
    plan = read_scenario("paper_a", ["engine=bm"])
    overrides = {"sensors": fs.SensorParams(gain_right=0.8), "calibration": fs.CalibrationParams(row_shift_px=0.25)}
    disturbed = fs.run(plan.model_copy(update=overrides), seed=8, renderer="tiny", out=tmp_path / "run")
    assert disturbed.recall == 1.0 and disturbed.center_error.median < 0.02
    data = json.loads((tmp_path / "run" / "report.json").read_text(encoding="utf-8"))
    assert data["sensors"] == {"gain_right": 0.8} and data["calibration"] == {"row_shift_px": 0.25}
    assert Report.from_json(data).sensors == {"gain_right": 0.8}
    config = json.loads((tmp_path / "run" / "config.json").read_text(encoding="utf-8"))["scenario"]
    assert config["sensors"]["gain_right"] == 0.8 and config["calibration"]["row_shift_px"] == 0.25
    assert "disturbed: sensors.gain_right 0.8, calibration.row_shift_px 0.25" in str(disturbed)
    clean = fs.run(plan.model_copy(update={"stops": plan.stops[:1]}), renderer="tiny")
    assert not {"sensors", "calibration"} & clean.to_json().keys()
    assert "disturbed" not in str(clean)


@pytest.fixture
def looking():
    """What an environment shows as pixels, at its reset and a step later."""
    made = []

    def look(**settings):
        env = FlyNavEnv(world="paper", observation="pixels", renderer="tiny", size=(64, 48), **settings)
        made.append(env)
        first, _ = env.reset(seed=3)
        then, *_ = env.step(np.array([0.5, 1.0], np.float32))
        return [seen[side].astype(float) for seen in (first, then) for side in ("left", "right")]

    yield look
    for env in made:
        env.close()


def test_the_environment_looks_through_the_same_cameras(looking):
    perfect = looking()
    for one in (fs.SensorParams(gain_right=0.5, noise=3.0), {"gain_right": 0.5, "noise": 3.0}):
        images = looking(sensors=one)
        for image, before, gain in zip(images, perfect, (1.0, 0.5, 1.0, 0.5), strict=True):
            inside = (before > 30) & (before < 220)
            off = (image - gain * before)[inside]
            assert abs(off.mean()) < 0.3 and off.std() == pytest.approx(3.0, rel=0.1)
        again = looking(sensors=one)
        for image, other in zip(images, again, strict=True):
            np.testing.assert_array_equal(image, other)
    assert np.abs(images[0] - images[2]).mean() > 0


def test_the_environment_turns_under_a_rolling_shutter_and_shows_a_rolled_camera(looking):
    perfect, late = looking(), looking(sensors={"row_time_us": 900.0})
    np.testing.assert_array_equal(late[0], perfect[0])  # it stands
    assert np.abs(late[2] - perfect[2]).mean() > 0.2  # it turns
    rolled = looking(calibration={"right_roll_deg": 20.0})
    np.testing.assert_array_equal(rolled[0], perfect[0])
    assert np.abs(rolled[1] - perfect[1]).mean() > 5.0


def test_a_robot_that_stands_sees_other_noise_at_each_step_and_in_each_episode():
    env = FlyNavEnv(world="paper", observation="pixels", renderer="tiny", size=(64, 48), sensors={"noise": 5.0})
    start, still = {"start": (0.0, 0.0, 0.0), "goal": (0.0, -2.0)}, np.zeros(2, np.float32)
    try:
        seen = [env.reset(seed=seed, options=start)[0]["left"].astype(float) for seed in (3, 4)]
        seen += [env.step(still)[0]["left"].astype(float) for _ in range(2)]
    finally:
        env.close()
    for k in range(4):
        for other in range(k):
            assert np.abs(seen[k] - seen[other])[10:-10, 10:-10].mean() > 2.0, (k, other)


def test_the_environment_s_engine_believes_the_wrong_rig():
    def farthest(**calibration):
        env = FlyNavEnv(world="paper", observation="bm", renderer="tiny", calibration=calibration)
        try:
            env.reset(seed=3, options={"start": (0.0, 0.0, 0.0), "goal": (0.0, -2.0)})
            return np.median(env.seen()[1][:, 0])
        finally:
            env.close()

    # Who believes the eyes 1.3 times as far apart believes all 1.3 times as far away.
    assert farthest(baseline_error=0.3) == pytest.approx(1.3 * farthest(), rel=0.1)


@pytest.mark.parametrize(
    ("settings", "said"),
    [
        ({"sensors": {"nois": 5}}, r"^sensors has no 'nois'\. Did you mean 'noise'\?$"),
        ({"sensors": {"noise": -5}}, r"^sensors: noise must be a number in \[0, 255\] grey levels, got -5$"),
        ({"sensors": 5}, r"^sensors must be a SensorParams or a dict of its fields, got 5$"),
        ({"calibration": {"focal_error": 99}}, r"^calibration: focal_error must be a number in \[-0\.9, 10\]"),
    ],
)
def test_the_environment_refuses_nonsense_in_one_line(settings, said):
    with pytest.raises(ValueError, match=said):
        FlyNavEnv(world="paper", **settings)
