"""`cns-drake generate`: skipping, errors and remaining files."""

import json
import os
from pathlib import Path
import signal

from helpers.bag_recordings import contents
from helpers.generation import Generation
from helpers.internal import studies
from helpers.internal.eval_program import run_program
from helpers.measured_pairs import compare_maps
from helpers.small_city import write_small_city
from helpers.tiny_drive import (
    FRAMES,
    long_scenario,
    tiny_scenario,
    write_scenario,
)
from mcap.reader import make_reader
import numpy as np
import pytest
import yaml

from cns_drake.__main__ import main
from cns_drake.base import Cluster, InputError
from cns_drake.city import generate_city
from cns_drake.scenarios import load_scenario
from cns_drake.simulation import simulate
from cns_drake.studies import is_recorded, record_all, recording
from cns_drake.studies.maps import map_step
from evaluation.change import read_map
from evaluation.drives import open_drive

pytestmark = pytest.mark.slow

ONE = Cluster(num_workers=1)


@pytest.fixture(scope="module")
def scenarios(tmp_path_factory):
    folder = tmp_path_factory.mktemp("scenarios")
    return [
        tiny_scenario(folder, name="short"),
        long_scenario(folder, "long"),
    ]


@pytest.fixture(scope="module")
def files(scenarios, tmp_path_factory):
    folder = tmp_path_factory.mktemp("files")
    return [write_scenario(scenario, folder) for scenario in scenarios]


@pytest.mark.night
def test_interrupted_killed_and_run_again(scenarios, files, tmp_path):
    # Ctrl-C reaches every process of the terminal.
    output = tmp_path / "output"
    run = Generation(files, output, "--jobs", "2")
    run.wait_for("simulating frames")
    os.killpg(run.process.pid, signal.SIGINT)
    status, results = run.end()
    assert (status, results) == (130, [])
    assert run.lines[-1] == "cns-drake: interrupted\n"
    assert not [line for line in run.lines if "Traceback" in line]
    assert not (output / "long" / "metadata.yaml").exists()

    # A parent that is killed cannot end its processes; they do so themselves.
    run = Generation(files, output, "--jobs", "2")
    run.wait_for("simulating frames")
    run.process.kill()
    status, _ = run.end()
    assert status == -signal.SIGKILL
    assert not [line for line in run.lines if "Traceback" in line]

    run = Generation(files, output, "--jobs", "2")
    status, results = run.end()
    assert status == 0, run.lines
    assert results == [str(output / "short"), str(output / "long")]
    for scenario in scenarios:
        folder = simulate(scenario, tmp_path / "whole").folder
        assert contents(output / scenario.name) == contents(folder)


def test_finished_and_other_recordings(scenarios, tmp_path, capsys):
    short, _ = scenarios
    folder = simulate(short, tmp_path).folder
    before = contents(folder)
    record_all([short], tmp_path, ONE, overwrite=False)
    assert "short: already finished" in capsys.readouterr().err
    for other in (
        short.model_copy(update={"frames": FRAMES - 1}),
        short.model_copy(update={"frames": None}),
        short.model_copy(update={"seed": 5}),
    ):
        assert not is_recorded(other, tmp_path)
        with pytest.raises(
            InputError, match=r"another scenario.*: short \(--overwrite"
        ):
            record_all([other], tmp_path, ONE, overwrite=False)
    assert contents(folder) == before


def test_a_recording_of_the_whole_drive_is_no_prefix_of_it(scenarios, tmp_path):
    whole = scenarios[0].model_copy(update={"frames": None})
    frames = simulate(whole, tmp_path).num_frames
    assert is_recorded(whole, tmp_path)
    assert is_recorded(whole.model_copy(update={"frames": frames}), tmp_path)


@pytest.mark.parametrize("name", ["tiny.sdf", "tiny.csv"])
def test_a_world_or_a_route_that_has_changed(tmp_path, name):
    scenario = tiny_scenario(tmp_path, frames=3)
    simulate(scenario, tmp_path / "output")
    assert is_recorded(scenario, tmp_path / "output")
    file = tmp_path / name
    file.write_text(file.read_text() + "\n")
    assert not is_recorded(scenario, tmp_path / "output")


@pytest.mark.parametrize("damage", ["", "{", "a: 1", "- 1"])
@pytest.mark.parametrize("name", ["metadata.yaml", "scenario.yaml"])
def test_damaged_files_are_no_recording(tmp_path, name, damage):
    scenario = tiny_scenario(tmp_path, frames=3)
    folder = tmp_path / "output" / "tiny_01"
    folder.mkdir(parents=True)
    (folder / "tiny_01_0.mcap").touch()
    (folder / "metadata.yaml").touch()
    (folder / name).write_text(damage)
    assert not is_recorded(scenario, tmp_path / "output")


def test_two_drives_of_one_name(scenarios, tmp_path):
    with pytest.raises(InputError, match="short: 2 drives"):
        record_all([scenarios[0]] * 2, tmp_path, ONE)


def test_what_it_was_made_of_is_in_the_file(tmp_path):
    scenario = tiny_scenario(tmp_path, frames=2)
    folder = simulate(scenario, tmp_path / "output").folder
    with (folder / "tiny_01_0.mcap").open("rb") as stream:
        attachments = {
            attachment.name: json.loads(attachment.data)
            for attachment in make_reader(stream).iter_attachments()
        }
    assert attachments["scenario.json"]["name"] == "tiny_01"
    versions = attachments["provenance.json"]["versions"]
    assert {"cns-drake", "python", "drake", "numpy", "mcap"} <= versions.keys()
    inputs = attachments["provenance.json"]["inputs_sha256"]
    assert inputs.keys() == {"world", "vehicle", "waypoints"}
    names = [entry["name"] for entry in attachments["structures.json"]]
    assert names == ["ground", "hall"]


@pytest.fixture(scope="module")
def town(tmp_path_factory):
    """Folder of a generated town, with a drive through each of its stages."""
    folder = write_small_city(tmp_path_factory.mktemp("maps") / "town")
    generate_city(folder)
    for stage in ("01", "02"):
        drive = {
            "map": ".",
            "stage": stage,
            "route": [
                {"road": name, "direction": "forward", "lane": 1}
                for name in ("north", "south")
            ],
            "speeds": {"cruise": 14.0, "longitudinal_acceleration": 8.0},
            "lidars": {"lidar": {"columns": 128}},
            "frames": FRAMES,
        }
        (folder / f"sequence_{stage}.yaml").write_text(yaml.safe_dump(drive))
    return folder


@pytest.mark.night
def test_drives_of_experiments_share_other_cities(
    town, tmp_path, monkeypatch, capsys
):
    output = tmp_path / "output"
    done = []
    for module in (recording, map_step):
        monkeypatch.setattr(
            module,
            "run_jobs",
            lambda jobs, cluster, unit="": done.extend(studies.do(jobs)),
        )

    def generate(**values):
        path = tmp_path / "vary.yaml"
        path.write_text(yaml.safe_dump({"maps": str(town)} | values))
        words = ("generate", "--vary", path, "--output", output)
        status, out, err = run_program(capsys, "cns-drake", main, *words)
        assert status == 0, err
        return [Path(result) for result in out.splitlines()]

    redrawn = {"drives": "stages", "both": {"redraw": [7]}}
    drives = generate(**redrawn, database={"stage": "02", "missing": [0, 0.6]})
    names = [path.name for path in drives]
    assert len(names) == 3
    city, *recorded = done
    assert city.startswith("city town")
    assert recorded == names
    stage = next((output / "cities").glob("town_c7/stage_*.sdf"))
    drawn = stage.stat()
    plain, query, less = drives

    done.clear()
    redrawn["both"] = {"redraw": [8, 7]}
    others = generate(**redrawn, database={"stage": "02"})
    assert sum(one.startswith("city ") for one in done) == 1
    assert stage.stat() == drawn
    other = next(one for one in others if "redraw_8" in one.name)
    databases = [plain, less]

    # Each city is another place.
    with pytest.raises(InputError, match=r"through town\w*8\w*, .* town\w*7"):
        compare_maps(read_map(query), read_map(other))
    changes = {
        path.name: compare_maps(
            read_map(path), read_map(query)
        ).change.symmetric
        for path in databases
    }
    assert changes[names[0]] == 0.0  # The very same drive.
    assert changes[names[2]] > 0.1

    # Each member is complete, also after it has been moved.
    moved = tmp_path / "moved"
    output.rename(moved)
    member = load_scenario(moved / "scenarios" / f"{names[2]}.yaml")
    assert is_recorded(member.model_copy(update={"frames": FRAMES}), moved)
    again = open_drive(simulate(member, tmp_path).folder)
    before = open_drive(moved / names[2])
    assert len(again) == len(before) == FRAMES
    for scan, scan_before in zip(again, before, strict=True):
        np.testing.assert_array_equal(scan, scan_before)
