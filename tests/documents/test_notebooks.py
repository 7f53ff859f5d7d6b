"""The notebooks run from top to bottom, and find what they say."""

import json

from helpers import documents
import matplotlib as mpl
import numpy as np
import pytest

FOLDER = documents.ROOT / "docs/notebooks"
pytestmark = pytest.mark.slow


def run(name, *changes):
    """Runs the cells of a notebook; returns its variables."""
    notebook = json.loads((FOLDER / name).read_text())
    cells = ["".join(c["source"]) for c in notebook["cells"] if is_code(c)]
    source = "\n".join(cells)
    for old, new in changes:
        assert old in source
        source = source.replace(old, new)
    mpl.use("agg")
    values = {"__name__": name}
    exec(compile(source, name, "exec"), values)
    return values


def is_code(cell):
    # As it is committed, a notebook has not been run.
    assert not cell.get("outputs")
    return cell["cell_type"] == "code"


def test_a_lidar_in_my_diagram():
    values = run("lidar_in_my_diagram.ipynb")
    # The near side of the wall, after the cart has moved by 3 m.
    y = values["p_W"][1, values["wall"]]
    assert len(y) > 1000
    assert np.isclose(np.median(y), 4.9, atol=0.01)
    assert np.isclose(values["X_WS"].translation()[0], 3.0, atol=0.02)


def test_what_survives(tmp_path):
    values = run(
        "what_survives.ipynb",
        ("FRAMES = 400", "FRAMES = 16"),
        ("tempfile.mkdtemp()", repr(str(tmp_path))),
        (
            '("scan-context++", "solid", "ring++", "layered-overlap")',
            '("solid",)',
        ),
    )
    assert len(values["aucs"]) == 2
    # Nothing has changed on the other lane, and much before.
    assert 0.0 < values["change"].symmetric < 1.0
    assert all(0.0 <= auc <= 1.0 for auc in values["aucs"].values())


def test_all_are_run():
    names = {path.name for path in FOLDER.iterdir()}
    assert names == {"lidar_in_my_diagram.ipynb", "what_survives.ipynb"}
