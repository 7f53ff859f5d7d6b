"""Data sheets of one's own: what is read, and what is refused."""

import numpy as np
import pytest
import yaml

from cns_drake.sensors import make_beam_pattern
from evaluation.base import InputError
from evaluation.lidar_sheets import MOST_RINGS, find_sheet, read_sheet

GOOD = {
    "rings_deg": [[10.0, -10.0, 48]],
    "columns": 512,
    "ranges": [0.5, 60.0],
    "source": "mine",
}
ROSETTE = {
    "pattern": "rosette",
    "fov_deg": 40.0,
    "points_per_second": 1000.0,
    "ranges": [0.5, 60.0],
    "source": "mine",
}
NODDING = {
    **ROSETTE,
    "pattern": "nodding",
    "elevations_deg": [-5.0, 10.0],
}
del NODDING["fov_deg"]
GONE = object()
FAULTS = [
    ({"columns": GONE}, "columns: Field required"),
    ({"ranges": GONE}, "ranges: Field required"),
    ({"source": GONE}, "source: Field required"),
    ({"rings_deg": GONE}, "elevations_deg: missing"),
    ({"elevations_deg": [1.0, 0.0]}, "elevations_deg: give either"),
    ({"rings_deg": []}, "rings_deg: "),
    ({"rings_deg": [[-10.0, 10.0, 48]]}, "rings_deg: elevations ascend"),
    ({"rings_deg": [[10, 0, 3], [5, -5, 3]]}, "rings_deg: elevations ascend"),
    ({"rings_deg": [[10.0, -10.0, 0]]}, r"rings_deg.0.2: "),
    ({"rings_deg": [[10.0, -10.0, 10**8]]}, r"rings_deg.0.2: "),
    ({"rings_deg": [[10.0, 5.0, 300], [4.0, 0.0, 300]]}, "rings_deg: 600 ring"),
    ({"rings_deg": [[10.0, -10.0, 2.5]]}, r"rings_deg.0.2: "),
    ({"rings_deg": [[90.1, -10.0, 8]]}, r"rings_deg.0.0: "),
    ({"rings_deg": [[10.0, -90.1, 8]]}, r"rings_deg.0.1: "),
    ({"rings_deg": [[10.0, -10.0]]}, r"rings_deg.0.2: Field required"),
    ({"rings_deg": [[float("nan"), -10.0, 8]]}, r"rings_deg.0.0: "),
    ({"rings_deg": ["low"]}, r"rings_deg.0: "),
    ({"rings_deg": [[10.0, -10.0, 1]]}, "rings_deg: one ring cannot be at 10"),
    ({"rings_deg": 32}, "rings_deg: "),
    ({"rings_deg": True}, "rings_deg: "),
    (
        {"rings_deg": GONE, "elevations_deg": [0.0, 1.0]},
        "elevations_deg: elevations ascend",
    ),
    ({"rings_deg": GONE, "elevations_deg": []}, "elevations_deg: "),
    ({"rings_deg": GONE, "elevations_deg": [91.0]}, r"elevations_deg.0: "),
    (
        {"rings_deg": GONE, "elevations_deg": [0.0] * (MOST_RINGS + 1)},
        "elevations_deg: ",
    ),
    ({"columns": 10**8}, "columns: "),
    ({"columns": 0}, "columns: "),
    ({"columns": "many"}, "columns: "),
    ({"columns": True}, "columns: "),
    ({"rings_deg": [[10, 0, 512]], "columns": 8192.5}, "columns: "),
    ({"ranges": [60.0, 0.5]}, "ranges: 60 is not below 0.5"),
    ({"ranges": [1.0, 1.0]}, "ranges: 1 is not below 1"),
    ({"ranges": [-1.0, 60.0]}, r"ranges.0: "),
    ({"ranges": [0.5, 1e9]}, r"ranges.1: "),
    ({"ranges": [0.5, float("inf")]}, r"ranges.1: "),
    ({"ranges": [0.5]}, r"ranges.1: "),
    ({"ranges": "far"}, "ranges: "),
    ({"azimuths_deg": [10.0, 10.0]}, "azimuths_deg: "),
    ({"azimuths_deg": [-200.0, 200.0]}, "azimuths_deg: "),
    ({"period": 0.0}, "period: "),
    ({"period": float("nan")}, "period: "),
    ({"period": 1e-310, "fires_steadily": True}, "period: "),
    ({"period": 4.1}, "period: "),
    ({"colums": 3}, "colums: Extra .* did you mean columns"),
    ({"source": ""}, "source: "),
    ({"source": 3}, "source: "),
    ({"pattern": "laser"}, "pattern: no kind 'laser' .*spinning, rosette"),
    ({"pattern": ["spinning"]}, "pattern: "),
    ({"returns": 3}, "returns: "),
    ({"returns": {"rows": []}}, "returns.rows: "),
    ({"returns": {"rows": [[0.8, 60.0, 1.0]]}}, r"returns.rows.0.*: "),
    (
        {"returns": {"rows": [[0.8, 9, 0.9], [0.1, 9, 0.9]]}},
        "returns.rows: two",
    ),
    (
        {"returns": {"rows": [[0.1, 60, 0.9], [0.8, 20, 0.9]]}},
        "returns.rows: a target of 0.1 cannot",
    ),
    ({"returns": {"rows": [[1e-320, 60, 0.9]]}}, r"returns.rows.0.*: "),
    ({"returns": {"rows": [[0.8, 1e-200, 0.9]]}}, r"returns.rows.0.*: "),
    (
        {"returns": {"head": {"blocks": [[0.0, 0.1, 1], [5.0, 0.0, 1]]}}},
        "returns.head.blocks: elevations ascend",
    ),
    (
        {"returns": {"head": {"elevations_deg": [10.0, 0.0, -10.0]}}},
        ".*returns.head.elevations_deg: 3 elevations of 48 rings",
    ),
    (
        {"returns": {"rows": [[0.8, 60, 0.9], [0.5, 20, 0.9]]}},
        "returns: rows: these two say that echoes get stronger",
    ),
    ({"returns": {"range_noise": -1.0}}, "returns.range_noise: "),
    ({"returns": {"noise": 1.0}}, "returns.noise: Extra"),
    ({"returns": {"head": {"alternate": 5.0}}}, "returns.head: alternate: 5"),
    ({"returns": {"response": {"gain": "much"}}}, "returns.response.gain: "),
]


def write(path, values):
    kept = {name: one for name, one in values.items() if one is not GONE}
    path.write_text(yaml.safe_dump(kept))
    return path


@pytest.mark.parametrize(("changes", "fault"), FAULTS)
def test_faults_are_one_line_with_file_and_field(tmp_path, changes, fault):
    path = write(tmp_path / "unit.yaml", {**GOOD, **changes})
    with pytest.raises(InputError, match=rf"^{path}: {fault}") as error:
        read_sheet(path)
    assert "\n" not in str(error.value)
    assert len(str(error.value)) < 1000


@pytest.mark.parametrize(
    ("sheet", "changes", "fault"),
    [
        (ROSETTE, {"fov_deg": GONE}, "fov_deg: Field required"),
        (ROSETTE, {"columns": 512}, "columns: Extra"),
        (ROSETTE, {"points_per_second": 1e8}, "points_per_second: .*beams"),
        (ROSETTE, {"num_lines": 0}, "num_lines: "),
        (NODDING, {"elevations_deg": [10.0, -5.0]}, "elevations_deg: not the"),
        (NODDING, {"fov_deg": 10.0}, "fov_deg: Extra"),
    ],
)
def test_faults_of_other_kinds(tmp_path, sheet, changes, fault):
    read_sheet(write(tmp_path / "good.yaml", sheet))
    path = write(tmp_path / "unit.yaml", {**sheet, **changes})
    with pytest.raises(InputError, match=rf"^{path}: {fault}"):
        read_sheet(path)


@pytest.mark.parametrize(
    ("text", "fault"),
    [
        ("mine", "not a mapping"),
        (f"elevations_deg: [{'0.0, ' * 20_000}0.0]", "elevations_deg: "),
    ],
)
def test_other_texts_are_no_sheets(tmp_path, text, fault):
    path = tmp_path / "unit.yaml"
    path.write_text(text)
    with pytest.raises(InputError, match=rf"^{path}: {fault}"):
        read_sheet(path)
    with pytest.raises(InputError, match=r"nowhere.yaml: No such file"):
        find_sheet("nowhere.yaml")


@pytest.mark.parametrize("rings", [[3.0], [[3.0, 3.0, 2]]])
def test_a_level_lidar_has_no_other_rings(tmp_path, rings):
    """They would all be at one elevation."""
    sheet = read_sheet(write(tmp_path / "u.yaml", {**GOOD, "rings_deg": rings}))
    with pytest.raises(ValueError, match=r"rings: all .* are at 3 deg"):
        sheet.with_rings(8)


@pytest.mark.parametrize("period", [0.0, -1.0, 1e9, float("inf")])
def test_periods_are_bounded(tmp_path, period):
    """A revolution of a steady LiDAR has as many columns as it takes time."""
    for name in ("vlp-16", write(tmp_path / "rosette.yaml", ROSETTE)):
        with pytest.raises(ValueError, match=r"^period: "):
            make_beam_pattern(name, period)


def test_a_small_file_stays_cheap(tmp_path):
    """The largest sheet that is read has no more than four million beams."""
    largest = {**GOOD, "rings_deg": [[10.0, -10.0, 512]], "columns": 8192}
    sheet = read_sheet(write(tmp_path / "unit.yaml", largest))
    assert sheet.num_rings * sheet.columns == 2**22


def test_rings_one_by_one_are_those_of_a_block(tmp_path):
    listed = {k: one for k, one in GOOD.items() if k != "rings_deg"}
    elevations = np.linspace(10.0, -10.0, 48).tolist()
    listed["elevations_deg"] = elevations
    mixed = {**GOOD, "rings_deg": [*elevations[:8], [*elevations[8::39], 40]]}
    patterns = [
        make_beam_pattern(write(tmp_path / f"{k}.yaml", sheet))
        for k, sheet in enumerate((GOOD, listed, mixed))
    ]
    for pattern in patterns:
        np.testing.assert_allclose(
            np.degrees(pattern.elevations_rad), elevations, atol=1e-12
        )
    assert patterns[0] == patterns[1]


def test_the_way_that_a_lidar_turns(tmp_path):
    """From the right to the left, counter-clockwise."""
    path = write(tmp_path / "u.yaml", {**GOOD, "azimuths_deg": [-90.0, 90.0]})
    beams = make_beam_pattern(path).beams(0)
    azimuth = np.degrees(np.arctan2(beams.d_Sset[:, 1], beams.d_Sset[:, 0]))
    assert azimuth[0] == pytest.approx(-90.0)
    assert azimuth[-1] == pytest.approx(90.0)
    assert (np.diff(azimuth) > -1e-9).all()


def test_a_slower_turn_of_a_steady_lidar_has_more_columns(tmp_path):
    path = write(tmp_path / "unit.yaml", {**GOOD, "fires_steadily": True})
    assert make_beam_pattern(path, 0.1).num_columns == 1024
    path = write(tmp_path / "unit.yaml", GOOD)
    assert make_beam_pattern(path, 0.1).num_columns == 512
