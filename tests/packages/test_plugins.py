"""The package of the documents: its members come and go with it."""

import json
import os
import subprocess
import sys
import sysconfig

from helpers import documents
import numpy as np
import pytest

EXPERIMENT = """
about: What does a rebuilt city cost a method of a package?
both: {stage: [last, own]}
drives: both-ways
tasks: [place, change]
protocol: recorded
charts:
  - {kind: scatter, x: tcr_sym, y: wrong_answers, both.stage: own}
"""
BROKEN = {
    "pyproject.toml": """
[build-system]
requires = ["hatchling"]
build-backend = "hatchling.build"

[project]
name = "broken"
version = "1.0"

[project.entry-points."cns_drake.plugins"]
broken = "broken"
""",
    "broken.py": "import evaluation\n\nevaluation.register('solid')(3)\n",
}


@pytest.fixture
def environment(tmp_path):
    """Returns functions that call pip, and a program, in an environment."""
    subprocess.check_call([sys.executable, "-m", "venv", tmp_path / "env"])
    python = tmp_path / "env/bin/python"
    where = "import sysconfig; print(sysconfig.get_path('purelib'))"
    site = subprocess.check_output([python, "-c", where], text=True).strip()
    # It sees what the tests see, and has packages beside it.
    seen = [str(documents.ROOT), sysconfig.get_path("purelib"), *sys.path]
    with open(f"{site}/tests.pth", "w") as stream:
        stream.write("\n".join(one for one in seen if os.path.isdir(one)))

    def pip(*words):
        options = ("--quiet", "--disable-pip-version-check")
        subprocess.check_call(
            [python, "-m", "pip", *words, *options], cwd=tmp_path
        )

    def run(program, *words):
        return subprocess.run(
            [python, "-m", program, *words],
            cwd=tmp_path,
            capture_output=True,
            text=True,
            check=False,
        )

    return pip, run


def write_drives(folder):
    """Writes two drives along one street, past posts, in the layout `Npz`."""
    folder.mkdir()
    rng = np.random.default_rng(1)
    posts = rng.uniform([-20, -20, 0], [120, 20, 8], (400, 3))
    X_WS = np.tile(np.eye(4), (41, 1, 1))
    X_WS[:, 0, 3] = np.arange(0.0, 102.5, 2.5)
    for stage in ("01", "02"):
        scans = {str(k): posts - X[:3, 3] for k, X in enumerate(X_WS)}
        stamps_ns = np.arange(41) * 10**8
        path = folder / f"town_{stage}.npz"
        np.savez(path, stamps_ns=stamps_ns, X_WS=X_WS, **scans)
        posts = posts[:250]


@pytest.mark.slow
def test_the_package_of_the_documents(tmp_path, environment):
    pip, run = environment
    page = documents.read("docs/how-to/own_plugin.md")
    texts = [one.text for one in documents.fenced(page)]
    mine = dict(zip(("pyproject.toml", "mine.py"), texts, strict=True))
    for name, files in (("mine", mine), ("broken", BROKEN)):
        (tmp_path / name).mkdir()
        for file, text in files.items():
            (tmp_path / name / file).write_text(text)
    write_drives(tmp_path / "recordings")
    (tmp_path / "own.yaml").write_text(EXPERIMENT)
    pair = ("recordings/town_01.npz", "recordings/town_02.npz")
    method = ("--method", "mean-heights")
    pr = ("evaluation", "pr", *pair, *method, "--output", "pr")
    compare = ("evaluation", "compare", "pr", "--metric", "wrong_answers")
    study = ("cns_drake", "study", "own.yaml", "recordings", *method)
    study += ("--output", "study", "--jobs", "2")
    ladder = ("cns_drake", "study", "ladder", "--show")
    export = ("cns_drake", "export", pair[0], "--format", "kitti")
    export += ("--output", "kitti")

    pip("install", "--no-deps", "--no-build-isolation", "./mine", "./broken")
    verbs = ((*pr, "--json"), compare, study, ladder, export)
    done = [run(*words) for words in verbs]
    assert [one.returncode for one in done] == [0] * 5, done[2].stderr
    fault = "plug-in broken (broken): InputError: 3: no subclass of Method"
    assert all(fault in one.stderr.splitlines() for one in done)
    assert json.loads(done[0].stdout)["wrong_answers"] >= 0.0
    assert done[1].stdout.splitlines()[1].startswith("mean-heights")
    table = (tmp_path / "study/results.csv").read_text()
    assert ",mean-heights,0,recorded," in table
    assert ",wrong_answers," in table
    assert "  deep_snow:" in done[3].stdout
    assert done[4].stdout == "kitti/sequences/01\n"

    pip("uninstall", "--yes", "mine", "broken")
    # What was measured stays.
    assert run(*compare).stdout.splitlines()[1].startswith("mean-heights")
    gone = run(*pr)
    assert (gone.returncode, gone.stdout) == (2, "")
    assert "no method 'mean-heights'" in gone.stderr
    assert "deep_snow" not in run(*ladder).stdout
