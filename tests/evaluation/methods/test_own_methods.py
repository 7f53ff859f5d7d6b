"""Methods of one's own, from a file."""

import json

import documents
from eval_program import assert_refused, run
import pytest

from evaluation.methods import method


def shown_method(folder):
    """Saves the method that the documents show, as a file of a name."""
    blocks = documents.fenced(documents.read("docs/methods.md"))
    (example,) = (block.text for block in blocks if "@register" in block.text)
    path = folder / "shown_heights.py"
    path.write_text(example, encoding="utf-8")
    return path


def test_the_method_in_the_documents(capsys, towns, tmp_path, monkeypatch):
    # Others need not know of it.
    monkeypatch.setattr(method, "_METHODS", dict(method._METHODS))
    path = shown_method(tmp_path)
    assert len(path.read_text().splitlines()) < 30
    both = ["pr", towns / "town_01", towns / "town_02", "--method", path]
    status, out, _ = run(capsys, *both, "--set", "rings=30", "--json")
    assert status == 0
    values = json.loads(out)
    assert values["method"] == "heights"
    assert values["parameters"] == {"sensor_height": 1.6, "rings": 30}
    assert values["recall_at_1"] > 0.8
    assert_refused(capsys, [*both, "--set", "rings=x"], "heights: rings")


@pytest.mark.parametrize(
    ("text", "fault"),
    [
        ("x = ", "SyntaxError"),
        ("1 / 0", "ZeroDivisionError: division by zero"),
        ("x = 1", "registers 0 methods"),
        (
            "from evaluation.methods import Method, register\n"
            "register('btc')(type('A', (Method,), {}))",
            "there is another method 'btc'",
        ),
    ],
)
def test_files_that_are_no_method(capsys, towns, tmp_path, text, fault):
    path = tmp_path / "no_method.py"
    path.write_text(text)
    both = ["pr", towns / "town_01", towns / "town_02", "--method"]
    assert_refused(capsys, [*both, path], path, fault)
    nowhere = tmp_path / "nowhere.py"
    assert_refused(capsys, [*both, nowhere], nowhere, "no such file")
