"""`cns-drake study`: what it lists, shows and takes."""

from helpers.internal.eval_program import run_program
from helpers.internal.studies import asked_studies
import pytest

from cns_drake.__main__ import main
from evaluation.methods import shipped_methods
from evaluation.study import load_experiment, shipped_experiments


def run(capsys, *words):
    return run_program(capsys, "cns-drake", main, *words)


@pytest.fixture
def asked(monkeypatch):
    """The experiments, and maps, of all calls; nothing is measured."""
    return asked_studies(monkeypatch)


def test_all_shipped_experiments_are_listed(capsys):
    status, out, err = run(capsys, "study", "--list")
    assert (status, err) == (0, "")
    lines = dict(line.split(maxsplit=1) for line in out.splitlines())
    assert lines == {
        name: load_experiment(name).about for name in shipped_experiments()
    }
    # One line each, on a terminal of 80 columns.
    assert max(map(len, out.splitlines())) <= 80


def test_an_experiment_is_shown_ready_to_copy(capsys, tmp_path):
    for name, path in shipped_experiments().items():
        status, out, err = run(capsys, "study", name, "--show")
        assert (status, err) == (0, "")
        # Cases from files of causes are written out; all else is the file's.
        shown = {*out.splitlines()}
        lines = path.read_text().splitlines()
        rest = [line for line in lines if line not in shown]
        assert all(line.startswith("causes:") for line in rest)
        copy = tmp_path / f"{name}.yaml"
        copy.write_text(out)
        assert load_experiment(copy) == load_experiment(name)


def test_a_faulty_file_is_not_shown(capsys, tmp_path):
    path = tmp_path / "mine.yaml"
    path.write_text("seeds: []\n")
    status, out, err = run(capsys, "study", path, "--show")
    assert (status, out) == (2, "")
    assert f"error: {path}: seeds: " in err
    assert err.count("\n") == 1


def test_options_replace_fields(capsys, tmp_path, asked):
    path = tmp_path / "mine.yaml"
    path.write_text(
        """
        database: {frames: [9, 5, 20]}
        tasks: {place: {}, change: {spacing: 5.0}}
        methods: {solid: {ranges: [20, 40]}, btc: {}}
        protocol: recorded
        quick: {database: {frames: [9, 20]}}
        """
    )
    words = ["study", path, "town", "village", "--output", tmp_path / "out"]
    status, out, err = run(capsys, *words)
    # Nothing was measured that could be compared.
    page = tmp_path / "out" / "index.html"
    assert (status, err) == (0, f"next: open {page} in a browser\n")
    assert out == f"{page}\n"
    words += ["--quick", "--task", "change", "--task", "pose"]
    words += ["--method", "solid", "--set", "protocol.radius=5"]
    words += ["--set", "seeds=[3, 4]", "--jobs", "2"]
    assert run(capsys, *words)[0] == 0
    (whole, maps, source), (quick, *_) = asked
    assert whole == load_experiment(path)
    assert (maps, source) == (("town", "village"), str(path))
    # Tasks and methods keep the settings of the file.
    assert quick.tasks == {"change": {"spacing": 5.0}, "pose": {}}
    assert quick.methods == {"solid": {"ranges": [20, 40]}}
    assert quick.database == {"frames": [9, 20]}
    assert quick.protocol == {"base": "recorded", "radius": 5}
    assert quick.seeds == (3, 4)


@pytest.mark.parametrize(
    ("fields", "place"),
    [
        ("methods: [solid, {file}]", "methods"),
        ("methods: {{{file}: {{x: [1, 2]}}}}", "methods"),
        ("tasks: {{localise: {{methods: [gicp, {file}]}}}}", "tasks"),
        ("tasks: {{localise: {{methods: {file}}}}}", "tasks"),
    ],
)
def test_a_program_of_an_experiment_is_asked_for(
    capsys, tmp_path, asked, fields, place
):
    program = tmp_path / "theirs.py"
    program.write_text(f"open({str(tmp_path / 'ran')!r}, 'w')\n")
    path = tmp_path / "mine.yaml"
    path.write_text(fields.format(file=program))
    words = ["study", path, "--output", tmp_path / "out"]
    status, out, err = run(capsys, *words)
    assert (status, out) == (2, "")
    assert err == (
        f"cns-drake: error: {path}: {place}: {program} is a program, and would"
        " run with your permissions; read it, then add --allow-code\n"
    )
    assert not asked
    # Nor does it run where a copy of the experiment is shown.
    assert run(capsys, "study", path, "--show")[0] == 0
    assert not (tmp_path / "ran").exists()
    assert run(capsys, *words, "--allow-code")[0] == 0
    # What the user names needs no question.
    for more in (
        ("--method", program, "--set", f"tasks.localise.methods=[{program}]"),
        ("--method", "solid", "--task", "place"),
    ):
        assert run(capsys, *words, *more)[0] == 0
    assert len(asked) == 3


def test_a_program_of_the_quick_section_is_asked_for(capsys, tmp_path, asked):
    path = tmp_path / "mine.yaml"
    path.write_text("methods: [solid]\nquick: {methods: [theirs.py]}\n")
    words = ["study", path, "--output", tmp_path / "out"]
    assert run(capsys, *words)[0] == 0
    status, _, err = run(capsys, *words, "--quick")
    assert status == 2
    assert "methods: theirs.py is a program" in err
    assert len(asked) == 1


def test_an_output_is_needed(capsys, asked):
    status, out, err = run(capsys, "study", "ladder")
    assert (status, out) == (2, "")
    assert err == "cns-drake: error: --output: missing\n"
    assert not asked


def test_settings_of_methods_are_set_as_elsewhere(capsys, asked, tmp_path):
    """`METHOD.NAME=VALUE`, also of two methods and of a list."""
    words = ("study", "ladder", "--output", tmp_path)
    settings = ("solid.sensor_height=1.7", "btc.keypoint_range=0.5,2")
    settings = [f"--set={one}" for one in settings]
    status, _, err = run(capsys, *words, *settings)
    assert status == 0, err
    (experiment, *_) = asked[0]
    assert set(experiment.methods) == set(shipped_methods())
    assert experiment.methods["solid"] == {"sensor_height": 1.7}
    assert experiment.methods["btc"] == {"keypoint_range": [["0.5", "2"]]}
    methods = ("--method", "solid", "--method", "ring++")
    status, _, err = run(capsys, *words, *methods, settings[0])
    assert status == 0, err
    (experiment, *_) = asked[1]
    assert experiment.methods == {"solid": {"sensor_height": 1.7}, "ring++": {}}
    status, _, err = run(capsys, *words, "--set", "bow.words=3")
    assert status == 2
    assert "bow" in err


def test_standard_stands_for_the_standard_methods(capsys, asked, tmp_path):
    words = ("study", "ladder", "--output", tmp_path)
    run(capsys, *words, "--method", "standard", "--method", "probe")
    (experiment, *_) = asked[0]
    assert list(experiment.methods) == [*shipped_methods(), "probe"]
