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


@pytest.mark.parametrize("file", ["mine", "own_{}"])
def test_each_file_has_its_own_helpers(tmp_path, file):
    """Helpers of one name, in files of one name or of several."""
    line = "from common import VALUE; from parts.deep import DEEP"
    paths = []
    for k in range(3):
        folder = tmp_path / str(k)
        paths.append(
            write(
                folder,
                f"own_{k}",
                head=f"{_ON_PATH}\n{line}",
                body="return VALUE + DEEP",
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


@pytest.mark.parametrize("end", ["", "1 / 0"])
def test_the_process_is_as_before(tmp_path, end):
    head = (
        f"os.chdir({str(tmp_path)!r})\n"
        f"sys.path.append('somewhere')\nimport json.tool\n{end}"
    )
    path = write(tmp_path, "moved", head=head)
    before = os.getcwd(), list(sys.path)
    if end:
        with pytest.raises(Exception, match="ZeroDivisionError"):
            load_method(path)
    else:
        load_method(path)
    assert (os.getcwd(), sys.path) == before
    # Python's own modules stay.
    assert "json.tool" in sys.modules


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
