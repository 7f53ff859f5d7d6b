"""A machine without the libraries that wheels need."""

import os
import subprocess
import sys

import pytest

from evaluation.base import missing_library


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        (
            "libglib-2.0.so.0: cannot open shared object file: No such file or"
            " directory",
            "this system lacks the shared library libglib-2.0.so (Debian: apt"
            " install libglib2.0-0)",
        ),
        (
            "libodd_1+2.so.1.2: cannot open shared object file: No such file",
            "this system lacks the shared library libodd_1+2.so",
        ),
        ("No module named 'pydrake'", None),
        ("/x/a.so: undefined symbol: b", None),
    ],
)
def test_named_libraries(text, expected):
    assert missing_library(ImportError(text)) == expected


@pytest.mark.night
@pytest.mark.slow
def test_a_missing_library_is_one_line_and_names_the_package(tmp_path):
    """The import of Drake fails here as it does without GLib."""
    stub = tmp_path / "path" / "pydrake"
    stub.mkdir(parents=True)
    (stub / "__init__.py").write_text(
        "raise ImportError('libglib-2.0.so.0: cannot open shared object file:"
        " No such file or directory')\n"
    )
    path = os.pathsep.join([str(stub.parent), os.getcwd(), *sys.path])
    for words in (
        ("scan", "a.sdf", "--pose", *"000000", "--output", "a.bin"),
        ("simulate", "riverside_01", "--output", "out"),
        ("generate", "riverside_01", "--output", "out", "--jobs", "1"),
        ("list",),
    ):
        result = subprocess.run(
            [sys.executable, "-m", "cns_drake", *words],
            cwd=tmp_path,
            env={**os.environ, "PYTHONPATH": path},
            capture_output=True,
            text=True,
            check=False,
        )
        if result.returncode == 0:
            assert words == ("list",)
            continue
        assert result.returncode in (1, 2)
        line = result.stderr.splitlines()[-1]
        assert line.startswith("cns-drake: error: ")
        assert line.endswith("(Debian: apt install libglib2.0-0)")
        assert "Traceback" not in result.stderr


@pytest.mark.slow
def test_a_locale_without_utf8_is_named():
    """Drake cannot be imported there, and would print a traceback."""
    environment = {
        **os.environ,
        **{"LC_ALL": "C", "PYTHONUTF8": "0", "PYTHONCOERCECLOCALE": "0"},
    }
    command = ("-m", "cns_drake.command_line.cli", "scan", "x.sdf")
    place = ("--pose", *"000000", "--output", "x.pcd")
    done = subprocess.run(
        [sys.executable, *command, *place],
        env=environment,
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 2
    assert done.stderr == (
        "cns-drake: error: the locale C lacks UTF-8, which Drake needs "
        "(LC_ALL=C.UTF-8)\n"
    )
