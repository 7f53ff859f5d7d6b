"""The API reference can be built, and shows every public name."""

from pathlib import Path
import re
import subprocess
import sys

import cns_drake
import evaluation

SCRIPT = Path(__file__).parents[2] / "docs" / "api_reference.py"


def test_every_public_name_is_explained(tmp_path):
    run = subprocess.run(
        [sys.executable, SCRIPT, tmp_path], capture_output=True, text=True
    )
    assert (run.returncode, run.stderr) == (0, "")
    for package in (cns_drake, evaluation):
        page = (tmp_path / f"{package.__name__}.html").read_text()
        shown = set(re.findall(r'<section id="(\w+)"', page))
        assert set(package.__all__) - {"__version__"} <= shown
        # Examples are blocks of code.
        assert re.search(r"Example</strong></p>\s*<div class=.pdoc-code", page)
