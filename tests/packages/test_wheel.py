"""The wheels are small, and run the main job where there is no checkout."""

import os
from pathlib import Path
import re
import subprocess
import sys
import venv
import zipfile

import pytest

from evaluation.base import __version__

ROOT = Path(__file__).parents[2]
# As in a workflow of a repository.
REPOSITORY = {
    "GITHUB_SERVER_URL": "https://example.org",
    "GITHUB_REPOSITORY": "owner/project",
    "GITHUB_SHA": "0123abcd",
}
PAGE = "https://example.org/owner/project"


@pytest.fixture(scope="module")
def wheels(tmp_path_factory):
    """The wheels of cns-drake and cns-eval."""
    folder = tmp_path_factory.mktemp("wheel")
    run(
        sys.executable,
        "-m",
        "pip",
        "wheel",
        "--quiet",
        "--no-deps",
        "--no-build-isolation",
        "--wheel-dir",
        folder,
        ROOT,
        ROOT / "evaluation",
        env=os.environ | REPOSITORY,
    )
    return sorted(folder.glob("*.whl"))


def run(*command, **options):
    done = subprocess.run(
        list(map(str, command)), capture_output=True, text=True, **options
    )
    assert done.returncode == 0, done.stderr
    return done.stdout


@pytest.mark.slow
@pytest.mark.night
def test_it_is_small_and_has_its_notices(wheels):
    wheel, _ = wheels
    assert wheel.stat().st_size < 10e6
    with zipfile.ZipFile(wheel) as files:
        names = {Path(name).name for name in files.namelist()}
        (metadata,) = (n for n in files.namelist() if n.endswith("/METADATA"))
        said = files.read(metadata).decode()
    assert {"LICENSE", "NOTICE.md", "py.typed"} <= names
    assert "\nLicense-Expression: BSD-3-Clause\n" in said
    assert f"\nVersion: {__version__}\n" in said
    assert f"\nProject-URL: Source, {PAGE}\n" in said
    assert "\nProject-URL: Paper, https://arxiv.org/" in said
    pictures = re.findall(r"!\[[^]]*\]\((.*?)\)", said)
    assert pictures
    for address in pictures:
        assert address.startswith(f"{PAGE}/raw/0123abcd/docs/pictures/")
    assert f"({PAGE}/blob/0123abcd/docs/tutorial.md)" in said
    assert "](docs/" not in said


@pytest.mark.slow
@pytest.mark.night
def test_the_evaluation_is_pure_and_has_its_licence(wheels):
    _, wheel = wheels
    assert wheel.name == f"cns_eval-{__version__}-py3-none-any.whl"
    with zipfile.ZipFile(wheel) as files:
        tops = {name.partition("/")[0] for name in files.namelist()}
        (licence,) = (n for n in files.namelist() if n.endswith("/LICENSE"))
        assert files.read(licence) == (ROOT / "LICENSE").read_bytes()
    assert tops == {"evaluation", f"cns_eval-{__version__}.dist-info"}


@pytest.mark.slow
@pytest.mark.night
def test_they_run_the_main_job_without_the_checkout(wheels, tmp_path):
    venv.create(tmp_path / "venv", symlinks=True)
    (site,) = (tmp_path / "venv").glob("lib/*/site-packages")
    # What the package needs, but not the package of the checkout.
    needed = [path for path in sys.path if path.endswith("-packages")]
    (site / "needed.pth").write_text("\n".join(needed) + "\n")
    python = tmp_path / "venv/bin/python"
    pip = (sys.executable, "-m", "pip", "--python", python, "install")
    run(*pip, "--quiet", "--no-deps", "--force-reinstall", *wheels)
    options = {
        "cwd": tmp_path,
        "env": {
            "PATH": os.environ["PATH"],
            "HOME": str(tmp_path),
            "XDG_CACHE_HOME": str(tmp_path / "cache"),
            # Its loops are compiled anew, for two frames.
            "NUMBA_OPT": "0",
        },
    }
    where = run(
        python, "-c", "import cns_drake; print(cns_drake.__file__)", **options
    )
    assert where.startswith(str(site))
    run(
        python,
        "-m",
        "cns_drake",
        "simulate",
        "suburbia_01",
        "--frames",
        "2",
        "--output",
        "output",
        **options,
    )
    drive = "output/suburbia_01"
    said = run(tmp_path / "venv/bin/cns-eval", "tcr", drive, drive, **options)
    assert "TCR_sym" in said
    assert list(tmp_path.glob("cache/cns-drake/worlds-*/suburbia/roads.yaml"))
