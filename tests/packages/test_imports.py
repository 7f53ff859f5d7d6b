"""Where modules lie, and that the packages declare their hints.

Steps of `.ci/run` check who imports whom, types and spelling.
"""

from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
PACKAGES = ("cns_drake", "evaluation")
ENTRIES = {"__init__", "__main__"}


@pytest.mark.parametrize("package", PACKAGES)
def test_no_module_lies_loose(package):
    loose = {path.stem for path in (ROOT / package).glob("*.py")}
    assert loose == ENTRIES


@pytest.mark.parametrize("package", PACKAGES)
def test_packages_declare_their_hints(package):
    assert (ROOT / package / "py.typed").is_file()
