"""The plots below the time line show the values that they are given."""

from dataclasses import replace
import re

import numpy as np
from pydrake.geometry import FrameId
from pydrake.math import RigidTransform
import pytest

from cns_drake.pictures import ShownStages
from cns_drake.pictures.drive_record import DriveRecord, ScanRecord, pack_scan
from cns_drake.pictures.page_panel import TimePlot, make_panel, motion_plots


def points(plot):
    return np.array([one.split(",") for one in plot.points.split()], float)


def test_curve_goes_from_left_to_right_and_up():
    plot = TimePlot.of("Speed", "km/h", np.array([0, 20, 10]))
    # Zero is at the bottom, the greatest value at the top.
    np.testing.assert_allclose(points(plot), [[0, 20], [200, 0], [400, 10]])
    assert plot.values == "0.0,20.0,10.0"


def test_curve_has_a_scale():
    plot = TimePlot.of("Speed", "km/h", np.array([0, 20, 10]))
    assert plot.ticks == [("0", 1.0), ("20", 0.0)]


def test_curve_of_both_signs_has_its_zero_line():
    plot = TimePlot.of("IMU, left", "m/s²", np.array([-3.0, 0.0, 1.0]))
    np.testing.assert_allclose(points(plot)[:, 1], [20.0, 5.0, 0.0])
    assert ("0", 0.25) in plot.ticks


@pytest.mark.parametrize("scale", [0.0, 0.3, 4.0, 17.0, 220.0, 9999.0])
@pytest.mark.parametrize("sign", [1, -1])
def test_scale_has_at_least_two_round_values(scale, sign):
    for unit in ("km/h", "m/s²", "deg/s"):
        ticks = TimePlot.of("a", unit, np.array([0.0, sign * scale])).ticks
        assert 2 <= len(ticks) <= 3
        assert all(0.0 <= share <= 1.0 for _, share in ticks)


@pytest.mark.parametrize("high", [0.0, 0.7, 1.0, 1.6, 2.4, 3.9, 4.99, 12.0])
@pytest.mark.parametrize("low", [0.0, -0.7, -1.49, -2.4, -4.99, -9.99, -41.0])
def test_labels_of_a_scale_do_not_touch(low, high):
    ticks = TimePlot.of("a", "m/s²", np.array([low, 0.0, high])).ticks
    shares = sorted(share for text, share in ticks if text)
    assert len(shares) >= 2
    # The plot is 22 pixels high on a phone, and digits are 8 pixels high.
    assert np.diff(shares).min() > 9.0 / 22.0


def test_zero_between_near_labels_keeps_its_line():
    plot = TimePlot.of("a", "m/s²", np.array([-2.4, 2.4]))
    assert plot.ticks == [
        ("-2", pytest.approx(4.4 / 4.8)),
        ("", 0.5),
        ("2", pytest.approx(0.4 / 4.8)),
    ]
    drive = record(2)
    drive.specific_forces_I[:] = np.array([[-2.4, 0, 9.8], [2.4, 0, 9.8]])
    html = make_panel("a", drive, set(), ShownStages())
    plot = html.partition("IMU, forward")[2].partition("</div>")[0]
    assert re.findall(r">(-?\d)</i>", plot) == ["-2", "2"]
    assert plot.count("<line") == 3


def test_times_have_a_scale():
    def scale(frames):
        html = make_panel("a", record(frames), set(), ShownStages())
        times = html.partition('id="times"')[2].partition("</div>")[0]
        return re.findall(r'left: ([\d.]+)%">([\d:]+)<', times)

    # 0.5 s a frame: 3 minutes, and half a second.
    found = [(float(share), text) for share, text in scale(361)]
    assert found == [
        (pytest.approx(100 * k / 6), f"{k // 2}:{30 * (k % 2):02d}")
        for k in range(7)
    ]
    assert scale(2) == [("0.0", "0:00")]
    # An hour and a minute.
    assert [text for _, text in scale(7321)][1::3] == ["15:00", "60:00"]


@pytest.mark.parametrize(
    ("length", "frames", "facts"),
    [
        (2.4, 5, "2 m in 2 s"),
        (999.4, 121, "999 m in 1 min 0 s"),
        (999.6, 121, "1.00 km in 1 min 0 s"),
        (1714.0, 331, "1.71 km in 2 min 45 s"),
    ],
)
def test_panel_says_length_and_duration(length, frames, facts):
    drive = record(frames)
    drive.X_WBs[-1] = RigidTransform([length, 0.0, 0.0])
    html = make_panel("a", drive, set(), ShownStages())
    assert f"<p>{facts}</p>" in html


@pytest.mark.parametrize(
    ("stride", "text"), [(1, "Every scan"), (12, "One scan in 12")]
)
def test_page_says_which_scans_it_shows(stride, text):
    html = make_panel("a", record(2), set(), ShownStages())
    assert "every point" not in html
    scans = ScanRecord(stride=stride)
    for number in (5, 61234):
        points = np.zeros((number, 3))
        scans.add(pack_scan(0, points, np.zeros(number, int), np.zeros(3)))
    html = make_panel(
        "a", replace(record(40), scans=scans), set(), ShownStages()
    )
    assert f"<p>{text}, every point: up to 61,234 a scan</p>" in html


@pytest.mark.parametrize("value", [0.0, 1e-9, -1e-9])
def test_noise_is_not_stretched(value):
    plot = TimePlot.of("IMU, turn", "deg/s", np.array([0.0, value]))
    y = points(plot)[:, 1]
    assert abs(y[0] - y[1]) < 0.1
    assert plot.values == "0.0,0.0"


def test_long_drive_has_few_samples_from_first_to_last():
    plot = TimePlot.of("Speed", "km/h", np.arange(3001.0))
    said = plot.values.split(",")
    assert len(said) == len(points(plot)) == 400
    assert (said[0], said[-1]) == ("0.0", "3000.0")


def record(frames):
    """The record of a drive with the same motion at each frame."""
    return DriveRecord(
        0.5,
        [RigidTransform()] * frames,
        speeds=[10.0] * frames,
        specific_forces_I=[np.array([1.0, 2.0, 9.81])] * frames,
        angular_velocities_I=[np.array([0.0, 0.0, np.pi])] * frames,
    )


def test_units_of_motion():
    plots = motion_plots(record(2))
    assert [(plot.name, plot.unit, plot.values) for plot in plots] == [
        ("Speed", "km/h", "36.0,36.0"),
        ("IMU, forward", "m/s²", "1.0,1.0"),
        ("IMU, left", "m/s²", "2.0,2.0"),
        ("IMU, turn", "deg/s", "180.0,180.0"),
    ]


def test_plots_stand_in_the_panel():
    html = make_panel("a", record(2), set(), ShownStages())
    assert 'data-unit="km/h" data-values="36.0,36.0"' in html
    assert (
        re.findall(r'<polyline points="([^"]*)"', html)[0]
        == "0.0,0.0 400.0,0.0"
    )
    assert ">Stage" not in html


def test_stage_stands_in_the_panel_as_text():
    shown = ShownStages(stage="02", stages=("01", "02", "03"))
    html = make_panel("a", record(2), set(), shown)
    assert "<p>Stage 02, one of 3 (01 to 03)</p>" in html
    shown = ShownStages(stage="01", stages=("01",))
    html = make_panel("a", record(2), set(), shown)
    assert ">Stage" not in html


def test_layers_that_are_there_have_switches():
    def switches(drive, changes=frozenset()):
        html = make_panel("a", drive, changes, ShownStages())
        return set(re.findall(r'<input id="(\w+)" type="checkbox"', html))

    always = {"follow", "points", "route", "city"}
    assert switches(record(2)) == always
    drive = record(2)
    drive.names[FrameId.get_new_id()] = "traffic_car_001"
    drive.images["front"] = [(0, b"jpeg")]
    assert switches(drive, {"before"}) == always | {
        "moving",
        "images",
        "change",
    }


def test_nothing_without_frames():
    assert motion_plots(record(0)) == []
    assert motion_plots(record(1)) == []
