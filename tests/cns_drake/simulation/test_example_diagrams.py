"""The examples in `diagrams`, shortened, as a user would run them.

A few towers stand in place of Downtown, which takes long to load and to show.
"""

from pathlib import Path
import re
import shutil
import subprocess
import sys

from helpers.meshcat_pages import objects, read_commands
import pytest

DIAGRAMS = Path(__file__).parents[3] / "diagrams"
STAGE = Path("worlds/downtown/stage_04.sdf")
pytestmark = pytest.mark.slow
# Name -> its duration, the path of the points on its page, and their least
# number.
EXAMPLES = {
    "warehouse_robot": (0.5, "/drake/lidar", 50_000),
    "wrist_scanner": (0.2, "/drake/cloud", 3_000),
    "drone_downtown": (0.3, "/drake/cloud", 20_000),
}


@pytest.mark.parametrize("name", EXAMPLES)
def test_an_example_runs_and_shows_its_points(name, small_map, tmp_path):
    duration, path, least = EXAMPLES[name]
    script = tmp_path / "diagrams" / f"{name}.py"
    shutil.copytree(DIAGRAMS, script.parent)
    assert (DIAGRAMS.parent / STAGE).is_file()
    (tmp_path / STAGE).parent.mkdir(parents=True)
    shutil.copy(small_map / "stage_04.sdf", tmp_path / STAGE)
    assert len(script.read_text().splitlines()) < 60
    page = tmp_path / "page.html"
    done = subprocess.run(
        [sys.executable, script, "--page", page, "--duration", str(duration)],
        capture_output=True,
        text=True,
        check=True,
        cwd=tmp_path,
    )
    (count,) = re.findall(r"(\d+) returns", done.stdout)
    assert int(count) > least
    points = objects(read_commands(page.read_text()))
    assert any(key.startswith(path) for key in points)
