"""Costs of methods in the report."""

import csv
import pickle

from helpers import studies
from helpers.small_towns import drive
import pytest

from evaluation.methods import shipped_methods
from evaluation.recognition import costs, search
from evaluation.study.recordings.recording_search import find_recordings
from evaluation.study.report_jobs.stages_report import StagesReport
from evaluation.study.storage.study_files import StudyFiles

pytestmark = pytest.mark.slow


@pytest.mark.night
@pytest.mark.usefixtures("unrendered_figures")
def test_costs_in_the_report(tmp_path, monkeypatch):
    # A clock that advances by 1 ms whenever it is read.
    ticks = iter(range(0, 10**12, 10**6))
    for module in (costs, search):
        monkeypatch.setattr(module, "process_time_ns", lambda: next(ticks))
    for stage, route in (("01", "a"), ("02", "b")):
        drive(tmp_path / "in" / f"town_{stage}", stage, route, city="town")
    found = find_recordings(tmp_path / "in")
    output = tmp_path / "out"
    study = StagesReport(found, output, with_costs=True)
    jobs = study.jobs()
    # The job runs alone on the machine.
    assert set(jobs[-1].needs) == {job.name for job in jobs[:-1]}
    studies.do(jobs)
    assert jobs[-1].step.is_done()
    files = StudyFiles(output)
    described = {
        name: files.features("town_01").described(name).read()[1]
        for name in shipped_methods()
    }
    path = study.assemble(with_tables=True)
    with (output / "costs.csv").open(newline="") as stream:
        rows = {row["method"]: row for row in csv.DictReader(stream)}
    assert tuple(rows) == shipped_methods()
    for name, row in rows.items():
        assert float(row["describe_ms"]) == float(row["query_ms"]) == 1.0
        assert row["scans_per_place"] == ("10" if name == "btc" else "1")
        places = described[name].places.descriptors
        sizes = [len(pickle.dumps(one, protocol=5)) for one in places]
        assert float(row["place_bytes"]) == sum(sizes) / len(sizes)
        assert int(row["places"]) == len(places)
    for name in ("report.html", "report.md"):
        assert "What the methods cost" in path.with_name(name).read_text()
