"""The notebooks run from top to bottom, and find what they say."""

import base64
import io
import json
import re

from helpers import documents
from helpers.small_map import scenario_values, write_small_map
import matplotlib as mpl
import numpy as np
from PIL import Image
import pytest
import yaml

FOLDER = documents.ROOT / "docs/notebooks"
NAMES = ("lidar_in_my_diagram.ipynb", "what_survives.ipynb")


def code_cells(name):
    cells = json.loads((FOLDER / name).read_text())["cells"]
    return [cell for cell in cells if cell["cell_type"] == "code"]


def run(name, *changes):
    """Runs the cells of a notebook; returns its variables."""
    source = "\n".join("".join(cell["source"]) for cell in code_cells(name))
    for old, new in changes:
        assert old in source
        source = source.replace(old, new)
    mpl.use("agg")
    values = {"__name__": name}
    exec(compile(source, name, "exec"), values)
    return values


def stored(name, kind):
    """Returns the texts that a notebook stores of a kind of output."""
    outputs = [out for cell in code_cells(name) for out in cell["outputs"]]
    return [
        "".join(out.get("text") or out["data"][kind])
        for out in outputs
        if kind in (out.get("name"), *out.get("data", ()))
    ]


@pytest.mark.parametrize("name", NAMES)
def test_a_notebook_stores_one_whole_run_with_its_figure(name):
    counts = [cell["execution_count"] for cell in code_cells(name)]
    assert counts == list(range(1, len(counts) + 1))
    (figure,) = stored(name, "image/png")
    width, height = Image.open(io.BytesIO(base64.b64decode(figure))).size
    assert min(width, height) > 250
    # Neither a fault, nor a path or an address of the machine that ran it.
    kinds = {
        out["output_type"] for c in code_cells(name) for out in c["outputs"]
    }
    assert kinds == {"display_data", "stream"}
    assert stored(name, "stderr") == []


def test_something_does_not_survive_and_something_does():
    text = "".join(stored("what_survives.ipynb", "stdout"))
    kept = {
        line.partition(":")[0]: int(re.search(r"(\d+)%", line)[1])
        for line in text.splitlines()
        if line.endswith("retained")
    }
    assert len(kept) == 5
    assert kept["solid"] < 50
    assert kept["layered-overlap"] > 90
    assert min(kept, key=kept.get) == "solid"
    changes = dict(re.findall(r"(\w+): TCR_sym ([\d.]+)", text))
    assert float(changes["beside"]) < 0.05 < 0.2 < float(changes["before"])


@pytest.mark.slow
def test_a_lidar_in_my_diagram():
    values = run("lidar_in_my_diagram.ipynb")
    # The near side of the wall, after the cart has moved by 3 m.
    y = values["p_W"][1, values["wall"]]
    assert len(y) > 1000
    assert np.isclose(np.median(y), 4.9, atol=0.01)
    assert np.isclose(values["X_WS"].translation()[0], 3.0, atol=0.02)


@pytest.mark.slow
def test_what_survives(tmp_path):
    """On a map of boxes, which loads at once."""
    town = write_small_map(tmp_path / "town")
    values = scenario_values(town)
    # The second road begins beside a tower that stage 01 lacks.
    values["route"] = values["route"][1:3]
    drive = tmp_path / "drive.yaml"
    drive.write_text(yaml.safe_dump(values))
    values = run(
        "what_survives.ipynb",
        ('"metropolis_04"', repr(str(drive))),
        ("FRAMES = 600", "FRAMES = 16"),
        ("tempfile.mkdtemp()", repr(str(tmp_path))),
        (
            '("scan-context++", "solid", "ring++", "btc", "layered-overlap")',
            '("solid",)',
        ),
    )
    assert len(values["aucs"]) == 2
    # Nothing has changed on the other lane, and much before.
    assert 0.0 < values["change"].symmetric < 1.0
    assert all(0.0 <= auc <= 1.0 for auc in values["aucs"].values())


def test_all_are_run():
    assert {path.name for path in FOLDER.iterdir()} == {*NAMES}
