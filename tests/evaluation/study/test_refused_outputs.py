"""What cannot be written is refused before anything is measured."""

import pytest

from evaluation.base import InputError, choose_cluster
from evaluation.recognition import RANDOM_YAW_PROTOCOL, choose_methods
from evaluation.results import check_output
from evaluation.study import study_recordings

PROTOCOLS = {"random-yaw": RANDOM_YAW_PROTOCOL}


def measure(output):
    cluster = choose_cluster(1, None)
    methods = choose_methods(["solid"])
    study_recordings([], output, cluster, methods, PROTOCOLS, source="nowhere")


@pytest.mark.parametrize("name", ["results.csv", "queries.csv"])
def test_a_link_is_refused_at_once(tmp_path, name):
    elsewhere = tmp_path / "mine.csv"
    elsewhere.write_text("mine")
    output = tmp_path / "study"
    output.mkdir()
    (output / name).symlink_to(elsewhere)
    with pytest.raises(InputError, match=rf"{name}: a link; give the name"):
        measure(output)
    assert elsewhere.read_text() == "mine"
    assert sorted(path.name for path in output.iterdir()) == [name]


def test_a_dead_link_is_no_folder(tmp_path):
    output = tmp_path / "study"
    output.symlink_to(tmp_path / "gone")
    with pytest.raises(InputError, match="study: not a folder"):
        measure(output)


def test_outputs_need_not_exist(tmp_path):
    check_output(tmp_path / "new" / "study", ["page"])
    assert not (tmp_path / "new").exists()
    (tmp_path / "other.csv").write_text("mine")
    check_output(tmp_path, ["page"])
    (tmp_path / "index.html").mkdir()
    with pytest.raises(InputError, match=r"index\.html: a folder has this"):
        check_output(tmp_path, ["page"])
