"""A user's own methods, from a file."""

import json
from pathlib import Path

from helpers import documents
from helpers.internal.eval_program import assert_refused, make_block_scene, run
import numpy as np
import pytest

from evaluation import check_method, judge, open_drive, retrieve
from evaluation.methods import load_method
from evaluation.recognition import choose_methods

pytestmark = pytest.mark.usefixtures("own_methods")


def shown_method(folder):
    """Saves the method of the documents to a file."""
    blocks = documents.fenced(documents.read("docs/how-to/own_method.md"))
    (example,) = (block.text for block in blocks if "@register(" in block.text)
    path = folder / "shown_heights.py"
    path.write_text(example, encoding="utf-8")
    return path


def test_the_method_in_the_documents(capsys, towns, tmp_path):
    path = shown_method(tmp_path)
    assert len(path.read_text().splitlines()) < 40
    both = ["pr", towns / "town_01", towns / "town_02", "--method", path]
    status, out, _ = run(capsys, *both, "--set", "rings=30", "--json")
    assert status == 0
    values = json.loads(out)
    assert values["method"] == "heights"
    assert values["parameters"] == {
        "sensor_height": 1.6,
        "place": None,
        "center_scores": False,
        "rings": 30,
    }
    assert values["recall_at_1"] > 0.8
    assert_refused(capsys, [*both, "--set", "rings=x"], "heights: rings")


def test_a_network_in_the_documents(towns):
    """With a network of NumPy: of the file only `load` knows PyTorch."""
    rng = np.random.default_rng(1)
    kernel, bias = rng.normal(size=(3, 64)), rng.normal(size=64)

    def network(cloud):
        """PointNet of one layer."""
        assert cloud.shape == (4096, 3)
        assert cloud.dtype == np.float32
        assert np.linalg.norm(cloud, axis=1).max() < 1.0
        return np.maximum(3.0 * cloud @ kernel + bias, 0.0).mean(axis=0)

    kind = load_method(documents.ROOT / "docs/examples/network.py")
    method = kind(kind.Config(model="mine.pt"), network)
    check_method(method)
    drives = (open_drive(towns / f"town_0{k}") for k in (1, 2))
    found = retrieve(*drives, method)
    outcomes = judge(found.scores, found.matches)
    assert outcomes.recall_at(1) > 0.9


def test_the_shown_method_finds_turned_places(tmp_path):
    heights = load_method(shown_method(tmp_path))()
    scenes = [make_block_scene(seed) for seed in range(6)]
    database = heights.build_database([heights.describe(s) for s in scenes])
    for place, scene in enumerate(scenes):
        turn = np.radians(60.0 * place + 9.0)
        c, s = np.cos(turn), np.sin(turn)
        turned = scene @ np.array([[c, s, 0.0], [-s, c, 0.0], [0.0, 0.0, 1.0]])
        scores = heights.score(heights.describe(turned), database)
        assert scores.argmax() == place
        assert scores[place] == pytest.approx(1.0, abs=0.02)


@pytest.mark.parametrize(
    ("text", "fault"),
    [
        ("1 / 0", "ZeroDivisionError: division by zero"),
        ("x = 1", "registers 0 methods"),
        (
            "from evaluation.methods import METHODS, register\n"
            "register('btc')(type('A', (METHODS['solid'],), {}))",
            "there is another method 'btc'",
        ),
        (
            "from evaluation.methods import Method, register\n"
            "register('a\\nb')(type('A', (Method,), {}))",
            "no name of a method",
        ),
    ],
)
def test_files_that_are_no_method(capsys, towns, tmp_path, text, fault):
    path = tmp_path / "no_method.py"
    path.write_text(text)
    both = ["pr", towns / "town_01", towns / "town_02", "--method"]
    assert_refused(capsys, [*both, path], path, fault)
    nowhere = tmp_path / "nowhere.py"
    assert_refused(capsys, [*both, nowhere], nowhere, "no such file")


_WHOLE = """
import numpy as np

from evaluation.methods import Method, register


@register("own_{number}")
class Own(Method):
    def describe(self, points):
        return len(points)

    def build_database(self, places):
        return np.array(places)

    def score(self, query, database, *, exhaustive=False):
        return -abs(database - query).astype(float)
"""


@pytest.mark.parametrize(
    ("old", "new", "fault"),
    [
        ("return -abs", "-abs", "score returned NoneType of shape"),
        ("-abs(database - query)", "np.zeros(1)", "of shape (1,) instead of"),
        (
            "-abs(database - query).astype(float)",
            "np.array(['a'] * len(database))",
            "score returned ndarray",
        ),
        ("return len(points)", "1 / 0", "line 10: ZeroDivisionError: division"),
        ("return np.array(places)", "places.x", "line 13: AttributeError"),
        ("import numpy", "raise SystemExit(0)\nimport numpy", "line 2: System"),
        ("    def score", "    def scare", "Own: lacks score"),
        (
            "    def desc",
            "    scans_per_place = 0\n    def desc",
            "0 is no whole",
        ),
        (
            "    def desc",
            "    divides = True\n    rerank_best = 5\n    def desc",
            "Own: divides: ",
        ),
        (
            "    def desc",
            "    def __init__(self, config=None):\n        exit(0)\n"
            "    def desc",
            "line 10: SystemExit",
        ),
        ("    def desc", "    Config = dict\n    def desc", "Config: <class"),
        ("return len(points)", "raise GeneratorExit", "line 10: GeneratorExit"),
        ("return len(points)", "points -= 1.0", "change a copy of it"),
        (
            "    def desc",
            "    rerank_best = 2\n"
            "    def rerank(self, query, places, scores):\n"
            "        places[1].sort(axis=0)\n"
            "    def desc",
            "line 11: ValueError: sort array is read-only (all methods share",
        ),
    ],
)
@pytest.mark.parametrize("data", ["drives", "scans"])
def test_faults_of_a_method_are_one_line(
    capsys, towns, tmp_path, data, old, new, fault
):
    text = _WHOLE.replace("{number}", "a")
    assert old in text
    path = tmp_path / "own.py"
    path.write_text(text.replace(old, new))
    if data == "drives":
        words = ["pr", towns / "town_01", towns / "town_02"]
    else:
        words = ["scores", towns / "town_01_scans", towns / "town_02_scans"]
        words += ["--output", tmp_path / "scores.csv"]
    assert_refused(capsys, [*words, "--method", path], fault)
    assert not (tmp_path / "scores.csv").exists()


@pytest.mark.parametrize(
    ("parent", "own", "fault"),
    [
        (
            "class Parent(Method):\n"
            "    def describe_place(self, points):\n        exit(0)",
            "Parent",
            "line 9: SystemExit: 0",
        ),
        (
            "class Parent(Method):\n"
            "    @classmethod\n"
            "    def describe_place(cls, points):\n        exit(cls.name)",
            "Parent",
            "line 10: SystemExit: own_p",
        ),
        (
            "class Config(Method.Config):\n"
            "    def model_post_init(self, _):\n        exit(0)",
            "Method",
            "line 9: SystemExit: 0",
        ),
    ],
)
def test_faults_outside_the_class_of_the_method(
    capsys, towns, tmp_path, parent, own, fault
):
    text = _WHOLE.replace("{number}", "p").replace("(Method)", f"({own})")
    if own == "Method":
        text = text.replace("    def desc", "    Config = Config\n    def desc")
    path = tmp_path / "own.py"
    path.write_text(text.replace("@register", f"{parent}\n\n@register"))
    words = ["pr", towns / "town_01", towns / "town_02", "--method", path]
    assert_refused(capsys, words, f"own.py: {fault}")


@pytest.mark.parametrize("name", ["own.py", "./own.py", "sub/../own.py"])
def test_a_relative_path_has_line_and_traceback(
    capsys, towns, tmp_path, monkeypatch, name
):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "sub").mkdir()
    text = _WHOLE.replace("{number}", "b").replace("len(points)", "1 / 0")
    (tmp_path / "own.py").write_text(text)
    words = ["pr", towns / "town_01", towns / "town_02", "--method", name]
    line = f"{Path(name)}: line 10: ZeroDivisionError: division by zero"
    assert_refused(capsys, words, line)
    for place in (0, len(words)):
        longer = [*words[:place], "--traceback", *words[place:]]
        status, out, err = run(capsys, *longer)
        assert (status, out) == (2, "")
        assert 'own.py", line 10, in describe\n    return 1 / 0\n' in err
        assert err.endswith(f"\ncns-eval: error: {line}\n")


@pytest.mark.parametrize(
    ("function", "body", "fault"),
    [
        ("for_lidar(self, field)", "pass", "own_c: for_lidar returned no"),
        ("for_lidar(self, field)", "1 / 0", "line 18: ZeroDivisionError"),
        (
            "describe_batch(self, clouds, *, of_places)",
            "pass",
            "own_c: describe_batch returned NoneType of length None",
        ),
        ("relative_poses(self, *three)", "return []", "list of length 0"),
        ("relative_poses(self, *three)", "pass", "NoneType of length None"),
        ("relative_pose(self, *three)", "return 5", "int of shape ()"),
        (
            "relative_pose(self, *three)",
            "return np.diag([1.0, 1.0, -1.0, 1.0])",
            "no pose",
        ),
    ],
)
def test_results_of_the_other_functions(
    capsys, towns, tmp_path, function, body, fault
):
    path = tmp_path / "own.py"
    path.write_text(
        _WHOLE.replace("{number}", "c")
        + f"    def {function}:\n        {body}\n"
    )
    words = ["pr", towns / "town_01", towns / "town_02", "--method", path]
    assert_refused(capsys, words, fault)


def test_a_file_in_a_setting_counts_by_its_content(tmp_path):
    """Weights beside the method, as a text, in a list, and in a folder."""
    text = _WHOLE.replace("{number}", "weights").replace(
        "    def desc",
        "    class Config(MethodConfig):\n"
        "        beside: Path = Path(__file__).with_name('beside.npy')\n"
        "        more: list[Path] = []\n"
        "        text: str = 'none'\n"
        "    def desc",
        1,
    )
    text = text.replace("import Method,", "import Method, MethodConfig,")
    path = tmp_path / "own.py"
    path.write_text(f"from pathlib import Path\n{text}")
    files = [tmp_path / name for name in ("beside.npy", "b.npy", "c.npy")]
    files += [tmp_path / "net" / "layers" / "d.npy", path]
    files[3].parent.mkdir(parents=True)
    for file in files[:-1]:
        file.write_bytes(b"weights")
    settings = [
        f"own_weights.more={files[1]},{tmp_path / 'net'}",
        f"own_weights.text={files[2]}",
    ]
    chosen = choose_methods([path], settings)[-1]
    known = [chosen.identity()]
    assert known[0] == chosen.identity()
    for file in files:
        file.write_bytes(file.read_bytes() + b"\n# Trained.")
        known.append(chosen.identity())
        assert known[-1] not in known[:-1]
