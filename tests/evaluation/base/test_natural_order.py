"""Natural order, and files that are hidden."""

import itertools

import pytest

from evaluation.base import listed, natural_key


@pytest.mark.parametrize(
    "names",
    [
        ("2", "9", "10"),
        ("01", "2", "03", "10"),
        ("v9", "v10"),
        ("2012-2-4", "2012-2-11", "2012-10-28"),
        ("KAIST9", "KAIST10", "Riverside1"),
        ("", "a", "a1", "a1b", "a01b2", "a1c"),
        ("1" * 5000, "1" * 4999 + "2", "1" * 5001),
        # Only ASCII digits are numbers.
        ("²", "٣"),
    ],
)
def test_numbers_count_as_numbers(names):
    for order in itertools.permutations(names):
        assert sorted(order, key=natural_key) == list(names)


def test_a_folder_without_hidden_files(tmp_path):
    for name in ("10.bin", "9.bin", "._9.bin", ".DS_Store", "x.npy"):
        (tmp_path / name).touch()
    names = [path.name for path in listed(tmp_path, "*.bin")]
    assert names == ["9.bin", "10.bin"]
    assert [path.name for path in listed(tmp_path)] == [*names, "x.npy"]
    assert listed(tmp_path / "nowhere") == []
