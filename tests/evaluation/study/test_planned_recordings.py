"""Studies are planned before their recordings exist."""

from pathlib import Path
import pickle

from helpers.internal import studies
import pytest

from evaluation.base import InputError
from evaluation.recognition import PROTOCOLS
from evaluation.study import RecordingInfo, drives_by_map


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


def test_every_recording_is_read_once_when_it_is_made(tmp_path):
    jobs = {job.name: job for job in studies.planned(FAMILY, tmp_path)}
    features = {n: j for n, j in jobs.items() if n.startswith("features of ")}
    assert {name: job.needs for name, job in features.items()} == {
        "features of metropolis_01": ("metropolis_01",),
        "features of metropolis_02": ("metropolis_02",),
        "features of metropolis_04": ("metropolis_04",),
        "features of metropolis_01_stage_04": (),
    }
    roles = {name: sorted(job.step.roles) for name, job in features.items()}
    assert roles == {
        "features of metropolis_01": ["places"],
        "features of metropolis_02": ["places"],
        "features of metropolis_04": ["queries"],
        "features of metropolis_01_stage_04": ["places"],
    }
    assert not any(tmp_path.iterdir())


def test_two_protocols_read_a_drive_once(tmp_path):
    """Places of methods that merge scans differ; so do all queries."""
    both = {name: PROTOCOLS[name] for name in ("random-yaw", "paper")}
    jobs = studies.planned(FAMILY, tmp_path, protocols=both)
    names = [job.name for job in jobs]
    assert sum("features of" in name for name in names) == 4
    assert not [name for name in names if name.startswith("describe")]
    further = {
        job.name: {
            (choice.name, role)
            for choice, roles, protocol in job.step.further
            for role in roles
            if protocol == PROTOCOLS["paper"]
        }
        for job in jobs
        if job.name.startswith("features of")
    }
    of_the_paper = ("ring++", "btc", "scan-context++", "solid")
    queries = {(name, "queries") for name in of_the_paper}
    assert further["features of metropolis_04"] == queries
    assert further["features of metropolis_01"] == {("btc", "places")}


def test_pairs_wait_for_their_features(tmp_path):
    jobs = {job.name: job for job in studies.planned(FAMILY, tmp_path)}
    both = ("features of metropolis_01", "features of metropolis_04")
    assert job_of(jobs, "place", "metropolis_01", "metropolis_04").needs == both
    change = "change metropolis_01,metropolis_04"
    assert jobs[change].needs == both
    # Pictures are drawn once the tables are written, when all is there.
    assert jobs["draw metropolis 01 > 04"].needs == ()
    assert jobs["draw metropolis"].needs == ()
    control = job_of(jobs, "place", "metropolis_01_stage_04", "metropolis_04")
    assert control.needs == (
        "features of metropolis_01_stage_04",
        "features of metropolis_04",
    )
    # Four features, one city, two changes; two pairs and a control, each with
    # its change.
    assert len(jobs) == 4 + 1 + 2 + 2 * 3


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
    jobs = {job.name: job for job in studies.planned(drives, tmp_path)}
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
    both = {name: PROTOCOLS[name] for name in ("random-yaw", "paper")}
    jobs = studies.planned(FAMILY + river, Path("out"), protocols=both)
    names = [job.name for job in jobs]
    assert len(set(names)) == len(names)
    outputs = [job.step.output for job in jobs]
    assert len(set(outputs)) == len(outputs)
    for job in jobs:
        assert tmp_path / "out" / "parts" in job.step.output.parents
        assert job.cost > 0
        assert pickle.loads(pickle.dumps(job.step)) == job.step
    # Two drives are compared both ways, by both protocols.
    compared = [name.split()[1:3] for name in names if "place river" in name]
    there, back = (
        ["riverside_01", "riverside_02"],
        ["riverside_02", "riverside_01"],
    )
    assert compared == [there, there, back, back]


def test_names_of_files_stay_apart(tmp_path):
    odd = [
        info("a/b", "1", city="x"),
        info("a,b", "2", city="x"),
        info("a%2Cb", "3", city="x"),
    ]
    outputs = [job.step.output for job in studies.planned(odd, tmp_path)]
    assert len({str(path).lower() for path in outputs}) == len(outputs)
    depths = {len(path.relative_to(tmp_path).parts) for path in outputs}
    assert depths == {3}


def test_one_name_for_two_recordings(tmp_path):
    twice = [info("town_01", "01", city="a"), info("town_01", "01", city="b")]
    with pytest.raises(InputError, match=r"town_01 is there twice"):
        studies.planned(twice, tmp_path)
