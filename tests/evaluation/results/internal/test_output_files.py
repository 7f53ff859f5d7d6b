"""A folder of results keeps the user's files, and no files of earlier runs."""

import pytest

from evaluation.base import InputError
from evaluation.results import (
    QUERIES,
    RESULTS,
    QueryRows,
    Results,
    make_output,
    write_tables,
)
from evaluation.results.output_files import remove_earlier

TABLE = "experiment,map,task,method,verified,metric,value,low,high,n\n"
OWN = {
    RESULTS: TABLE + "map-update,a,map,b,0,miou,1,,,1\n",
    "queries.csv": "experiment\n",
    "index.html": "<p>Made by cns-drake 3.0.0; protocol: paper</p>",
    "summaries.csv": "a\n",
    "chart_1.pdf": "a",
    "chart_12.png": "a",
    "localisation.csv": "frame,stamp_ns,translation_error,along\n",
    "track.png": "a",
    "A.npy": "a",
    "B.npy": "a",
}
OTHERS = ["notes.txt", "chart_1.eps", "my_chart_1.png", "C.npy", "track.pdf"]
GROUPS = ["page", "localise", "map-update"]


def write(folder, files):
    for name, text in files.items():
        (folder / name).write_text(text)


def names(folder):
    return {path.name for path in folder.iterdir()}


def test_files_of_an_earlier_run_go_and_others_stay(tmp_path):
    write(tmp_path, OWN | dict.fromkeys(OTHERS, "mine"))
    (tmp_path / "parts").mkdir()
    make_output(tmp_path, GROUPS)
    remove_earlier(tmp_path)
    assert names(tmp_path) == {*OTHERS, "parts"}


def test_earlier_tables_stay_if_new_ones_cannot_be_written(tmp_path):
    """The tables of a pair belong together."""
    earlier = {name: OWN[name] for name in (RESULTS, QUERIES)}
    write(tmp_path, earlier)

    class Broken(QueryRows):
        def write_csv(self, path):
            path.write_text("half")
            raise InputError(f"{path}: File too large")

    fault = rf"^{tmp_path / QUERIES}: File too large"
    with pytest.raises(InputError, match=fault):
        write_tables(tmp_path, Results((), ()), Broken((), ()))
    assert {one.name: one.read_text() for one in tmp_path.iterdir()} == earlier


@pytest.mark.parametrize("name", OWN)
def test_a_file_that_no_run_wrote_is_neither_removed_nor_overwritten(
    tmp_path, name
):
    (tmp_path / name).write_text("mine")
    with pytest.raises(InputError, match="no earlier run wrote it") as refusal:
        make_output(tmp_path, GROUPS)
    assert str(refusal.value).startswith(str(tmp_path / name))
    remove_earlier(tmp_path)
    assert (tmp_path / name).read_text() == "mine"


@pytest.mark.parametrize("name", sorted(OWN.keys() - {RESULTS, "queries.csv"}))
def test_beside_results_of_another_command_it_stays(tmp_path, name):
    write(tmp_path, {RESULTS: TABLE + "pr,a,place,b,0,auc,1,,,1\n"})
    (tmp_path / name).write_text("mine")
    make_output(tmp_path)
    remove_earlier(tmp_path)
    assert names(tmp_path) == {name}


def test_an_interrupted_run_can_continue(tmp_path):
    write(tmp_path, {RESULTS: TABLE, "chart_1.png": "a", "summaries.csv": "a"})
    make_output(tmp_path, GROUPS)
