"""Reading a drive while it is recorded."""

import shutil

from helpers.tiny_drive import FRAMES, tiny_scenario
import numpy as np
import pytest

from cns_drake.base.errors import InputError
from cns_drake.recording import bag_writer
from cns_drake.simulation.simulation import simulate
from evaluation.drives import open_drive

pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def scenario(tmp_path_factory):
    return tiny_scenario(tmp_path_factory.mktemp("scenario"))


@pytest.fixture(scope="module")
def recorded(scenario, tmp_path_factory):
    """Folder of a recording that was not read meanwhile."""
    return simulate(scenario, tmp_path_factory.mktemp("output")).folder


def contents(folder):
    return {path.name: path.read_bytes() for path in folder.iterdir()}


@pytest.mark.parametrize("num_read", [0, 1, 7, FRAMES])
def test_scans_read_are_those_recorded(scenario, recorded, tmp_path, num_read):
    scans, drives = [], []

    def read(drive):
        drives.append(drive)
        scans.extend(drive.scan(k) for k in range(num_read))

    run = simulate(scenario, tmp_path, reader=read)
    assert contents(run.folder) == contents(recorded)
    (drive,) = drives
    expected = open_drive(recorded)
    assert len(scans) == num_read
    for k, scan in enumerate(scans):
        np.testing.assert_array_equal(scan, expected.scan(k))
    assert len(drive) == len(expected) == FRAMES
    for name in ("X_WS", "stamps_ns"):
        np.testing.assert_array_equal(
            getattr(drive, name), getattr(expected, name)
        )
    assert drive.name == expected.name
    assert drive.world_frame == expected.world_frame
    assert drive.instances == expected.instances


def test_what_was_recorded_before_is_not_read(scenario, recorded, tmp_path):
    folder = shutil.copytree(recorded, tmp_path / recorded.name)
    mcap = folder / f"{recorded.name}_0.mcap"
    mcap.rename(mcap.with_name(f"{mcap.name}.part"))
    (folder / "metadata.yaml").unlink()
    run = simulate(
        scenario, tmp_path, reader=lambda drive: pytest.fail("is read")
    )
    assert run.resumed_frames > 0
    assert contents(folder) == contents(recorded)


def test_a_fault_of_the_simulation_is_not_lost(scenario, tmp_path, monkeypatch):
    """It is raised even if the reader catches it."""
    write = bag_writer.BagWriter.write

    def fail(bag, topic, stamp_ns, *rest):
        if bag._counts[topic] == 5:
            raise InputError("DISK: full")
        write(bag, topic, stamp_ns, *rest)

    monkeypatch.setattr(bag_writer.BagWriter, "write", fail)

    def read(drive):
        for k in range(len(drive)):
            try:
                drive.scan(k)
            except Exception:
                return

    with pytest.raises(InputError, match="DISK: full"):
        simulate(scenario, tmp_path, reader=read)
    assert not (tmp_path / scenario.name / "metadata.yaml").exists()


def test_a_vehicle_elsewhere_is_noticed(scenario, tmp_path):
    faults = []

    def read(drive):
        X_WB = drive.X_WBs[3]
        X_WB.set_translation(X_WB.translation() + np.full(3, 1e-12))
        for k in range(3):
            drive.scan(k)
        try:
            drive.scan(3)
        except ValueError as error:
            faults.append(str(error))

    simulate(scenario, tmp_path, reader=read)
    assert faults == ["frame 3: the vehicle is not at its planned place"]
