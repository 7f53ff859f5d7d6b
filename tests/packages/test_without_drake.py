"""What makes cities, roads and imports runs where Drake is absent."""

from pathlib import Path
import subprocess
import sys

import pytest

ROOT = Path(__file__).parents[2]
# Finds no pydrake, and imports every module of the packages that follow.
IMPORT_ALL = """
import importlib, pkgutil, sys

class Absent:
    def find_spec(self, name, path=None, target=None):
        if name.partition(".")[0] == "pydrake":
            raise ModuleNotFoundError(f"no {name} here", name=name)

sys.meta_path.insert(0, Absent())
for package in sys.argv[1:]:
    found = importlib.import_module(package)
    for module in pkgutil.walk_packages(found.__path__, package + "."):
        importlib.import_module(module.name)
        print(module.name)
"""


def import_all(*packages):
    return subprocess.run(
        [sys.executable, "-c", IMPORT_ALL, *packages],
        cwd=ROOT,
        capture_output=True,
        text=True,
    )


@pytest.mark.slow
@pytest.mark.night
def test_cities_roads_and_imports_need_no_drake():
    packages = ("city", "imports", "roads")
    done = import_all(*(f"cns_drake.{name}" for name in packages))
    assert done.returncode == 0, done.stderr
    found = {line.split(".")[1] for line in done.stdout.splitlines()}
    assert found == set(packages)


@pytest.mark.slow
def test_drake_is_really_absent():
    done = import_all("cns_drake.scene")
    assert done.returncode != 0
    assert "no pydrake" in done.stderr
