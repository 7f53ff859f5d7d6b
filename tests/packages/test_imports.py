"""Which module may import which, and where modules lie.

The directions themselves stand in `pyproject.toml`.
"""

from pathlib import Path

from importlinter.cli import EXIT_STATUS_SUCCESS, lint_imports
import pytest

ROOT = Path(__file__).parents[2]
PACKAGES = ("cns_drake", "evaluation")
ENTRIES = {"__init__", "__main__"}


def test_imports_run_one_way(capsys):
    status = lint_imports(str(ROOT / "pyproject.toml"), no_cache=True)
    assert status == EXIT_STATUS_SUCCESS, capsys.readouterr().out


@pytest.mark.parametrize("package", PACKAGES)
def test_no_module_lies_loose(package):
    loose = {path.stem for path in (ROOT / package).glob("*.py")}
    assert loose == ENTRIES
