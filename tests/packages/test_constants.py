"""A constant has a line of its own, and room for a comment."""

import ast
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]


def hidden_constants(code):
    """Returns the lines of a module that assign several constants at once.

    They assign the values of a literal tuple to names of the module, or unpack
    a literal tuple or list into another one.
    """
    tree = ast.parse(code)
    return [
        node.lineno
        for node in tree.body
        if isinstance(node, ast.Assign)
        and isinstance(node.targets[0], ast.Tuple)
        and isinstance(node.value, ast.Tuple)
    ] + [
        node.lineno
        for node in ast.walk(tree)
        if isinstance(node, ast.Starred)
        and isinstance(node.value, ast.Tuple | ast.List)
    ]


@pytest.mark.parametrize(
    ("code", "number"),
    [
        ("WIDTH, SPEED = 2.0, 1.0", 1),
        ("_WIDTH, (_LOW, _HIGH) = 2.0, (1.0, 3.0)", 1),
        ('NAMES = (*("a", "b"), "c")', 1),
        ("print(*[1, 2], 3)", 1),
        ("SIZE = (2.0, 1.0)", 0),
        ("FIRST, SECOND = range(2)", 0),
        ("NODES, WEIGHTS = leggauss(12)", 0),
        ("def swapped(a, b):\n    a, b = b, a\n    return (*a, b)", 0),
    ],
)
def test_hidden_constants_are_found(code, number):
    assert len(hidden_constants(code)) == number


@pytest.mark.slow
@pytest.mark.parametrize(
    "folder", ["cns_drake", "evaluation", "diagrams", "docs", "tests"]
)
def test_a_constant_has_a_line(folder):
    assert not {
        str(path): lines
        for path in (ROOT / folder).rglob("*.py")
        if (lines := hidden_constants(path.read_text(encoding="utf-8")))
    }
