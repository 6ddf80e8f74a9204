import math
import string
from dataclasses import fields

import pytest
from hypothesis import HealthCheck, assume, given, settings
from hypothesis import strategies as st

from flysim.common.catalogue import names
from flysim.errors import ScenarioError, did_you_mean
from flysim.flies.parameters import FlyParams
from flysim.obstacles.parameters import ObstacleParams
from flysim.render.light import LightParams
from flysim.runs.scenario import MAX_BYTES, Scenario, make_scenario, read_scenario
from flysim.runs.scenario_parts import MAX_STOPS, StopPlan, TruthParams
from flysim.sensors.calibration import CalibrationParams
from flysim.sensors.parameters import SensorParams
from flysim.sim.driving import DriveParams

MINIMAL = {"world": "paper", "stops": [{"x": 0.0, "y": 0.0}]}
KEYS = {
    "flies": [field.name for field in fields(FlyParams)],
    "obstacles": [field.name for field in fields(ObstacleParams)],
    "sensors": [field.name for field in fields(SensorParams)],
    "calibration": [field.name for field in fields(CalibrationParams)],
    "truth": list(TruthParams.model_fields),
    "stops": list(StopPlan.model_fields),
    "light": [field.name for field in fields(LightParams)],
    "drive": [field.name for field in fields(DriveParams)],
    "": [name for name in Scenario.model_fields if name not in ("name", "folder")],
}


def refusal(data):
    with pytest.raises(ScenarioError) as caught:
        make_scenario(data, "here.toml")
    assert str(caught.value).startswith("here.toml: ")
    return str(caught.value).removeprefix("here.toml: ")


def written(tmp_path, text):
    path = tmp_path / "drive.toml"
    path.write_bytes(text if isinstance(text, bytes) else text.encode())
    return str(path)


@pytest.mark.parametrize("name", ["paper_a", "paper_b", "paper_c", "yard", "corridor"])
def test_the_shipped_scenarios_are_the_papers(name):
    assert name in names("runs")
    plan = read_scenario(name)
    assert (plan.name, plan.robot) == (name, "rover")
    assert (plan.flies.population, plan.flies.operators) == (5000, "A")  # paper, section 4.2
    assert 6 <= len(plan.stops) <= 12
    assert plan.description.endswith(".")
    assert plan.world_path.is_file()
    assert plan.robot_path.is_file()


def test_what_a_file_may_leave_out():
    plan = make_scenario(MINIMAL)
    assert plan == Scenario(world="paper", stops=(StopPlan(x=0, y=0),))
    assert (plan.robot, plan.truth.merge_gap) == ("rover", 0.09)
    assert plan.flies == FlyParams()
    assert plan.obstacles == ObstacleParams()


def test_a_stop_in_degrees_is_a_pose_in_radians():
    pose = make_scenario({**MINIMAL, "stops": [{"x": 1, "y": -2, "yaw_deg": 90}]}).stops[0].pose
    assert (pose.x, pose.y, pose.yaw) == (1.0, -2.0, pytest.approx(math.pi / 2))


def test_operator_shares_may_be_a_list():
    plan = make_scenario({**MINIMAL, "flies": {"operators": [0.4, 0.2, 0.2, 0.2]}})
    assert plan.flies.operators == (0.4, 0.2, 0.2, 0.2)


def test_a_world_and_a_robot_beside_the_scenario(tmp_path, monkeypatch):
    (tmp_path / "worlds").mkdir()
    (tmp_path / "worlds" / "mine.sdf").touch()
    (tmp_path / "mine.urdf").touch()
    file = written(tmp_path, 'world = "worlds/mine.sdf"\nrobot = "mine.urdf"\nstops = [{ x = 0, y = 0 }]\n')
    monkeypatch.chdir("/")
    plan = read_scenario(file)
    assert plan.world_path == tmp_path / "worlds/mine.sdf"
    assert plan.robot_path == tmp_path / "mine.urdf"
    assert plan.name == "drive"


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"wrld": "paper"}, "unknown key 'wrld'. Did you mean 'world'?"),
        ({"flies": {"populaton": 3}}, "unknown key 'flies.populaton'. Did you mean 'population'?"),
        ({"flies": {"search": {"fold_shar": 0.1}}}, "unknown key 'flies.search.fold_shar'. Did you mean 'fold_share'?"),
        ({"stops": [{"x": 0, "y": 0, "yaw": 3}]}, "unknown key 'stops.0.yaw'. Did you mean 'yaw_deg'?"),
        ({"truth": {"gap": 1}}, "unknown key 'truth.gap'. Did you mean 'merge_gap'?"),
        ({"obstacles": {"zz": 1}}, "unknown key 'obstacles.zz'. Known: again, climb, ground_clearance, "),
        ({"stops": []}, "stops: Tuple should have at least 1 item after validation, not 0"),
        ({"stops": [{"x": 0, "y": 0}] * (MAX_STOPS + 1)}, "stops: Tuple should have at most 1000 items"),
        ({"stops": [{"x": 0}]}, "'stops.0.y' is missing. Add it."),
        ({"stops": [{"x": math.nan, "y": 0}]}, "stops.0.x: Input should be a finite number, got nan."),
        ({"stops": [{"x": math.inf, "y": 0}]}, "stops.0.x: Input should be a finite number, got inf."),
        ({"stops": [{"x": 1e9, "y": 0}]}, "stops.0.x: Input should be less than or equal to 10000, got 1000000000.0."),
        ({"stops": [{"x": "left", "y": 0}]}, "stops.0.x: Input should be a valid number, unable to parse string"),
        ({"stops": [{"x": 0, "y": 0, "yaw_deg": 400}]}, "stops.0.yaw_deg: Input should be less than or equal to 360"),
        ({"stops": 3}, "stops: Input should be a valid tuple, got 3."),
        ({"world": 3}, "world: Input should be a valid string, got 3."),
        ({"flies": 3}, "flies: Input should be a dictionary or an instance of FlyParams, got 3."),
        ({"flies": {"population": math.nan}}, "flies.population: Input should be a finite number, got nan."),
        ({"flies": {"population": 3}}, "flies: population must be in [10, 1000000] flies, got 3."),
        ({"flies": {"operators": "D"}}, "flies: operators must be A, B, C or four shares, got 'D'."),
        ({"flies": {"min_depth": 5.0}}, "flies: max_depth must be > min_depth = 5.0 m, got 4.0 m."),
        (
            {"flies": {"fitness": "papre"}},
            "flies: fitness must be one of epipolar, paper, louchet, zncc, product, or an own one as module:object, "
            "got 'papre'. Did you mean 'paper'?",
        ),
        ({"obstacles": {"trim": 0.7}}, "obstacles: trim must be < 0.5, got 0.7."),
        ({"truth": {"merge_gap": -1}}, "truth.merge_gap: Input should be greater than or equal to 0, got -1."),
        (
            {"description": "x" * 9000, "robot": ["x" * 9000]},
            "robot: Input should be a valid string, got ['xxxxxxxxxxxx",
        ),
    ],
)
def test_says_in_one_line_what_is_wrong(change, said):
    message = refusal({**MINIMAL, **change})
    assert message.startswith(said)
    assert message.isprintable()
    assert len(message) < 400


def test_a_missing_world():
    assert refusal({"stops": MINIMAL["stops"]}) == "'world' is missing. Add it."
    # What an unknown key was meant to be is likely to be what is missing.
    assert "Did you mean 'world'?" in refusal({"stops": MINIMAL["stops"], "wolrd": "paper"})


def placed(table, key, value):
    if table == "":
        return {**MINIMAL, key: value}
    if table == "stops":
        return {**MINIMAL, "stops": [{"x": 0.0, "y": 0.0, key: value}]}
    return {**MINIMAL, table: {key: value}}


@given(
    table=st.sampled_from(sorted(KEYS)),
    data=st.data(),
    letter=st.sampled_from(string.ascii_lowercase),
    kind=st.sampled_from(["drop", "swap", "add"]),
)
def test_a_key_with_a_slip_in_it_names_the_nearest_known_one(table, data, letter, kind):
    key = data.draw(st.sampled_from([key for key in KEYS[table] if len(key) > 3]))
    place = data.draw(st.integers(0, len(key) - 2))
    if kind == "drop":
        slip = key[:place] + key[place + 1 :]
    elif kind == "swap":
        slip = key[:place] + key[place + 1] + key[place] + key[place + 2 :]
    else:
        slip = key[:place] + letter + key[place:]
    assume(slip not in (*KEYS[table], "name", "folder"))
    message = refusal(placed(table, slip, 1))
    where = {"": "", "stops": "stops.0."}.get(table, f"{table}.")
    assert message.startswith(f"unknown key '{where}{slip}'. Did you mean '")
    assert did_you_mean(slip, KEYS[table]) in message
    assert f"'{key}'" in message or key not in did_you_mean(slip, KEYS[table])


@settings(max_examples=40)
@given(
    table=st.sampled_from(sorted(KEYS)),
    key=st.text(string.printable, min_size=1, max_size=20),
    value=st.integers() | st.text(max_size=5),
)
def test_any_other_key_is_refused_with_what_is_known(table, key, value):
    assume(key not in (*KEYS[table], "name", "folder"))
    message = refusal(placed(table, key, value))
    assert message.startswith("unknown key '")
    assert "Did you mean" in message or f"Known: {', '.join(sorted(KEYS[table])[:4])}" in message


@given(st.recursive(st.none() | st.booleans() | st.floats() | st.text(max_size=5), lambda s: st.lists(s, max_size=3)))
def test_any_value_is_taken_or_refused_and_nothing_else(value):
    for table in ("flies", "obstacles"):
        for key in KEYS[table]:
            try:
                make_scenario(placed(table, key, value), "here.toml")
            except ScenarioError as error:
                assert str(error).startswith("here.toml: ")


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("world = ", "not TOML: Invalid value (at end of document)."),
        ("world", "not TOML: Expected '=' after a key"),
        ("a = 1\na = 2\n", "not TOML: Cannot overwrite a value (at line 2, column 6)."),
        (b"world = '\xff'", "cannot read the scenario: byte 9 is not UTF-8"),
        ("x = " + "[" * 100_000, "lists or tables are nested deeper than 32"),
        ("x = " + "{a=" * 100_000, "lists or tables are nested deeper than 32"),
        ("x." + "a." * 30_000 + "a = 1", "a key has more than 32 parts"),  # tomllib takes 3.6 GB for it
        ("[x." + '"a" . ' * 30_000 + "a]", "a key has more than 32 parts"),
        ('#"\nx.' + "a." * 30_000 + "a = 1", "a key has more than 32 parts"),  # a comment begins no string
        ("x = 0x" + "f" * 300, "x: a whole number of more than 64 bits"),
        ("[flies]\npopulation = 0b" + "1" * 70, "flies.population: a whole number of more than 64 bits"),
        ('world = "' + "a" * 20_000 + '"', "world: a text of 20000 characters, at most 10000 are read"),
        ("x = " + "1" * 5000, "Exceeds the limit (4300 digits)"),
        ("#" * (MAX_BYTES + 1), "cannot read the scenario: it is larger than 1000000 bytes."),
        ('name = "other"', "'name' comes from the file's own name, or from planning; take it out."),
        ('folder = "/"', "'folder' comes from the file's own name, or from planning; take it out."),
    ],
)
def test_what_is_no_scenario_file(tmp_path, text, said):
    path = written(tmp_path, text)
    with pytest.raises(ScenarioError) as caught:
        read_scenario(path)
    assert str(caught.value).startswith(f"{path}: {said}")


@settings(max_examples=60, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(st.binary(max_size=60))
def test_any_bytes_are_read_or_refused_and_nothing_else(tmp_path, data):
    with pytest.raises(ScenarioError):
        read_scenario(written(tmp_path, data))


@pytest.mark.parametrize(
    ("name", "said"),
    [
        ("papr_a", "no scenario 'papr_a'. Did you mean 'paper_a'?"),
        ("zzz", "no scenario 'zzz'. Known: corridor, paper_a, "),
        ("", "no scenario ''. Known: corridor, paper_a, "),
        ("none/such.toml", "no scenario file 'none/such.toml'. Give a path that exists, or a name: corridor, "),
        ("such.toml", "no scenario file 'such.toml'. Give a path that exists"),
        ("./", "no scenario file '.'. Give a path"),
        ("a" * 9000, "no scenario 'aaaa"),
        ("a\0b", "no scenario 'a?b'."),
    ],
)
def test_no_such_scenario(name, said):
    with pytest.raises(ScenarioError) as caught:
        read_scenario(name)
    assert str(caught.value).startswith(said)
    assert len(str(caught.value)) < 300


def test_overrides_change_what_the_file_says():
    plan = read_scenario(
        "paper_a",
        [
            "flies.population=3000",
            "flies.operators=C",
            'description = "x = y"',
            "truth.merge_gap=0.1",
            "stops=[{x=1,y=2}]",
            "flies.population=4000",  # the last one counts
        ],
    )
    assert (plan.flies.population, plan.flies.operators) == (4000, "C")
    assert (plan.description, plan.truth.merge_gap) == ("x = y", 0.1)
    assert plan.stops == (StopPlan(x=1, y=2),)


@pytest.mark.parametrize(
    ("override", "said"),
    [
        ("flies.population", "--set flies.population: write KEY=VALUE, as in --set flies.population=3000."),
        ("=3", "--set =3: write KEY=VALUE"),
        ("flies..population=3", "--set flies..population=3: write KEY=VALUE"),
        ("world.name=3", "--set world.name=3: 'world' is a value, not a table."),
        ("flies.population.x=3", "--set flies.population.x=3: 'population' is a value, not a table."),
        ("flies.populaton=3", "unknown key 'flies.populaton'. Did you mean 'population'?"),
        ("flies.population=many", "flies.population: Input should be a valid integer"),
        ("flies.population=nan", "flies.population: Input should be a finite number, got nan."),
        ("flies.population=" + "[" * 9000, "--set flies.population: lists or tables are nested deeper than 32"),
        ("flies.population=" + "a." * 9000, "--set flies.population: it is too long"),
        (".".join("a" * 40) + "=1", ": it is too long"),
        ("flies.population=0x" + "f" * 300, "--set flies.population: value: a whole number of more than 64 bits"),
        ("flies.stop=inf", "flies: stop must be in [1e-06, 1.0], got inf."),
        ("truth.merge_gap=1e999", "truth.merge_gap: Input should be a finite number"),
        ("flies=3", "flies: Input should be a dictionary"),
        ("name=x", "'name' comes from the file's own name"),
    ],
)
def test_overrides_that_are_refused(override, said):
    with pytest.raises(ScenarioError) as caught:
        read_scenario("paper_a", [override])
    assert said in str(caught.value)
    assert len(str(caught.value)) < 300


def test_a_world_or_robot_that_is_not_there_names_the_nearest():
    from flysim.errors import RobotError, WorldError

    with pytest.raises(WorldError, match=r"no world 'yrad'. Did you mean 'yard'\?"):
        _ = make_scenario({**MINIMAL, "world": "yrad"}).world_path
    with pytest.raises(RobotError, match=r"no robot 'rovr'. Did you mean 'rover'\?"):
        _ = make_scenario({**MINIMAL, "robot": "rovr"}).robot_path
    with pytest.raises(WorldError, match=r"no world file 'no/such.sdf'. Give a path that exists, or a name: corridor"):
        _ = make_scenario({**MINIMAL, "world": "no/such.sdf"}).world_path
