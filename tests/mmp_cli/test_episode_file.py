"""The file of one episode of a dataset: what is wrong in it is named."""

import io
import pickle
import zipfile

import numpy as np
import pytest

from mmp_cli.datasets.episode_file import Rows, read_episode, rows_of
from mmp_env.errors import MmpError
from mmp_env.gym.env import MultiArmCellEnv


@pytest.fixture(scope="module")
def rows():
    return rows_of(MultiArmCellEnv(cell="ring-2"))


def episode(rows, steps=4):
    """Returns an episode of zeros that ends well."""
    out = {name: np.zeros((steps + each.extra, *each.shape), each.dtype) for name, each in rows.items()}
    for name in (name for name in out if name.startswith("observations.")):
        out[name] += (rows[name].low + rows[name].high) / 2
    out["terminations"][-1] = out["infos.is_success"][-1] = True
    return out


def with_value(array, at, value):
    out = array.copy()
    out[at] = value
    return out


WRONG_ARRAYS = {
    "text": ("actions", lambda a: a.astype(str), r"array 'actions' is of type '<U\d+'; it must be 'float32'"),
    "objects": ("rewards", lambda a: a.astype(object), "array 'rewards' is of type 'object'; it must be 'float64'"),
    "another type": ("terminations", lambda a: a.astype(int), "is of type 'int64'; it must be 'bool'"),
    "nan": ("actions", lambda a: with_value(a, (1, 2), np.nan), r"'actions' has nan at \[1, 2\]; it must be a finite"),
    "infinite": ("rewards", lambda a: with_value(a, 3, np.inf), r"has inf at \[3\]; it must be a finite number$"),
    "beyond": ("actions", lambda a: a + 2, "has 2 at .* a finite number from -1 to 1"),
    "a clearance": ("observations.clearance", lambda a: a - 9, "has -9 at .* from -1 to 1"),
    "contacts": ("infos.contacts", lambda a: a - 1, "has -1 at .* from 0 to 0"),
    "a contact": ("infos.contacts", lambda a: a + 1, "has 1 at .* from 0 to 0"),
    "no success": ("infos.is_success", np.zeros_like, "'infos.is_success' must be true at the last step"),
    "joints": ("actions", lambda a: a[:, :3], r"has shape \(4, 3\); for 4 steps it must be \(4, 12\)"),
    "too short": ("rewards", lambda a: a[:2], r"has shape \(2,\); for 4 steps it must be \(4,\)"),
    "too long": ("observations.goal_positions", lambda a: a[[0, *range(len(a))]], r"for 4 steps it must be \(5, 12\)"),
    "no axis": ("infos.is_success", lambda a: a[0], r"has shape \(\); for 4 steps"),
    "no end": ("terminations", np.zeros_like, "'terminations' must be true at the last step alone"),
    "cut off": ("truncations", lambda a: ~a, "and 'truncations' at no step"),
}


@pytest.mark.parametrize(("name", "change", "said"), WRONG_ARRAYS.values(), ids=WRONG_ARRAYS)
def test_an_array_of_an_episode_that_is_wrong_is_named(name, change, said, rows, tmp_path):
    path, good = tmp_path / "00000.npz", episode(rows)
    np.savez(path, **good)
    assert read_episode(path, 4, rows).keys() == good.keys()
    np.savez(path, **good | {name: change(good[name])})
    with pytest.raises(MmpError, match=f"00000.npz: .*{said}"):
        read_episode(path, 4, rows)


def test_other_arrays_and_other_steps_of_an_episode_are_named(rows, tmp_path):
    path, good = tmp_path / "00000.npz", episode(rows)
    np.savez_compressed(path, **good)
    with pytest.raises(MmpError, match=r"clearance' has shape \(5, 1\); for 5 steps it must be \(6, 1\)"):
        read_episode(path, 5, rows)
    np.savez(path, **good, reward=good["rewards"])
    with pytest.raises(MmpError, match=r"unknown array 'reward'\. Did you mean 'rewards'"):
        read_episode(path, 4, rows)
    np.savez(path, **{name: array for name, array in good.items() if name != "rewards"})
    with pytest.raises(MmpError, match="it has no array 'rewards'"):
        read_episode(path, 4, rows)


def test_a_file_that_is_no_episode_is_a_sentence(rows, tmp_path):
    path = tmp_path / "00000.npz"
    np.savez(path, **episode(rows))
    good = path.read_bytes()
    changed = bytearray(good)
    changed[good.index(b"rewards.npy") + 170] ^= 1
    for content in (b"", b"x", good[:1000], good[:-1], b"x" + good, bytes(changed), pickle.dumps([1])):
        path.write_bytes(content)
        with pytest.raises(MmpError, match=r"00000\.npz: it is not an episode of a dataset"):
            read_episode(path, 4, rows)


def test_an_array_that_is_huge_is_refused_before_it_is_read(tmp_path):
    path, rows = tmp_path / "00000.npz", {"actions": Rows(dtype=np.dtype("f4"))}
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED, compresslevel=1) as archive:
        archive.writestr("actions.npy", bytes(2**28 + 1))
    with pytest.raises(MmpError, match="its arrays have 256 MB; at most 256 MB are read"):
        read_episode(path, 2**26, rows)
    header = io.BytesIO()
    np.lib.format.write_array_header_1_0(header, {"descr": "<f4", "fortran_order": False, "shape": (10**15,)})
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr("actions.npy", header.getvalue() + bytes(40))
    with pytest.raises(MmpError, match=r"has shape \(1000000000000000,\); for 10 steps it must be \(10,\)"):
        read_episode(path, 10, rows)
    with pytest.raises(MmpError, match="has other numbers than its shape"):
        read_episode(path, 10**15, rows)
