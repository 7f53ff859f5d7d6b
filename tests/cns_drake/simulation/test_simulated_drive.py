"""A drive simulated for the evaluation is the drive that is recorded."""

import pickle

from helpers.tiny_drive import FRAMES, tiny_scenario
import numpy as np
import pytest
import yaml

from cns_drake.scenarios import load_scenario
from cns_drake.simulation import SimulationSource, simulate
from evaluation import map_drive
from evaluation.base import InputError
from evaluation.drives import open_drive


def check_same(simulated, recorded, frames):
    assert len(simulated) == len(recorded)
    assert simulated.name == recorded.name
    assert simulated.world_frame == recorded.world_frame
    np.testing.assert_array_equal(simulated.stamps_ns, recorded.stamps_ns)
    np.testing.assert_array_equal(simulated.X_WS, recorded.X_WS)
    for frame in frames:
        a, b = simulated.scan(frame), recorded.scan(frame)
        for name in b.dtype.names:
            np.testing.assert_array_equal(a[name], b[name])
        assert len(a) > 0


def test_scans_and_poses_are_those_of_a_recording(short_recording):
    recorded = open_drive(short_recording)
    source = SimulationSource(load_scenario(short_recording / "scenario.yaml"))
    simulated = pickle.loads(pickle.dumps(source))()
    check_same(simulated, recorded, [0, 1, 2, 17, 39])
    keys = ("map", "stage", "route")
    assert [simulated.scenario[k] for k in keys] == [
        recorded.scenario[k] for k in keys
    ]
    # All maps of these scans are equal as well.
    ours, theirs = (map_drive(one, 0.5) for one in (source(), recorded))
    np.testing.assert_array_equal(ours.centroids_W, theirs.centroids_W)


def test_noise_and_motion_distortion_too(tmp_path):
    """A frame's noise depends on its number only, in any order."""
    scenario = tiny_scenario(tmp_path)
    recorded = open_drive(simulate(scenario, tmp_path / "out").folder)
    simulated = SimulationSource(scenario)()
    assert len(simulated) == FRAMES
    check_same(simulated, recorded, [40, 0, 41, FRAMES - 1, 40])


def test_scans_of_a_still_world_in_any_order(tmp_path):
    """The time stands still there: only the sensor's pose differs."""
    source = SimulationSource(
        tiny_scenario(
            tmp_path, lidars={"lidar": {"preset": "vlp-16", "columns": 64}}
        )
    )
    alone = {k: source().scan(k).tobytes() for k in (10, 25, 40)}
    assert len(set(alone.values())) == 3
    together = source()
    for frame in (25, 10, 40, 40, 10, 25):
        assert together.scan(frame).tobytes() == alone[frame]
        # Views of others leave the LiDAR at their places.
        together.look(30)


def test_calibrated_returns_in_fog_too(tmp_path):
    scenario = tiny_scenario(
        tmp_path,
        frames=4,
        weather={"visibility": 30.0},
        lidars={
            "lidar": {
                "preset": "vlp-16",
                "columns": 64,
                "returns": "calibrated",
                "unit_seed": 4,
            }
        },
    )
    folder = simulate(scenario, tmp_path / "out").folder
    described = yaml.safe_load((folder / "calibration.yaml").read_text())
    assert described["lidar"]["unit_seed"] == 4
    assert described["lidar"]["elevations_deg"] == list(range(15, -16, -2))
    recorded = open_drive(folder)
    simulated = SimulationSource(scenario)()
    check_same(simulated, recorded, [2, 0, 3])
    clear = scenario.with_returns("ideal")
    assert len(SimulationSource(clear)().scan(0)) != len(simulated.scan(0))


def test_identity_differs_by_scenario_and_world(tmp_path):
    scenario = tiny_scenario(tmp_path)
    source = SimulationSource(scenario)
    other = SimulationSource(scenario.model_copy(update={"seed": 5}))
    assert source.identity() == SimulationSource(scenario).identity()
    assert source.identity() != other.identity()
    before = source.identity()
    sdf = tmp_path / "tiny.sdf"
    sdf.write_text(sdf.read_text().replace("20 12 10", "20 12 11"))
    assert source.identity() != before


def test_too_many_frames_are_refused(tmp_path):
    scenario = tiny_scenario(tmp_path, frames=100_000)
    with pytest.raises(InputError, match="frames: 100000 is too many"):
        SimulationSource(scenario)()
