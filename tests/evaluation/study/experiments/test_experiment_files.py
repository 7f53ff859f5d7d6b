"""Files of experiments: their changes, and their faults."""

import pytest
import yaml

from evaluation.base import InputError
from evaluation.methods import shipped_methods
from evaluation.study import Experiment, load_experiment, shipped_experiments


def test_a_file_of_few_words_is_enough(read):
    experiment = read("about: nothing changes\n")
    assert experiment.name == "mine"
    assert experiment.seeds == (1,)
    assert list(experiment.tasks) == ["place"]
    (only,) = experiment.conditions
    assert (only.factors, only.changes, only.causes) == ({}, {}, ())
    assert only.baseline == {}


def test_settings_of_optional_methods_need_no_entry_in_the_file(read):
    # No file of the experiment names the method: --method chooses it.
    found = read("maps: suburbia", "bevplace.weights=a.pth.tar")
    assert found.methods["bevplace"] == {"weights": "a.pth.tar"}
    assert set(found.methods) == {*shipped_methods(), "bevplace"}


def test_a_smaller_experiment(read):
    text = """
    database: {aside: [0, 5, 20], u: 2}
    protocol: random-yaw
    quick:
      database: {aside: [0, 20]}
      protocol: {query_spacing: 30.0}
    """
    assert read(text).database["aside"] == [0, 5, 20]
    found = read(text, quick=True)
    assert found.database == {"aside": [0, 20], "u": 2}
    assert found.protocol == {"base": "random-yaw", "query_spacing": 30.0}
    with pytest.raises(InputError, match=r"mine\.yaml: quick: missing"):
        read("about: all of it\n", quick=True)


@pytest.mark.parametrize("few", ["{place: {}}", "[place]", "place"])
def test_a_smaller_experiment_leaves_tasks_and_methods_out(read, few):
    text = f"""
    tasks: {{place: {{}}, change: {{spacing: 5.0}}}}
    methods: {{solid: {{ranges: 20}}, btc: {{}}}}
    quick:
      tasks: {few}
      methods: {{solid: {{}}}}
    """
    found = read(text, quick=True)
    assert (found.tasks, found.methods) == ({"place": {}}, {"solid": {}})
    assert list(read(text).tasks) == ["place", "change"]
    # So do overrides; one of a single setting keeps the others.
    assert read(text, f"tasks={few}").tasks == {"place": {}}
    found = read(text, "tasks.change.spacing=9.0")
    assert found.tasks == {"place": {}, "change": {"spacing": 9.0}}


@pytest.mark.parametrize("name", shipped_experiments())
def test_shipped_experiments_are_read_and_written(name):
    for quick in (False, True):
        if quick and not load_experiment(name).quick:
            continue
        experiment = load_experiment(name, quick=quick)
        again = Experiment.model_validate(yaml.safe_load(experiment.text))
        assert again == experiment
        first = experiment.conditions[0].factors
        assert all(one.baseline == first for one in experiment.conditions)
        assert experiment.about.endswith("?")


@pytest.mark.parametrize(
    ("causes", "fault"),
    [
        ("ladder", "causes: not"),
        ("{each: a, together: b}", "causes: not"),
        ("{some: ladder}", "causes.some: neither"),
        ("{each: lader}", "no strengths 'lader'.*did you mean ladder"),
    ],
)
def test_faults_of_causes(tmp_path, causes, fault):
    path = tmp_path / "mine.yaml"
    path.write_text(f"causes: {causes}\n")
    with pytest.raises(InputError, match=fault):
        load_experiment(path)


@pytest.mark.parametrize("quick", [False, True])
def test_some_of_the_causes(tmp_path, quick):
    """The level of `--quick` is the greatest that they have."""
    only = "causes.only=[snow, hidden]"
    found = load_experiment("ladder", [only], quick=quick)
    assert found.cases["all"] == ("snow", "hidden")
    assert list(found.cases) == ["snow", "hidden", "all"]
    single = load_experiment("ladder", ["causes.only=turn"], quick=quick)
    assert list(single.cases) == ["turn"]
    assert {one.factors["level"] for one in single.conditions} == {0, 1}
    path = tmp_path / "mine.yaml"
    path.write_text("about: one\ncauses: {each: ladder, only: turn}\n")
    assert load_experiment(path).cases == single.cases


@pytest.mark.parametrize(
    ("override", "fault"),
    [
        ("causes.only=[snwo]", "causes.only: no case 'snwo'.*mean snow"),
        ("causes.only=[]", "causes: choose some by causes.only"),
        ("causes.each=levels", "causes: choose some by causes.only"),
        ("causes=3", "causes: choose some by causes.only"),
    ],
)
def test_causes_that_cannot_be_chosen(override, fault):
    with pytest.raises(InputError, match=f"^--set: {fault}"):
        load_experiment("ladder", [override])


def test_own_cases_beside_those_of_causes(tmp_path):
    path = tmp_path / "mine.yaml"
    path.write_text(
        "causes: {each: ladder}\ncases: {turn: {protocol: {tilt_queries: 9}}}\n"
    )
    cases = load_experiment(path).cases
    wanted = {"protocol": {"turn_queries": True, "tilt_queries": 9}}
    assert cases["turn"] == wanted
    assert "snow" in cases


FAULTS = [
    ("- 1", "not a mapping of an experiment's fields"),
    ("metods: [solid]", "metods: Extra inputs .* mean methods"),
    ("name: ../x", "name: "),
    ("maps: []", "maps: at least 1 needed"),
    ("maps: [7]", "maps.0: neither a name nor how to make a map"),
    ("maps: [null]", "maps.0: neither a name nor how to make a map"),
    ("tasks: {place: null}", "tasks.place: not a mapping"),
    ("quick: {tasks: 3}", "quick: tasks: not a mapping"),
    ("seeds: [null]", "seeds.0: not a whole number"),
    ("maps: [suburbia, suburbia]", "maps: 'suburbia' is there twice"),
    ("maps: [{name: a, seed: 1}]", "maps.0: .*either age .* or import"),
    ("maps: [{name: a, seed: 1, age: town}]", "maps.0: .*years"),
    ("maps: [{name: a, seed: 1, import: b, years: 2}]", "maps.0: .*years"),
    ("maps: [{name: a, seed: 1, age: b, year: 2}]", "maps.0: .*year: Extra"),
    ("maps: [{name: ../a, seed: 1, import: b}]", "maps.0: .*name: "),
    ("drives: all", "drives: "),
    ("design: half", "design: "),
    ("database: [years]", "database: "),
    ("database:", "database: "),
    (
        "database: {aside: []}",
        "database.aside: a list without a value",
    ),
    ("database: {a: {b: []}}", "database.a.b: a list without a value"),
    (
        "both: {city: {redraw: {frozen: []}}}",
        "both.city.redraw.frozen: a list without a value",
    ),
    (
        "database: {aside: [0, 5, 0]}",
        "database.aside: 0 is there twice",
    ),
    (
        "database: {aside: [1, 1.0]}",
        "database.aside: 1 is there twice",
    ),
    (
        "both: {city: {redraw: {frozen: [2, 2]}}}",
        "both.city.redraw.frozen: 2 is there twice",
    ),
    ("protocol: {radius: [5, 5]}", "protocol.radius: 5 is there twice"),
    ("database: {a: [null, {}]}", "database.a: 'none' is there twice"),
    ("database: {a: [1, '1']}", "database.a: '1' is there twice"),
    ("database: {a.b: 1, a: {b: [2, 3]}}", "database.a.b: it is there twice"),
    (
        "query: {a: [{b: 1}, {}], a.b: [2, 3]}",
        "query.a.b: another factor changes it, too",
    ),
    (
        "query: {a: {b: [1, 2]}}\ncases: {c: {query: {a: {b: [3]}}}}",
        "cases.c.query.a.b: another factor changes it, too",
    ),
    (
        "query: {a: [{b: 1}, {}]}\ncases: {c: {query: {a: {b: [3]}}}}",
        "cases.c.query.a.b: another factor changes it, too",
    ),
    ("cases: {c: {query: {a: {b: 3}, a.b: 4}}}", "cases.c.query.a.b: another"),
    ("seeds: true", "seeds: True is no number"),
    ("levels: true\ncases: {a: {query: {x: 1}}}", "levels: True is no number"),
    (
        "maps: [town, {name: town, age: town, years: 2, seed: 1}]",
        "maps: 'town' is there twice",
    ),
    (
        "database: {aside: .nan}",
        "database.aside: nan is not finite",
    ),
    ("query: {a: {b: [0, .inf]}}", "query.a.b: .*inf.* is not finite"),
    ("query: {offset: {left: [.nan, 0]}}", "query.offset.left: .* not finite"),
    ("database: {a: {from: 0, to: .inf, count: 3}}", "database.a: from and"),
    ("database: {a: {from: x, to: 1, count: 3}}", "database.a: from and"),
    ("database: {a: {from: 0, to: true, count: 3}}", "database.a: from and"),
    ("database: {a: {from: 0, to: 1, count: 1}}", "database.a: .*count"),
    ("database: {a: {from: 0, to: 1, count: 2.0}}", "database.a: .*count"),
    ("database: {a: {from: 0, to: 1, count: 10001}}", "database.a: .*count"),
    ("database: {a: {from: 1, to: 1, count: 2}}", "database.a: 1 is .*twice"),
    ("seeds: {from: 0, to: 1, count: 1}", "seeds: .*from and to .* count"),
    ("seeds: {from: 0, to: 1, count: 3}", "seeds: .*not all whole"),
    ("seeds: {from: 1, to: 3}", "seeds: .*a list needs from, to and count"),
    (
        "levels: {from: 1, to: 2, count: 2, step: 1}\n"
        "cases: {a: {query: {x: [1, 2]}}}",
        "levels: .*a list needs from, to and count, nothing else",
    ),
    ("seeds: []", "seeds: "),
    ("seeds: [1, 1]", "seeds: 1 is there twice"),
    ("seeds: -1", "seeds.0: "),
    ("seeds: [1.5]", "seeds.0: "),
    ("seeds: [.nan]", "seeds.0: "),
    ("seeds: one", "seeds.0: "),
    *(
        (
            f"maps: [{{name: a, age: town, years: 5, seed: 1, {given}}}]",
            f"maps.0: .*{given.split(':')[0]}: it belongs to import",
        )
        for given in ("grow: 0.0", "plain: true", "sha256: a")
    ),
    ("tasks: []", "tasks: "),
    ("tasks: [place, place]", "tasks: 'place' is there twice"),
    ("tasks: {place: 3}", "tasks.place: "),
    ("methods: []", "methods: "),
    ("methods: [solid, solid]", "methods: 'solid' is there twice"),
    ("methods: {solid: {ranges: []}}", "methods.solid.ranges: a list without"),
    (
        "methods: {solid: {ranges: [9, 9]}}",
        "methods.solid.ranges: 9 is",
    ),
    ("methods: {solid: {x: .inf}}", "methods.solid.x: inf is not finite"),
    ("protocol: 3", "protocol: "),
    (
        "baseline: {database: {aside: 0}}",
        "baseline.database.aside: this",
    ),
    (
        "database: {aside: [0, 1]}\nbaseline: {database: {aside: 2}}",
        "baseline.database.aside: 2 is no value of it",
    ),
    (
        "database: {aside: [0, 1]}\nbaseline: {database: {aside: [0]}}",
        r"baseline.database.aside: \[0\] is no value of it",
    ),
    ("baseline: {query: 3}", "baseline.query: this is no factor"),
    ("baseline: {cause: none}", "baseline.cause: this is no factor"),
    (
        "cases: {a: {query: {x: [1, 2]}}}\nbaseline: {level: 3}",
        "baseline.level: 3 is no value of it",
    ),
    ("cases: {snow: {}}", "cases.snow: "),
    ("cases: {snow: 3}", "cases.snow: "),
    ("cases: {snow: {query: {}}}", "cases.snow: query: no fields"),
    ("cases: {snow: {query: [1]}}", "cases.snow: query: no fields"),
    ("cases: {snow: {seeds: {radius: 3}}}", "cases.snow: seeds: no section"),
    ("cases: {snow: {query: {x: []}}}", "cases.snow.query.x: a list without"),
    ("cases: {all: []}", "cases.all: "),
    ("cases: {all: [snow]}", "cases.all: snow is no case with fields"),
    ("cases: {all: [all]}", "cases.all: all is no case with fields"),
    (
        "cases: {a: {query: {x: 1}}, b: [a], c: [a, b]}",
        "cases.c: b is no case with fields",
    ),
    ("cases: {a: {query: {x: 1}}, b: [a, a]}", "cases.b: 'a' is there twice"),
    ("cases: {none: {query: {x: 1}}}", "cases.none: "),
    ("cases: {../x: {query: {x: 1}}}", "cases.../x"),
    ("levels: [1]", "levels: there are no cases"),
    ("levels: []\ncases: {a: {query: {x: 1}}}", "levels: "),
    ("levels: [0]\ncases: {a: {query: {x: 1}}}", "levels.0: "),
    (
        "levels: [7]\ncases: {a: {query: {x: 1}}}",
        "levels: no case has level 7; the greatest is 1",
    ),
    (
        "levels: [1, 4]\ncases: {a: {query: {x: [1, 2, 3]}}, b: [a]}",
        "levels: no case has level 4; the greatest is 3",
    ),
    ("levels: [2, 2]\ncases: {a: {query: {x: 1}}}", "levels: 2 is there twice"),
    ("charts: [3]", "charts.0: "),
    ("quick: 3", "quick: "),
    ("quick: {metods: [solid]}", "quick: metods: Extra"),
    (
        "quick: {database: {aside: []}}",
        "quick: database.aside: a list without",
    ),
    (
        "quick: {baseline: {database: {aside: 0}}}",
        "quick: baseline.database.aside: this is no factor",
    ),
]


@pytest.mark.parametrize(("text", "fault"), FAULTS)
def test_faults_are_one_line_with_file_and_field(read, text, fault):
    with pytest.raises(InputError, match=rf"mine\.yaml: {fault}") as error:
        read(text)
    assert "\n" not in str(error.value)


@pytest.mark.parametrize(
    ("override", "fault"),
    [
        ("years", "--set: 'years' is not FIELD=VALUE"),
        ("=3", "--set: '=3' is not FIELD=VALUE"),
        ("database.aside=[", "--set: database.aside: not readable"),
        (
            "database.aside=[]",
            "database.aside: a list without a value",
        ),
        ("metods=[solid]", "metods: Extra inputs"),
    ],
)
def test_overrides_that_cannot_be(read, override, fault):
    with pytest.raises(InputError, match=fault):
        read("about: some\n", override)


def test_no_such_experiment(tmp_path):
    with pytest.raises(InputError, match=r"nothing: neither an .*ladder.* nor"):
        load_experiment("nothing")
    with pytest.raises(InputError, match="neither"):
        load_experiment(tmp_path)


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ("database: {missing: 0.1}", "database.missing: write city: {missing:"),
        ("both: {redraw: 3}", "both.redraw: write city: {redraw: ...}"),
        (
            "database: {years: [0, 5]}",
            "database.years: .* write query: {city: {years: ...}}",
        ),
        (
            "cases: {a: {query: {years: 5}}}",
            "cases.a.query.years: .* write database: {city: {years: ...}}",
        ),
        (
            "database: {sessions: [{}, {years: 5}]}",
            "database.sessions.2.years: write city: {years: ...}",
        ),
        (
            "database: {sessions: [[{viewpoint: lane}], [{}]]}",
            "database.sessions.1.viewpoint: write offset: {left: METRES",
        ),
        ("database: {lateral: 5}", "database.lateral: write offset: .*radius"),
        ("query: {returns: calibrated}", r'query.returns: write lidars: {"\*"'),
        ("both: {lidar: vlp-16}", r'both.lidar: write lidars: {"\*": {preset:'),
        ("query: {turn_queries: true}", "query.turn_queries: write protocol: "),
    ],
)
def test_words_of_older_releases_are_told_with_the_new_ones(
    tmp_path, text, told
):
    path = tmp_path / "mine.yaml"
    path.write_text(text)
    with pytest.raises(InputError, match=f"mine.yaml: {told}") as error:
        load_experiment(path)
    assert "\n" not in str(error.value)
