import io
import zipfile

import numpy as np
import pytest

from flysim.errors import FlysimError
from flysim.foreign.arrays import parse_npy, read_npz


def npy(array, **more):
    sink = io.BytesIO()
    np.save(sink, array, **more)
    return sink.getvalue()


def packed(path, members, method=zipfile.ZIP_DEFLATED):
    with zipfile.ZipFile(path, "w", method) as archive:
        for name, data in members.items():
            archive.writestr(name, data)
    return path


def header(text):
    return b"\x93NUMPY\x01\x00" + len(text).to_bytes(2, "little") + text.encode()


@pytest.mark.parametrize("shape", [(), (3,), (0, 2), (2, 3), (2, 3, 4)])
@pytest.mark.parametrize("kind", ["<f4", ">f8", "|u1", "<i8"])
def test_what_numpy_saves_is_read(shape, kind):
    array = np.arange(np.prod(shape, dtype=int)).reshape(shape).astype(kind)
    assert np.array_equal(parse_npy(npy(array)), array)
    assert np.array_equal(parse_npy(npy(array.T)), array.T)  # the other order


@pytest.mark.parametrize(
    "data",
    [
        b"",
        b"\x93NUMPY\x01\x00",
        npy(np.arange(3))[:-1],
        npy(np.arange(3)) + b"\0",
        npy(np.array([None, 1]), allow_pickle=True),
        npy(np.array(["a", "b"])),
        npy(np.zeros(2, [("a", "<f4")])),
        npy(np.zeros(2, complex)),
        header("{'descr': '<f8', 'fortran_order': False, 'shape': (1000000000, 1000000000), }\n"),
        header("{'descr': '<f8', 'fortran_order': False, 'shape': (-1,), }\n"),
        header("{'descr': '<f8', 'fortran_order': False, 'shape': (" + "(" * 5000 + "\n"),
        header("-" * 9000),
    ],
    ids=range(12),
)
def test_anything_else_is_a_value_error_before_numpy_makes_room(data):
    with pytest.raises(ValueError, match=r"header|bytes, not an array|no array"):
        parse_npy(data)


def test_a_file_of_arrays(tmp_path):
    np.savez_compressed(tmp_path / "a.npz", x=np.arange(5), y=np.eye(2))
    found = read_npz(tmp_path / "a.npz", "policy", 10_000)
    assert sorted(found) == ["x", "y"]
    assert np.array_equal(found["y"], np.eye(2))


def test_bombs_and_other_zips_are_refused(tmp_path):
    zeros = npy(np.zeros(10**6))
    bomb = packed(tmp_path / "bomb.npz", {"a.npy": zeros})
    assert bomb.stat().st_size < 10**5
    data = bomb.read_bytes().replace(len(zeros).to_bytes(4, "little"), (500).to_bytes(4, "little"))
    (tmp_path / "liar.npz").write_bytes(data)  # says that it unpacks to 500 bytes
    for path, why in (
        (bomb, "unpacks to more than is read"),
        (tmp_path / "liar.npz", "Bad CRC-32|bytes, not an array"),
        (packed(tmp_path / "l.npz", {"a.npy": zeros}, zipfile.ZIP_LZMA), "packed by another method"),
        (packed(tmp_path / "b.npz", {"a.npy": zeros}, zipfile.ZIP_BZIP2), "packed by another method"),
        (packed(tmp_path / "n.npz", {f"{k}.npy": b"" for k in range(101)}), "holds 101 arrays"),
    ):
        with pytest.raises(FlysimError, match=why) as caught:
            read_npz(path, "policy", 10**5)
        assert path.name in str(caught.value)


def test_damage_anywhere_is_one_line_with_the_file_s_name(tmp_path):
    np.savez_compressed(tmp_path / "a.npz", x=np.random.default_rng(0).integers(0, 9, 200), y=np.eye(3))
    good, path = (tmp_path / "a.npz").read_bytes(), tmp_path / "bad.npz"
    rng = np.random.default_rng(1)
    for _ in range(150):
        data = bytearray(good)
        data[rng.integers(len(data))] ^= 1 << int(rng.integers(8))
        path.write_bytes(data[: rng.integers(len(data))] if rng.random() < 0.2 else data)
        try:
            read_npz(path, "policy", 10**6)
        except FlysimError as error:
            assert str(error).startswith(f"{path}: cannot read the policy: ")
            assert len(str(error)) < 300
