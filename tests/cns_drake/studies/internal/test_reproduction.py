"""`cns-drake reproduce`: from recordings to tables."""

from helpers.counting_method import COUNTING
from helpers.internal import studies
from helpers.small_map import write_town
import pytest

from cns_drake.studies import reproduction
from evaluation.base import Cluster
from evaluation.recognition import RANDOM_YAW_PROTOCOL
from evaluation.results import QueryRows, Results
from evaluation.study import recorded_city, run

pytestmark = pytest.mark.slow
RANDOM_YAW = {"random-yaw": RANDOM_YAW_PROTOCOL}


@pytest.fixture(scope="module")
def town(tmp_path_factory):
    """Folder of a map with two drives of a few frames."""
    routes = {"01": "metropolis_01", "04": "metropolis_04"}
    return write_town(tmp_path_factory.mktemp("maps") / "town", routes, 3)


@pytest.mark.night
@pytest.mark.usefixtures("few_methods")
def test_quick_gives_the_same_tables(tmp_path, monkeypatch, own_methods):
    """The tables include controls, and come from simulation alone."""
    routes = {"01": "metropolis_04", "04": "metropolis_04"}
    town = write_town(tmp_path / "town", routes, 40)
    studies.run_here(monkeypatch, run, recorded_city, reproduction)
    cluster = Cluster()
    own = tmp_path / "counting.py"
    own.write_text(COUNTING)
    quick = reproduction.reproduce_maps(
        [str(town)],
        tmp_path / "quick",
        cluster,
        RANDOM_YAW,
        with_recordings=False,
        methods=["standard", str(own)],
    )
    assert {path.name for path in (tmp_path / "quick").iterdir()} == {"report"}
    full = reproduction.reproduce_maps(
        [str(town)],
        tmp_path / "full",
        cluster,
        RANDOM_YAW,
        with_pages=False,
        methods=["standard", str(own)],
    )
    assert (tmp_path / "full" / "town_01_stage_04" / "metadata.yaml").is_file()
    for name in ("results.csv", "queries.csv"):
        ours, theirs = (path.parent / name for path in (quick, full))
        assert ours.read_text() == theirs.read_text(), name
    assert "counting" in Results.read(quick.parent).distinct("method")
    # Both ways; the control takes the place of the earlier drive.
    matched = {
        drive
        for one in QueryRows.read(quick.parent).answers
        if one["both.stage"] == "last"
        for drive in one.columns["match_drive"]
    }
    assert matched == {"town_01_stage_04", "town_04"}
