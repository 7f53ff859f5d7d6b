"""What commands write: whole or not at all, and in place of nothing of yours.

Each row of `WRITERS` is a command, with a name that it would write. A file, a
link or a folder of yours has this name. The command must refuse it in one line
that names it, and must change nothing. Inputs are as small as possible, or not
there at all: what is in the way is found before a drive is opened.
"""

from collections.abc import Iterator
import json
from pathlib import Path
import shutil
import signal
from typing import NamedTuple

from helpers.internal.eval_program import run_program, write_towns
from helpers.internal.signal_handlers import interrupt_at
from helpers.small_city import write_small_city
from helpers.small_map import write_town
from helpers.small_osm import write_corner
from helpers.tiny_drive import tiny_scenario, write_scenario
import numpy as np
import pytest
import typer

from cns_drake import command_line as simulator
from cns_drake.scenarios import write_scenarios
from evaluation import command_line as evaluation
from evaluation.clouds import read_cloud
from evaluation.drives import open_drive
from evaluation.map_update import SIDES, write_session

pytestmark = pytest.mark.slow

PROGRAMS = {"cns-drake": simulator, "cns-eval": evaluation}
# What a command that writes no files needs none of.
WRITE_NOTHING = {"cns-drake list", "cns-eval compare"}


class Writer(NamedTuple):
    """A command that writes.

    Attributes:
        words: the command; `OUT` stands for what it writes.
        names: names of files within OUT, each of which may be in the way; ""
            is OUT itself.
        replaces: whether the help says that an existing file is replaced.
    """

    words: str
    names: tuple[str, ...]
    replaces: bool = False


TABLES = ("results.csv", "queries.csv")
PAGE = (*TABLES, "index.html", "summaries.csv", "chart_1.png")
RECORDING = ("scenario.yaml", "metadata.yaml", "fingerprint.txt", "thesis.tex")
DRIVE = tuple(f"tiny_01/{name}" for name in RECORDING)
NEW = ("thesis.tex",)
EXPORT = "cns-drake export"
EVAL = "cns-eval"
WRITERS = [
    Writer("cns-drake import corner.osm --output OUT", NEW),
    Writer("cns-drake age town --years 1 --output OUT", NEW),
    Writer("cns-drake simulate tiny_01.yaml --output OUT", DRIVE),
    Writer(
        "cns-drake simulate tiny_01.yaml --output x --recording OUT",
        ("",),
        True,
    ),
    Writer(
        "cns-drake simulate tiny_01.yaml --output x --graphviz OUT", ("",), True
    ),
    Writer("cns-drake generate tiny_01.yaml --output OUT", DRIVE),
    Writer(
        "cns-drake generate --vary vary.yaml --output OUT",
        ("scenarios/mine.yaml",),
    ),
    Writer(
        "cns-drake scan tiny.sdf --pose 0 0 2 0 0 0 --output OUT", ("",), True
    ),
    Writer("cns-drake study vary.yaml --output OUT", PAGE),
    Writer(
        "cns-drake reproduce town --output OUT",
        tuple(f"report/{name}" for name in PAGE),
    ),
    Writer("cns-drake train --output OUT", ("",), True),
    *(
        Writer(f"{EXPORT} town_01 --format {name} --output OUT", NEW)
        for name in ("cns", "kitti", "mulran", "tum")
    ),
    Writer("cns-drake pairs tiny_01.yaml --output OUT", NEW),
    Writer(
        "cns-drake pairs --vary vary.yaml --output OUT",
        ("thesis.tex", "scenarios/mine.yaml"),
    ),
    Writer(
        "cns-drake truth tiny_01.yaml tiny_01.yaml --format overlaps"
        " --output OUT",
        ("overlaps.csv",),
    ),
    Writer("cns-drake truth town_01 town_02 --output OUT", NEW),
    Writer(f"{EXPORT} town_01 town_02 --format map-sessions --output OUT", NEW),
    Writer("cns-drake film tiny_01.yaml --output OUT.webp", ("",), True),
    Writer(f"{EVAL} tcr town_01.npy town_02.npy --output OUT", TABLES),
    Writer(f"{EVAL} pr town_01 town_02 --method solid --output OUT", TABLES),
    Writer(
        f"{EVAL} pr town_01 town_02 --method solid --truth overlap:0.5"
        " --overlaps OUT",
        ("",),
        True,
    ),
    Writer(
        f"{EVAL} scores town_01_scans town_02_scans --method solid"
        " --output OUT",
        ("",),
        True,
    ),
    Writer(f"{EVAL} report . --output OUT", PAGE),
    Writer(
        f"{EVAL} localise town_01 town_02 --method icp --output OUT",
        (*TABLES, "localisation.csv", "track.png"),
    ),
    Writer(f"{EVAL} map-update maps --output OUT", (*TABLES, "A.npy", "B.npy")),
]
# The city is written to the folder of its inputs.
CITY = ("stage_01.sdf", "structures.csv", "sequences.csv", "meshes")


@pytest.fixture(scope="module")
def inputs(tmp_path_factory):
    """A folder with the inputs of all commands."""
    top = tmp_path_factory.mktemp("inputs")
    write_towns(top)
    write_scenario(tiny_scenario(top), top)
    write_corner(top / "corner.osm")
    write_town(top / "town", {"01": "metropolis_01"}, 4)
    (top / "vary.yaml").write_text(
        f"maps: {json.dumps(str(top / 'town'))}\n"
        "drives: stages\nboth: {stage: [last]}\nmethods: [solid]\n"
        "tasks: [place]\n"
    )
    shipped = Path(evaluation.__file__).parents[1] / "results/baselines"
    (top / "tables").mkdir()
    shutil.copy(min(shipped.glob("*.csv")), top / "tables" / "results.csv")
    for side, name in zip(SIDES, ("town_01", "town_02"), strict=True):
        folder = top / "maps" / side
        folder.parent.mkdir(exist_ok=True)
        write_session(open_drive(top / name), folder, 1.0)
        size = len(read_cloud(folder / "map.ply"))
        np.save(folder / "truth.npy", np.ones(size, np.uint8))
    return top


def written(folder: Path) -> dict[str, str]:
    """Name -> what is there, of all files, links and folders."""
    return {
        str(path.relative_to(folder)): (
            f"-> {path.readlink()}"
            if path.is_symlink()
            else path.read_text()
            if path.is_file()
            else "a folder"
        )
        for path in folder.rglob("*")
    }


def in_the_way(writer: Writer) -> Iterator[tuple[str, str]]:
    """Yields what is in the way: a name, and what has it."""
    for name in writer.names:
        if not writer.replaces:
            yield name, "file"
        if name not in NEW:
            yield name, "link"
            yield name, "folder"
    if not writer.replaces:
        yield "", "file"
        yield "", "dead link"


def refusal(capsys, words: list[str]) -> str:
    program, *rest = words
    status, out, err = run_program(
        capsys, program, PROGRAMS[program].main, *rest
    )
    lines = [line for line in err.splitlines() if ": error: " in line]
    assert (status, out, len(lines)) == (2, "", 1), (out, err)
    return lines[0]


def put(path: Path, kind: str) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    if kind == "file":
        path.write_text("mine")
    elif kind == "folder":
        path.mkdir()
        (path / "note").write_text("mine")
    else:
        if kind == "link":
            (path.parent / "note").write_text("mine")
        path.symlink_to("note")


@pytest.mark.parametrize(
    "writer", WRITERS, ids=[" ".join(one.words.split()[:4]) for one in WRITERS]
)
def test_what_is_in_the_way_stays(
    inputs, tmp_path, monkeypatch, capsys, writer
):
    if " train " in writer.words:
        pytest.importorskip("jax")
    monkeypatch.chdir(inputs)
    for number, (name, kind) in enumerate(in_the_way(writer)):
        place = tmp_path / str(number)
        put(place / "out" / name if name else place / "out", kind)
        if "OUT.webp" in writer.words:
            (place / "out").rename(place / "out.webp")
        before = written(place)
        words = writer.words.replace("OUT", str(place / "out")).split()
        line = refusal(capsys, words)
        assert str(place / "out") in line, (name, kind)
        assert written(place) == before, (name, kind)


@pytest.mark.sampled(3)
@pytest.mark.parametrize("kind", ["file", "link", "folder"])
@pytest.mark.parametrize("name", CITY)
def test_a_city_keeps_what_is_yours(tmp_path, capsys, name, kind):
    if (name, kind) == ("meshes", "folder"):
        pytest.skip("the folder of all meshes, also of yours")
    folder = write_small_city(tmp_path / "town")
    (folder / "sequence_01.yaml").write_text("title: t\n")
    put(folder / name, kind)
    before = written(folder)
    line = refusal(capsys, ["cns-drake", "city", str(folder)])
    assert str(folder / name) in line
    assert written(folder) == before


def test_every_command_that_writes_is_here():
    known = {" ".join(one.words.split()[:2]) for one in WRITERS}
    commands = {
        f"{name} {command}"
        for name, program in PROGRAMS.items()
        for command in typer.main.get_command(program.app).commands
    }
    assert commands - known == {"cns-drake city", *WRITE_NOTHING}


# Commands whose work is in their own process, and how often they report what
# they do; tests of jobs interrupt those that run in other processes.
INTERRUPTED = {
    "cns-drake import corner.osm --output OUT": (2, 5),
    "cns-drake age suburbia --years 1 --no-pictures --output OUT": (1, 2),
    "cns-drake simulate tiny_01.yaml --output OUT": (2, 6),
    "cns-drake scan tiny.sdf --pose 0 0 2 0 0 0 --output OUT/a.pcd": (2, 3),
    "cns-drake list town": (2, 3),
    f"{EXPORT} town_01 --format kitti --output OUT": (2, 6),
    f"{EXPORT} town_01 town_02 --format map-sessions --output OUT": (2, 6),
    "cns-drake truth tiny_01.yaml tiny_01.yaml --output OUT": (3, 9),
    f"{EVAL} compare tables": (2, 3),
    f"{EVAL} map-update maps --output OUT": (2, 5),
    f"{EVAL} tcr town_01 town_02 --output OUT": (2, 9),
    f"{EVAL} pr town_01 town_02 --method ring++ --output OUT": (2, 9),
    f"{EVAL} pr town_01 town_02 --method learned --output OUT": (9,),
    f"{EVAL} localise town_01 town_02 --method icp --jobs 1 --output OUT": (9,),
}
# Only this file is written before the work, and not removed after an interrupt.
MARK = "export.yaml"


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
@pytest.mark.parametrize("words", INTERRUPTED)
def test_an_interrupt_is_one_line_and_leaves_nothing_half(
    inputs, tmp_path, monkeypatch, capsys, words, number
):
    monkeypatch.chdir(inputs)
    # Each signal is used at each second moment.
    offset = number == signal.SIGTERM
    for count in INTERRUPTED[words][offset::2]:
        interrupt_at(monkeypatch, count, number)
        name, *rest = words.replace("OUT", str(tmp_path / "out")).split()
        main = PROGRAMS[name].main
        status, out, err = run_program(capsys, name, main, *rest)
        assert (status, out) == (130, ""), err
        assert err.endswith(f"{name}: interrupted\n")
        assert "error" not in err
        assert "Traceback" not in err
        files = {path for path in tmp_path.rglob("*") if not path.is_dir()}
        assert files <= {tmp_path / "out" / MARK}


def test_scenarios_of_an_earlier_run_are_replaced(tmp_path):
    one = tiny_scenario(tmp_path)
    (path,) = write_scenarios([one], tmp_path / "scenarios")
    before = path.read_bytes()
    (again,) = write_scenarios([one], tmp_path / "scenarios")
    assert again.read_bytes() == before
