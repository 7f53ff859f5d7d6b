"""Bad usage and bad input of `cns-eval`: one line each, status 2."""

import csv

from helpers.drive_files import make_scan, write_recording, yaw_pose
from helpers.internal.eval_program import (
    assert_refused,
    make_block_scene,
    run,
    without_world,
)
import numpy as np
import pytest


def test_bad_usage(capsys, towns):
    town = towns / "town_01"
    assert_refused(capsys, ["evaluate"], "unknown command 'evaluate'")
    assert_refused(capsys, ["tcr", town], "Missing argument 'B'")
    assert_refused(capsys, ["tcr", town, town, "--colour"], "--colour")
    assert_refused(capsys, ["pr", town, town], "Missing option '--method'")
    pr = ["pr", town, town, "--method"]
    fault = "--method: no method 'bow' (there are: "
    assert_refused(capsys, [*pr, "bow"], fault, "scan-context++")
    pr.append("scan-context++")
    assert_refused(capsys, [*pr, "--mode", "some"], ": 'some' is not")
    assert_refused(capsys, [*pr, "--set", "candidates"], "is not NAME=VALUE")
    assert_refused(capsys, [*pr, "--set", "x=1"], "no parameter 'x'")
    assert_refused(capsys, [*pr, "--set", "rings=many"], "rings")
    for height in ("nan", "inf", "-1.6"):
        assert_refused(
            capsys, [*pr, f"--sensor-height={height}"], "sensor_height"
        )


def test_bad_settings(capsys, towns, tmp_path):
    output = ["--output", tmp_path / "out", "--set"]
    report = ["report", towns, *output]
    for text, fault in (
        ("rings=3", "'rings=3' is not METHOD.NAME=VALUE"),
        ("solid.rings", "'solid.rings' is not METHOD.NAME=VALUE"),
        ("bow.rings=3", "no method 'bow' (there are: btc, "),
        ("solid.x=1", "solid: no parameter 'x'"),
        ("solid.sensor_height=high", "solid: sensor_height"),
    ):
        assert_refused(capsys, [*report, text], fault)
    assert not (tmp_path / "out").exists()


def test_bad_input(capsys, towns, tmp_path):
    town = towns / "town_01"
    cut = tmp_path / "cut.mcap"
    whole = (town / "town_01_0.mcap").read_bytes()
    cut.write_bytes(whole[: len(whole) // 2])
    assert_refused(capsys, ["tcr", town, cut], cut, "cut off")
    empty = tmp_path / "empty"
    empty.mkdir()
    assert_refused(capsys, ["tcr", empty, town], empty, "not a recorded")
    short = tmp_path / "short.bin"
    short.write_bytes(b"12345")
    assert_refused(capsys, ["tcr", short, short], short, "5 bytes")
    assert_refused(
        capsys,
        ["pr", town, towns / "town_01.npy", "--method", "scan-context++"],
        "town_01.npy",
        "not a recorded drive",
    )


def test_points_that_are_not_finite_are_noted(capsys, towns, tmp_path):
    scan = make_scan(make_block_scene(0))
    scan["y"][:7] = np.nan
    write_recording(tmp_path / "holes", [scan], [yaw_pose(0.0, 0.0, 0.0, 0.0)])
    town = towns / "town_01"
    status, _, err = run(capsys, "tcr", town, tmp_path / "holes")
    assert status == 0
    assert (
        without_world(err) == "holes: 7 points are not finite, and left out\n"
    )
    both = [tmp_path / "holes", town, "--method", "scan-context++"]
    status, _, err = run(capsys, "pr", *both, "--radius", "100")
    assert status == 0
    left_out, easy = without_world(err).splitlines()
    assert left_out == "holes: 7 points are not finite, and left out"
    assert easy.startswith("holes: every place lies within 100 m of every que")
    (tmp_path / "scans").mkdir()
    np.save(
        tmp_path / "scans" / "a.npy",
        np.stack([scan[axis] for axis in "xyz"], axis=1),
    )
    folders = [tmp_path / "scans", tmp_path / "scans"]
    output = tmp_path / "scores.csv"
    scores = ["scores", *folders, "--method", "solid", "--output", output]
    status, _, err = run(capsys, *scores)
    assert status == 0
    assert err.startswith("14 points are not finite, and left out\n")
    (row,) = csv.DictReader(output.open())
    assert float(row["score"]) == pytest.approx(1.0, abs=1e-12)


def test_poses_out_of_this_world(capsys, towns, tmp_path):
    scan = make_scan(make_block_scene(0))
    write_recording(tmp_path / "lost", [scan], [yaw_pose(1e9, 0.0, 0.0, 0.0)])
    for command in (["tcr"], ["pr", "--method", "solid"]):
        lost = [*command, towns / "town_01", tmp_path / "lost"]
        assert_refused(
            capsys, lost, "lost_0.mcap: /odometry: a pose is 1e+09 m"
        )


def test_parameters_that_need_too_much_memory(capsys, towns):
    town = towns / "town_01"
    large = ["pr", town, town, "--method", "scan-context++"]
    large += ["--set", "rings=10000000000000"]
    assert_refused(capsys, large, "not enough memory")


def test_bad_folders_of_scans(capsys, towns, tmp_path):
    good = towns / "town_01_scans"

    def scores(database, query, output=tmp_path / "out.csv"):
        options = ["--method", "scan-context++", "--output", output]
        return ["scores", database, query, *options]

    empty = tmp_path / "empty"
    empty.mkdir()
    assert_refused(capsys, scores(empty, good), empty, "no scan in it")
    assert_refused(
        capsys, scores(good, tmp_path / "none"), "none", "no such folder"
    )
    twice = tmp_path / "twice"
    twice.mkdir()
    for name in ("a.bin", "a.npy"):
        (twice / name).write_bytes(b"")
    assert_refused(capsys, scores(twice, good), "a.npy", "same name")
    far = tmp_path / "far"
    far.mkdir()
    np.save(far / "a.npy", np.full((10, 3), 300.0))
    assert_refused(capsys, scores(good, far), "a.npy", "no finite point")
    void = tmp_path / "void"
    void.mkdir()
    (void / "a.bin").write_bytes(b"")
    assert_refused(capsys, scores(good, void), "a.bin", "no finite point")
    noise = tmp_path / "noise"
    noise.mkdir()
    junk = np.random.default_rng(9).bytes(1600)
    (noise / "a.bin").write_bytes(junk)
    assert_refused(capsys, scores(good, noise), "a.bin", "point", "is at")
    assert not (tmp_path / "out.csv").exists()
    assert not (tmp_path / "out.csv.part").exists()
    blocked = tmp_path / "a file" / "out.csv"
    blocked.parent.write_text("")
    assert_refused(capsys, scores(good, good, blocked), blocked)


def test_a_protocol_that_cannot_be(capsys, towns):
    both = ["pr", towns / "town_01", towns / "town_02", "--method", "solid"]
    assert_refused(capsys, [*both, "--radius", "0"], "--radius", "0.0")
    assert_refused(capsys, [*both, "--scans-per-place", "-1"], "--scans-per")
    assert_refused(
        capsys,
        [*both, "--exclude-recent", "5"],
        "--exclude-recent",
        "a drive against itself",
    )
    itself = ["pr", towns / "town_01", towns / "town_01", "--method", "solid"]
    assert_refused(
        capsys, [*itself, "--exclude-recent", "60"], "town_01: never within"
    )


def test_a_drive_that_finds_itself_gets_a_note(capsys, towns):
    town = towns / "town_01"
    _, out, err = run(capsys, "pr", town, town, "--method", "solid")
    assert "every scan finds itself (--exclude-recent" in err
    assert "1.0000" in out


def test_bad_figures(capsys, tmp_path):
    file = tmp_path / "a.pdf"
    for words, fault in (
        (["--width", "3in"], "--output: missing"),
        (["--no-title"], "--output: missing"),
        (["--output", tmp_path / "a.jpg"], "the name must end in .pdf"),
        (["--output", file, "--rankings"], "--rankings has no figure"),
        (["--output", file, "--font", "nofont"], "--font: 'nofont'"),
        (["--output", file, "--width", "3.5"], "--width: '3.5'"),
        (
            ["--metric", "tcr_sym"],
            "have no values of tcr_sym; measure it (cns-dr",
        ),
    ):
        assert_refused(capsys, ["compare", *words], fault)
    assert not file.exists()
