"""Recordings of added and removed objects: interrupted and resumed."""

import shutil

from helpers.tiny_drive import tiny_scenario
from helpers.transient_town import ORIGIN, write_transient_town
from pydrake.math import RigidTransform, RollPitchYaw
import pytest

from cns_drake.simulation.simulation import simulate

pytestmark = pytest.mark.slow

# More than fits into a chunk of the recording.
FRAMES = 30
UNIT = {"preset": "vlp-16", "columns": 256, "range_noise": 0.02}


def test_a_resumed_recording_has_the_same_bytes(tmp_path):
    X_WT = RigidTransform(RollPitchYaw(*ORIGIN[3:]), ORIGIN[:3])
    sdf = write_transient_town(tmp_path)
    way = tmp_path / "way.csv"
    way.write_text(
        "x,y\n"
        + "".join(
            "{:.3f},{:.3f}\n".format(*(X_WT @ [x, -1.0, 0.0])[:2])
            for x in (-40.0, 0.0, 40.0)
        )
    )
    scenario = tiny_scenario(
        tmp_path,
        world=str(sdf),
        waypoints=str(way),
        lidars={"lidar": UNIT},
        frames=FRAMES,
        transient={
            "seed": 5,
            "parked_cars": 0.5,
            "leaves": 0.3,
            "snow": 0.2,
            "furniture": 0.5,
        },
    )
    whole = simulate(scenario, tmp_path / "whole").folder
    name = whole.name
    mcap = (whole / f"{name}_0.mcap").read_bytes()
    folder = tmp_path / "cut" / name
    folder.mkdir(parents=True)
    (folder / f"{name}_0.mcap.part").write_bytes(mcap[: int(0.9 * len(mcap))])
    shutil.copy(whole / "fingerprint.txt", folder / "fingerprint.txt.part")
    assert 0 < simulate(scenario, folder.parent).resumed_frames < FRAMES
    assert (folder / f"{name}_0.mcap").read_bytes() == mcap
