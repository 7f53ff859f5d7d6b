"""The package of the documents: its members come and go with it."""

import os
import subprocess
import sys
import sysconfig

from helpers import documents
import pytest

SHOWN = """
import numpy as np
from cns_drake import causes
from cns_drake.studies import load_experiment
from evaluation import InputError, known_methods, open_drive
from evaluation.recognition import METRICS

X_WS = np.tile(np.eye(4), (2, 1, 1))
scans = {str(k): np.ones((5, 3)) for k in range(2)}
np.savez("drive.npz", stamps_ns=np.arange(2), X_WS=X_WS, **scans)
print("mean-heights" in known_methods(), "wrong_answers" in METRICS)
print("deep_snow" in causes(), "deep_snow" in load_experiment("ladder").cases)
try:
    print(len(open_drive("drive.npz")), open_drive("drive.npz").scan(1).shape)
except InputError as error:
    print("not a recorded drive" in str(error))
"""


@pytest.mark.slow
def test_the_package_of_the_documents(tmp_path):
    page = documents.read("docs/how-to/own_plugin.md")
    project, module = (one.text for one in documents.fenced(page))
    package = tmp_path / "mine"
    package.mkdir()
    (package / "pyproject.toml").write_text(project)
    (package / "mine.py").write_text(module)
    subprocess.check_call([sys.executable, "-m", "venv", tmp_path / "env"])
    python = tmp_path / "env/bin/python"
    where = "import sysconfig; print(sysconfig.get_path('purelib'))"
    site = subprocess.check_output([python, "-c", where], text=True).strip()
    # It sees what the tests see, and has this package beside it.
    seen = [str(documents.ROOT), sysconfig.get_path("purelib"), *sys.path]
    with open(f"{site}/tests.pth", "w") as stream:
        stream.write("\n".join(one for one in seen if os.path.isdir(one)))

    def pip(*words):
        options = ("--quiet", "--disable-pip-version-check")
        subprocess.check_call(
            [python, "-m", "pip", *words, *options], cwd=tmp_path
        )

    def shown():
        done = subprocess.run(
            [python, "-c", SHOWN], cwd=tmp_path, capture_output=True, text=True
        )
        assert done.returncode == 0, done.stderr
        return done.stdout.splitlines()

    pip("install", "--no-deps", "--no-build-isolation", "./mine")
    assert shown() == ["True True", "True True", "2 (5,)"]
    pip("uninstall", "--yes", "mine")
    assert shown() == ["False False", "False False", "True"]
