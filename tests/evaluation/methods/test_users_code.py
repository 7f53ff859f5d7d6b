"""A user's file shares the process: nothing of it reaches other code."""

import os
import sys

import numpy as np
import pytest

from evaluation.methods import load_method, make_method

pytestmark = pytest.mark.usefixtures("own_methods")

_METHOD = """
import os
import subprocess
import sys
{head}
import numpy as np
from evaluation.methods import Method, register

@register({name!r})
class Own(Method):
    def describe(self, points):
        {body}

    def build_database(self, places):
        return np.array(places)

    def score(self, query, database, *, exhaustive=False):
        return -abs(database - query)
"""
_ON_PATH = "sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))"


def write(folder, name, *, head="", body="return 1.0", file="mine"):
    folder.mkdir(exist_ok=True)
    path = folder / f"{file}.py"
    path.write_text(_METHOD.format(head=head, name=name, body=body))
    return path


def process_state():
    return os.getcwd(), list(sys.path), dict(sys.modules)


@pytest.mark.parametrize("when", ["at import", "in a call"])
@pytest.mark.parametrize("file", ["mine", "own_{}"])
def test_each_file_has_its_own_helpers(tmp_path, when, file):
    """Helpers of one name, in files of one name or of several."""
    line = "from common import VALUE; from parts.deep import DEEP"
    at_import, in_call = (line, "") if when == "at import" else ("", line)
    paths = []
    for k in range(3):
        folder = tmp_path / str(k)
        paths.append(
            write(
                folder,
                f"own_{k}",
                head=f"{_ON_PATH}\n{at_import}",
                body=f"{in_call}\n        return VALUE + DEEP",
                file=file.format(k),
            )
        )
        (folder / "common.py").write_text(f"VALUE = {k}.0\n")
        (folder / "parts").mkdir()
        (folder / "parts" / "__init__.py").write_text("")
        (folder / "parts" / "deep.py").write_text(f"DEEP = {10 * k}\n")
    for path in paths:
        load_method(path)
    methods = [make_method(f"own_{k}", {}) for k in range(3)]
    for k in (2, 0, 1, 1, 2, 0):
        assert methods[k].describe(np.zeros((1, 3))) == 11.0 * k
    assert not {"common", "parts", "parts.deep"} & set(sys.modules)


def test_a_loaded_module_keeps_its_state(tmp_path):
    """A helper is loaded once, not at each call."""
    head = f"{_ON_PATH}\nimport counting"
    body = "import counting; counting.CALLS += 1; return counting.CALLS"
    path = write(tmp_path / "a", "counted", head=head, body=body)
    (tmp_path / "a" / "counting.py").write_text("CALLS = 0\n")
    method = load_method(path)()
    assert [method.describe(None) for _ in range(3)] == [1, 2, 3]


def test_the_process_is_as_before(tmp_path):
    (tmp_path / "data").mkdir()
    (tmp_path / "data" / "weight.txt").write_text("7")
    head = (
        f"os.chdir({str(tmp_path / 'data')!r})\n"
        "sys.path.append('somewhere')\nimport json.tool"
    )
    body = "return float(open('weight.txt').read())"
    path = write(tmp_path, "moved", head=head, body=body)
    directory, folders, _ = process_state()
    method = load_method(path)()
    assert process_state()[:2] == (directory, folders)
    # The file finds the directory that it has chosen.
    assert method.describe(None) == 7.0
    assert process_state()[:2] == (directory, folders)
    # Python's own modules stay.
    assert "json.tool" in sys.modules


def test_state_returns_after_an_error(tmp_path):
    body = f"os.chdir({str(tmp_path)!r}); sys.path.clear(); 1 / 0"
    method = load_method(write(tmp_path / "a", "failing", body=body))()
    before = process_state()[:2]
    with pytest.raises(Exception, match="ZeroDivisionError"):
        method.describe(None)
    assert process_state()[:2] == before


@pytest.mark.slow
def test_prints_go_to_stderr(tmp_path, capfd):
    """Of Python, of the file descriptor, and of a child process."""
    say = (
        "print('by print'); os.write(1, b'by write\\n');"
        f" subprocess.run([{sys.executable!r}, '-c', 'print(\"by child\")'])"
    )
    path = write(tmp_path, "chatty", head=say, body=f"{say}; return 1.0")
    print("before")
    method = load_method(path)()
    method.describe(None)
    print("after")
    out, err = capfd.readouterr()
    assert out == "before\nafter\n"
    for words in ("by print", "by write", "by child"):
        assert err.count(words) == 2


def test_a_property_runs_as_the_users_code(tmp_path):
    path = write(tmp_path, "listed")
    path.write_text(
        path.read_text() + "    @property\n    def num_shortlisted(self):\n"
        "        return 1 // 0\n"
    )
    with pytest.raises(Exception, match=r"mine.py: line .*ZeroDivision"):
        _ = load_method(path)().num_shortlisted


def test_two_commands_of_one_stem_are_two_methods(tmp_path):
    from evaluation.recognition import choose_methods

    paths = [write(tmp_path / str(k), f"stem_{k}") for k in range(2)]
    found = choose_methods(paths)
    assert [one.name for one in found] == ["stem_0", "stem_1"]
