"""One contract for every reader and writer of recordings."""

import hashlib

import numpy as np
import pytest
from mimique.corpus.recordings import RECORDING_SUFFIXES, read_take, write_take
from mimique.corpus.take import check_take, make_take
from mimique.errors import InputError, MimiqueError


@pytest.fixture
def take(rng):
    position = (rng.normal(size=(40, 6, 3)) * 50).astype(np.float32).astype(np.float64)
    position[5:9, 2] = np.nan
    return make_take(position, [f"M{i}" for i in range(6)], 200.0, signer="cr")


@pytest.mark.parametrize("suffix", RECORDING_SUFFIXES)
def test_what_is_written_is_read_again(tmp_path, take, suffix):
    path = tmp_path / f"joy{suffix}"
    write_take(path, take)
    again = read_take(str(path))
    check_take(again)
    np.testing.assert_array_equal(again["position"], take["position"])
    np.testing.assert_array_equal(again["marker"], take["marker"])
    np.testing.assert_array_equal(again["time"], take["time"])
    assert again.attrs["source_file"] == path.name and again.attrs["source_unit"] == "mm"
    assert again.attrs["source_sha256"] == hashlib.sha256(path.read_bytes()).hexdigest()
    assert again.attrs.get("signer") == (
        take.attrs["signer"] if suffix == ".c3d" else None
    )  # a TRC has no place for it


@pytest.mark.parametrize("suffix", RECORDING_SUFFIXES)
def test_writing_again_replaces_and_gives_the_same_bytes(tmp_path, take, suffix):
    path = tmp_path / f"joy{suffix.upper()}"
    path.write_text("something else")
    write_take(path, take)
    first = path.read_bytes()
    write_take(path, take)
    assert path.read_bytes() == first


@pytest.mark.parametrize("suffix", RECORDING_SUFFIXES)
@pytest.mark.parametrize("content", [b"", b"\0" * 3000, b"no recording at all\n" * 40])
def test_another_file_of_that_name_is_refused_in_one_line(tmp_path, suffix, content):
    path = tmp_path / f"joy{suffix}"
    path.write_bytes(content)
    with pytest.raises(InputError) as caught:
        read_take(path)
    assert str(caught.value).startswith(path.name) and "\n" not in str(caught.value)


@pytest.mark.parametrize("suffix", RECORDING_SUFFIXES)
def test_positions_beyond_any_room_are_refused(tmp_path, take, suffix):
    far = take.copy(deep=True)
    far["position"].values[3, 1, 0] = 2e6
    write_take(tmp_path / f"joy{suffix}", far)
    with pytest.raises(InputError, match="'M1' is more than a kilometre away in frame 3"):
        read_take(tmp_path / f"joy{suffix}")


@pytest.mark.parametrize("suffix", RECORDING_SUFFIXES)
def test_every_way_to_cut_a_file_gives_a_take_or_one_clear_line(tmp_path, take, suffix):
    path = tmp_path / f"joy{suffix}"
    write_take(path, take)
    whole = path.read_bytes()
    for size in range(1, len(whole), max(1, len(whole) // 97)):
        path.write_bytes(whole[:size])
        try:
            read_take(path)
        except MimiqueError as error:
            assert "\n" not in str(error)


@pytest.mark.parametrize("suffix", RECORDING_SUFFIXES)
def test_no_such_file_and_no_such_folder(tmp_path, take, suffix):
    with pytest.raises(InputError, match="cannot be read"):
        read_take(tmp_path / f"nothing{suffix}")
    with pytest.raises(InputError, match="cannot be written"):
        write_take(tmp_path / "nowhere" / f"a{suffix}", take)


def test_another_suffix_is_refused(tmp_path, take):
    with pytest.raises(InputError, match=r"ending in .c3d or .trc, but got '.bvh'"):
        read_take(tmp_path / "a.bvh")
    with pytest.raises(InputError, match="ending in"):
        write_take(tmp_path / "a", take)


def test_what_is_no_take_is_not_written(tmp_path, take):
    for suffix in RECORDING_SUFFIXES:
        with pytest.raises(InputError, match="take:"):
            write_take(tmp_path / f"a{suffix}", take.drop_attrs())
    assert not list(tmp_path.iterdir())


def test_a_unit_can_be_named_by_the_caller(tmp_path, take):
    write_take(tmp_path / "a.c3d", take)
    again = read_take(tmp_path / "a.c3d", unit="cm")
    np.testing.assert_allclose(again["position"], take["position"] * 10)
    assert again.attrs["source_unit"] == "cm"


def test_every_real_recording_is_read_or_refused_in_one_line(shared_data):
    n_read, n_refused = 0, 0
    for path in sorted(shared_data.rglob("*")):
        if path.suffix.lower() not in RECORDING_SUFFIXES:
            continue
        try:
            check_take(read_take(path))
            n_read += 1
        except MimiqueError as error:
            n_refused += 1
            assert str(error).startswith(path.name) and "\n" not in str(error)
    assert (n_read, n_refused) == (32, 5)
