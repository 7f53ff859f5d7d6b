"""The example of a new kind of sensor measures, and is recorded."""

import itertools
import json

from helpers.bag_recordings import messages_by_topic
from helpers.tiny_drive import tiny_scenario
from mcap.reader import make_reader
import numpy as np
from pydantic import ValidationError
import pytest

from cns_drake.simulation import make_station, simulate
from docs.examples.gnss import METRES_PER_DEG, GnssScenario, with_gnss

FRAMES = 6


@pytest.fixture(scope="module")
def scenario(tmp_path_factory):
    folder = tmp_path_factory.mktemp("gnss")
    return with_gnss(tiny_scenario(folder), FRAMES)


@pytest.fixture(scope="module")
def recording(scenario, tmp_path_factory):
    return simulate(scenario, tmp_path_factory.mktemp("recordings")).folder


@pytest.fixture(scope="module")
def messages(recording):
    return messages_by_topic(recording)


def test_fixes_are_places_on_the_vehicle_with_noise(scenario, messages):
    fixes, odometry = messages["/gnss/fix"], messages["/odometry"]
    assert len(fixes) == 10 * (FRAMES - 1) + 1
    assert {b[0] - a[0] for a, b in itertools.pairwise(fixes)} == {5_000_000}
    at_scans = fixes[::10]
    assert [fix[0] for fix in at_scans] == [one[0] for one in odometry]
    errors = []
    for (_, fix), (_, pose) in zip(at_scans, odometry, strict=True):
        place = pose.pose.pose.position
        latitude, longitude = scenario.gnss.origin_deg
        north = (fix.latitude - latitude) * METRES_PER_DEG
        east = (fix.longitude - longitude) * METRES_PER_DEG
        east *= np.cos(np.radians(latitude))
        errors += [east - place.x, north - place.y, fix.altitude - 1.9]
        assert fix.header.frame_id == "gnss"
        assert fix.position_covariance[0] == pytest.approx(0.25)
    assert 0.2 < np.std(errors) < 0.9


def test_its_frame_is_known(recording, messages):
    (static,) = messages["/tf_static"]
    places = {
        one.child_frame_id: one.transform.translation.z
        for one in static[1].transforms
    }
    assert places["gnss"] == 1.9
    (file,) = recording.glob("*.mcap")
    with open(file, "rb") as stream:
        (calibration,) = (
            json.loads(one.data)
            for one in make_reader(stream).iter_attachments()
            if one.name == "calibration.json"
        )
    assert calibration["gnss"]["translation"] == [0.0, 0.0, 1.9]


def test_the_station_exports_its_port(scenario):
    diagram = make_station(scenario)
    context = diagram.CreateDefaultContext()
    p_WG = diagram.GetOutputPort("gnss").Eval(context)
    assert p_WG.shape == (3,)


def test_its_rate_and_name_are_checked(scenario):
    values = scenario.model_dump(exclude_none=True)
    with pytest.raises(ValidationError, match="must be a number from 20"):
        GnssScenario(**values | {"gnss": {"rate": 10}})
    lidars = {"gnss": values["lidars"]["lidar"]}
    with pytest.raises(ValidationError, match="name of another frame"):
        GnssScenario(**values | {"lidars": lidars})
