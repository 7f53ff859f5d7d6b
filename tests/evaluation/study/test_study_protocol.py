"""Studies of recordings by another protocol than the shipped ones."""

from helpers.internal import studies
from helpers.small_towns import drive
import pytest

from evaluation.recognition import MethodChoice, RetrievalProtocol
from evaluation.results import Results

pytestmark = [
    pytest.mark.slow,
    pytest.mark.usefixtures("unrendered_figures"),
]

SOLID = (MethodChoice("solid"),)


def test_numbers_of_another_protocol_stand_without_the_papers(tmp_path):
    for stage, route in (("01", "a"), ("04", "b")):
        drive(tmp_path / "in" / f"metropolis_{stage}", stage, route)
    protocols = {"paper": RetrievalProtocol(radius=12.0, place="first")}
    path = studies.report(tmp_path / "in", tmp_path / "out", SOLID, protocols)
    results = Results.read(path.parent)
    assert results.distinct("protocol") == ["own"]
    text = path.read_text()
    assert "a match within 12 m" in text
    assert "Nothing was measured by the paper's protocol" in text
    assert "as the paper seems" not in text


def test_another_protocol_measures_anew(tmp_path):
    for stage, route in (("01", "a"), ("04", "b")):
        drive(tmp_path / "in" / f"metropolis_{stage}", stage, route)
    seen = []
    for protocol in (
        RetrievalProtocol(),
        RetrievalProtocol(place_spacing=20.0),
        RetrievalProtocol(place_spacing=20.0, radius=12.0),
    ):
        path = studies.report(
            tmp_path / "in", tmp_path / "out", SOLID, {"recorded": protocol}
        )
        results = Results.read(path.parent).where(verified=False)
        (places, *_), (matches, *_) = (
            results.where(metric=name).rows for name in ("places", "with_match")
        )
        seen.append((places.value, matches.value))
    assert [places for places, _ in seen] == [9.0, 5.0, 5.0]
    assert len({number for _, number in seen}) > 1
