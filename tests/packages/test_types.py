"""Types fit, every function has hints, and words are spelled right.

What is checked, and what cannot be, stands in `pyproject.toml`.
"""

from pathlib import Path
import subprocess
import sys

import pytest

ROOT = Path(__file__).parents[2]


@pytest.mark.slow
@pytest.mark.parametrize("checker", ["mypy", "codespell_lib"])
def test_it_finds_nothing(checker):
    done = subprocess.run(
        [sys.executable, "-m", checker],
        cwd=ROOT,
        capture_output=True,
        text=True,
    )
    assert done.returncode == 0, done.stdout + done.stderr


@pytest.mark.parametrize("package", ["cns_drake", "evaluation"])
def test_packages_declare_their_hints(package):
    assert (ROOT / package / "py.typed").is_file()
