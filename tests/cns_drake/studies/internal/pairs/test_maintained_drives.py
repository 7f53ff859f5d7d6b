"""Drives in maps that later drives update."""

from cns_drake.studies.pairs.simulated_pairs import with_upkept_maps
from evaluation.base import Cluster
from evaluation.drives import RecordingSource
from evaluation.study import (
    Experiment,
    NamedDrive,
    Study,
)


def test_their_maps_differ_and_nothing_else(tmp_path):
    """Their years tell the task `seen` how late a change is noticed."""
    study = Study(Experiment(name="x"), tmp_path, "x", Cluster())
    drives = [
        NamedDrive(f"d{k}", RecordingSource(tmp_path), years=k, length=9.0 + k)
        for k in (0, 5)
    ]
    kept = with_upkept_maps(study, drives, "distance")
    assert len({one.name for one in (*drives, *kept)}) == 4
    for old, new in zip(drives, kept, strict=True):
        assert (new.years, new.length) == (old.years, old.length)
        assert new.needs != old.needs
