"""What the functions return is what the commands print and write."""

import json
import math

from helpers.drive_files import make_scan, write_recording, yaw_pose
from helpers.internal.eval_program import run
import numpy as np
import pytest

from evaluation import (
    change_between,
    localise,
    make_method,
    open_drive,
    recognise,
    update_map,
)
from evaluation.base import InputError, json_values
from evaluation.drives import MovedDrive
from evaluation.recognition import METRICS, RetrievalProtocol
from evaluation.results import QueryRows, Results, compare_tables, draw_chart

OWN = """
from evaluation import register_metric


@register_metric("share_right", "share of right answers", least=0, greatest=1)
def share_right(outcomes):
    return outcomes.is_right.mean()
"""


@pytest.fixture(autouse=True)
def only_shipped():
    """Forgets the metrics of a test's files."""
    known = dict(METRICS._members)
    yield
    METRICS._members = known


def both(towns):
    return towns / "town_01", towns / "town_02"


def printed(capsys, *words):
    """Returns what a command prints, as an object and as lines."""
    status, out, _ = run(capsys, *words, "--json")
    assert status == 0
    _, text, _ = run(capsys, *words)
    return json.loads(out), text.splitlines()


def check_printed(found, values, lines, *tasks):
    """Checks that a command prints each metric of its tasks."""
    assert found.metrics.keys() == {
        name
        for name, one in METRICS.items()
        if {*tasks} & {*one.tasks} and not one.is_compared
    }
    # Times differ from run to run.
    now = json.loads(json.dumps(found.to_json()))
    assert {**now, "seconds_mean": 0} == {**values, "seconds_mean": 0}
    for name, value in found.metrics.items():
        assert values[name] == json_values(value), name
        label = METRICS[name].label
        (line,) = (one for one in lines if one.startswith(f"{label}  "))
        shown = line.removeprefix(label).split()[0]
        if math.isnan(value):
            assert shown == "undefined"
        else:
            assert float(shown) == pytest.approx(value, abs=6e-5)


@pytest.mark.parametrize("mode", ["all", "filtered"])
def test_places_are_recognised_as_the_command_does(capsys, towns, mode):
    options = "--method", "solid", "--mode", mode, "--radius", 5
    values, lines = printed(capsys, "pr", *both(towns), *options)
    found = recognise(
        *map(open_drive, both(towns)), "solid", mode=mode, radius=5.0
    )
    check_printed(found, values, lines, "place", "pose")
    assert found.metrics["r1"] == values["recall_at_1"]
    assert {"f1_max", "r5", "r10", "r25", "r1_percent", "mrr"} < {*values}
    assert {"auc_2.5m", "pose_success", "translation_90"} < {*values}


def test_a_path_and_an_object_give_the_same(towns, tmp_path):
    first = recognise(*both(towns), "solid", settings={"ranges": 20})
    made = make_method("solid", {"ranges": 20})
    second = recognise(*both(towns), made, protocol=RetrievalProtocol())
    third = recognise(*both(towns), made)
    assert first.metrics == third.metrics
    assert first.results == third.results
    assert (
        second.metrics["rotation_median_deg"]
        != (first.metrics["rotation_median_deg"])
    )
    first.queries.write_csv(tmp_path / "queries.csv")
    read = QueryRows.read(tmp_path)
    assert len(first.queries) == len(read) == len([*read]) == 16
    for mine, theirs in zip(first.queries, read, strict=True):
        assert mine["query_frame"] == theirs["query_frame"]
        assert mine["methods.solid.ranges"] == 20


def test_a_world_that_nothing_confirms_is_doubted(towns):
    """As of two maps by SLAM, each of which calls its own origin `map`."""
    first, second = map(open_drive, both(towns))
    X_WS = np.roll(second.X_WS, len(second) // 2, axis=0)
    moved = MovedDrive(second, X_WS, "map", None)
    for query, is_told in ((second, False), (moved, True)):
        notes = []
        recognise(first, query, "solid", on_note=notes.append)
        said = "town_02: no answer is right; if the poses are not in one world"
        assert any(one.startswith(said) for one in notes) == is_told


def test_what_cannot_be_recognised(towns):
    with pytest.raises(InputError, match="protocol: no protocol 'fair'"):
        recognise(*both(towns), "solid", protocol="fair")
    with pytest.raises(InputError, match=r"mode: no mode 'Filtered' .*mean f"):
        recognise(*both(towns), "solid", mode="Filtered")
    with pytest.raises(InputError, match="yes is neither True nor False"):
        recognise(*both(towns), "solid", verified="yes")
    with pytest.raises(TypeError, match="raduis"):
        recognise(*both(towns), "solid", raduis=5.0)
    with pytest.raises(InputError, match="settings: this method was made"):
        recognise(
            *both(towns), make_method("solid", {}), settings={"ranges": 9}
        )
    with pytest.raises(InputError, match="drive against itself"):
        recognise(*both(towns), "solid", exclude_recent=30.0)


def test_whatever_is_printed_can_be_ranked_and_charted(towns, tmp_path):
    rows = []
    for pair in (both(towns), both(towns)[::-1]):
        for method in ("solid", "scan-context++"):
            found = recognise(*pair, method)
            rows += found.results.rows
            tasks = {one.metric: one.task for one in found.results.rows}
            assert tasks.keys() == found.metrics.keys()
    table = Results.of(rows)
    table.write_csv(tmp_path / "results.csv")
    for name in found.metrics:
        if all(math.isnan(r.value) for r in table.where(metric=name).rows):
            continue
        compared = compare_tables([tmp_path], name)
        assert {one.method for one in compared.ranked} == {
            "solid",
            "scan-context++",
        }
        assert compared.task == tasks[name]
        chart = {"kind": "matrix", "over": "query", "metric": name}
        assert f"metric {name}," in draw_chart(chart, table).source


def test_a_metric_of_a_file_is_everywhere(capsys, towns, tmp_path):
    file = tmp_path / "share.py"
    file.write_text(OWN)
    words = "pr", *both(towns), "--method", "solid", "--metric", file
    values, lines = printed(capsys, *words)
    assert values["share_right"] == 1.0
    (line,) = (one for one in lines if one.startswith("share of right answers"))
    assert line.split()[-1] == "1.0000"
    assert run(capsys, *words, "--output", tmp_path / "out")[0] == 0
    rows = Results.read(tmp_path / "out").where(metric="share_right").rows
    assert [(row.task, row.verified) for row in rows] == [
        ("place", False),
        ("place", True),
    ]
    status, out, _ = run(capsys, "compare", tmp_path / "out", "--metric", file)
    assert status == 0
    assert "share_right" in out


def write_towns_with_a_control(folder):
    rng = np.random.default_rng(1)
    before, after = rng.uniform(-40.0, 40.0, (2, 400, 3))
    routes = {"town_01": before, "town_02": after, "town_01_control": after}
    for name, points in routes.items():
        poses = [yaw_pose(3.0 * i, 0.0, 0.0, 0.0) for i in range(5)]
        scans = [make_scan(points) for _ in poses]
        write_recording(folder / name, scans, poses)
    return [folder / name for name in routes]


def test_change_is_what_the_command_prints(capsys, tmp_path):
    a, b, c = write_towns_with_a_control(tmp_path)
    values, lines = printed(capsys, "tcr", a, b, "--no-change", c)
    first, second, control = map(open_drive, (a, b, c))
    found = change_between(first, second, no_change=control)
    check_printed(found, values, lines, "change")
    # A third drive, and not the pair once more.
    assert values["no_change"]["between"] == ["town_01_control", "town_02"]
    assert values["no_change"]["tcr_sym"] == 0.0
    assert found.metrics["tcr_sym_no_change"] == 0.0 < found.metrics["tcr_sym"]
    rows = found.results.where(metric="tcr_sym").rows
    assert {row["both.stage"]: row.value for row in rows} == {
        "own": found.metrics["tcr_sym"],
        "last": 0.0,
    }


def test_localisation_is_what_the_command_prints(capsys, towns):
    words = "localise", *both(towns), "--method", "gicp", "--start", 1
    values, lines = printed(capsys, *words, "--track")
    drives = map(open_drive, both(towns))
    found = localise(*drives, "gicp", start=1.0, track=True)
    check_printed(found, values, lines, "localise")
    assert len(found.queries) == len(found.rows) == values["queries"]


def test_a_map_update_is_what_the_command_prints(capsys, tmp_path):
    rng = np.random.default_rng(3)
    kept = rng.uniform(0.0, 9.0, (30, 3))
    for side, change in (("A", 2), ("B", 3)):
        points = np.concatenate([kept, rng.uniform(0.0, 9.0, (10, 3))])
        (tmp_path / side).mkdir()
        lines = "\n".join(" ".join(map(repr, p)) for p in points.tolist())
        (tmp_path / side / "map.ply").write_text(
            f"ply\nformat ascii 1.0\nelement vertex {len(points)}\n"
            "property double x\nproperty double y\nproperty double z\n"
            f"end_header\n{lines}\n"
        )
        labels = np.repeat([1, change], [30, 10]).astype(np.uint8)
        np.save(tmp_path / side / "truth.npy", labels)
    words = "map-update", tmp_path, "--baseline", "distance"
    values, lines = printed(capsys, *words)
    found = update_map(tmp_path, baseline="distance")
    check_printed(found, values, lines, "map")
    with pytest.raises(InputError, match="no baseline 'near'"):
        update_map(tmp_path, baseline="near")
