"""Fingerprints: the code that a result depends on."""

import ast
import asyncio
import email
import json
import logging
import multiprocessing
from pathlib import Path
import shutil
import unittest

from helpers.documents import ROOT
import pytest

from cns_drake.base import code_digest, script_digest
from cns_drake.base.jobs import fingerprint as fingerprints

EXTRACTION = "evaluation.study.feature_extraction"
SIMULATION = "cns_drake.simulation.simulation"
SOURCES = {
    "evaluation/__init__.py": "import sys\n",
    "evaluation/top.py": """
from __future__ import annotations
from typing import TYPE_CHECKING
from . import level
from .inner import first
from evaluation.inner.second import *
import evaluation.inner.third as third, evaluation.fourth
if TYPE_CHECKING:
    from evaluation import types_only
else:
    from evaluation import otherwise
def late():
    try:
        with open("page.css") as stream:
            from evaluation.inner import offered
    except ImportError:
        import evaluation.fallback
""",
    "evaluation/inner/__init__.py": "import evaluation.initial\n",
    # A name that another package offers, too.
    "evaluation/inner/__init__.pyi": """
from evaluation.door import offered
from evaluation.unasked import other
""",
    "evaluation/door/__init__.py": "",
    "evaluation/door/__init__.pyi": """
from evaluation.hidden import offered, unasked
""",
    "evaluation/page.css": "",
    "evaluation/page.js": "",
    "evaluation/unrelated.py": "",
}
COUNTED = {
    "evaluation/inner/first.py": "from .deep import deeper",
    "evaluation/inner/deep/deeper.py": "from ...fifth import one",
    "evaluation/inner/deep/__init__.py": "",
    **{
        f"evaluation/{name}.py": ""
        for name in (
            "level", "inner/second", "inner/third", "fourth", "fifth",
            "initial", "otherwise", "hidden", "fallback",
        )
    },
}  # fmt: skip
NOT_COUNTED = {
    f"evaluation/{name}.py": ""
    for name in ("types_only", "unasked", "inner/unasked", "sys")
}


@pytest.fixture
def packages(tmp_path, monkeypatch):
    """A folder from which packages are imported."""
    monkeypatch.setattr(fingerprints, "_ROOT", tmp_path)
    code_digest.cache_clear()
    yield tmp_path
    code_digest.cache_clear()


def differs(file, module, change="\nchanged = True\n", **options):
    """Returns whether the digest of a module changes with a file."""
    code_digest.cache_clear()
    before = code_digest(module, **options)
    content = file.read_text()
    file.write_text(content + change)
    code_digest.cache_clear()
    after = code_digest(module, **options)
    file.write_text(content)
    return after != before


def test_every_kind_of_import_counts(packages):
    for name, text in (SOURCES | COUNTED | NOT_COUNTED).items():
        path = packages / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text)
    changing = {
        path.relative_to(packages).as_posix()
        for path in sorted(packages.rglob("*.*"))
        if differs(path, "evaluation.top")
    }
    expected = {*SOURCES, *COUNTED} - {
        "evaluation/inner/__init__.pyi",
        "evaluation/door/__init__.pyi",
        "evaluation/unrelated.py",
        "evaluation/page.js",
    }
    assert changing == expected
    # All modules of a package.
    assert differs(packages / "evaluation/inner/unasked.py", "evaluation.*")
    assert not differs(
        packages / "evaluation/inner/first.py",
        "evaluation.top",
        without=("evaluation.inner",),
    )


def imports_by_python(source):
    """Returns the imports of a source, as Python's own parser finds them."""
    return {
        ("." * node.level + (node.module or ""), name.name)
        if isinstance(node, ast.ImportFrom)
        else (name.name, "")
        for node in ast.walk(ast.parse(source))
        if isinstance(node, (ast.Import, ast.ImportFrom))
        for name in node.names
    }


@pytest.mark.parametrize(
    "package", [asyncio, email, json, logging, multiprocessing, unittest]
)
def test_imports_of_the_standard_library_are_found(package):
    for path in Path(package.__file__).parent.glob("*.py"):
        source = path.read_bytes()
        # Without a package, relative imports stay as they are written.
        found = fingerprints._find_imports(source, "")
        assert set(found) == imports_by_python(source), path


@pytest.mark.slow
def test_of_our_own_code_the_right_modules_count(packages):
    for name in ("cns_drake", "evaluation"):
        shutil.copytree(
            ROOT / name,
            packages / name,
            ignore=shutil.ignore_patterns("__pycache__"),
        )

    def digest(module):
        code_digest.cache_clear()
        return code_digest(module)

    modules = (SIMULATION, EXTRACTION, "evaluation.*")
    before = {module: digest(module) for module in modules}
    for path, counts, module in (
        ("cns_drake/sensors/lidar/patterns.py", True, SIMULATION),
        ("cns_drake/sensors/lidar/patterns.py", False, EXTRACTION),
        ("cns_drake/units/sheets/cns.yaml", True, SIMULATION),
        ("cns_drake/units/sheets/cns.yaml", True, EXTRACTION),
        ("evaluation/methods/btc.py", False, EXTRACTION),
        ("evaluation/results/page_template/frame.css", False, EXTRACTION),
        ("evaluation/results/page_template/frame.css", True, "evaluation.*"),
        ("cns_drake/pictures/page_template/drive.css", True, SIMULATION),
        ("cns_drake/base/progress_display.py", False, EXTRACTION),
    ):
        content = (packages / path).read_text()
        (packages / path).write_text(content + "\nchanged = True\n")
        assert (digest(module) != before[module]) == counts, (path, module)
        (packages / path).write_text(content)


def test_a_script_counts_with_the_modules_beside_it(tmp_path):
    path = tmp_path / "own.py"
    path.write_text("import own_help\nfrom evaluation.methods import Method\n")
    (tmp_path / "own_help.py").write_text("from own_parts import one\n")
    (tmp_path / "own_parts").mkdir()
    (tmp_path / "own_parts/__init__.py").write_text("from .core import one\n")
    (tmp_path / "own_parts/core.py").write_text("one = 1\n")
    (tmp_path / "unused.py").write_text("")
    before = script_digest(path)
    for file in sorted(tmp_path.rglob("*.py")):
        text = file.read_text()
        file.write_text(text + "\n# Changed.\n")
        assert (script_digest(path) != before) == (file.name != "unused.py")
        file.write_text(text)
    path.write_text("no Python at all")
    assert script_digest(path) != before
