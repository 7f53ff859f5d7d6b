"""Other processors: settings of libraries that one machine stands for them.

NumPy, OpenBLAS, the C library and Embree choose their instructions by the
processor. What the program computes must not follow.
"""

import os
from pathlib import Path
import sys

import numpy as np

# Variable of the environment: instructions of Embree, which are for `PROGRAM`.
EMBREE = "CNS_DRAKE_TEST_EMBREE"
# Runs `cns-drake` with these instructions.
PROGRAM = Path(__file__).parent / "internal/embree_program.py"


def processors():
    """Returns name of a processor -> variables of the environment."""
    extensions = np.show_config(mode="dicts")["SIMD Extensions"]
    found = extensions.get("found", [])
    newest = [n for n in found if n.startswith(("AVX512", "X86_V4"))]
    return {
        # The oldest that the wheels of NumPy and Embree run on.
        "oldest": {
            "NPY_DISABLE_CPU_FEATURES": " ".join(found),
            # The oldest kind that has matrix products of its own.
            "OPENBLAS_CORETYPE": "Prescott",
            # The C library does not fuse products and sums.
            "GLIBC_TUNABLES": "glibc.cpu.hwcaps=-FMA,-AVX2",
            EMBREE: "sse2",
        },
        "without AVX-512": {
            "NPY_DISABLE_CPU_FEATURES": " ".join(newest),
            "OPENBLAS_CORETYPE": "Sandybridge",
            EMBREE: "sse4.2",
        },
    }


def on_processor(name):
    """Returns the environment of a test's own program on a processor."""
    paths = {"PYTHONPATH": os.pathsep.join(sys.path)}
    return os.environ | processors()[name] | paths
