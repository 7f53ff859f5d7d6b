"""What SECURITY.md says and no other test checks."""

import ast
import pickle
import re

from helpers import documents
import numpy as np
import pytest

from evaluation.base import InputError
from evaluation.clouds import read_cloud
from evaluation.methods import load_method


class Trap:
    """Leaves a file behind when it is unpickled."""

    def __init__(self, path):
        self._path = path

    def __reduce__(self):
        return (open, (str(self._path), "w"))


def test_an_array_of_objects_is_not_unpickled(tmp_path):
    path = tmp_path / "map.npy"
    np.save(path, np.array([[Trap(tmp_path / "ran")] * 3]), allow_pickle=True)
    assert b"builtins" in path.read_bytes() or b"open" in path.read_bytes()
    with pytest.raises(InputError, match=r"map\.npy: "):
        read_cloud(path)
    assert not (tmp_path / "ran").exists()
    pickle.loads(pickle.dumps(Trap(tmp_path / "ran"))).close()
    assert (tmp_path / "ran").exists()


def test_a_method_file_is_a_program(tmp_path, own_methods):
    path = tmp_path / "program.py"
    path.write_text(f"open({str(tmp_path / 'ran')!r}, 'w').close()\n")
    with pytest.raises(InputError, match="registers 0 methods"):
        load_method(path)
    assert (tmp_path / "ran").exists()


def test_a_page_in_the_making_is_seen_from_this_machine_alone():
    source = (documents.ROOT / "cns_drake/pictures/drive_page.py").read_text()
    calls = [
        node
        for node in ast.walk(ast.parse(source))
        if isinstance(node, ast.Call)
        and getattr(node.func, "id", "") == "MeshcatParams"
    ]
    assert calls
    for call in calls:
        given = {
            word.arg: ast.literal_eval(word.value) for word in call.keywords
        }
        assert given == {"host": "127.0.0.1", "port": 0}


def test_each_promise_names_its_tests():
    text = (documents.ROOT / "SECURITY.md").read_text()
    safe, _, _ = text.partition("## Not safe")
    known = {
        path.name for path in (documents.ROOT / "tests").rglob("test_*.py")
    }
    for promise in safe.split("\n- ")[1:]:
        named = re.findall(r"`(test_\w+\.py)`", promise)
        assert named, promise
        assert known.issuperset(named), named
