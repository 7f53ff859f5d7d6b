"""Compiled code is cached outside of the installation."""

import os
from pathlib import Path
import shutil
import subprocess
import sys

from helpers import documents
import pytest

from evaluation.base import compilation

_SCRIPT = """
import numba
import numpy as np
before = numba.config.CACHE_LOCATOR_CLASSES
from evaluation.methods.btc_planes import group_alike
assert numba.config.CACHE_LOCATOR_CLASSES == before
print(len(group_alike(np.zeros((1, 3)), np.zeros((1, 3)), 0.1, 0.3)))
"""
_IGNORED = """
from evaluation.base.working_folder import ignore_local_settings
ignore_local_settings()
"""


@pytest.mark.night
@pytest.mark.slow
@pytest.mark.parametrize("is_there", [True, False])
def test_nothing_is_kept_beside_the_code(tmp_path, is_there):
    """This holds with and without a folder of the user."""
    ours = tmp_path / "installed"
    shutil.copytree(
        documents.ROOT / "evaluation",
        ours / "evaluation",
        ignore=shutil.ignore_patterns("__pycache__"),
    )
    cache = tmp_path / "cache"
    if is_there:
        cache.mkdir()
    environment = {k: v for k, v in os.environ.items() if "NUMBA" not in k}
    result = subprocess.run(
        [sys.executable, "-c", _SCRIPT],
        env={
            **environment,
            "PYTHONPATH": str(ours),
            "PYTHONDONTWRITEBYTECODE": "1",
            "XDG_CACHE_HOME": str(cache) if is_there else "not/absolute",
            "HOME": str(tmp_path / "home"),
        },
        cwd=tmp_path,
        capture_output=True,
        text=True,
        check=True,
    )
    assert result.stdout == "1\n"
    kept = {path.relative_to(tmp_path) for path in tmp_path.rglob("*.nb?")}
    assert kept
    inside = Path("cache" if is_there else "home/.cache") / "cns-drake"
    assert all(path.is_relative_to(inside) for path in kept)


@pytest.mark.slow
@pytest.mark.sampled(1)
@pytest.mark.parametrize(
    "place", ["no home", "writable by all", "another's", "here", "ignored"]
)
def test_no_machine_code_where_others_can_write(tmp_path, place):
    """Numba unpickles what it finds, so it must find nothing there."""
    cache = tmp_path / "cache"
    environment = {
        k: v
        for k, v in os.environ.items()
        if not k.startswith(("NUMBA", "HOME", "XDG"))
    }
    who, script = [], _SCRIPT
    if place == "ignored":
        # Numba reads the file when it is imported, and whenever it compiles.
        (tmp_path / ".numba_config.yaml").write_text("{{{")
        environment["XDG_CACHE_HOME"] = str(tmp_path.with_suffix(".cache"))
        environment["NUMBA_DISABLE_JIT"] = "1"
        script = _IGNORED + _SCRIPT
    elif place == "here":
        # Numba itself would take the folder from this file.
        (tmp_path / ".numba_config.yaml").write_text("cache_dir: unpacked\n")
        environment["XDG_CACHE_HOME"] = str(tmp_path.with_suffix(".cache"))
    elif place == "no home":
        if os.geteuid():
            pytest.skip("only root can take a uid without a name")
        tmp_path.chmod(0o777)
        who = ["setpriv", "--reuid", "54321", "--regid", "54321"]
        who += ["--clear-groups"]
    else:
        environment["XDG_CACHE_HOME"] = str(cache)
        methods = documents.ROOT / "evaluation/methods"
        name = compilation._content_hash(methods)
        folder = cache / "cns-drake/compiled" / name
        folder.mkdir(parents=True)
        if place == "writable by all":
            folder.chmod(0o777)
        elif os.geteuid():
            pytest.skip("only root can give a folder away")
        else:
            os.chown(folder, 54321, 54321)
    result = subprocess.run(
        [*who, sys.executable, "-B", "-c", script],
        env=environment | {"PYTHONPATH": str(documents.ROOT)},
        cwd=tmp_path,
        capture_output=True,
        text=True,
        check=False,
    )
    assert (result.stdout, result.returncode) == ("1\n", 0), result.stderr
    assert not [*tmp_path.rglob("*.nb?")]


def output_of(script, folder):
    """Returns what a script prints; its machine code is kept in a folder."""
    result = subprocess.run(
        [sys.executable, script],
        env={
            **os.environ,
            "PYTHONPATH": str(documents.ROOT),
            "XDG_CACHE_HOME": str(folder / "cache"),
        },
        capture_output=True,
        text=True,
        check=False,
    )
    assert result.returncode == 0, result.stderr
    return result.stdout


_TWICE = """
import fcntl
import os

from evaluation.base.compilation import compiled

@compiled
def twice(number):
    return 2 * number

@compiled
def later(time, by):
    return time + by

@compiled
def two_times(time):
    return later(time, 1) + later(time, time)

lock = fcntl.lockf

def wait(*arguments):
    fcntl.lockf = lock
    child = os.fork()
    if child == 0:
        twice(2)
        os._exit(0)
    os.waitpid(child, 0)
    return lock(*arguments)

fcntl.lockf = wait
print(twice(2), twice.stats.cache_hits.total(), twice.stats.cache_misses)
print(two_times(2), later.signatures)
"""


@pytest.mark.slow
def test_nothing_is_compiled_twice(tmp_path):
    """Neither by two processes, nor for numbers that are written out."""
    script = tmp_path / "twice.py"
    script.write_text(_TWICE)
    assert output_of(script, tmp_path) == "4 1 Counter()\n7 [(int64, int64)]\n"


_THRICE = """
from evaluation.base.compilation import compiled

@compiled
def thrice(number):
    return 3 * number

print(thrice(2), thrice.stats.cache_misses.total())
"""


@pytest.mark.slow
@pytest.mark.night
def test_equal_sources_share_the_code_wherever_they_lie(tmp_path):
    """Age and place of the source do not count; content of a sibling does."""
    for name in ("checkout", "installed", "changed"):
        (tmp_path / name).mkdir()
        (tmp_path / name / "thrice.py").write_text(_THRICE)
    os.utime(tmp_path / "installed/thrice.py", (1e9, 1e9))
    (tmp_path / "changed/sibling.py").write_text("# Another folder.\n")
    assert output_of(tmp_path / "checkout/thrice.py", tmp_path) == "6 1\n"
    assert output_of(tmp_path / "installed/thrice.py", tmp_path) == "6 0\n"
    assert output_of(tmp_path / "changed/thrice.py", tmp_path) == "6 1\n"


_DAMAGED = """
import sys
from evaluation.base.compilation import compiled, compiled_callback

@compiled
def thrice(number):
    return 3 * number

@compiled
def nine_times(number):
    return 3 * thrice(number)

def call(address):
    pass

print(nine_times(2), compiled_callback(call) > 0)
"""


@pytest.mark.slow
@pytest.mark.parametrize(
    ("ending", "length"), [("nbi", 60), ("nbi", 0), ("nbc", 0), ("nbc", 300)]
)
def test_damaged_machine_code_is_compiled_again(tmp_path, ending, length):
    """A cut index of a callback and of a function that another calls, too."""
    script = tmp_path / "damaged.py"
    script.write_text(_DAMAGED)
    assert output_of(script, tmp_path) == "18 True\n"
    files = [*(tmp_path / "cache").rglob(f"*.{ending}")]
    assert len(files) == 3
    for file in files:
        os.truncate(file, length)
    assert output_of(script, tmp_path) == "18 True\n"
    sizes = [file.stat().st_size for file in files]
    assert min(sizes) > length
