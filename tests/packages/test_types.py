"""Types fit, and every function has hints.

What is checked, and what cannot be, stands in `pyproject.toml`.
"""

from pathlib import Path
import subprocess
import sys

import pytest

ROOT = Path(__file__).parents[2]


@pytest.mark.slow
def test_mypy_finds_nothing():
    done = subprocess.run(
        [sys.executable, "-m", "mypy"], cwd=ROOT, capture_output=True, text=True
    )
    assert done.returncode == 0, done.stdout + done.stderr


@pytest.mark.parametrize("package", ["cns_drake", "evaluation"])
def test_packages_declare_their_hints(package):
    assert (ROOT / package / "py.typed").is_file()
