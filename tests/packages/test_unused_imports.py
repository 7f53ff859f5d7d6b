"""What a command does not use is not imported."""

import subprocess
import sys

import pytest

TYPES = "rosbags.typesys.stores.ros2_humble"
LIST = "from cns_drake.__main__ import main; main()"
# Code and its arguments -> modules that it does without.
UNUSED = {
    ("import cns_drake.simulation.scanning",): (
        "scipy.spatial", "shapely", "matplotlib", TYPES,
    ),
    ("import cns_drake.simulation.simulation",): (
        "cns_drake.pictures", "matplotlib", TYPES,
    ),
    (LIST, "study", "--list"): ("pydrake", "scipy", "numba", "matplotlib"),
}  # fmt: skip
PRINT = """
import atexit, sys
atexit.register(lambda: print(*sys.modules, sep="\\n", file=sys.stderr))
"""


@pytest.mark.slow
@pytest.mark.parametrize("code", UNUSED)
def test_what_a_command_does_not_use_is_not_imported(code):
    done = subprocess.run(
        [sys.executable, "-c", PRINT + code[0], *code[1:]],
        capture_output=True,
        text=True,
        check=True,
    )
    imported = set(done.stderr.split())
    assert {"numpy", "evaluation"} <= imported
    assert not imported & set(UNUSED[code])
