"""Networks as engines, by tiny ones that are made here: a block matcher of shifts, differences, means and a least."""

import numpy as np
import pytest

from flysim.engines.choose import engine
from flysim.engines.engine import alone
from flysim.errors import EngineError
from flysim.flies.parameters import FlyParams

pytest.importorskip("onnxruntime", reason="make test installs onnxruntime")
onnx = pytest.importorskip("onnx", reason="make test installs onnx")

PARAMS = FlyParams(population=500)


def saved(path, nodes, inputs, outputs, constants=()):
    from onnx import TensorProto, helper, numpy_helper

    kinds = {"float": TensorProto.FLOAT, "uint8": TensorProto.UINT8}
    graph = helper.make_graph(
        nodes,
        "tiny",
        [helper.make_tensor_value_info(name, kinds[kind], shape) for name, shape, kind in inputs],
        [helper.make_tensor_value_info(name, TensorProto.FLOAT, shape) for name, shape in outputs],
        [numpy_helper.from_array(np.asarray(value), name) for name, value in constants],
    )
    model = helper.make_model(graph, opset_imports=[helper.make_opsetid("", 13)], ir_version=8)
    onnx.checker.check_model(model)
    path.write_bytes(model.SerializeToString())
    return path


def matcher(path, *, size=("h", "w"), disparities=48, kind="float", gray=False, times=1.0):
    """A network of as many shifts as disparities, which gives the shift of least difference."""
    from onnx import TensorProto, helper

    node = helper.make_node
    constants = [
        ("axis", np.array([3], np.int64)), ("far", np.array([1 << 30], np.int64)), ("times", np.float32(times)),
        ("mean", np.array([1], np.int64)),
    ]  # fmt: skip
    nodes = [node("Cast", [eye], [f"{eye}_f"], to=TensorProto.FLOAT) for eye in ("left", "right")]
    costs = []
    for d in range(disparities):
        constants += [(f"from{d}", np.array([d], np.int64)), (f"pad{d}", np.array([0, 0, 0, d, 0, 0, 0, 0], np.int64))]
        constants += [(f"end{d}", np.array([-d if d else 1 << 30], np.int64)), (f"zero{d}", np.array([0], np.int64))]
        nodes += [
            node("Slice", ["right_f", f"zero{d}", f"end{d}", "axis"], [f"cut{d}"]),
            node("Pad", [f"cut{d}", f"pad{d}"], [f"moved{d}"], mode="edge"),
            node("Sub", ["left_f", f"moved{d}"], [f"off{d}"]),
            node("Abs", [f"off{d}"], [f"abs{d}"]),
            node("ReduceMean", [f"abs{d}"], [f"grey{d}"], axes=[1], keepdims=1),
            node("AveragePool", [f"grey{d}"], [f"cost{d}"], kernel_shape=[7, 7], pads=[3, 3, 3, 3]),
        ]
        costs.append(f"cost{d}")
    nodes += [
        node("Concat", costs, ["costs"], axis=1),
        node("ArgMin", ["costs"], ["least"], axis=1, keepdims=1),
        node("Cast", ["least"], ["whole"], to=TensorProto.FLOAT),
        node("Mul", ["whole", "times"], ["disparity"]),
    ]
    shape = [1, 1 if gray else 3, *size]
    used = {name for one in nodes for name in one.input}
    return saved(
        path, nodes, [("right", shape, kind), ("left", shape, kind)], [("disparity", [1, 1, *size])],
        [(name, value) for name, value in constants if name in used],
    )  # fmt: skip


def see(scene, name):
    return alone(engine(f"onnx:{name}"), scene.pair, PARAMS, rng=np.random.default_rng(0))


def share_right(scene, swarm, within):
    u, v = np.rint(swarm.uv).astype(int).T
    off = np.abs(swarm.uv[:, 0] - swarm.uv_right[:, 0] - scene.disparity[v, u])
    return (off[np.isfinite(off) & scene.seen[v, u]] <= within).mean()


@pytest.mark.parametrize("how", [{}, {"kind": "uint8", "gray": True}, {"times": -1.0}])
def test_a_network_of_any_size_sees(scene, tmp_path, how):
    path = matcher(tmp_path / "net.onnx", **how)
    settings = "times=-1 multiple=50 range=1 " if "times" in how else ""
    swarm = see(scene, f"{settings}{path}")
    assert len(swarm.points) > 200
    assert share_right(scene, swarm, 1.0) > 0.9  # whole disparities, and right: left and right are not exchanged


def test_a_network_of_one_size_gets_pictures_of_it_and_its_pixels_are_turned_back(scene, tmp_path):
    swarm = see(scene, matcher(tmp_path / "net.onnx", size=(120, 160), disparities=32))
    assert share_right(scene, swarm, 2.0) > 0.85


def test_one_input_holds_both_eyes(scene, tmp_path):
    from onnx import helper

    # 1 px where the sixth channel is the right eye's blue: its mean over the picture says that it got that.
    nodes = [
        helper.make_node("Slice", ["pair", "five", "six", "one"], ["blue"]),
        helper.make_node("Mul", ["blue", "scale"], ["disparity"]),
    ]
    constants = [
        ("five", np.array([5], np.int64)), ("six", np.array([6], np.int64)), ("one", np.array([1], np.int64)),
        ("scale", np.float32(0.1)),
    ]  # fmt: skip
    path = saved(
        tmp_path / "net.onnx", nodes, [("pair", [1, 6, "h", "w"], "float")], [("disparity", [1, 1, "h", "w"])],
        constants,
    )  # fmt: skip
    found = engine(f"onnx:{path}")._disparity(scene.pair.left, scene.pair.right)  # type: ignore[attr-defined]
    blue = scene.pair.right[..., 2]
    np.testing.assert_allclose(np.nan_to_num(found), blue * np.float32(0.1), rtol=1e-5)


def test_what_is_no_network_of_a_pair_is_one_line(scene, tmp_path):
    from onnx import helper

    (tmp_path / "text.onnx").write_text("nonsense")
    one = helper.make_node("ReduceMean", ["left"], ["mean"], axes=[2, 3], keepdims=0)
    two = helper.make_node("Identity", ["right"], ["same"])
    eyes = [("left", [1, 3, "h", "w"], "float"), ("right", [1, 3, "h", "w"], "float")]
    short = saved(tmp_path / "short.onnx", [one, two], eyes, [("mean", [1, 3]), ("same", [1, 3, "h", "w"])])
    alone_ = saved(tmp_path / "alone.onnx", [one], eyes[:1], [("mean", [1, 3])])
    for name, why in (
        (f"{tmp_path}/gone.onnx", "cannot read the network: No such file"),
        (f"{tmp_path}/text.onnx", "cannot be loaded"),
        (f"rnge=1 {short}", "has no setting 'rnge'. Did you mean 'range'?"),
        (f"{alone_}", "Wanted: left and right"),
        (f"{short}", "gives 1x3 numbers for a pair of 320x256 px, no disparity map"),
    ):
        with pytest.raises(EngineError) as refused:
            see(scene, name)
        assert why in str(refused.value) and "\n" not in str(refused.value)
