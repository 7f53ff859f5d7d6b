"""The study of years: the jobs that it runs."""

import pytest

from cns_drake.base.jobs.cluster import Cluster
from cns_drake.studies import years
from evaluation.study.chosen_methods import MethodChoice


class PlannedError(Exception):
    """All jobs are known."""


def test_each_part_has_a_job_of_its_own(tmp_path, monkeypatch):
    """If two have one name, one of them never runs."""
    runs = []

    def note(jobs, cluster):
        runs.append(list(jobs))
        if len(runs) == 2:
            raise PlannedError

    monkeypatch.setattr(years, "run_jobs", note)
    with pytest.raises(PlannedError):
        years.measure_years(
            ["suburbia", "riverside"],
            [5, 20],
            [1, 2],
            {},
            tmp_path,
            Cluster(),
            (MethodChoice("solid"),),
            localises=True,
            updates=True,
        )
    names = [job.name for job in runs[1]]
    assert len(set(names)) == len(names)
    # Two drives, today and after two times of two histories each, both ways.
    wanted = {"map suburbia": 5, "localise task": 18, "map task": 18}
    assert wanted == {
        start: sum(name.startswith(start) for name in names) for start in wanted
    }
