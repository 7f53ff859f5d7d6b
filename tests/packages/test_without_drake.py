"""What makes and ages cities runs where Drake is absent."""

from pathlib import Path
import subprocess
import sys

import pytest

ROOT = Path(__file__).parents[2]
# Finds no Drake, and imports every module of the packages that follow.
IMPORT_ALL = """
import importlib, pkgutil, sys

class Absent:
    def find_spec(self, name, path=None, target=None):
        if name.partition(".")[0] in ABSENT.split():
            raise ModuleNotFoundError(f"no {name} here", name=name)

sys.meta_path.insert(0, Absent())
ABSENT, *packages = sys.argv[1:]
for package in packages:
    found = importlib.import_module(package)
    for module in pkgutil.walk_packages(found.__path__, package + "."):
        importlib.import_module(module.name)
        print(module.name)
"""


def import_all(absent, *packages):
    return subprocess.run(
        [sys.executable, "-c", IMPORT_ALL, absent, *packages],
        cwd=ROOT,
        capture_output=True,
        text=True,
    )


@pytest.mark.slow
@pytest.mark.night
def test_worlds_need_no_drake():
    done = import_all("cns_drake pydrake", "worlds")
    assert done.returncode == 0, done.stderr
    found = {line.split(".")[1] for line in done.stdout.splitlines()}
    assert found == {"ageing", "city", "imports", "maps", "roads", "shapes"}


@pytest.mark.slow
def test_drake_is_really_absent():
    done = import_all("pydrake", "cns_drake.scene")
    assert done.returncode != 0
    assert "no pydrake" in done.stderr
