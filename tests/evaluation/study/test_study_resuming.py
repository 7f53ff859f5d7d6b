"""A study that runs again with another method, or another version of one."""

from collections import Counter

from helpers.internal import studies
from helpers.small_towns import drive
import pytest

from evaluation.methods import make_method
from evaluation.recognition import choose_methods

pytestmark = pytest.mark.slow

METHODS = "solid", "scan-context++"


@pytest.mark.usefixtures("unrendered_figures")
def test_what_other_methods_found_stays(tmp_path, monkeypatch):
    """Also what no method changes: how much of a scan its match shows."""
    for stage, route in (("01", "a"), ("04", "b")):
        drive(tmp_path / "in" / f"metropolis_{stage}", stage, route)

    def run(methods):
        output = tmp_path / "out"
        studies.report(tmp_path / "in", output, choose_methods(methods))
        return {
            path.relative_to(output): path.stat().st_mtime_ns
            for path in (output / "parts").rglob("*.data")
        }

    run(METHODS[1:])
    before = run(METHODS)
    assert run(METHODS) == before
    # The one that comes first has changed.
    monkeypatch.setattr(type(make_method(METHODS[0], {})), "version", 2)
    after = run(METHODS)
    new = after.keys() - before.keys()
    assert {path: after[path] for path in before} == before
    kinds = Counter(path.parts[1] for path in new)
    # Each way, without the change and with it; one drive is asked both.
    assert kinds.keys() == {
        "descriptors", "describingtime", "place", "search",
    }  # fmt: skip
    assert kinds["place"] == kinds["search"]
