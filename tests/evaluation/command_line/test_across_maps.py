"""Drives of two maps are compared with the option `--across-maps`."""

import json

from helpers.internal.eval_program import assert_refused, run, without_world
from helpers.measured_pairs import place_outcome
from helpers.small_towns import drive
import pytest

from evaluation.base import InputError
from evaluation.drives import open_drive
from evaluation.methods import make_method


def test_two_draws_of_a_city(capsys, tmp_path):
    for city, stage, route in (("town", "01", "a"), ("town_c1", "02", "b")):
        drive(tmp_path / f"{city}_{stage}", stage, route, city=city)
    both = ["pr", tmp_path / "town_01", tmp_path / "town_c1_02"]
    both += ["--method", "solid", "--json"]
    assert_refused(
        capsys,
        both,
        "through town_c1",
        "(cns-eval pr --across-maps",
    )
    with pytest.raises(InputError, match="through town_c1"):
        place_outcome(*map(open_drive, both[1:3]), make_method("solid", {}))
    status, out, err = run(capsys, *both, "--across-maps")
    assert (status, without_world(err)) == (0, "")
    assert json.loads(out)["queries_with_match"] > 0
