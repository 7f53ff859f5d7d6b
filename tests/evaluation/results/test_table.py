"""The tables of results and of queries, written by hand and by programs."""

import csv
import math

from helpers.result_keys import place_key
import numpy as np
import pytest

from evaluation.base import InputError
from evaluation.results import (
    Answers,
    Key,
    QueryRows,
    Results,
    Row,
    as_factor,
    means,
)

FACTOR = "query.transient.snow"
HEADER = (
    f"experiment,map,database,query,seed,{FACTOR},task,method,verified,protocol,"
    "metric,value,low,high,n"
)
LINE = (
    "e,town,town_01,town_02,1,0.2,place,btc,0,random-yaw,auc,0.25,0.125,0.5,80"
)
QUERY_HEADER = (
    "experiment,map,database,query,seed,task,method,verified,protocol,"
    "query_frame,correct,has_match,score,first_right_rank"
)
QUERY_LINE = "e,town,town_01,town_02,1,place,btc,0,random-yaw,7,1,1,0.5,1"


def write(path, *lines):
    path.write_text("".join(f"{line}\n" for line in lines))
    return path


def replaced(line, header, column, cell):
    names = header.split(",")
    cells = line.split(",")
    cells[names.index(column)] = cell
    return ",".join(cells)


def key(**changes):
    return place_key(**{"factors": {FACTOR: 0.2}, **changes})


def test_a_line_becomes_a_row(tmp_path):
    results = Results.read(write(tmp_path / "results.csv", HEADER, LINE))
    row = Row(**key(), metric="auc", value=0.25, low=0.125, high=0.5, n=80)
    assert results == Results((FACTOR,), (row,))
    assert Results.read(tmp_path) == results
    assert row[FACTOR] == 0.2
    assert row["database.years"] is None


def test_numbers_keep_all_digits_and_bytes(tmp_path):
    rng = np.random.default_rng(0)
    values = rng.random(200)
    rows = [
        Row(**key(seed=k), metric="auc", value=value, n=np.int64(k))
        for k, value in enumerate(values)
    ]
    first, second = tmp_path / "a.csv", tmp_path / "b.csv"
    Results.of(rows).write_csv(first)
    found = Results.read(first)
    assert [row.value for row in found.rows] == values.tolist()
    found.write_csv(second)
    assert first.read_bytes() == second.read_bytes()
    made = "protocol,protocol_digest,version,"
    header = first.read_text().splitlines()[0]
    assert header == HEADER.replace("protocol,", made)
    # A reader of its own.
    with first.open() as file:
        lines = list(csv.DictReader(file))
    assert [float(line["value"]) for line in lines] == values.tolist()
    assert {line["low"] for line in lines} == {""}


@pytest.mark.parametrize(
    ("cell", "value"),
    [
        ("", None),
        ("3", 3),
        ("-2", -2),
        ("0.10", 0.1),
        ("1e-3", 0.001),
        ("true", True),
        ("FALSE", False),
        ("avia", "avia"),
        ("01", "01"),
        ("nan", "nan"),
    ],
)
def test_values_of_factors(tmp_path, cell, value):
    path = write(
        tmp_path / "r.csv", HEADER, replaced(LINE, HEADER, FACTOR, cell)
    )
    (row,) = Results.read(path).rows
    assert row[FACTOR] == value
    assert type(row[FACTOR]) is type(value)


@pytest.mark.parametrize(
    ("given", "value"),
    [
        ("60", 60),
        (" 1e5", 1e5),
        ("True", True),
        ("007", "007"),
        (" x ", " x "),
        ("", ""),
        (True, True),
        (60, 60),
        (math.nan, None),
    ],
)
def test_a_text_of_the_command_line_counts_as_what_it_says(given, value):
    found = as_factor(given)
    assert (type(found), found) == (type(value), value)


def test_columns_may_have_any_order(tmp_path):
    order = np.random.default_rng(1).permutation(15)
    lines = [
        ",".join(np.array(line.split(","))[order]) for line in (HEADER, LINE)
    ]
    shuffled = Results.read(write(tmp_path / "a.csv", *lines))
    plain = Results.read(write(tmp_path / "b.csv", HEADER, LINE))
    assert shuffled.rows == plain.rows


def test_programs_with_floats_for_whole_numbers(tmp_path):
    """As pandas writes a column with an empty cell, and truth values."""
    line = replaced(LINE, HEADER, "n", "80.0")
    line = replaced(line, HEADER, "seed", "1.0")
    line = replaced(line, HEADER, "verified", "True")
    (row,) = Results.read(write(tmp_path / "r.csv", HEADER, line)).rows
    assert (row.n, row.seed, row.verified) == (80, 1, True)


@pytest.mark.parametrize("seed", [2**64, 10**400])
def test_seeds_of_any_length(tmp_path, seed):
    line = replaced(LINE, HEADER, "seed", str(seed))
    (row,) = Results.read(write(tmp_path / "r.csv", HEADER, line)).rows
    assert row.seed == seed


@pytest.mark.parametrize(
    ("column", "cell", "words"),
    [
        ("value", "1.0001", ["value", "0 to 1"]),
        ("value", "-0.0001", ["value", "0 to 1"]),
        ("value", "nan", ["value", "'nan' is no number"]),
        ("value", "1e999", ["value", "no number"]),
        ("low", "0.51", ["low", "more than high"]),
        ("low", "", ["low", "high"]),
        ("high", "", ["low", "high"]),
        ("n", "8.5", ["n: '8.5'", "whole"]),
        ("n", "-8", ["n: '-8'", "whole"]),
        ("n", "eighty", ["n: 'eighty'"]),
        ("seed", "1.5", ["seed: '1.5'"]),
        ("seed", "", ["seed: empty"]),
        ("verified", "2", ["verified: '2' is neither 0 nor 1"]),
        ("verified", "", ["verified"]),
        ("metric", "", ["metric: empty"]),
        ("map", " ", ["map: empty"]),
        ("task", "", ["task: empty"]),
        ("method", "", ["method: empty"]),
        ("protocol", "mine", ["protocol: no protocol 'mine'", "random-yaw"]),
        ("method", "bt\x07c", ["method", "control character"]),
        ("map", '"to\nwn"', ["map", "control character"]),
        ("value", "0.2,5", ["16 cells instead of 15"]),
    ],
)
def test_values_that_cannot_be(tmp_path, column, cell, words):
    wrong = replaced(LINE, HEADER, column, cell)
    good = replaced(LINE, HEADER, "seed", "3")
    path = write(tmp_path / "r.csv", HEADER, good, wrong)
    with pytest.raises(InputError) as raised:
        Results.read(path)
    for word in (str(path), "line 3" if "\n" not in cell else "line 4", *words):
        assert word in str(raised.value)


def test_a_number_of_queries_is_never_undefined(tmp_path):
    line = replaced(LINE, HEADER, "metric", "with_match")
    path = write(
        tmp_path / "r.csv", HEADER, replaced(line, HEADER, "value", "")
    )
    with pytest.raises(InputError, match=r"line 2: value: .*needs a number"):
        Results.read(path)


@pytest.mark.parametrize(
    ("task", "metric"), [("change", "tcr_sym"), ("seen", "seen")]
)
def test_tasks_of_drives_have_no_method(tmp_path, task, metric):
    row = Row(**key(task=task, method=""), metric=metric, value=0.5)
    Results.of([row]).write_csv(tmp_path / "r.csv")
    (found,) = Results.read(tmp_path / "r.csv").rows
    assert (found.task, found.method, found.value) == (task, "", 0.5)


@pytest.mark.parametrize(
    ("metric", "value", "fits"),
    [
        ("relative_auc", "1.2", True),
        ("relative_auc", "-0.1", False),
        ("visible_change", "-0.5", True),
        ("visible_change", "-1.5", False),
        ("tcr_sym", "1.5", False),
        ("miou", "2", False),
        ("query_time", "-1", False),
        ("elevation", "-7", True),
        ("tcr_sym", "", True),
    ],
)
def test_ranges_of_metrics(tmp_path, metric, value, fits):
    line = replaced(LINE, HEADER, "metric", metric)
    line = replaced(line, HEADER, "value", value)
    path = write(tmp_path / "r.csv", HEADER, line)
    if fits:
        (row,) = Results.read(path).rows
        assert math.isnan(row.value) == (value == "")
    else:
        with pytest.raises(InputError, match=f"value: .*{metric} is"):
            Results.read(path)


def test_a_table_may_be_wide(tmp_path):
    """Names of columns are compared in linear time, not each with each."""
    names = [f"query.f{k}" for k in range(32_000)]
    header, line = HEADER.split(","), LINE.split(",")
    header[5:6], line[5:6] = names, ["1"] * len(names)
    path = tmp_path / "results.csv"
    (row,) = Results.read(write(path, ",".join(header), ",".join(line))).rows
    assert row.factors == dict.fromkeys(names, 1)
    header[6] = header[30_000]
    with pytest.raises(InputError, match=rf"'{header[6]}' is there twice"):
        Results.read(write(path, ",".join(header), ",".join(line)))


def test_a_number_twice_is_refused(tmp_path):
    again = replaced(LINE, HEADER, "value", "0.3")
    path = write(tmp_path / "r.csv", HEADER, LINE, again)
    with pytest.raises(InputError, match=r"line 3: .* line 2"):
        Results.read(path)


@pytest.mark.parametrize(
    ("header", "words"),
    [
        (HEADER.replace(",n", ""), "no column 'n'"),
        (HEADER.replace(",low", ",value"), "no column 'low'"),
        (HEADER + ",map", "column 'map' is there twice"),
        (HEADER + ",", "has no name"),
        (HEADER + ",label", "'label' names no factor"),
        ("", "no column 'experiment'"),
    ],
)
def test_tables_with_other_columns(tmp_path, header, words):
    row = ",".join("1" for _ in header.split(","))
    path = write(tmp_path / "r.csv", header, row)
    with pytest.raises(InputError, match=words) as raised:
        Results.read(path)
    assert str(raised.value).startswith(f"{path}: ")


def test_columns_that_are_not_there(tmp_path):
    table = Results.read(write(tmp_path / "results.csv", HEADER, LINE))
    with pytest.raises(InputError, match=r"no column 'metho'.*mean method"):
        table.where(metho="solid")
    with pytest.raises(InputError, match=r"no column 'metho'.*mean method"):
        means(table.rows, "metho")
    # Some tables lack a factor, where it has no value.
    assert not table.where({"both.stage": "own"}).rows


def test_files_that_are_no_table(tmp_path):
    empty = write(tmp_path / "empty.csv", HEADER)
    with pytest.raises(InputError, match="no rows"):
        Results.read(empty)
    latin = tmp_path / "latin.csv"
    latin.write_bytes(HEADER.encode() + b"\n\xe9")
    with pytest.raises(InputError, match="UTF-8"):
        Results.read(latin)
    quoted = write(tmp_path / "quoted.csv", HEADER, 'e,"to"wn')
    with pytest.raises(InputError, match="not CSV"):
        Results.read(quoted)


def test_selection():
    rows = [
        Row(**key(seed=s, factors={FACTOR: f}), metric=m, value=0.5)
        for s in (1, 2)
        for f in (0, 0.2)
        for m in ("auc", "r1")
    ]
    results = Results.of(rows)
    assert len(results.where(metric="auc").rows) == 4
    assert len(results.where({FACTOR: (0, 0.2)}, seed=2).rows) == 4
    assert len(results.where({FACTOR: 0.2, "metric": "r1"}).rows) == 2
    assert results.distinct(FACTOR) == [0, 0.2]
    assert results.distinct("method") == ["btc"]


def test_what_identifies_a_condition():
    round_crop = {"methods.ring++.crop": "round", "level": 2, "cause": None}
    one = Key(**key(method="ring++", factors=round_crop))
    other = Key(**key(factors={"level": 2}))
    assert one.label == "ring++, crop round"
    assert one.without("method") == other.without("method")
    assert one.identity != Key(**key(method="ring++")).identity


def make_answers(**changes):
    return Answers(
        **key(**changes),
        columns={
            "query_frame": np.array([0, 10, 20]),
            "query_stamp_ns": np.array([0, 1, 2]) + 1_700_000_000_000_000_001,
            "query_x": np.array([0.1, 1.0 / 3.0, -5.0]),
            "block": np.array([0, 0, 1]),
            "correct": np.array([True, False, False]),
            "has_match": np.array([True, True, False]),
            "score": np.array([-1.0, 0.5, math.nan]),
            "first_right_rank": np.array([1.0, 4.0, math.inf]),
            "why": np.array(["", "elsewhere", "no_place"], dtype=object),
            "match_frame": np.array([5, 7, -1]),
        },
    )


def test_queries_are_read_as_written(tmp_path):
    one, other = make_answers(), make_answers(method="solid", factors={})
    first, second = tmp_path / "queries.csv", tmp_path / "b.csv"
    QueryRows.of([one, other]).write_csv(first)
    found = QueryRows.read(tmp_path)
    assert found.factors == (FACTOR,)
    for read, made in zip(found.answers, (one, other), strict=True):
        assert read.identity == made.identity
        for name, column in made.columns.items():
            expected = np.where(column == math.inf, -1, column)
            assert read.columns[name].tolist()[:2] == expected.tolist()[:2]
        assert math.isnan(read.columns["score"][2])
        assert np.isnan(read.columns["overlap"]).all()
        outcomes = read.outcomes
        assert outcomes.first_right_ranks.tolist() == [1.0, 4.0, math.inf]
        assert outcomes.blocks.tolist() == [0, 0, 1]
        assert outcomes.recall_at(1) == 0.5
    found.write_csv(second)
    assert first.read_bytes() == second.read_bytes()


def test_a_few_columns_of_queries_are_enough(tmp_path):
    lines = [
        QUERY_LINE.replace("random-yaw,7", f"random-yaw,{frame}")
        for frame in (20, 10, 0)
    ]
    # Lines of another method stand between.
    lines.insert(1, lines[0].replace("btc", "solid"))
    path = write(tmp_path / "queries.csv", QUERY_HEADER, *lines)
    btc, solid = QueryRows.read(path).answers
    # By key, not by position.
    assert btc.columns["query_frame"].tolist() == [0, 10, 20]
    assert len(solid.outcomes) == 1
    assert btc.outcomes.blocks is None


@pytest.mark.parametrize(
    ("column", "cell", "words"),
    [
        ("correct", "yes", "correct: 'yes' is neither"),
        ("has_match", "0", "correct: 1, without a match"),
        ("score", "", "score: empty"),
        ("score", "nan", "score: 'nan' is no number"),
        ("first_right_rank", "2", "first_right_rank: 1 means correct"),
        ("first_right_rank", "1.5", "first_right_rank: '1.5'"),
        ("query_frame", "", "query_frame: empty"),
        ("query_frame", "6", "query_frame: this query is there twice"),
    ],
)
def test_answers_that_cannot_be(tmp_path, column, cell, words):
    good = replaced(QUERY_LINE, QUERY_HEADER, "query_frame", "6")
    wrong = replaced(QUERY_LINE, QUERY_HEADER, column, cell)
    path = write(tmp_path / "q.csv", QUERY_HEADER, good, wrong)
    with pytest.raises(InputError, match=words) as raised:
        QueryRows.read(path)
    assert str(raised.value).startswith(f"{path}: line 3: ")


@pytest.mark.parametrize(
    ("value", "low", "high", "fault"),
    [
        (0.5, 0.55 - 1e-9, 0.7, None),
        (0.5, 0.55 + 1e-9, 0.7, "value: .* off its interval"),
        (0.5, 0.3, 0.45 - 1e-9, "value: .* off its interval"),
        (1.0, 0.99, 1.0 + 1e-10, None),
        (1.0, 0.99, 1.0 + 1e-8, "(low|high): .* from 0 to 1"),
        (0.0, -1e-8, 0.1, "(low|high): .* from 0 to 1"),
    ],
)
def test_intervals_that_cannot_be(tmp_path, value, low, high, fault):
    start = LINE.partition(",auc,")[0]
    line = f"{start},auc,{value!r},{low!r},{high!r},80"
    path = write(tmp_path / "results.csv", HEADER, line)
    if fault is None:
        assert len(Results.read(path).rows) == 1
        return
    with pytest.raises(InputError, match=rf"results\.csv: line 2: {fault}"):
        Results.read(path)


# Texts that names, settings and paths can have.
WORDS = (
    "01",
    "12e4567",
    "1e999",
    "inf",
    "nan",
    "True",
    "a;b",
    "a, b",
    'the "old" one',
    "[0, 0, 1.6]",
    "Zürich\u00a0West",
    "+5",
    "5.",
    "-0",
    "x" * 300,
    "1e5",
    "true",
    "007",
    " x ",
    '"quoted"',
    '"',
    "two\nlines",
    "\x1b[31m",
)
FACTORS = (
    None,
    True,
    False,
    0,
    -7,
    2**70,
    0.1,
    -1e-300,
    1e300,
    math.inf,
    -math.inf,
    *WORDS,
)


@pytest.mark.parametrize("seed", range(3))
def test_what_is_written_is_read_value_for_value(tmp_path, seed):
    rng = np.random.default_rng(seed)

    def some(values):
        return values[rng.integers(len(values))]

    keys = [
        key(
            map=some(WORDS),
            database=some(WORDS),
            query=some(WORDS),
            method=f"{some(WORDS)} {k}",
            seed=int(some((0, 1, 2**63 - 1, 2**80))),
            verified=bool(rng.integers(2)),
            factors={
                name: value
                for name in ("query.a;b", "methods.c,d.e", "both.f")
                if (value := some(FACTORS)) is not None
            },
        )
        for k in range(30)
    ]
    # The first row has all factors, and so determines their order.
    names = ("query.a;b", "methods.c,d.e", "both.f")
    keys[0]["factors"] = dict.fromkeys(names, 1)
    numbers = (0.0, -0.0, 0.1, 1e-300, math.inf, math.nan, rng.random())
    rows = [
        Row(
            **one,
            metric="my score",
            value=some(numbers),
            low=-math.inf,
            high=math.inf,
            n=some((None, 0, 2**62)),
        )
        for one in keys
    ]
    Results.of(rows).write_csv(tmp_path / "results.csv")
    read = Results.read(tmp_path).rows
    # NaN is not equal to itself, but its text is.
    assert list(map(repr, read)) == list(map(repr, rows))
    answers = [
        Answers(
            **{**one, "task": "localise"},
            columns={
                "query_frame": np.arange(6),
                "correct": rng.random(6) < 0.5,
                "has_match": rng.random(6) < 0.5,
                "score": np.array(numbers[:6]),
                "why": np.array([some(WORDS) for _ in range(6)], object),
            },
        )
        for one in keys
    ]
    QueryRows.of(answers).write_csv(tmp_path / "queries.csv")
    found = QueryRows.read(tmp_path).answers
    for before, after in zip(answers, found, strict=True):
        assert before.identity == after.identity
        for name, values in before.columns.items():
            assert repr(after.columns[name].tolist()) == repr(values.tolist())


def test_what_is_undefined_is_left_out_and_told():
    rows = [
        Row(**key(seed=k), metric="relative_auc", value=value)
        for k, value in enumerate((0.5, math.nan, 0.7))
    ]
    known, note = Results.of(rows).defined()
    assert [row.value for row in known.rows] == [0.5, 0.7]
    assert "relative_auc (1 of 3)" in note
    assert known.defined() == (known, "")
