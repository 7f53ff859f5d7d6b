"""Advice in errors of validation."""

from pydantic import BaseModel, ConfigDict, ValidationError
import pytest

from evaluation.base import describe_validation_error


class Corner(BaseModel):
    model_config = ConfigDict(extra="forbid")

    kerb_radius: float = 1.0
    stage: str = "01"


class Plan(BaseModel):
    model_config = ConfigDict(extra="forbid")

    corners: dict[str, Corner] = {}
    places: list[Corner | None] = []
    home: Corner | None = None


@pytest.mark.parametrize(
    ("values", "advice"),
    [
        ({"corners": {"a": {"kerb_raduis": 2}}}, "did you mean kerb_radius?"),
        ({"places": [None, {"kerb_raduis": 2}]}, "did you mean kerb_radius?"),
        ({"home": {"stagge": "01"}}, "did you mean stage?"),
        ({"cornres": {}}, "did you mean corners?"),
        ({"home": {"stage": 2}}, 'quote it: stage: "2"'),
        ({"home": {"stage": 0.1}}, 'quote it: stage: "0.1"'),
        ({"home": {"colour": 2}}, "; there are: kerb_radius, stage"),
    ],
)
def test_what_to_write_instead(values, advice):
    with pytest.raises(ValidationError) as caught:
        Plan.model_validate(values)
    text = describe_validation_error("plan.yaml", caught.value, Plan)
    assert text.startswith("plan.yaml: ")
    assert text.endswith(advice)
