"""What the tests of ageing share."""

from helpers.recorded_traffic import write_rounds
from helpers.small_city import write_small_city
import pytest

from worlds.city import generate_city

_DRIVE = """
map: .
stage: "02"
title: Around the north
route:
  - {road: north, direction: forward, lane: 1, start: 10.0, end: 120.0}
speeds: {cruise: 8.0}
"""


@pytest.fixture(scope="module")
def town(tmp_path_factory):
    folder = write_small_city(tmp_path_factory.mktemp("age") / "town")
    generate_city(folder)
    (folder / "sequence_02.yaml").write_text(_DRIVE)
    write_rounds(folder / "traffic.npz")
    return folder
