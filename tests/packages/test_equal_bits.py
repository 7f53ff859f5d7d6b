"""What reaches files of worlds and recordings has equal bits everywhere.

The last bits of NumPy's elementary functions and of complex numbers depend on
the vector instructions of the processor, and so does the order of equal values
after a sort that is not stable. Products of matrices depend on the kernels of
OpenBLAS. `elementary` and `math` take their place.
"""

import ast
import re

from helpers.door_contract import ROOT, ROOTS
import pytest

TABLES = "results are equal up to rounding errors, see docs/recordings.md"
# Folders whose numbers reach no such file -> why.
FREE = {
    "cns_drake/pictures": "pixels depend on the libraries that draw them",
    "cns_drake/sensors/camera": "pixels depend on the renderer",
    "cns_drake/training": "weights of networks depend on JAX",
    "evaluation/alignment": TABLES,
    "evaluation/change": TABLES,
    "evaluation/drives": TABLES,
    "evaluation/map_update": TABLES,
    "evaluation/maps": TABLES,
    "evaluation/methods": TABLES,
    "evaluation/recognition": TABLES,
    "evaluation/results": TABLES,
}
# Folders without Drake, whose poses have products of their own.
WORLDS = ("worlds",)
# File and what it uses -> why no last bit of it shows.
ALLOWED = {
    "worlds/imports/cityjson/reading.py: numpy.linalg.inv": (
        "a matrix of axes has one number in each row and column"
    ),
    "worlds/imports/cityjson/reference_systems.py: numpy.linalg.solve": (
        "a place, whose scale is told from others by half a percent"
    ),
    "worlds/imports/opendrive/road_marks.py: numpy.linalg.lstsq": (
        "heights along a mark, which are written in millimetres"
    ),
}
ELEMENTARY = re.compile(
    "exp2?|expm1|log|log2|log10|log1p|logaddexp2?|power|float_power|pow|cbrt"
    "|(a|arc)?(sin|cos|tan)h?|(a|arc)tan2|angle|sinc|i0|hanning|hamming"
    "|blackman|kaiser"
)
MATRICES = re.compile(
    "dot|vdot|inner|matmul|tensordot|convolve|correlate|cov|corrcoef|polyfit"
    "|vecdot|matvec|vecmat"
)
# Numba calls the C library.
COMPILED = ("compiled", "compiled_callback")


def faults(code, in_worlds=True):
    """Yields what depends on the processor in Python code."""
    tree, homes = ast.parse(code), {"np": "numpy"}
    for node in tree.body:
        if isinstance(node, ast.Import | ast.ImportFrom):
            prefix = f"{node.module}." if hasattr(node, "module") else ""
            homes |= {n.asname or n.name: prefix + n.name for n in node.names}

    def full_name(node):
        if isinstance(node, ast.Attribute):
            return f"{full_name(node.value)}.{node.attr}"
        return homes.get(node.id, node.id) if hasattr(node, "id") else ""

    def fault(node):
        if isinstance(node, ast.Call):
            name = full_name(node.func)
            words = {n.arg: ast.unparse(n.value) for n in node.keywords}
            if name.endswith("argsort") and words.get("kind") == "'stable'":
                return ""
            if name.endswith((".argsort", ".argpartition")):
                return "a sort that is not stable"
            if name == "numpy.linalg.norm" and "axis" not in words:
                return name if in_worlds else ""
            return ""
        if isinstance(node, ast.Attribute | ast.Name):
            name = full_name(node)
            home, _, last = name.rpartition(".")
            if name.startswith("scipy.ndimage.gaussian"):
                return name
            if home == "numpy" and ELEMENTARY.fullmatch(last):
                return name
            if in_worlds and (
                (home == "numpy" and MATRICES.fullmatch(last))
                or (home == "numpy.linalg" and last != "norm")
            ):
                return name
        if isinstance(node, ast.Constant) and isinstance(node.value, complex):
            return "a complex number"
        if isinstance(node, ast.BinOp | ast.AugAssign):
            base, operator, exponent = ast.iter_child_nodes(node)
            if isinstance(operator, ast.MatMult) and in_worlds:
                return "a product of matrices"
            if isinstance(operator, ast.Pow):
                known = is_number(base) and is_number(exponent)
                known |= ast.unparse(exponent) in ("2", "0.5")
                return "" if known else "a power"
        return ""

    nodes = [tree]
    while nodes:
        node = nodes.pop()
        decorators = getattr(node, "decorator_list", ())
        if not any(getattr(one, "id", "") in COMPILED for one in decorators):
            if one := fault(node):
                yield one
            nodes += ast.iter_child_nodes(node)


def is_number(node):
    return not any(isinstance(n, ast.Name | ast.Call) for n in ast.walk(node))


def test_nothing_depends_on_the_processor():
    for folder in (*FREE, *WORLDS):
        assert (ROOT / folder).is_dir(), folder
    found = set()
    for root in ROOTS:
        for path in sorted((ROOT / root).rglob("*.py")):
            name = path.relative_to(ROOT).as_posix()
            some = faults(path.read_text(), name.startswith(WORLDS))
            if name.startswith(tuple(f"{folder}/" for folder in FREE)):
                some = [one for one in some if "sort" in one]
            found |= {f"{name}: {one}" for one in some}
    assert found == ALLOWED.keys()


IMPORTS = """
import numpy
import numpy as np
from numpy import exp as e, linalg
from scipy import ndimage
from evaluation.base import compiled, exp
"""


@pytest.mark.parametrize(
    "code",
    [
        "np.cos(x)", "numpy.log(x)", "e(x)", "map(np.exp, x)", "x**3",
        "x **= n", "2.0**x", "1j * x", "np.argsort(x)", "x.argsort()",
        "np.argpartition(x, 3)",
        "x.argsort(kind='quicksort')", "ndimage.gaussian_filter(x, 2)",
        "a @ b", "np.dot(a, b)", "np.linalg.norm(x)", "linalg.svd(x)",
    ],
)  # fmt: skip
def test_what_depends_on_the_processor_is_found(code):
    assert len(list(faults(IMPORTS + code))) == 1


@pytest.mark.parametrize(
    "code",
    [
        "exp(x)", "math.cos(x)", "np.hypot(x, y)", "x**2", "x**0.5", "2.0**-9",
        "x.argsort(kind='stable')", "np.argmax(x)", "x.sum()", "x.exp",
        "np.linalg.norm(x, axis=1)",
        "@compiled\ndef f(x):\n    return np.exp(x) ** 3",
    ],
)  # fmt: skip
def test_what_is_equal_everywhere_is_no_fault(code):
    assert list(faults(IMPORTS + code)) == []
