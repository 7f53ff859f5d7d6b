"""Members of a family of modules, found by their files."""

import sys

from cns_drake.base import family_members


def test_members_are_found_by_a_line(tmp_path, monkeypatch):
    package = tmp_path / "some_family"
    for name, text in {
        "__init__": "MEMBER = 0",
        "second": "import broken\nMEMBER = 2\n",
        "first": '"""Text."""\n\nMEMBER = 1\n',
        "not_one": "text = 'MEMBER = 3'\n  MEMBER = 4\n",
        "inner/__init__": "MEMBER = 5\n",
        "inner/deeper": "MEMBER = 6\n",
        "other/__init__": "",
    }.items():
        path = package / f"{name}.py"
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text)
    monkeypatch.syspath_prepend(tmp_path)
    found = family_members("some_family", "MEMBER = ")
    assert list(found) == ["first", "inner", "second"]
    assert found["inner"] == "some_family.inner"
    # Nothing is imported.
    assert not {*found.values()} & {*sys.modules}
