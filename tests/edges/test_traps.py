"""No command runs code, or reads a setting, of a folder that others filled."""

from importlib.util import find_spec
import shutil

import pytest

from edges import inputs
from edges.measured import run, verbs_in

pytestmark = pytest.mark.slow

# Each command of a program, where it finds what those before it have made.
COMMANDS = {
    "cns_drake": """
city town
list town
import blocks.json --output blocks --plain --years 1930 1980
age town --output aged --years 1
scan meshes.sdf --pose 0 0 1.6 0 0 0 --output scan.npy
simulate ride_and_camera.yaml --frames 2 --output one --recording page.html
generate town/sequence_01.yaml town/sequence_02.yaml --output drives --jobs 2
film town/sequence_02.yaml --output film.webp --seconds 1 --size 64x48
export drives/town_01 --format kitti --output kitti
pairs town/sequence_01.yaml town/sequence_02.yaml --output pairs
truth town/sequence_01.yaml town/sequence_02.yaml --output truth
study houses.yaml --output study --jobs 2
reproduce town --method solid --no-costs --output all
train --minutes 0 --cities 1 --steps 1 --output weights.npz
""",
    "evaluation": """
tcr before after
pr before after --method solid
scores scans scans --method solid --output scores.csv
report drives --method solid --no-costs --output report
compare report
localise before after --method gicp --jobs 1 --output places
map-update maps --baseline distance --output labels
""",
}


def lines_of(program):
    return [line.split() for line in COMMANDS[program].strip().splitlines()]


@pytest.mark.parametrize("program", COMMANDS)
def test_every_command_meets_the_traps(program, tmp_path):
    verbs = verbs_in(run(tmp_path, program, "--help"))
    assert sorted(verbs) == sorted(verb for verb, *_ in lines_of(program))


@pytest.mark.night
@pytest.mark.parametrize("program", COMMANDS)
def test_no_command_is_trapped(program, tmp_path):
    if program == "cns_drake":
        inputs.write_city(tmp_path)
        inputs.write_sequences(tmp_path)
        inputs.write_scenarios(tmp_path)
        inputs.write_worlds(tmp_path)
        inputs.write_blocks_cityjson(tmp_path)
        inputs.write_experiment(tmp_path)
    else:
        inputs.write_drives(tmp_path)
        for stage, name in (("01", "before"), ("02", "after")):
            copy = tmp_path / "drives" / f"town_{stage}"
            shutil.copytree(tmp_path / name, copy)
        inputs.write_maps(tmp_path)
        inputs.write_kitti_drives(tmp_path)
        (tmp_path / "sequences/00/velodyne").rename(tmp_path / "scans")
    for verb, *words in lines_of(program):
        if verb != "train" or find_spec("jax"):
            run(tmp_path, program, verb, *words)
