"""A study that is interrupted again and again, at every file."""

import os
from pathlib import Path

from helpers.internal import studies
from helpers.small_towns import drive
import pytest

from cns_drake.base import InputError
from evaluation.study import Part, choose_methods, find_recordings
from evaluation.study.feature_extraction import FeatureExtraction

pytestmark = pytest.mark.slow


def measuring_jobs(recordings, output):
    """Returns the jobs without drawing, which takes most of the time."""
    return [
        job
        for job in studies.planned(find_recordings(recordings), output)
        if isinstance(job.step, FeatureExtraction)
        or job.name.startswith("place")
    ]


def parts(output):
    return {
        path.relative_to(output): path.read_bytes()
        for path in output.rglob("*")
        if path.is_file()
    }


def test_every_attempt_gets_further(tmp_path, monkeypatch, few_methods):
    drive(tmp_path / "in" / "metropolis_01", "01", "a")
    drive(tmp_path / "in" / "metropolis_04", "04", "b")
    whole, broken = tmp_path / "whole", tmp_path / "broken"
    studies.do(measuring_jobs(tmp_path / "in", whole))
    expected = parts(whole)
    # Two maps and the scans of each drive, a description by each method; both
    # ways what matches show, and results.
    methods = len(few_methods)
    assert len(expected) == 2 * (3 + methods) + 2 * (methods + 1)
    replace = os.replace

    def replace_and_stop(source, target):
        replace(source, target)
        # Digests of files are kept elsewhere.
        if broken in Path(target).parents:
            raise KeyboardInterrupt

    for done in range(len(expected)):
        assert len(parts(broken)) == done
        jobs = measuring_jobs(tmp_path / "in", broken)
        with monkeypatch.context() as patch:
            patch.setattr(os, "replace", replace_and_stop)
            with pytest.raises(KeyboardInterrupt):
                studies.do(jobs)
    studies.do(measuring_jobs(tmp_path / "in", broken))
    assert parts(broken) == expected


def test_a_new_recording_under_an_old_name(tmp_path, few_methods):
    for stage, route in (("01", "a"), ("04", "b")):
        drive(tmp_path / "in" / f"metropolis_{stage}", stage, route)
    out = tmp_path / "out"
    studies.do(measuring_jobs(tmp_path / "in", out))
    before = parts(out)
    for path in (tmp_path / "in" / "metropolis_01").iterdir():
        path.unlink()
    (tmp_path / "in" / "metropolis_01").rmdir()
    drive(tmp_path / "in" / "metropolis_01", "01", "b")
    studies.do(measuring_jobs(tmp_path / "in", out))
    after = parts(out)
    assert after.keys() == before.keys()
    kept = {path for path in after if after[path] == before[path]}
    assert {path.parent.name for path in kept} == {"metropolis_04"}
    assert len(kept) == 3 + len(few_methods)


@pytest.mark.night
@pytest.mark.usefixtures("few_methods", "unrendered_figures")
def test_values_that_no_result_needs_are_removed(tmp_path, monkeypatch):
    """They are made again for new results, which are as of one run."""
    for stage, route in (("01", "a"), ("04", "b")):
        drive(tmp_path / "in" / f"metropolis_{stage}", stage, route)
    recordings = tmp_path / "in"
    methods = choose_methods()
    do_jobs = studies.do

    def run(folder, methods):
        done = []
        monkeypatch.setattr(
            studies, "do", lambda jobs: done.extend(do_jobs(jobs)) or done
        )
        studies.report(recordings, tmp_path / folder, methods)
        return done

    whole = run("whole", methods)
    assert set(whole) >= {
        "features of metropolis_01",
        "features of metropolis_04",
    }
    assert run("whole", methods) == []
    features = tmp_path / "whole" / "parts" / "features"
    for path in features.rglob("*.data"):
        if not path.name.startswith("described"):
            Part(path).read()
        else:
            assert path.stat().st_size < 2000
            with pytest.raises(InputError, match="its value was removed"):
                Part(path).read()
    run("later", methods[:1])
    # New results of one method need its descriptions alone.
    shape = features.relative_to(tmp_path / "whole")
    old = tmp_path / "later" / shape / "metropolis_01" / "fine.data"
    before = old.stat().st_mtime_ns
    assert "features of metropolis_01" in run("later", methods)
    assert old.stat().st_mtime_ns == before
    for name in ("queries.csv", "results.csv"):
        expected = (tmp_path / "whole" / name).read_bytes()
        assert (tmp_path / "later" / name).read_bytes() == expected
