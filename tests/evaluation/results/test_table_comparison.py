"""Tables beside each other, and beside those that ship."""

import csv
from dataclasses import replace
import itertools
import json
import math
from pathlib import Path

from helpers.internal.eval_program import assert_refused, run
from helpers.result_keys import place_key
import numpy as np
import pytest
from scipy.stats import kendalltau

from evaluation.base import InputError
from evaluation.command_line import show_results
from evaluation.recognition import RANDOM_YAW_PROTOCOL, RetrievalProtocol
from evaluation.results import (
    LAST,
    OWN,
    STAGE,
    Answers,
    QueryRows,
    Results,
    Row,
    compare_tables,
    made_by,
    summary_lines,
)

STAGES = Path("evaluation/results/baselines/stages.csv")


def key(method, town="town", **changes):
    made = made_by(RANDOM_YAW_PROTOCOL)
    return place_key(town, **{"method": method, **made, **changes})


def write_table(folder, towns, number=40, *, queries=False, **changes):
    """Writes a table in which all scores of a method are equal.

    AUC is then the part of its answers that are right.

    Args:
        folder: to write.
        towns: town -> (method -> the part that is right).
        number: of queries of each town.
        queries: whether there are answers.
        changes: of all keys.
    """
    folder.mkdir()
    rows, answers = [], []
    for town, parts in towns.items():
        for method, part in parts.items():
            keys = key(method, town, **changes)
            rows.append(Row(**keys, metric="auc", value=part))
            right = np.arange(number) < part * number
            columns = {
                "query_frame": np.arange(number),
                "block": np.arange(number) % 10,
                "correct": right,
                "has_match": np.ones(number, dtype=bool),
                "score": np.full(number, 0.5),
            }
            answers.append(Answers(**keys, columns=columns))
    Results.of(rows).write_csv(folder / "results.csv")
    if queries:
        QueryRows.of(answers).write_csv(folder / "queries.csv")
    return folder


def shipped(**columns):
    stages = Results.read(STAGES)
    return stages.where(columns).rows


def test_an_entrant_stands_among_the_shipped(tmp_path):
    """Each value is just above the best shipped method's, or below it."""
    best = {}
    changed = {
        "map": "suburbia",
        STAGE: OWN,
        "metric": "auc",
        "verified": False,
    }
    for row in shipped(**changed):
        condition = row.without("method")
        if condition not in best or best[condition].value < row.value:
            best[condition] = row
    rows = [
        Row(**{**vars(row), "method": name, "value": row.value - less})
        for row in best.values()
        for name, less in (("mine", -0.001), ("solid", 0.01))
    ]
    path = tmp_path / "entrant.csv"
    Results.of(rows).write_csv(path)
    found = compare_tables([path])
    assert found.conditions == 2
    names = [one.method for one in found.ranked]
    assert names[0] == "mine"
    assert {"solid", "solid (entrant)"} < set(names)
    value = {one.method: one.value for one in found.ranked}
    expected = np.mean([row.value for row in best.values()])
    assert value["mine"] == pytest.approx(expected + 0.001)
    assert value["solid (entrant)"] == pytest.approx(expected - 0.01)
    mean = np.mean([row.value for row in shipped(**changed, method="ring++")])
    assert value["ring++"] == pytest.approx(mean)
    (note,) = found.notes
    assert note.startswith("solid: other values in entrant and ")
    assert " in 2 of 2 conditions, by up to " in note
    assert found.agreements == []


def test_a_task_that_is_not_shipped_is_named(tmp_path):
    rows = [replace(row, task="plac") for row in shipped(metric="auc")]
    path = tmp_path / "misspelt.csv"
    Results.of(rows).write_csv(path)
    lacking = "shipped tables have no auc of the task plac with these options"
    assert any(lacking in note for note in compare_tables([path]).notes)


@pytest.mark.parametrize(
    ("change", "may_be_rounding"), [(0.0069, True), (0.011, False)]
)
def test_small_differences_can_be_rounding(tmp_path, change, may_be_rounding):
    """One query of 152 changes R@1 by 0.0066."""
    rows = [
        Row(**{**vars(row), "value": row.value + change})
        for row in shipped(map="metropolis", metric="r1", method="btc")
    ]
    path = tmp_path / "mine.csv"
    Results.of(rows).write_csv(path)
    notes = compare_tables([path], "r1").notes
    (note,) = (note for note in notes if note.startswith("btc: other values"))
    assert f"by up to {change:.4f}" in note
    assert ("rounding" in note) == may_be_rounding


def test_controls_are_not_ranked(tmp_path):
    """Nothing changes in them; they count only if there is nothing else."""
    plain = {"x": 0.5, "y": 0.4}
    own, last, both = tmp_path / "own", tmp_path / "last", tmp_path / "both"
    write_table(own, {"a": plain}, factors={STAGE: OWN})
    write_table(last, {"a": {"x": 0.9, "y": 1.0}}, factors={STAGE: LAST})
    both.mkdir()
    rows = [Results.read(one).rows for one in (own, last)]
    Results.of(itertools.chain(*rows)).write_csv(both / "results.csv")
    left = (
        "left out, as nothing changes in them (both.stage last): 1 conditions"
    )
    found = compare_tables([both, both / "results.csv"])
    assert [one.value for one in found.ranked] == [0.5, 0.4]
    assert left in found.notes
    found = compare_tables([both, own], rankings=True)
    assert [one.value for one in found.ranked] == [0.5, 0.4, 0.5, 0.4]
    assert found.agreements[0].tau == pytest.approx(1.0)
    assert found.notes == [f"both: {left}"]
    found = compare_tables([last, both])
    assert [one.value for one in found.ranked] == [1.0, 0.9]


def test_what_lacks_conditions_is_left_out_and_named(tmp_path):
    one = write_table(
        tmp_path / "one",
        {"a": {"x": 0.5, "y": 0.4}, "b": {"x": 0.6}, "c": {"x": 0.1}},
    )
    two = write_table(tmp_path / "two", {"a": {"z": 0.2}, "b": {"z": 0.3}})
    found = compare_tables([one, two])
    assert found.conditions == 2
    assert [(r.method, r.value) for r in found.ranked] == [
        ("x", pytest.approx(0.55)),
        ("z", pytest.approx(0.25)),
    ]
    assert found.notes == [
        "one: left out, as two lacks them: 1 conditions",
        "the shipped tables have none of these conditions (experiment: e in"
        " one, but fresh, stages in shipped)",
        "y: left out, with 1 of 2 conditions",
    ]


def test_a_metric_that_no_shipped_table_has(tmp_path):
    rows = [replace(row, metric="mine") for row in shipped(metric="auc")]
    own = tmp_path / "own.csv"
    Results.of(rows[:1]).write_csv(own)
    lacking = "the shipped tables have no values of mine; measure it"
    assert lacking in compare_tables([own], "mine").notes[-1]
    with pytest.raises(InputError, match=lacking):
        compare_tables([], "mine")


def test_differences_of_answers(tmp_path):
    parts = {"a": {"x": 0.9}, "b": {"x": 0.7}}
    one = write_table(tmp_path / "one", parts, queries=True)
    two = write_table(
        tmp_path / "two", {"a": {"x": 0.5}, "b": {"x": 0.7}}, queries=True
    )
    found = compare_tables([one, two])
    assert [r.method for r in found.ranked] == ["x (one)", "x (two)"]
    (difference,) = found.differences
    assert (difference.first, difference.second) == ("x (one)", "x (two)")
    assert difference.difference.value == pytest.approx(0.2)
    fewer = write_table(
        tmp_path / "fewer", {"a": {"x": 0.5}, "b": {"x": 0.5}}, 8, queries=True
    )
    with pytest.raises(InputError, match="different queries"):
        compare_tables([one, fewer])


def written_times(folder, number, parts):
    """Writes the same answers for one drive under several conditions."""
    tables = [
        write_table(
            folder / str(k), {"a": parts}, queries=True, factors={"cause": k}
        )
        for k in range(number)
    ]
    for name, reader, items in (
        ("results.csv", Results, "rows"),
        ("queries.csv", QueryRows, "answers"),
    ):
        read = [getattr(reader.read(one / name), items) for one in tables]
        reader.of(itertools.chain(*read)).write_csv(folder / name)
    return folder


def test_conditions_of_a_drive_are_not_independent(tmp_path):
    """The same answers under four conditions are no stronger evidence."""
    found = []
    for number in (1, 4):
        pair = []
        for name, parts in (
            ("one", {"x": 0.6, "y": 0.5}),
            ("two", {"x": 0.5, "y": 0.55}),
        ):
            folder = tmp_path / f"{name} {number}"
            folder.mkdir()
            pair.append(written_times(folder, number, parts))
        found.append(compare_tables(pair))
    once, again = found
    assert (once.conditions, again.conditions) == (1, 4)
    assert len(once.differences) == 6
    for one, other in zip(once.differences, again.differences, strict=True):
        assert other.difference.p_value == one.difference.p_value
        assert other.difference.value == pytest.approx(one.difference.value)


def counted_tau(first, second):
    """Pairs in the same order less those in the opposite, over all pairs."""
    signs = [
        np.sign((one - other) * (second[i] - second[k]))
        for (i, one), (k, other) in itertools.combinations(enumerate(first), 2)
    ]
    return np.mean(signs)


@pytest.mark.parametrize("queries", [False, True])
def test_tau_of_mean_areas(tmp_path, queries):
    names = "wxyz"
    simulated = write_table(
        tmp_path / "simulated",
        {
            "a": dict(zip(names, (0.9, 0.7, 0.5, 0.1), strict=True)),
            "b": dict(zip(names, (0.7, 0.9, 0.2, 0.3), strict=True)),
        },
        queries=queries,
    )
    real = write_table(
        tmp_path / "real",
        {"c": dict(zip(names, (0.6, 0.2, 0.4, 0.1), strict=True))},
        queries=queries,
    )
    found = compare_tables([simulated, real], rankings=True)
    (one,) = found.agreements
    assert one.methods == tuple(names)
    # Each table stands beside the other, with its own means.
    shown = {entry.method: entry.value for entry in found.ranked}
    assert shown == pytest.approx(
        dict(
            zip(
                [f"{n} ({t})" for t in ("simulated", "real") for n in names],
                (0.8, 0.8, 0.35, 0.2, 0.6, 0.2, 0.4, 0.1),
                strict=True,
            )
        )
    )
    # The first two are equal on one side: tau-b divides by the root of the
    # 5 of 6 pairs that are not.
    expected = counted_tau((0.8, 0.8, 0.35, 0.2), (0.6, 0.2, 0.4, 0.1))
    assert one.tau == pytest.approx(expected / np.sqrt(5 / 6))


def images_ranked(folder, real):
    """Writes a half of the published ranking; returns R@1 (4 maps, methods)."""
    with open("docs/notes/image_ranking.csv", newline="") as file:
        lines = [
            line
            for line in csv.DictReader(file)
            if line["images"].startswith("KITTI") == real
        ]
    rows = [
        Row(
            **key(line["method"], line["images"]),
            metric="r1",
            value=int(line["right"]) / int(line["queries"]),
        )
        for line in lines
    ]
    Results.of(rows).write_csv(folder)
    methods = sorted({row.method for row in rows})
    maps = dict.fromkeys(row.map for row in rows)
    value = {(row.map, row.method): row.value for row in rows}
    return np.array([[value[one, m] for m in methods] for one in maps])


def test_variants_are_one_family_in_the_published_ranking(tmp_path):
    """Six methods have the same order, but only four are different."""
    paths = [tmp_path / "real.csv", tmp_path / "simulated.csv"]
    for path, real in zip(paths, (True, False), strict=True):
        images_ranked(path, real)
    (found,) = compare_tables(paths, "r1", rankings=True).agreements
    assert found.tau == pytest.approx(1.0)
    assert len(found.methods) == 6
    assert found.families == (
        "layered-overlap",
        "probe",
        "ring++",
        "scan-context++",
    )
    assert found.tau_of_families == pytest.approx(1.0)
    # Two of the 24 orders of four families: the same, and the opposite.
    assert found.p_value == pytest.approx(2 / 24)
    # Four sequences and four cities cannot show more.
    assert math.isnan(found.interval.low)


def ranked_on(folder, values, number=12, scatter=0.0):
    """Writes a table of methods on maps; all methods suffer from a hard map."""
    rng = np.random.default_rng(len(folder.name))
    towns = {}
    for k in range(number):
        hard = 0.2 * rng.random()
        towns[f"town {k}"] = {
            name: float(np.clip(value - hard + scatter * rng.normal(), 0, 1))
            for name, value in values.items()
        }
    return write_table(folder, towns)


def test_the_interval_of_tau_is_what_the_maps_leave_open(tmp_path):
    up = {"x": 0.3, "y": 0.5, "z": 0.7, "w": 0.9}
    down = {name: 1.2 - value for name, value in up.items()}
    paths = [ranked_on(tmp_path / "up", up), ranked_on(tmp_path / "down", down)]
    (one,) = compare_tables(paths, rankings=True).agreements
    assert (one.interval.low, one.interval.high) == (-1.0, -1.0)
    # Where results scatter as much as neighbours differ, their order is open.
    rough = ranked_on(tmp_path / "rough", up, scatter=0.15)
    (one,) = compare_tables([paths[0], rough], rankings=True).agreements
    assert one.interval.low < one.tau_of_families <= one.interval.high == 1.0
    # Seven maps say nothing.
    few = ranked_on(tmp_path / "few", up, 7)
    (one,) = compare_tables([paths[0], few], rankings=True).agreements
    assert math.isnan(one.interval.low)
    # Eight cannot show any of six differences in two tables.
    eight = ranked_on(tmp_path / "eight", up, 8)
    (one,) = compare_tables([paths[0], eight], rankings=True).agreements
    assert (one.interval.low, one.interval.high) == (-1.0, 1.0)


def test_opposite_rankings(tmp_path):
    up = {"a": {"x": 0.1, "y": 0.4, "z": 0.9}}
    down = {"a": {"x": 0.9, "y": 0.6, "z": 0.1}}
    found = compare_tables(
        [
            write_table(tmp_path / "up", up, queries=True),
            write_table(tmp_path / "down", down, queries=True),
        ]
    )
    (one,) = found.agreements
    assert one.tau == pytest.approx(-1.0)
    assert one.tau_of_families == one.tau
    # One of six orders, and the opposite.
    assert one.p_value == pytest.approx(2 / 6)
    assert math.isnan(one.interval.low)


def test_rankings_are_of_one_protocol(tmp_path):
    parts = {"a": {"x": 0.1, "y": 0.4}}
    fair = write_table(tmp_path / "random-yaw", parts)
    rows = [
        Row(**key(method, protocol=name), metric="auc", value=value)
        for name in ("paper", "own")
        for method, value in (("x", 0.9), ("y", 0.1))
    ]
    both = tmp_path / "both.csv"
    Results.of(rows).write_csv(both)
    with pytest.raises(InputError, match="paper and own in one table"):
        compare_tables([fair, both], rankings=True)
    also_fair = tmp_path / "also.csv"
    Results.of([*rows, *Results.read(fair).rows]).write_csv(also_fair)
    (one,) = compare_tables([fair, also_fair], rankings=True).agreements
    assert one.tau == pytest.approx(1.0)
    with pytest.raises(InputError, match=r"no row of auc .* protocol paper"):
        compare_tables([fair, both], protocol="paper", rankings=True)


def test_less_may_be_better(tmp_path):
    rows = [
        Row(**key(name, task="localise"), metric="translation_median", value=v)
        for name, v in (("gicp", 0.1), ("icp", 0.4))
    ]
    paths = [tmp_path / "a.csv", tmp_path / "b.csv"]
    for path in paths:
        Results.of(rows).write_csv(path)
    found = compare_tables(paths, "translation_median")
    assert found.task == "localise"
    assert [r.method for r in found.ranked] == ["gicp", "icp"]


def test_the_command(tmp_path, capsys):
    one = write_table(tmp_path / "one", {"a": {"x": 0.5, "y": 0.25}})
    two = write_table(tmp_path / "two", {"a": {"x": 0.75, "y": 0.5}})
    status, out, err = run(capsys, "compare", one, two)
    assert (status, err.count("\n")) == (0, 1)
    head, first, *_ = out.splitlines()
    # An interval that is unknown is left out.
    assert head.split() == ["method", "auc,", "mean", "of", "1", "conditions"]
    assert first.split() == ["x", "(two)", "0.7500"]
    status, out, _ = run(capsys, "compare", one, two, "--json")
    found = json.loads(out)
    assert found["conditions"] == 1
    assert [m["value"] for m in found["methods"]] == [0.75, 0.5, 0.5, 0.25]
    assert found["agreements"][0]["kendall_tau"] == pytest.approx(1.0)


def test_faults_are_one_line(tmp_path, capsys):
    one = write_table(tmp_path / "one", {"a": {"x": 0.5}})
    other = write_table(tmp_path / "other", {"b": {"x": 0.5}})
    assert_refused(capsys, ["compare", one, other], one, "in common")
    assert_refused(capsys, ["compare", one, "--metric", "r1"], "r1", "auc")
    assert_refused(
        capsys, ["compare", one, "--verified"], "with geometric verification"
    )
    assert_refused(capsys, ["compare", one, "--protocol", "x"], "--protocol")
    assert_refused(capsys, ["compare", one, "--rankings"], "two tables")
    pair = ["compare", one, other, "--rankings"]
    assert_refused(capsys, pair, "fewer than two methods")
    assert_refused(capsys, ["compare", tmp_path / "none.csv"], "none.csv")


def test_queries_without_blocks_are_noted(tmp_path):
    pair = [
        write_table(tmp_path / name, {"town": {name: part}}, queries=True)
        for name, part in (("one", 0.9), ("other", 0.5))
    ]
    assert len(compare_tables(pair).differences) == 1
    for folder in pair:
        file = folder / "queries.csv"
        lines = [line.split(",") for line in file.read_text().splitlines()]
        block = lines[0].index("block")
        shorter = [line[:block] + line[block + 1 :] for line in lines]
        file.write_text("\n".join(map(",".join, shorter)))
    notes = compare_tables(pair).notes[:2]
    files = [str(folder / "queries.csv") for folder in pair]
    assert [note.split(": ")[0] for note in notes] == files
    assert "column block" in notes[0]


def test_rows_by_another_protocol_are_left_out_and_named(tmp_path):
    """They have the name of no shipped protocol, and each digest is its own."""
    fair = made_by(RANDOM_YAW_PROTOCOL)
    wide, coarse = (
        made_by(replace(RANDOM_YAW_PROTOCOL, **one))
        for one in ({"radius": 25.0}, {"place_spacing": 8})
    )
    assert [one["protocol"] for one in (fair, wide, coarse)] == [
        "random-yaw",
        "own",
        "own",
    ]
    both = {"x": 0.5, "y": 0.4}
    one = write_table(tmp_path / "one", {"a": both}, **fair)
    two = write_table(tmp_path / "two", {"a": {"z": 0.9}}, **wide)
    with pytest.raises(
        InputError, match="protocol: random-yaw in one, but own in t"
    ):
        compare_tables([one, two])
    three = write_table(tmp_path / "three", {"a": {"z": 0.9}}, **coarse)
    with pytest.raises(InputError, match=f"digest: {wide['protocol_digest']}"):
        compare_tables([two, three])
    rows = [Results.read(path).rows for path in (one, two)]
    mixed = tmp_path / "mixed.csv"
    Results.of(itertools.chain(*rows)).write_csv(mixed)
    found = compare_tables([one, mixed])
    assert [(r.method, r.value) for r in found.ranked] == [
        ("x", 0.5),
        ("y", 0.4),
    ]
    assert (
        f"mixed: left out, by protocol own ({wide['protocol_digest']}), not"
        f" random-yaw ({fair['protocol_digest']}) in one: 1 conditions"
    ) in found.notes


def test_settings_outside_of_the_protocol_count():
    """The height of a LiDAR changes numbers; verification has a column."""
    fair = made_by(RANDOM_YAW_PROTOCOL)
    assert made_by(replace(RANDOM_YAW_PROTOCOL, verified=True)) == fair
    other = made_by(RANDOM_YAW_PROTOCOL, {"sensor_height": 2.0})
    assert other["protocol"] == "own"
    assert other["protocol_digest"] != fair["protocol_digest"]
    # A whole number is the same number; a seed counts where it draws.
    same = replace(RANDOM_YAW_PROTOCOL, query_spacing=10)
    assert made_by(same) == fair
    assert made_by(RetrievalProtocol(seed=4))["protocol"] == "recorded"
    assert made_by(replace(RANDOM_YAW_PROTOCOL, seed=4))["protocol"] == "own"


@pytest.mark.parametrize("fault", ["value", "n"])
def test_answers_that_contradict_their_results_are_refused(tmp_path, fault):
    folder = write_table(tmp_path / "mine", {"a": {"x": 0.5}}, queries=True)
    other = write_table(tmp_path / "other", {"a": {"y": 0.4}}, queries=True)
    rows = [
        replace(row, **{"n": 40, fault: {"n": 39, "value": 0.475}[fault]})
        for row in Results.read(folder).rows
    ]
    Results.of(rows).write_csv(folder / "results.csv")
    with pytest.raises(
        InputError, match=r"queries.csv: contradicts .*: auc of x"
    ):
        compare_tables([folder, other])
    (folder / "queries.csv").unlink()
    assert len(compare_tables([folder, other]).ranked) == 2


def test_other_numbers_of_queries_are_named(tmp_path):
    paths = []
    for name, number in (("one", 12), ("two", 141), ("three", None)):
        folder = write_table(tmp_path / name, {"a": {name: 0.5}})
        rows = [replace(row, n=number) for row in Results.read(folder).rows]
        Results.of(rows).write_csv(folder / "results.csv")
        paths.append(folder)
    notes = compare_tables(paths).notes
    assert "three: of how many queries is not known" in notes
    assert any("not the same queries: 12 (one), 141 (two)" in n for n in notes)
    alike = compare_tables(
        [paths[0], write_table(tmp_path / "four", {"a": {"z": 0.1}})]
    )
    assert not any("not the same queries" in note for note in alike.notes)


def test_other_baselines_are_named(tmp_path):
    folders = []
    for name, baseline in (("old", ""), ("new", f"{STAGE}={LAST}")):
        folder = write_table(tmp_path / name, {"a": {name: 0.5}})
        rows = [
            replace(row, metric=metric, baseline=baseline)
            for row in Results.read(folder).rows
            for metric in ("auc", "relative_auc")
        ]
        Results.of(rows).write_csv(folder / "results.csv")
        # Of a table without a name for its baselines, nothing changes.
        header = (folder / "results.csv").read_text().splitlines()[0]
        assert header.endswith(",baseline") == bool(baseline)
        read = Results.read(folder)
        assert {row["baseline"] for row in read.rows} == {baseline}
        assert STAGE not in read.factors
        folders.append(folder)
    notes = compare_tables(folders, metric="relative_auc").notes
    said = "not the same baselines: both.stage=last, or the first values"
    assert said in notes
    assert said not in compare_tables(folders, metric="auc").notes


def test_what_a_table_does_not_say_is_unknown(tmp_path):
    """Tables of other programs have neither digest nor version."""
    folder = write_table(tmp_path / "theirs", {"a": {"x": 0.5, "y": 0.4}})
    file = folder / "results.csv"
    lines = [line.split(",") for line in file.read_text().splitlines()]
    kept = [
        k
        for k, name in enumerate(lines[0])
        if name not in ("protocol_digest", "version")
    ]
    file.write_text(
        "\n".join(",".join(line[k] for k in kept) for line in lines)
    )
    assert {row.protocol_digest for row in Results.read(file).rows} == {""}
    new = write_table(
        tmp_path / "new", {"a": {"z": 0.3}}, **made_by(RANDOM_YAW_PROTOCOL)
    )
    found = compare_tables([folder, new])
    assert len(found.ranked) == 3
    assert any(
        "theirs: rows do not say how they were made" in n for n in found.notes
    )


def test_the_page_and_the_tables_beside_it_are_named(tmp_path, capsys):
    page = tmp_path / "a" / "index.html"
    opened = f"next: open {page} in a browser\n"
    show_results(page)
    assert capsys.readouterr() == (f"{page}\n", opened)
    write_table(tmp_path / "a", {"a": {"x": 0.5}})
    show_results(page)
    shown = capsys.readouterr()
    wrote, *rest = shown.err.splitlines(keepends=True)
    assert wrote.startswith("wrote ")
    assert rest == [opened]
    assert shown.out == (
        f"Place recognition\nmethod  AUC\nx       0.50\n\n{page}\n"
    )


def test_a_terminal_shows_the_tables_of_the_page():
    """A column a condition; intervals of single results; verification."""
    rows = [
        Row(
            **key(method, "a", factors={"years": years}, verified=verified),
            metric="auc",
            value=value,
            low=value - 0.25 * bool(years),
            high=value if years else math.nan,
        )
        for method, verified, years, value in (
            ("solid", False, 0, 0.75),
            ("solid", False, 5, 0.5),
            ("btc", False, 5, 0.25),
            ("solid", True, 0, 1.0),
        )
    ]
    assert list(summary_lines(Results.of(rows))) == [
        "Place recognition: AUC by years",
        "method  0     5",
        "SOLiD   0.75  0.50 [0.25, 0.50]",
        "BTC           0.25 [0.00, 0.25]",
        "with geometric verification",
        "SOLiD   1.00",
        "",
    ]


@pytest.mark.parametrize("number", [2, 3, 5, 9])
def test_kendall_tau_is_that_of_a_library(tmp_path, number):
    """Of few different values, so that there are ties."""
    pair = np.random.default_rng(number).integers(4, size=(2, number)) / 4
    paths = [
        write_table(
            tmp_path / name,
            {"a": {f"m{k}": float(v) for k, v in enumerate(values)}},
        )
        for name, values in zip(("one", "two"), pair, strict=True)
    ]
    (found,) = compare_tables(paths, rankings=True).agreements
    assert found.tau == pytest.approx(kendalltau(*pair).statistic)


def test_a_study_by_several_protocols_is_compared_with_the_shipped(tmp_path):
    """The factor of its protocols, which shipped tables lack, says nothing."""
    stages = Results.read(STAGES)
    mine = [
        replace(
            row,
            method="mine",
            value=0.99 * row.value,
            factors={**row.factors, "protocol.base": "random-yaw"},
        )
        for row in stages.where(map="suburbia", method="btc", metric="auc").rows
    ]
    Results.of(mine).write_csv(tmp_path / "results.csv")
    found = compare_tables([tmp_path])
    assert found.conditions == 2
    assert {one.method for one in found.ranked} > {"mine", "btc"}
    values = {one.method: one.value for one in found.ranked}
    assert values["mine"] == pytest.approx(0.99 * values["btc"], abs=1e-4)
