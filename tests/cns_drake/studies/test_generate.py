"""`cns-drake generate`: skipping, errors and remaining files."""

import json
import os
import signal

from helpers.bag_recordings import contents
from helpers.generation import Generation
from helpers.tiny_drive import (
    FRAMES,
    long_scenario,
    tiny_scenario,
    write_scenario,
)
from mcap.reader import make_reader
import pytest

from cns_drake.simulation import simulate
from cns_drake.studies import is_recorded, record_all
from evaluation.base import Cluster, InputError

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
    run.wait_for("long simulating")
    os.killpg(run.process.pid, signal.SIGINT)
    status, results = run.end()
    assert (status, results) == (130, [])
    assert run.lines[-1] == "cns-drake: interrupted\n"
    assert not [line for line in run.lines if "Traceback" in line]
    assert not (output / "long" / "metadata.yaml").exists()

    # A parent that is killed cannot end its processes; they do so themselves.
    run = Generation(files, output, "--jobs", "2")
    run.wait_for("long simulating")
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


def test_damaged_files_are_no_recording(tmp_path):
    scenario = tiny_scenario(tmp_path, frames=3)
    folder = simulate(scenario, tmp_path / "output").folder
    for name, damages in (
        ("metadata.yaml", ("", "{", "a: 1", "- 1")),
        ("scenario.yaml", ("{", "a: b: c")),
        ("fingerprint.txt", ("", "other")),
    ):
        whole = (folder / name).read_text()
        for damage in damages:
            (folder / name).write_text(damage)
            assert not is_recorded(scenario, tmp_path / "output"), name
        (folder / name).write_text(whole)
    assert is_recorded(scenario, tmp_path / "output")


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
