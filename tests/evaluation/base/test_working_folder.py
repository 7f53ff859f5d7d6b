"""Neither code nor settings of the working folder count."""

import json
import os
import subprocess
import sys

import pytest

from evaluation.base import start_python

_PROBE = """
import json, os, sys
answer = {"json": json.__file__, "here": os.getcwd(), "path": sys.path}
print(json.dumps(answer))
"""


@pytest.mark.slow
def test_a_python_of_its_own_is_not_in_the_working_folder(
    tmp_path, monkeypatch
):
    here, modules = tmp_path / "here", tmp_path / "modules"
    here.mkdir()
    modules.mkdir()
    (here / "json.py").write_text("raise ImportError\n")
    (modules / "probe.py").write_text(_PROBE)
    monkeypatch.chdir(here)
    for folder in (modules, here, ""):
        monkeypatch.syspath_prepend(folder)
    process = start_python("probe")
    found = json.loads(process.communicate()[0])
    assert found["json"] == json.__file__
    assert found["here"] == "/"
    assert str(modules) in found["path"]
    assert not {"", str(here)} & {*found["path"]}


@pytest.mark.slow
def test_a_working_folder_that_is_gone_is_named(tmp_path):
    done = subprocess.run(
        [sys.executable, "-m", "evaluation", "--version"],
        cwd=tmp_path,
        preexec_fn=lambda: os.rmdir(tmp_path),
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 2
    assert done.stderr == "error: the working folder is not there any more\n"
