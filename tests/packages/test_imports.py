"""Which module may import which, where modules lie, and how they are called.

The directions themselves stand in `pyproject.toml`.
"""

from collections import defaultdict
from pathlib import Path

from importlinter.cli import EXIT_STATUS_SUCCESS, lint_imports
import pytest

ROOT = Path(__file__).parents[2]
PACKAGES = ("cns_drake", "evaluation")
# What may have the same name in two folders: each package has its entry.
ENTRIES = {"__init__", "__main__"}


def test_imports_run_one_way(capsys):
    status = lint_imports(str(ROOT / "pyproject.toml"), no_cache=True)
    assert status == EXIT_STATUS_SUCCESS, capsys.readouterr().out


@pytest.mark.parametrize("package", PACKAGES)
def test_no_module_lies_loose(package):
    loose = {path.stem for path in (ROOT / package).glob("*.py")}
    assert loose == ENTRIES


@pytest.mark.parametrize("package", PACKAGES)
def test_no_two_modules_share_a_name(package):
    places = defaultdict(list)
    for path in (ROOT / package).rglob("*.py"):
        places[path.stem].append(str(path.relative_to(ROOT)))
    shared = {
        name: paths
        for name, paths in places.items()
        if len(paths) > 1 and name not in ENTRIES
    }
    assert shared == {}
