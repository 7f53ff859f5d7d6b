"""The data sheets that ship, read by other means and against known facts."""

import math
from pathlib import Path

import numpy as np
import pytest
import yaml

from cns_drake.sensors import make_beam_pattern
from evaluation.drives import lidar_field
import evaluation.lidar_sheets
from evaluation.lidar_sheets import LIDAR_PRESETS, find_sheet, read_sheet

FOLDER = Path(evaluation.lidar_sheets.__file__).parent
FILES = sorted(FOLDER.glob("*.yaml"))
# What the manufacturers state: rings, highest and lowest elevation [deg],
# columns at 20 Hz, and greatest range [m].
FACTS = {
    "vlp-16": (16, 15.0, -15.0, 900, 100.0),
    "hdl-32e": (32, 10.67, -30.67, 1085, 100.0),
    "hdl-64e": (64, 2.0, -24.33, 1040, 120.0),
    "alpha-prime": (128, 15.0, -25.0, 938, 245.0),
    "os0-128": (128, 45.0, -45.0, 1024, 50.0),
    "os1-32": (32, 22.5, -22.5, 1024, 120.0),
    "os1-64": (64, 22.5, -22.5, 1024, 120.0),
    "os1-128": (128, 22.5, -22.5, 1024, 120.0),
    "os1-64-33": (64, 16.6, -16.6, 1024, 120.0),
    "os1-128-42": (128, 21.2, -21.2, 1024, 200.0),
    "hesai-pandar64": (64, 15.0, -25.0, 900, 200.0),
    "hesai-pandar-xt32": (32, 15.0, -16.0, 1000, 120.0),
    "cns": (32, 22.5, -22.5, 1024, 120.0),
}


def elevations_in(values):
    """The elevations of a sheet's rings, by loops over its entries [deg]."""
    found = []
    for entry in values.get("rings_deg", values.get("elevations_deg")):
        if isinstance(entry, list):
            first, last, number = entry
            for k in range(number):
                part = k / (number - 1) if number > 1 else 0.0
                found.append(first + part * (last - first))
        else:
            found.append(entry)
    return found


def test_every_file_of_the_folder_is_a_preset():
    assert {file.stem for file in FILES} == set(LIDAR_PRESETS)
    assert LIDAR_PRESETS.keys() >= FACTS.keys()


@pytest.mark.parametrize("file", FILES, ids=lambda file: file.stem)
def test_the_beams_are_those_of_the_file(file):
    values = yaml.safe_load(file.read_text())
    pattern = make_beam_pattern(file.stem)
    assert pattern == make_beam_pattern(file)
    assert [pattern.min_range, pattern.max_range] == values["ranges"]
    beams = pattern.beams(0)
    elevation = np.degrees(np.arcsin(beams.d_Sset[:, 2]))
    if "pattern" in values:
        number = values["points_per_second"] * pattern.period
        assert len(elevation) == pytest.approx(number, abs=6)
        low, high = find_sheet(file.stem).field_deg
        assert low - 1e-9 <= elevation.min() < elevation.max() <= high + 1e-9
        return
    expected = elevations_in(values)
    assert len(elevation) == len(expected) * values["columns"]
    for ring, degrees in enumerate(expected):
        np.testing.assert_allclose(
            elevation[beams.ring == ring], degrees, atol=1e-9
        )


@pytest.mark.parametrize("name", FACTS)
def test_the_facts_of_data_sheets(name):
    rings, top, bottom, columns, farthest = FACTS[name]
    pattern = make_beam_pattern(name, 0.05)
    elevations = np.degrees(pattern.elevations_rad)
    assert len(elevations) == rings
    assert (elevations[0], elevations[-1]) == pytest.approx((top, bottom))
    assert pattern.num_columns == columns
    assert pattern.max_range == farthest
    assert lidar_field(name) == (rings, bottom, top)


def test_a_vlp_16_has_steps_of_two_degrees():
    elevations = np.degrees(make_beam_pattern("vlp-16").elevations_rad)
    np.testing.assert_allclose(elevations, np.arange(15.0, -16.0, -2.0))


@pytest.mark.parametrize("name", LIDAR_PRESETS)
def test_a_sheet_survives_its_own_fields(name, tmp_path):
    """What a recording states of a sheet makes the same sheet."""
    sheet = LIDAR_PRESETS[name]
    path = tmp_path / "copy.yaml"
    path.write_text(yaml.safe_dump(sheet.to_fields()))
    assert read_sheet(path) == sheet
    assert lidar_field(sheet.to_fields()) == lidar_field(name)


def test_fewer_rings_fill_the_same_field():
    sheet = LIDAR_PRESETS["hdl-64e"].with_rings(12)
    expected = [2.0 - k * 26.33 / 11.0 for k in range(12)]
    np.testing.assert_allclose(sheet.elevations, expected, atol=1e-12)
    # The elevations that were measured are those of other lasers.
    assert sheet.returns.head.elevations_deg == ()
    assert math.isinf(LIDAR_PRESETS["cns"].returns.response.far)
