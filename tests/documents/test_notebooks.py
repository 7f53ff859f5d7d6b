"""A notebook runs from top to bottom, and finds what it stores."""

import base64
import io
import json

from helpers import documents
import matplotlib as mpl
import numpy as np
from PIL import Image
import pytest

(NOTEBOOK,) = (documents.ROOT / "docs/notebooks").iterdir()
CELLS = [
    cell
    for cell in json.loads(NOTEBOOK.read_text())["cells"]
    if cell["cell_type"] == "code"
]


def stored(kind):
    """Returns the texts that the notebook stores of a kind of output."""
    return [
        "".join(out.get("text") or out["data"][kind])
        for cell in CELLS
        for out in cell["outputs"]
        if kind in (out.get("name"), *out.get("data", ()))
    ]


def test_it_stores_one_whole_run_with_its_figure():
    counts = [cell["execution_count"] for cell in CELLS]
    assert counts == list(range(1, len(counts) + 1))
    (figure,) = stored("image/png")
    width, height = Image.open(io.BytesIO(base64.b64decode(figure))).size
    assert min(width, height) > 250
    # Neither a fault, nor a path or an address of the machine that ran it.
    kinds = {out["output_type"] for c in CELLS for out in c["outputs"]}
    assert kinds == {"display_data", "stream"}
    assert stored("stderr") == []


@pytest.mark.slow
def test_a_lidar_in_my_diagram(capsys):
    mpl.use("agg")
    source = "\n".join("".join(cell["source"]) for cell in CELLS)
    values = {"__name__": NOTEBOOK.name}
    exec(compile(source, NOTEBOOK.name, "exec"), values)
    assert capsys.readouterr().out == "".join(stored("stdout"))
    # The near side of the wall, after the cart has moved by 3 m.
    y = values["p_W"][1, values["wall"]]
    assert len(y) > 1000
    assert np.isclose(np.median(y), 4.9, atol=0.01)
    assert np.isclose(values["X_WS"].translation()[0], 3.0, atol=0.02)
