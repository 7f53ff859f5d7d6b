"""Conditions: grids of factors, and cases with levels."""

import itertools

import pytest
import yaml

from evaluation.base import InputError


def factors(experiment):
    """The values of all factors, condition by condition."""
    return [dict(one.factors) for one in experiment.conditions]


def test_the_grid_is_the_product_of_all_factors(read):
    experiment = read(
        """
        database: {aside: [0, 10, 20]}
        query: {transient: {snow: [0, 0.2], leaves: 0.5}}
        protocol: {radius: [5, 7.5]}
        """
    )
    found = experiment.conditions
    columns = ["database.aside", "query.transient.snow", "protocol.radius"]
    assert all(list(one.factors) == columns for one in found)
    # The last factor varies fastest.
    assert [tuple(one.factors.values()) for one in found] == list(
        itertools.product((0, 10, 20), (0, 0.2), (5, 7.5))
    )
    for one in found:
        years, snow, radius = one.factors.values()
        assert one.changes == {
            "database": {"aside": years},
            "query": {"transient": {"snow": snow, "leaves": 0.5}},
            "protocol": {"radius": radius},
        }
        # Each protocol has a baseline of its own.
        baseline = dict(zip(columns, (0, 0, radius), strict=True))
        assert one.baseline == baseline


def test_the_baseline_comes_first(read):
    experiment = read(
        """
        database: {aside: [0, 10]}
        query: {name: [vlp-16, os1-64]}
        baseline: {query: {name: os1-64}}
        """
    )
    found = experiment.conditions
    assert [tuple(one.factors.values()) for one in found] == [
        (0, "os1-64"),
        (0, "vlp-16"),
        (10, "vlp-16"),
        (10, "os1-64"),
    ]
    # Each is compared with the same years.
    for one in found:
        assert one.baseline == {**one.factors, "query.name": "os1-64"}


@pytest.mark.parametrize(
    ("baseline", "found"),
    [
        ("", {"cause": "none", "level": 0, "both.stage": "own", "query.x": 1}),
        ("both.stage: last", {"both.stage": "last"}),
        (
            "both: {stage: last}, query.x: 2",
            {"both.stage": "last", "query.x": 2},
        ),
        ("cause: none", {"cause": "none", "level": 0}),
        ("cause: snow", {"cause": "snow"}),
        ("level: 2, protocol.radius: 5", {"level": 2, "protocol.radius": 5}),
    ],
)
def test_a_baseline_shares_the_factors_that_are_not_named(
    read, baseline, found
):
    experiment = read(
        f"""
        both: {{stage: [own, last]}}
        query: {{x: [1, 2]}}
        protocol: {{radius: [5, 7.5]}}
        cases: {{snow: {{query: {{transient: {{snow: [0.1, 0.2]}}}}}}}}
        baseline: {{{baseline}}}
        """
    )
    assert len(experiment.conditions) == 2 * 2 * 2 * (1 + 2)
    for one in experiment.conditions:
        assert one.baseline == {**one.factors, **found}
        assert list(one.baseline) == list(one.factors)


def test_one_at_a_time(read):
    experiment = read(
        """
        design: one-at-a-time
        database: {aside: [0, 5, 10]}
        query: {aside: [0, 5], transient: {snow: [0.1, 0]}}
        baseline: {query: {transient: {snow: 0}}}
        """
    )
    assert [tuple(one.values()) for one in factors(experiment)] == [
        (0, 0, 0),
        (5, 0, 0),
        (10, 0, 0),
        (0, 5, 0),
        (0, 0, 0.1),
    ]
    # All are compared with the centre.
    first = experiment.conditions[0].factors
    assert all(one.baseline == first for one in experiment.conditions)


def test_factors_and_cases_of_different_fields_of_a_section(read):
    experiment = read(
        """
        query: {a: [{b: 1}, {}], a.c: [2, 3]}
        database: {d: [5, 6]}
        cases:
          e: {query: {a: {f: [4]}, d: [7]}, both: {d: [8]}}
          g: {query: {d: [9]}}
          both: [e, g]
        """
    )
    assert len(experiment.conditions) == 2 * 2 * 2 * (1 + 1 + 1 + 1)


@pytest.mark.parametrize(
    ("value", "found"),
    [
        ("{from: 0, to: 0.6, count: 4}", [0, 0.2, 0.4, 0.6]),
        ("{from: 1, to: -1, count: 3}", [1, 0, -1]),
        ("[[1, 0], [2.5, 180]]", ["[1,0]", "[2.5,180]"]),
        ("[near]", ["near"]),
        ("[{snow: 0.1, leaves: 0}, {}]", ["snow: 0.1,leaves: 0", "none"]),
        ("[true, false]", [True, False]),
        ("[null, {snow: 1}]", ["none", "snow: 1"]),
        ('["01", "04"]', ["01", "04"]),
    ],
)
def test_values_of_factors(read, value, found):
    name = "xyz" if "[[" in value else "field"
    experiment = read(f"database: {{{name}: {value}}}\n")
    assert [next(iter(one.values())) for one in factors(experiment)] == found


@pytest.mark.parametrize(
    "field",
    [
        "without: [house_1, house_2]",
        "without: []",
        "route: [{road: a, direction: forward, lane: 1}]",
        "lidars: {lidar: {xyz: [1, 2, 3], rpy_deg: [0, 0, 90]}}",
        "field: {from: 1, to: 2}",
        "lidars: {lidar: {unit: {ranges: [1, 9], rings_deg: [[9, -9, 4]]}}}",
    ],
)
def test_lists_that_are_one_value(read, field):
    experiment = read(f"both: {{{field}}}\n")
    (only,) = experiment.conditions
    assert only.factors == {}
    assert only.changes == {"both": yaml.safe_load(f"{{{field}}}")}


CASES = """
cases:
  snow: {query: {transient: {snow: [0.1, 0.2, 0.4]}}}
  returns: {query: {aside: 1.0}}
  driver:
    database: {driver: {lane_changes: [0, 9], wander: 0.3}, traffic: {vehicles:
      [0, 0, 24]}}
  all: [snow, returns]
"""


def test_cases_have_levels(read):
    found = read(CASES).conditions
    assert [tuple(one.factors.values()) for one in found] == [
        ("none", 0),
        ("snow", 1),
        ("snow", 2),
        ("snow", 3),
        ("returns", 1),
        ("driver", 1),
        ("driver", 2),
        ("driver", 3),
        ("all", 1),
        ("all", 2),
        ("all", 3),
    ]
    assert all(one.baseline == found[0].factors for one in found)
    fields = {tuple(one.factors.values()): one.causes for one in found}
    assert fields["none", 0] == ()
    assert fields["snow", 2] == (({"query": {"transient": {"snow": 0.2}}},),)
    # A shorter list stays at its last value.
    assert fields["driver", 3] == (
        (
            {
                "database": {
                    "driver": {"lane_changes": 9, "wander": 0.3},
                    "traffic": {"vehicles": 24},
                }
            },
        ),
    )
    # What a map lacks gives way to a lower level of the same cause.
    snow, returns = fields["all", 2]
    assert [one["query"]["transient"]["snow"] for one in snow] == [0.2, 0.1]
    assert returns == ({"query": {"aside": 1.0}},)


@pytest.mark.parametrize(
    ("levels", "found"),
    [
        ("[3]", {"snow": [3], "returns": [1], "driver": [3], "all": [3]}),
        ("{from: 1, to: 3, count: 2}", {"snow": [1, 3], "returns": [1]}),
        ("[1, 3]", {"snow": [1, 3], "returns": [1], "all": [1, 3]}),
        ("2", {"snow": [2], "returns": [1], "all": [2]}),
    ],
)
def test_some_levels(read, levels, found):
    experiment = read(f"{CASES}\nlevels: {levels}\n")
    climbed = {}
    for one in factors(experiment):
        climbed.setdefault(one["cause"], []).append(one["level"])
    assert climbed.pop("none") == [0]
    assert climbed | found == climbed


def test_cases_beside_factors(read):
    experiment = read(f"{CASES}\nboth: {{seed: [3, 4]}}\nlevels: [1]\n")
    found = experiment.conditions
    assert len(found) == 2 * 5
    assert list(found[0].factors) == ["cause", "level", "both.seed"]
    assert all(one.baseline == found[0].factors for one in found)


def test_an_experiment_may_be_wide(read):
    """Fields are set in linear time; copies of all of them took minutes."""
    wide = ", ".join(f"f{k}: {k}" for k in range(20_000))
    (only,) = read(f"query: {{a: {{{wide}}}}}\n").conditions
    assert only.changes == {"query": {"a": {f"f{k}": k for k in range(20_000)}}}


def test_grids_have_an_end(read):
    """Half a million measurements can be planned, one more cannot."""
    spread = "{{from: 0, to: 1, count: {}}}".format

    def grid(*counts, more=""):
        fields = (f"f{k}: {spread(n)}" for k, n in enumerate(counts))
        return f"database: {{{', '.join(fields)}}}\n{more}"

    cases = "cases: {c: {query: {x: [1, 2, 3]}}}"
    read(grid(50, 100, more=cases))
    for text, number in (
        (grid(167, 2995), 500_165),
        (grid(2, 10_001, more=cases), None),
        (grid(50, 2501, more=cases), 500_200),
        (grid(1000, 1000, 1000, 1000), 10**12),
    ):
        fault = f"{number} measurements" if number else "count"
        with pytest.raises(InputError, match=fault):
            read(text)
    # One at a time they are few.
    few = read(grid(1000, 1000, 1000, more="design: one-at-a-time"))
    assert len(few.conditions) == 1 + 3 * 999
