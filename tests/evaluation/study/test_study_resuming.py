"""A study that is interrupted again and again, at every file."""

import os

from helpers import studies
from helpers.small_towns import drive
import pytest

from evaluation.study.collection import find_recordings
from evaluation.study.plan import Study
from evaluation.study.surveys import Survey

pytestmark = pytest.mark.slow


def measuring_jobs(recordings, output):
    """Returns the jobs without drawing, which takes most of the time."""
    return [
        job
        for job in Study(find_recordings(recordings), output).jobs()
        if isinstance(job.step, Survey)
        or (" > " in job.name and not job.name.startswith("change"))
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
    # Two maps and the scans of each drive, a description by each method;
    # results, and reasons for wrong ones.
    methods = len(few_methods)
    assert len(expected) == 2 * (3 + methods) + methods + 1
    replace = os.replace

    def replace_and_stop(source, target):
        replace(source, target)
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
