"""Names in the folder of a study that something else has."""

import pytest

from evaluation.base import InputError
from evaluation.study import StudyFiles


@pytest.mark.parametrize("name", ["results.csv", "queries.csv", "index.html"])
def test_a_folder_with_the_name_of_a_file_is_found_first(tmp_path, name):
    StudyFiles(tmp_path / "new").check()
    StudyFiles(tmp_path).check()
    (tmp_path / "parts").mkdir()
    StudyFiles(tmp_path).check()
    (tmp_path / name).write_text("of the user")
    with pytest.raises(InputError, match=f"{name}: no earlier run wrote it"):
        StudyFiles(tmp_path).check()
    (tmp_path / name).unlink()
    (tmp_path / name).mkdir()
    with pytest.raises(InputError, match=rf"^{tmp_path / name}: "):
        StudyFiles(tmp_path).check()


def test_a_file_with_the_name_of_a_folder_is_found_first(tmp_path):
    (tmp_path / "parts").write_text("")
    with pytest.raises(InputError, match=rf"^{tmp_path}/parts: not a folder"):
        StudyFiles(tmp_path).check()
    with pytest.raises(InputError, match=r"/parts: not a folder$"):
        StudyFiles(tmp_path / "parts").check()


def test_pictures_of_drives_that_are_gone_go(tmp_path):
    files = StudyFiles(tmp_path)
    files.figures.mkdir()
    gone = ("change_town_01_03.png", "change_town_01_03.webp")
    stay = ("change_town_02_03.png", "change_mine.png", "mine.png")
    for name in (*gone, *stay):
        (files.figures / name).write_bytes(b"")
    for drawn in ("change_town_01_03", "change_town_02_03"):
        files.change(drawn).write({}, [])
    files.remove_other_changes([files.figures / stay[0]])
    assert {one.name for one in files.figures.iterdir()} == {*stay}


def test_two_long_names_make_one_short_name(tmp_path):
    long, other = "x" * 120, "x" * 119 + "y"
    parts = [
        StudyFiles(tmp_path).part("place", *names)
        for names in ((long, long), (long, other), (other, long))
    ]
    for one in parts:
        one.write({}, 1)
    assert len({one.path for one in parts}) == 3
