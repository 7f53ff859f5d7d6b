"""Which folders are searched for recordings."""

import pytest

from cns_drake.base import InputError
from evaluation.study import find_recordings
from evaluation.study.recordings import recording_search


def write_cns(folder, stage):
    """Writes a drive in CNS' layout, without a scan that could be opened."""
    (folder / "pcd").mkdir(parents=True)
    (folder / "gt.csv").write_text("")


def test_drives_are_found_three_levels_down(tmp_path, monkeypatch):
    for place in ("Town/01", "deep/Town/02", "very/deep/Town/03"):
        write_cns(tmp_path / place, "01")
    (tmp_path / "Town/notes.txt").write_text("")
    seen = []
    monkeypatch.setattr(
        recording_search,
        "_recording_info",
        lambda path, *rest: seen.append(path),
    )
    with pytest.raises(InputError, match="map and stage are unknown"):
        find_recordings(tmp_path)
    assert seen == [tmp_path / "Town/01", tmp_path / "deep/Town/02"]


@pytest.mark.parametrize("levels", [2, 3])
def test_a_search_has_an_end(tmp_path, monkeypatch, levels):
    """A whole disk is not searched; so many files cost nothing."""
    monkeypatch.setattr(recording_search, "_MOST_FOLDERS", 5)
    inner = tmp_path.joinpath(*"abc"[: levels - 1])
    for k in range(5 - (levels - 2)):
        (inner / f"{k}").mkdir(parents=True)
    for k in range(20):
        (inner / f"{k}.txt").write_text("")
    with pytest.raises(InputError, match="no recorded drive in it"):
        find_recordings(tmp_path)
    (inner / "one more").mkdir()
    fault = "more than 5 folders in it; give the folder of the recordings"
    with pytest.raises(InputError, match=fault):
        find_recordings(tmp_path)
