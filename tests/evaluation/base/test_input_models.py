"""True and false are no numbers in any input file."""

from typing import Annotated

from pydantic import Field, ValidationError
import pytest

from cns_drake.sensors import LidarSection
from evaluation.base import InputModel
from evaluation.methods import MethodConfig
from worlds.city import BuildingPlan


class _Switches(InputModel):
    number: float | None = None
    pair: tuple[Annotated[float, Field(ge=0.0)], float] = (0.0, 0.0)
    shares: dict[str, list[int]] | None = None
    either: bool | int = 2
    switch: bool = False


class _Settings(MethodConfig):
    candidates: int = 20


@pytest.mark.parametrize(
    ("kind", "values"),
    [
        (_Switches, {"number": True}),
        (_Switches, {"pair": [True, 0.0]}),
        (_Switches, {"shares": {"a": [1, False]}}),
        (LidarSection, {"xyz": [0.0, False, 1.6]}),
        (LidarSection, {"rate": True}),
        (BuildingPlan, {"archetype": "villa", "at": [True, 0.0], "height": 9}),
        (_Settings, {"candidates": True}),
    ],
)
def test_truth_is_no_number(kind, values):
    with pytest.raises(ValidationError, match=r"(True|False) is no number"):
        kind.model_validate(values)


def test_other_values_are_read():
    given = {"number": 1, "pair": [0, 2.5], "shares": {"a": [1]}}
    read = _Switches.model_validate(given | {"either": True, "switch": True})
    assert (read.number, read.pair) == (1.0, (0.0, 2.5))
    assert read.shares == {"a": [1]}
    assert read.either is True
    assert read.switch is True
    assert _Switches.model_validate({"number": None}).number is None
