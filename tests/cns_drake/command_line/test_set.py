"""Any field of a scenario is changed by --set, or named in one line."""

import math
import re

from helpers.documents import ROOT
from helpers.internal.eval_program import run_program
from helpers.small_map import box_visual, scenario_values, world_text
import numpy as np
import pytest
import yaml

from cns_drake import InputError, load_scenario
from cns_drake.__main__ import main
from cns_drake.command_line import run_drive
from cns_drake.scenarios import set_fields

pytestmark = pytest.mark.slow

# Heading in the reference -> where the fields of its table are.
PLACES = {
    "Scenario": "",
    "LiDARs": "lidars.lidar.",
    "Cameras": "cameras.front.",
    "Route": "route.",
}
# Column of values -> a value.
KINDS = {
    "`true` or `false`": "true",
    "text": "mine",
    "list: text": "[mine]",
    "list": "[]",
    "": "{}",
    "values by name": "{}",
    "by name: number": "{}",
    "number or by name: number": "1",
    "integer": "100",
    "integer or text": "100",
}


def rows():
    """Yields each row of the reference as a field and a value for it."""
    text = (ROOT / "docs/reference/scenario.md").read_text("utf-8")
    for section in re.split(r"^## ", text, flags=re.MULTILINE)[1:]:
        heading = section.partition("\n")[0]
        place = PLACES.get(heading, f"{heading.lower()}.")
        for name, said in re.findall(
            r"(?m)^- `(.*?)`(?: \((.*?)\))?: ", section
        ):
            values, _, default = said.partition("; ")
            is_section = not default and values == "required"
            yield place + name, value_of("" if is_section else values)


def value_of(values):
    if values in KINDS:
        return KINDS[values]
    if choices := re.findall(r"`(.*?)`", values):
        return choices[-1]
    limits = re.search(r"(?:from|above) (\S+)(?: to (\S+))?", values)
    least, most = limits.groups() if limits else ("0", None)
    number = min(math.ceil(float(least) + 0.1), float(most or math.inf))
    several = re.match(r"(\d) numbers", values)
    return str([number] * int(several[1])) if several else f"{number:g}"


@pytest.fixture(scope="module")
def drive(tmp_path_factory, small_map):
    """A drive in a small city, with a LiDAR of few beams."""
    file = tmp_path_factory.mktemp("fields") / "drive.yaml"
    values = scenario_values(small_map) | {"name": "drive"}
    values["lidars"] = {"lidar": {"rings": 2, "columns": 8}}
    file.write_text(yaml.safe_dump(values))
    return file


@pytest.mark.parametrize(("field", "value"), list(rows()))
def test_each_field_of_a_drive_is_set_or_named(
    drive, tmp_path, capfd, field, value
):
    words = ("--frames", 2, "--output", tmp_path, "--set", f"{field}={value}")
    status, out, err = run_program(
        capfd, "cns-drake", main, "simulate", drive, *words
    )
    if status == 0:
        assert "2 frames" in out
        return
    assert status == 2
    (line,) = (one for one in err.splitlines() if "error" in one)
    assert set(field.split(".")) & set(re.findall(r"\w+", line))


def test_values_are_yaml_and_all_are_set_at_once(drive):
    texts = [
        "weather.rain=20",
        "lidars.lidar.returns=calibrated",
        "lidars.lidar.rings=16",
        "lidars={roof: {xyz: [0, 0, 2], columns: 64}}",
        "stage=01",
        "seed=7",
        "seed=8",
        "without=[tower_000, tower_001]",
        "lidars.roof.returns=calibrated",
    ]
    found = set_fields(load_scenario(drive), texts)
    assert (found.weather.rain, found.stage, found.seed) == (20.0, "01", 8)
    assert found.without == ("tower_000", "tower_001")
    lidars = found.lidars.values()
    assert [lidar.rings for lidar in lidars] == [16, None]
    assert [lidar.columns for lidar in lidars] == [8, 64]


def test_paths_start_at_the_working_directory(drive, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "way.csv").write_text("x,y\n0,0\n90,0\n")
    found = set_fields(load_scenario(drive), ["waypoints=way.csv"])
    assert found.waypoints == str(tmp_path / "way.csv")
    assert found.route is None


@pytest.mark.parametrize(
    ("text", "fault"),
    [
        ("weathr.rain=2", "weathr: .*; did you mean weather"),
        ("weather.rane=2", "weather.rane: .*; did you mean rain"),
        ("lidars.lidar.ring=2", "lidars.lidar.ring: .*; did you mean rings"),
        ("lidars.lidar.rings=many", "lidars.lidar.rings: .*integer"),
        ("weather.rain=[1", "weather.rain: "),
        ("weather.rain", "'weather.rain' is not FIELD=VALUE"),
    ],
)
def test_faults_name_the_field_and_a_similar_one(drive, text, fault):
    with pytest.raises(InputError, match=f"^--set: {fault}"):
        set_fields(load_scenario(drive), [text])


def test_a_scan_has_the_fields_of_one_lidar(tmp_path, capfd):
    world, output = tmp_path / "world.sdf", tmp_path / "scan.npy"
    wall = box_visual("wall", (8, 0, 2, 0, 0, 0), (1, 40, 4))
    world.write_text(world_text([wall]))
    words = ("scan", world, "--pose", *"001000", "--output", output, "--set")

    def scan(field):
        done = run_program(capfd, "cns-drake", main, *words, field)
        assert done[0] in (0, 2)
        return done[2] if done[0] else np.load(output)

    exact, noisy = map(scan, ("seed=1", "lidars.lidar.range_noise=0.1"))
    assert len(exact) == len(noisy)
    assert 0.01 < np.abs(exact[:, 0] - noisy[:, 0]).std() < 0.2
    assert len(scan("lidars.lidar.columns=512")) < 0.51 * len(exact)
    for field in ("lidars.lidar.xyz=[0,0,9]", "frames=3", "lidars.two={}"):
        name = field.partition("=")[0].removesuffix(".two")
        assert f"--set: {name}: not of a scan" in scan(field)


def test_generate_sets_fields_of_all_drives(drive, tmp_path, capfd):
    words = ("--frames", 2, "--jobs", 1, "--set", "lidars.lidar.rings=3")
    words += ("--set", "lidars.rear.columns=8")
    output = ("--output", tmp_path)
    done = run_program(
        capfd, "cns-drake", main, "generate", drive, *output, *words
    )
    assert done[0] == 0
    assert done[2].count("a further LiDAR") == 1
    recorded = yaml.safe_load((tmp_path / "drive/scenario.yaml").read_text())
    assert recorded["lidars"]["lidar"]["rings"] == 3


def test_run_drive_refuses_a_field_that_it_does_not_have(drive, tmp_path):
    with pytest.raises(TypeError, match="rian: "):
        run_drive(drive, tmp_path, rian=5)
