"""Where modules lie, and that the packages declare their hints.

Steps of `.ci/run` check who imports whom, types and spelling.
"""

import ast
import functools
from importlib.metadata import packages_distributions, requires
from pathlib import Path
import re
import sys

import pytest

ROOT = Path(__file__).parents[2]
PACKAGES = ("cns_drake", "evaluation", "worlds")
DISTRIBUTIONS = ("cns-drake", "cns-eval")


@pytest.mark.parametrize("package", PACKAGES)
def test_no_module_lies_loose(package):
    loose = {path.stem for path in (ROOT / package).glob("*.py")}
    assert loose - {"__main__"} == {"__init__"}


@pytest.mark.parametrize("package", PACKAGES)
def test_packages_declare_their_hints(package):
    assert (ROOT / package / "py.typed").is_file()


def modules_imported(package: str) -> set[str]:
    """Returns the packages of others that are imported to run."""
    found = set()
    for path in (ROOT / package).rglob("*.py"):
        tree = ast.parse(path.read_text())
        for node in list(ast.walk(tree)):
            if isinstance(node, ast.If) and "TYPE_CHECKING" in ast.dump(
                node.test
            ):
                node.body.clear()
        for node in ast.walk(tree):
            if isinstance(node, ast.Import):
                found |= {alias.name for alias in node.names}
            elif isinstance(node, ast.ImportFrom) and not node.level:
                found.add(node.module or "")
    tops = {name.partition(".")[0] for name in found}
    return tops - sys.stdlib_module_names - set(PACKAGES)


# It reads the lists of files of all that is installed.
_origins = functools.cache(packages_distributions)


@pytest.mark.slow
@pytest.mark.parametrize("package", PACKAGES)
def test_all_that_is_imported_is_required(package):
    """What another package happens to install may be gone tomorrow."""
    # cns-drake requires cns-eval.
    houses = ["cns-eval"] if package == "evaluation" else DISTRIBUTIONS
    asked = {
        re.match(r"[\w-]+", one)[0].lower()
        for house in houses
        for one in requires(house)
    }
    origins = _origins()
    lacking = {
        module
        for module in modules_imported(package)
        if not asked
        & {
            name.lower()
            for name in origins.get(module, [module.replace("_", "-")])
        }
    }
    assert not lacking


def test_an_import_is_found_wherever_it_stands(tmp_path, monkeypatch):
    monkeypatch.setitem(globals(), "ROOT", tmp_path)
    (tmp_path / "one").mkdir()
    (tmp_path / "one/two.py").write_text(
        "import os.path\nfrom typing import TYPE_CHECKING\n"
        "if TYPE_CHECKING:\n    import hints\n"
        "def f():\n    from there.inside import g\n    import here.inside\n"
    )
    assert modules_imported("one") == {"there", "here"}
