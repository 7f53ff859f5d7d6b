"""Families, and the plug-ins that add members to them."""

import contextlib
import sys

import pytest

from evaluation.base import Family, plugins, program
from evaluation.base.plugins import plugin_fault


@pytest.fixture
def install(tmp_path, monkeypatch):
    """Installs packages with an entry point each, before plug-ins are read."""
    monkeypatch.syspath_prepend(tmp_path)
    plugins._load_plugins.cache_clear()

    def write(name, text, module=None):
        (tmp_path / f"{name}.py").write_text(text)
        folder = tmp_path / f"{name}-1.0.dist-info"
        folder.mkdir()
        (folder / "METADATA").write_text(f"Name: {name}\nVersion: 1.0\n")
        (folder / "entry_points.txt").write_text(
            f"[cns_drake.plugins]\n{name}_plugin = {module or name}\n"
        )

    yield write
    plugins._load_plugins.cache_clear()


def test_members_come_in_order_and_once():
    loaded = []

    def load_own():
        loaded.append(1)
        family.add("own", 1, "here")

    family = Family("sort", load_own)
    family.add("added", 2, "there")
    assert family["added"] == 2
    assert not loaded
    assert dict(family) == {"added": 2, "own": 1}
    assert loaded == [1]
    assert family.own() == [1]
    family.add("own", 3, "here")
    assert (family.get("own"), family.get("none"), len(family)) == (3, None, 2)
    with pytest.raises(ValueError, match="there is another sort 'own'"):
        family.add("own", 4, "there")


def test_broken_plugins_are_a_line_each(install, capfd, monkeypatch):
    """The others are there, in the order of their names."""
    install("broken", "print('hello')\n1 / 0")
    install("ended", "raise SystemExit(3)")
    install("nowhere", "", "no_such_module")
    install("right_one", "def fail():\n    raise SystemExit(4)")
    assert list(Family("sort")) == []
    with pytest.raises(SystemExit) as raised:
        sys.modules["right_one"].fail()
    fault = plugin_fault(raised.value)
    assert fault.startswith("plug-in right_one_plugin: ")
    assert fault.endswith("right_one.py: line 2: SystemExit: 4")

    assert plugin_fault(ValueError()) is None

    monkeypatch.setattr(sys, "argv", ["town"])
    monkeypatch.setattr(program.interrupts, "ignore_interrupts", lambda: None)
    monkeypatch.setattr(
        program.interrupts, "interrupt_on_termination", lambda: lambda: False
    )
    app = program.plain_app()
    app.command()(sys.modules["right_one"].fail)
    with pytest.raises(SystemExit, match="2"):
        program.run(app, "town", contextlib.nullcontext())
    out, err = capfd.readouterr()
    assert out == ""
    assert err.splitlines() == [
        "hello",
        "plug-in broken_plugin (broken): ZeroDivisionError: division by zero",
        "plug-in ended_plugin (ended): SystemExit: 3",
        "plug-in nowhere_plugin (no_such_module): ModuleNotFoundError: No"
        " module named 'no_such_module'",
        f"town: error: {fault}",
    ]
