"""Studies are planned before their recordings exist."""

from pathlib import Path
import pickle

import pytest

from cns_drake.base.errors import InputError
from evaluation.paper import reference_for
from evaluation.study.recordings.map_drives import RecordingInfo, drives_by_map
from evaluation.study.report_jobs.stages_report import StagesReport


def info(name, stage, route="a", city="metropolis", needs=()):
    path = Path("nowhere") / name
    return RecordingInfo(name, path, city, stage, {"lanes": route}, needs)


FAMILY = [
    info("metropolis_01", "01", "a", needs=("metropolis_01",)),
    info("metropolis_02", "02", "b", needs=("metropolis_02",)),
    info("metropolis_04", "04", "c", needs=("metropolis_04",)),
    info("metropolis_01_stage_04", "04", "a"),
    # A second drive through a stage, on a route of its own.
    info("metropolis_walk", "02", "d"),
]


def test_every_recording_is_surveyed_when_it_is_made(tmp_path):
    jobs = {job.name: job for job in StagesReport(FAMILY, tmp_path).jobs()}
    features = {n: j for n, j in jobs.items() if n.startswith("features of ")}
    assert {name: job.needs for name, job in features.items()} == {
        "features of metropolis_01": ("metropolis_01",),
        "features of metropolis_02": ("metropolis_02",),
        "features of metropolis_04": ("metropolis_04",),
        "features of metropolis_01_stage_04": (),
        "features of metropolis_walk": (),
    }
    roles = {name: sorted(job.step.roles) for name, job in features.items()}
    assert roles == {
        "features of metropolis_01": ["places"],
        "features of metropolis_02": ["places"],
        "features of metropolis_04": ["queries"],
        "features of metropolis_01_stage_04": ["places"],
        "features of metropolis_walk": ["places"],
    }
    assert not any(tmp_path.iterdir())


def test_pairs_wait_for_their_features(tmp_path):
    jobs = {job.name: job for job in StagesReport(FAMILY, tmp_path).jobs()}
    both = ("features of metropolis_01", "features of metropolis_04")
    for task in ("place", "change"):
        assert (
            job_of(jobs, task, "metropolis_01", "metropolis_04").needs == both
        )
    # What is drawn is what the task has measured.
    assert jobs["draw metropolis 01 > 04"].needs == (
        job_of(jobs, "change", "metropolis_01", "metropolis_04").name,
        job_of(jobs, "change", "metropolis_01_stage_04", "metropolis_04").name,
        *both,
    )
    assert jobs["draw metropolis 02 > 04"].needs == (
        job_of(jobs, "change", "metropolis_02", "metropolis_04").name,
        "features of metropolis_02",
        "features of metropolis_04",
    )
    assert jobs["draw metropolis"].needs == (
        "features of metropolis_01",
        "features of metropolis_02",
        "features of metropolis_04",
    )
    control = job_of(jobs, "place", "metropolis_01_stage_04", "metropolis_04")
    assert control.needs == (
        "features of metropolis_01_stage_04",
        "features of metropolis_04",
    )
    own = job_of(jobs, "place", "metropolis_01", "metropolis_04")
    explained = jobs["explain metropolis_01 > metropolis_04"]
    assert explained.needs == (own.name,)
    # Five features, one city, two changes; two pairs and a control, each with
    # its change; the two drives of stage 02; two pairs are explained.
    assert len(jobs) == 5 + 1 + 2 + 2 * 3 + 1 + 2
    (together,) = (
        one
        for one in jobs.values()
        if "features of metropolis_walk" in one.needs
    )
    assert together.needs == (
        "features of metropolis_02",
        "features of metropolis_04",
        "features of metropolis_walk",
    )


def job_of(jobs, task, database, query):
    """Returns the job of a task on a pair, whose name ends with a digest."""
    start = f"{task} {database} {query} "
    (name,) = (one for one in jobs if one.startswith(start))
    return jobs[name]


def test_a_control_takes_the_place_of_one_drive():
    first = info("riverside_01", "01", "a", "riverside")
    last = info("riverside_02", "02", "b", "riverside")
    again = info("riverside_01_stage_02", "02", "a", "riverside")
    before = info("riverside_02_stage_01", "01", "b", "riverside")
    (city,) = drives_by_map([first, last, again])
    assert city.unchanged_pair(first, last) == (again, last)
    assert city.unchanged_pair(last, first) == (last, again)
    (city,) = drives_by_map([first, last, before])
    assert city.unchanged_pair(first, last) == (first, before)
    # With both, the queries keep their scans.
    (city,) = drives_by_map([first, last, before, again])
    assert city.unchanged_pair(first, last) == (again, last)
    assert city.unchanged_pair(last, first) == (before, first)
    (city,) = drives_by_map([first, last])
    assert city.unchanged_pair(first, last) is None


def test_a_control_serves_both_ways(tmp_path):
    drives = [
        info("riverside_01", "01", "a", "riverside"),
        info("riverside_02", "02", "b", "riverside"),
        info("riverside_01_stage_02", "02", "a", "riverside"),
    ]
    jobs = {
        job.name: job
        for job in StagesReport(
            drives, tmp_path, reference=reference_for({"riverside"})
        ).jobs()
    }
    roles = sorted(jobs["features of riverside_01_stage_02"].step.roles)
    assert roles == ["places", "queries"]
    for names in (
        ("riverside_01_stage_02", "riverside_02"),
        ("riverside_02", "riverside_01_stage_02"),
    ):
        assert job_of(jobs, "place", *names).step


def test_jobs_can_go_anywhere(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    river = [info(f"riverside_{s}", s, s, "riverside") for s in ("01", "02")]
    jobs = StagesReport(
        FAMILY + river, Path("out"), reference=reference_for({"riverside"})
    ).jobs()
    names = [job.name for job in jobs]
    assert len(set(names)) == len(names)
    outputs = [job.step.output for job in jobs]
    assert len(set(outputs)) == len(outputs)
    for job in jobs:
        assert tmp_path / "out" / "parts" in job.step.output.parents
        assert job.cost > 0
        assert pickle.loads(pickle.dumps(job.step)) == job.step
    # The paper has this map in both directions.
    published = [name for name in names if name.endswith(" published solid")]
    assert [name.split()[1:3] for name in published if "river" in name] == [
        ["riverside_01", "riverside_02"],
        ["riverside_02", "riverside_01"],
    ]


def test_names_of_files_stay_apart(tmp_path):
    odd = [
        info("a/b", "1", city="x"),
        info("a,b", "2", city="x"),
        info("a%2Cb", "3", city="x"),
    ]
    outputs = [job.step.output for job in StagesReport(odd, tmp_path).jobs()]
    assert len({str(path).lower() for path in outputs}) == len(outputs)
    depths = {len(path.relative_to(tmp_path).parts) for path in outputs}
    assert depths == {3}


def test_one_name_for_two_recordings(tmp_path):
    twice = [info("town_01", "01", city="a"), info("town_01", "01", city="b")]
    with pytest.raises(InputError, match=r"town_01 is there twice"):
        StagesReport(twice, tmp_path).jobs()
