"""What the programs do with small files, as texts that pins are compared with.

An edge is a function that runs the programs in a folder, in processes of their
own, and returns name of a pin -> text. Nothing here imports the project.
"""

from collections.abc import Callable, Iterator
import csv
from functools import cache
import hashlib
import io
import json
import math
import os
from pathlib import Path
import re
import shutil
import subprocess
import sys
import tempfile

from helpers.processors import EMBREE, PROGRAM
from mcap.reader import make_reader
import numpy as np

from edges import inputs

PINS = Path(__file__).parent / "pins"
WORLDS = Path(__file__).parents[2] / "worlds"
# Columns of results that are not compared: the release that measured. Columns
# and metrics of times would be, too, but the tasks here measure none.
_LEFT_OUT = ("version",)
# Their answers may differ between processors.
_LOOSE = ("ring++", "btc")
_RELATIVE = 1e-6
# For those: of a result, absolute; of answers to queries, their share.
_LOOSE_RESULT = 0.25
_LOOSE_ANSWERS = 0.2
# Pixels depend on the libraries that draw them.
_PICTURES = (".png", ".jpg", ".webp", ".svg")


# Package -> file of its program.
_PROGRAMS = {
    package: Path(sys.executable).with_name(name)
    for package, name in {
        "cns_drake": "cns-drake",
        "evaluation": "cns-eval",
    }.items()
}


def run(folder: Path, program: str, *words: object) -> str:
    """Runs a program in a folder of traps; returns what it prints.

    Raises:
        RuntimeError: it fails, or code of the folder runs.
    """
    inputs.write_traps(folder)
    file = _PROGRAMS[program]
    if program == "cns_drake" and EMBREE in os.environ:
        file = PROGRAM
    text = _python(folder, file, *words)
    if (folder / inputs.SPRUNG).exists():
        raise RuntimeError(f"{words}: code of the working folder runs")
    return text


def _python(folder: Path, *words: object) -> str:
    done = subprocess.run(
        [sys.executable, *map(str, words)],
        cwd=folder,
        env=os.environ | {"COLUMNS": "100"},
        capture_output=True,
        text=True,
        check=False,
    )
    if done.returncode:
        raise RuntimeError(f"{words}: {done.stderr}")
    return done.stdout


# Runs a program for each line of words, as forks of one process: to import it
# takes far longer than to show a help.
_FORKS = """
import importlib, os, runpy, sys
program, *lines = sys.argv[1:]
importlib.import_module(f"{program}.command_line.cli")
for number, line in enumerate(lines):
    print("\\n" * (number > 0) + f"$ {line}", flush=True)
    if os.fork() == 0:
        sys.argv = line.split()
        sys.exit(runpy.run_module(program, run_name="__main__"))
    if os.wait()[1]:
        sys.exit(f"{line}: it fails")
"""


def helps(program: str, name: str) -> Callable[[Path], dict[str, str]]:
    """Returns the edge of all help texts of a program."""

    def edge(folder: Path) -> dict[str, str]:
        verbs = verbs_in(run(folder, program, "--help"))
        lines = [f"{name} --help", *(f"{name} {verb} --help" for verb in verbs)]
        text = _python(folder, "-I", "-c", _FORKS, program, *lines)
        # Since 0.28, Typer ends an argument that may be repeated with dots.
        text = re.sub(r"(?m)^(Usage: .*)\.\.\.$", r"\1", text)
        return {f"{name}-help.txt": text}

    return edge


def verbs_in(text: str) -> Iterator[str]:
    """Yields what stands first in the rows of sections of commands."""
    for part in text.partition("--help")[2].split("\n\n"):
        title, *rows = part.strip("\n").splitlines() or [""]
        if title.endswith(":") and not title.startswith(" "):
            yield from (
                row.split()[0]
                for row in rows
                if row.startswith("  ") and row[2:3].isalpha()
            )


def recording(name: str) -> Callable[[Path], dict[str, str]]:
    """Returns the edge of a recording: a line for each of its topics."""

    def edge(folder: Path) -> dict[str, str]:
        shutil.copytree(_small_city(), folder / "town")
        inputs.write_scenarios(folder)
        words = "--output", "out", "--frames", 8
        run(folder, "cns_drake", "simulate", f"{name}.yaml", *words)
        rows = _topics(folder / "out" / name)
        return {f"recording-{name}.csv": _csv(rows)}

    return edge


def _topics(folder: Path) -> list[dict[str, object]]:
    """Returns what each topic's messages are, not how they are compressed."""
    digests: dict[str, list] = {}
    (file,) = folder.glob("*.mcap")
    with file.open("rb") as stream:
        for schema, channel, message in make_reader(stream).iter_messages():
            found = digests.setdefault(
                channel.topic, [schema.name, 0, 0, hashlib.sha256()]
            )
            found[1] += 1
            found[3].update(message.log_time.to_bytes(8, "little"))
            if not schema.name.endswith("Image"):  # Else a renderer's pixels.
                found[2] += len(message.data)
                found[3].update(message.data)
    return [
        {
            "recording": folder.name,
            "topic": topic,
            "type": kind,
            "messages": number,
            "bytes": size,
            "sha256": _short(digest),
        }
        for topic, (kind, number, size, digest) in sorted(digests.items())
    ]


@cache
def _city_holder(numpys: str | None) -> tempfile.TemporaryDirectory:
    """Returns the folder in which this process has built the small city.

    `numpys` are the instructions that NumPy may not use.
    """
    holder = tempfile.TemporaryDirectory()
    inputs.write_city(Path(holder.name))
    run(Path(holder.name), "cns_drake", "city", "town")
    return holder


def _small_city() -> Path:
    numpys = os.environ.get("NPY_DISABLE_CPU_FEATURES")
    return Path(_city_holder(numpys).name) / "town"


def city(folder: Path) -> dict[str, str]:
    """Builds the stages of the small city."""
    return {"city.csv": _files(_small_city())}


def kinds(folder: Path) -> dict[str, str]:
    """Builds a city of all archetypes and objects."""
    inputs.write_kinds(folder)
    run(folder, "cns_drake", "city", "kinds")
    return {"kinds.csv": _files(folder / "kinds")}


def age(folder: Path) -> dict[str, str]:
    """Ages the small city by three busy years."""
    shutil.copytree(_small_city(), folder / "town")
    words = "town", "--output", "aged", "--years", 1, 3, "--rate", 4
    run(folder, "cns_drake", "age", *words, "--seed", 5, "--no-pictures")
    return {"age.csv": _files(folder / "aged")}


def imported(
    write: Callable[[Path], None], file: str, *options: object
) -> Callable[[Path], dict[str, str]]:
    """Returns the edge of a town that is imported."""

    def edge(folder: Path) -> dict[str, str]:
        write(folder)
        words = (file, "--output", "town", *options)
        run(folder, "cns_drake", "import", *words)
        name = f"import-{Path(file).stem}.csv"
        return {name: _files(folder / "town")}

    return edge


def _files(folder: Path) -> str:
    """Returns a line for each file of a folder; of pictures only the name.

    Meshes that differ in a number have a line together.
    """
    digests: dict[str, list] = {}
    for path in sorted(folder.rglob("*")):
        if path.is_file():
            name = path.relative_to(folder).as_posix()
            data = b"" if path.suffix in _PICTURES else path.read_bytes()
            if path.suffix == ".obj":
                name = re.sub(r"_(\w?\d+|tile)(_.*)?\.obj", "", name)
            found = digests.setdefault(name, [0, 0, hashlib.sha256()])
            found[0] += 1
            found[1] += len(data)
            found[2].update(path.name.encode() + data)
    rows = [
        {"file": name, "files": number, "bytes": size, "sha256": _short(digest)}
        for name, (number, size, digest) in sorted(digests.items())
    ]
    return _csv(rows)


def _short(digest: "hashlib._Hash") -> str:
    return digest.hexdigest()[:16]


def study(folder: Path) -> dict[str, str]:
    """Studies what missing houses cost, in the small city."""
    shutil.copytree(_small_city(), folder / "town")
    inputs.write_experiment(folder)
    words = "study", "houses.yaml", "--output", "out", "--jobs", 1
    run(folder, "cns_drake", *words)
    return _tables(folder / "out", "study")


def pr(folder: Path) -> dict[str, str]:
    """Recognises places, and prints the numbers of a street in both ways."""
    inputs.write_drives(folder)
    words = "pr", "before", "after", "--method", "scan-context++", "--verified"
    run(folder, "evaluation", *words, "--output", "out")
    inputs.write_streets(folder)
    words = "pr", "old", "new", "--method", "scan-context++"
    tables = _tables(folder / "out", "pr")
    return tables | _printed(folder, "pr", *words, "--tilt-queries", 8)


def tcr(folder: Path) -> dict[str, str]:
    """Measures change, beside a control."""
    inputs.write_drives(folder)
    words = "tcr", "before", "after", "--no-change", "control"
    run(folder, "evaluation", *words, "--output", "out")
    return _tables(folder / "out", "tcr") | _printed(folder, "tcr", *words)


def kitti(folder: Path) -> dict[str, str]:
    """Recognises places between drives in KITTI's layout, aligned first."""
    inputs.write_kitti_drives(folder)
    drives = "sequences/00", "sequences/01"
    words = "--method", "solid", "--output", "out"
    run(folder, "evaluation", "pr", *drives, *words)
    return _tables(folder / "out", "kitti")


def _printed(folder: Path, name: str, *words: object) -> dict[str, str]:
    """Returns what `cns-eval` prints, as text and as JSON."""
    text = run(folder, "evaluation", *words)
    found = json.loads(run(folder, "evaluation", *words, "--json"))
    rows = [{"name": n, "value": v} for n, v in _leaves(found)]
    return {f"{name}.txt": text, f"{name}.json.csv": _csv(rows)}


def _leaves(value: object, name: str = "") -> Iterator[tuple[str, object]]:
    """Yields names and values of what a JSON value consists of."""
    if isinstance(value, dict | list):
        items = value.items() if isinstance(value, dict) else enumerate(value)
        for key, one in items:
            yield from _leaves(one, f"{name}.{key}".lstrip("."))
    else:
        yield name, value


def scan(folder: Path) -> dict[str, str]:
    """Scans a world of each kind, with a mesh of each format."""
    rows = []
    for world in inputs.write_worlds(folder):
        words = world, "--pose", 0, 0, 1.6, 0, 0, 0.1, "--output", "scan.npy"
        run(folder, "cns_drake", "scan", *words)
        points = np.load(folder / "scan.npy")
        digest = _short(hashlib.sha256(points.tobytes()))
        rows.append({"world": world, "points": len(points), "sha256": digest})
    return {"scan.csv": _csv(rows)}


def localise(folder: Path) -> dict[str, str]:
    inputs.write_drives(folder)
    words = "localise", "before", "after", "--method", "gicp", "--jobs", 1
    run(folder, "evaluation", *words, "--output", "out")
    return _tables(folder / "out", "localise")


def map_update(folder: Path) -> dict[str, str]:
    inputs.write_maps(folder)
    words = "map-update", "maps", "--baseline", "distance"
    run(folder, "evaluation", *words, "--output", "out")
    return _tables(folder / "out", "map-update")


def _tables(folder: Path, name: str) -> dict[str, str]:
    """Returns both tables of a folder without what differs each time."""
    found = {}
    for kind in ("results", "queries"):
        with (folder / f"{kind}.csv").open(newline="") as stream:
            reader = csv.DictReader(stream)
            rows = list(reader)
        columns = [c for c in reader.fieldnames or () if c not in _LEFT_OUT]
        found[f"{name}.{kind}.csv"] = _csv(rows, columns)
    return found


def shipped_cities(folder: Path) -> dict[str, str]:
    """Whether the files of the shipped cities are what would be written."""
    cities = "downtown", "metropolis", "riverside", "suburbia"
    for name in (*cities, "stress/metropolis_cleared"):
        run(folder, "cns_drake", "city", WORLDS / name, "--check")
    return {}


EDGES: dict[str, Callable[[Path], dict[str, str]]] = {
    "cns-drake-help": helps("cns_drake", "cns-drake"),
    "cns-eval-help": helps("evaluation", "cns-eval"),
    "recording-plain": recording("plain"),
    "pr": pr,
    "scan": scan,
    "kinds": kinds,
    "import-cityjson": imported(
        inputs.write_blocks_cityjson,
        "blocks.json",
        "--plain",
        "--years",
        1930,
        1980,
    ),
    "import-openstreetmap": imported(inputs.write_quarter_osm, "quarter.osm"),
    "import-opendrive": imported(
        inputs.write_network_opendrive, "network.xodr"
    ),
}
BY_NIGHT: dict[str, Callable[[Path], dict[str, str]]] = {
    "shipped-cities": shipped_cities,
    "city": city,
    "recording-rain_and_traffic": recording("rain_and_traffic"),
    "recording-queues": recording("queues"),
    "recording-ride_and_camera": recording("ride_and_camera"),
    "tcr": tcr,
    "kitti": kitti,
    "localise": localise,
    "map-update": map_update,
    "study": study,
    "age": age,
}


def _csv(rows: list[dict], columns: list[str] | None = None) -> str:
    """Returns rows as text, with their columns or those that are named."""
    stream = io.StringIO()
    names = list(rows[0]) if columns is None else columns
    writer = csv.DictWriter(
        stream, names, extrasaction="ignore", lineterminator="\n"
    )
    writer.writeheader()
    writer.writerows(rows)
    return stream.getvalue()


def differences(name: str, pin: str, now: str) -> list[str]:
    """Returns a line for each difference between a pin and a text of now.

    Rows of tables are found by their key, wherever they stand.
    """
    if not name.endswith(".csv"):
        old, new = pin.splitlines(), now.splitlines()
        return [f"- {line}" for line in old if line not in new] + [
            f"+ {line}" for line in new if line not in old
        ] or (["its lines are in another order"] if old != new else [])
    old_columns, old_rows = _by_key(pin)
    columns, rows = _by_key(now)
    found = [f"- column {c}" for c in old_columns if c not in columns]
    found += [f"+ column {c}" for c in columns if c not in old_columns]
    found += [f"- {' '.join(key)}" for key in old_rows if key not in rows]
    found += [f"+ {' '.join(key)}" for key in rows if key not in old_rows]
    answers: dict[str, list[list[str]]] = {}
    for key, old in old_rows.items():
        if key not in rows:
            continue
        new = rows[key]
        method = old.get("method", "")
        loose = _LOOSE_RESULT if method in _LOOSE else 0.0
        lines = [
            f"{' '.join(key)}: {column}: {old[column]} -> {new[column]}"
            for column in old_columns
            if column in new and not _is_close(old[column], new[column], loose)
        ]
        if method in _LOOSE and "metric" not in old:
            answers.setdefault(method, []).append(lines)
        else:
            found += lines
    for each in answers.values():
        if sum(map(bool, each)) > _LOOSE_ANSWERS * len(each):
            found += [line for lines in each for line in lines]
    return found


# Columns of values; all others are the key of a row.
_VALUES = ("value", "low", "high", "n", "sha256", "bytes", "messages")


def _by_key(text: str) -> tuple[list[str], dict[tuple[str, ...], dict]]:
    """Returns columns, and key -> row.

    A query's key ends with its number, behind which its answer stands.
    """
    reader = csv.DictReader(io.StringIO(text))
    columns = list(reader.fieldnames or ())
    keys = [c for c in columns if c not in _VALUES]
    if "query_frame" in keys:
        keys = keys[: keys.index("query_frame") + 1]
    rows = {tuple(row[c] for c in keys): row for row in reader}
    return columns, rows


def _is_close(old: str, new: str, absolute: float) -> bool:
    if old == new:
        return True
    try:
        numbers = float(old), float(new)
    except ValueError:
        return False
    return math.isclose(*numbers, rel_tol=_RELATIVE, abs_tol=absolute)
