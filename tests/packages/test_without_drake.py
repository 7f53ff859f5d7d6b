"""Each house runs where what it must not import is absent."""

from pathlib import Path
import subprocess
import sys

import pytest

ROOT = Path(__file__).parents[2]
# Imports every module of a house, and finds none of the packages that follow.
IMPORT_ALL = """
import importlib, pkgutil, sys

house, *absent = sys.argv[1:]

class Absent:
    def find_spec(self, name, path=None, target=None):
        if name.partition(".")[0] in absent:
            raise ModuleNotFoundError(f"no {name} here", name=name)

sys.meta_path.insert(0, Absent())
found = importlib.import_module(house)
for module in pkgutil.walk_packages(found.__path__, house + "."):
    if "map_closures" not in module.name:  # It needs an extra.
        importlib.import_module(module.name)
        print(module.name)
"""
ABSENT = {
    "evaluation": (
        "cns_drake",
        "distributed",
        "embreex",
        "open3d",
        "osmium",
        "pydrake",
        "pyproj",
        "shapely",
        "worlds",
    ),
    "worlds": ("cns_drake", "open3d", "pydrake"),
}


def import_all(house, *absent):
    return subprocess.run(
        [sys.executable, "-c", IMPORT_ALL, house, *absent],
        cwd=ROOT,
        capture_output=True,
        text=True,
    )


@pytest.mark.slow
@pytest.mark.parametrize("house", ABSENT)
def test_a_house_needs_nothing_of_those_below(house):
    done = import_all(house, *ABSENT[house])
    assert done.returncode == 0, done.stderr
    found = {line.split(".")[1] for line in done.stdout.splitlines()}
    inside = {path.parent.name for path in (ROOT / house).glob("*/__init__.py")}
    assert found - {"__main__"} == inside


@pytest.mark.slow
def test_what_is_absent_is_really_absent():
    done = import_all("cns_drake", "pydrake")
    assert done.returncode != 0
    assert "no pydrake" in done.stderr
