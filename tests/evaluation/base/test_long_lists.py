"""Lists that are too long for the memory, and results made from them."""

import numpy as np
import pytest

from evaluation.base import InputError, LongList, Part

# Number of items that are written together.
BLOCK = 64
# Number of items that are in memory.
HELD = 512


def item(number):
    rng = np.random.default_rng(number)
    return {"number": number, "cloud": rng.normal(size=(number % 7, 3))}


def assert_equal(found, expected):
    assert found["number"] == expected["number"]
    np.testing.assert_array_equal(found["cloud"], expected["cloud"])


def some(length):
    return LongList.of(map(item, range(length)))


@pytest.mark.parametrize(
    "length", [0, 1, HELD, HELD + 1, HELD + BLOCK, HELD + BLOCK + 1, 1200]
)
def test_a_list_has_its_items_before_and_after_it_is_written(tmp_path, length):
    growing = some(length)
    assert growing.is_in_file == (length > HELD)
    part = Part(tmp_path / "list.data")
    part.write({}, ("a", growing))
    _, again = part.read()
    assert isinstance(again, LongList) == (length > HELD)
    order = np.random.default_rng(3).permutation(length).tolist()
    for found in (growing, again):
        assert len(found) == length
        for number, value in enumerate(found):
            assert_equal(value, item(number))
        for number in order[:50]:
            assert_equal(found[number], item(number))
            assert_equal(found[number - length], item(number))
        with pytest.raises(IndexError):
            found[length]


def test_a_slice_reads_what_the_list_reads(tmp_path):
    part = Part(tmp_path / "list.data")
    part.write({}, some(700))
    for found in (some(700), part.read()):
        for rows in (slice(-5, None), slice(3, 600, 7), slice(2, 2)):
            expected = range(700)[rows]
            assert len(found[rows]) == len(expected)
            for value, number in zip(found[rows], expected, strict=True):
                assert_equal(value, item(number))
        assert_equal(found[:650][600:][-1], item(649))


def test_slices_join_lists(tmp_path):
    part = Part(tmp_path / "list.data")
    part.write({}, some(1100))
    for found in (some(1100), part.read()):
        assert isinstance(found[-5:], list)
        for whole in (found, found[: HELD + 1]):
            first, *_, last = [whole[0]] * 5 + whole + [7]
            assert_equal(first, item(0))
            assert last == 7
        assert len(found[10:20] + list("ab")) == 12


def test_a_part_that_is_replaced_while_it_is_read(tmp_path):
    part = Part(tmp_path / "list.data")
    part.write({}, some(600))
    found = part.read()
    part.write({}, LongList.of([7] * 700))
    assert len(found) == 600
    assert_equal(found[0], item(0))
    assert_equal(found[599], item(599))


def test_items_that_cannot_be_stored_stay_in_memory(tmp_path):
    things = [object() for _ in range(HELD + 200)]
    kept = LongList.of(things)
    assert not kept.is_in_file
    assert list(kept) == things
    with pytest.raises(InputError, match="cannot be kept"):
        Part(tmp_path / "list.data").write({}, kept)


def test_several_lists_and_other_values_share_a_file(tmp_path):
    part = Part(tmp_path / "lists.data")
    array = np.arange(5.0)
    value = [some(600), {"array": array, "short": some(3)}, some(530)]
    part.write({"a": 1}, value)
    first, others, last = part.read()
    np.testing.assert_array_equal(others["array"], array)
    assert [one["number"] for one in others["short"]] == [0, 1, 2]
    assert_equal(first[599], item(599))
    assert_equal(last[529], item(529))
    # The clouds alone have 24 bytes a point.
    assert part.size() > 24 * 3 * (600 + 530)
    # Written again from the file, the part is the same.
    again = Part(tmp_path / "again.data")
    again.write({"a": 1}, part.read())
    assert again.path.read_bytes() == part.path.read_bytes()


def test_a_damaged_list_is_named(tmp_path):
    part = Part(tmp_path / "list.data")
    part.write({}, some(600))
    whole = part.path.read_bytes()
    found = part.read()
    part.path.write_bytes(whole[:-1])
    with pytest.raises(InputError, match=r"list\.data: damaged \(cut off\)"):
        part.read()
    # The last block is cut off in a file that is already open.
    with pytest.raises(InputError, match=r"list\.data: damaged \(cut off\)"):
        found[599]
    part.path.write_bytes(whole[:-40] + bytes(40))
    with pytest.raises(InputError, match=r"list\.data: damaged"):
        part.read()[599]


def test_nothing_is_left_of_a_temporary_file(tmp_path):
    growing = LongList(tmp_path)
    for number in range(700):
        growing.append(item(number))
    assert growing.is_in_file
    assert list(tmp_path.iterdir()) == []
    lost = LongList(tmp_path / "nowhere")
    for number in range(HELD):
        lost.append(item(number))
    with pytest.raises(InputError, match="nowhere: No such file"):
        lost.append(item(HELD))
