"""How each command and example of the documents is run, on a small town.

A town of five roads, with two stages and two short drives, replaces Metropolis
and Riverside. All differences from the documents are written here.
"""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation
import yaml

from evaluation.drives import open_drive
from helpers.small_cityjson import write_blocks
from helpers.small_map import write_town
from helpers.small_opendrive import straight, write_roads


def _write_sources(folder: Path) -> None:
    write_blocks(folder / "blocks.json")
    write_roads(
        folder / "Town01.xodr",
        straight("1", 0, 0, 150, 0),
        straight("2", 150, 0, 300, 0),
    )
    write_town(folder / "boxes", {"01": "metropolis_01"}, 20)


def _write_own_drives(folder: Path) -> None:
    """Writes the scans of the town's drives as arrays, in UTM coordinates."""
    for stage in ("01", "02"):
        drive = open_drive(folder / f"output/town_{stage}")
        (folder / f"scans_{stage}").mkdir()
        rows = []
        for k, scan in enumerate(drive):
            columns = [scan[name] for name in ("x", "y", "z", "intensity")]
            path = folder / f"scans_{stage}/{k:06d}.npy"
            np.save(path, np.stack(columns, axis=1))
            p_WS = drive.X_WS[k, :3, 3] + [355_000.0, 4_026_000.0, 0.0]
            quat = Rotation.from_matrix(drive.X_WS[k, :3, :3]).as_quat()
            rows.append([1e-9 * drive.stamps_ns[k], *p_WS, *quat])
        np.savetxt(folder / f"poses_{stage}.tum", rows)


@dataclass(frozen=True)
class Recipe:
    """How one piece of a document is run.

    Attributes:
        start: first words of the piece.
        changes: (old, new) texts, applied in order; each old one must occur.
            `{scheduler}` in a new one is the scheduler's address.
        after: names of recipes that make its inputs.
        file: path to save its text; otherwise its lines are run.
        command: run after saving.
        ready: text on stderr after which others may go on, for a command that
            does not end by itself.
        prints: texts on stdout.
        makes: globs of files that exist afterwards.
        prepare: called afterwards with the folder.
        all_methods: whether a study compares all shipped methods.
        by_night: whether it takes too long for each run of the tests.
    """

    start: str
    changes: tuple[tuple[str, str], ...] = ()
    after: tuple[str, ...] = ()
    file: str | None = None
    command: str | None = None
    ready: str | None = None
    prints: tuple[str, ...] = ()
    makes: tuple[str, ...] = ()
    prepare: Callable[[Path], None] | None = None
    all_methods: bool = False
    by_night: bool = False


def shorten_drives(folder: Path) -> None:
    """Shortens drives to two roads, at a high speed, with few beams."""
    first = yaml.safe_load((folder / "town/sequence_01.yaml").read_text())
    for stage in ("01", "02"):
        short = first | {
            "stage": stage,
            "route": first["route"][:2],
            "speeds": {"cruise": 14.0, "longitudinal_acceleration": 8.0},
            "lidars": {"lidar": {"columns": 128}},
            "frames": 40,
        }
        path = folder / f"town/sequence_{stage}.yaml"
        path.write_text(yaml.safe_dump(short))


_FIRST = ("metropolis_01", "town_01")
_LAST = ("metropolis_04", "town_02")
_CITY = ".venv/bin/cns-drake city "

RECIPES = {
    "roads": Recipe(
        "defaults: {lanes:",
        file="town/roads.yaml",
        changes=(("140", "60"), ("110", "50"), ("240", "110"), ("25]", "20]")),
    ),
    "start a city": Recipe(
        _CITY + "town --new",
        after=("roads",),
        makes=(
            "town/city.yaml",
            "town/stages.yaml",
            "town/sequence_0[12].yaml",
            "town/stage_0[12].sdf",
        ),
        prepare=shorten_drives,
    ),
    "own city": Recipe(
        ".venv/bin/cns-drake list town\n",
        changes=(("town_output", "output"),),
        after=("start a city",),
        prints=("town_01", "town_02", "output/town_01: 40 frames"),
        makes=(
            "output/town_0[12]/metadata.yaml",
            "output/town_01_stage_02/metadata.yaml",
            "output/report/index.html",
            "output/pages/town_01.html",
            "town.html",
        ),
        prepare=_write_own_drives,
    ),
    "imported scenario": Recipe(
        'map: .\nstage: "01"',
        file="imported.yaml",
        # Inputs that a reader has from elsewhere.
        prepare=_write_sources,
    ),
    "imports": Recipe(
        ".venv/bin/cns-drake import delft",
        changes=(
            ("delft.city.jsonl --years 1930", "blocks.json --years 1930"),
            (
                "reproduce delft --output",
                "simulate delft/sequence_01.yaml --frames 2 --output",
            ),
        ),
        after=("imported scenario",),
        prints=("stage 02 (1970)", "drive b", "delft_04"),
        makes=("delft/from_above.png", "study/delft_01/metadata.yaml"),
    ),
    "imported roads": Recipe(
        ".venv/bin/cns-drake import Town01.xodr",
        changes=(
            (
                "reproduce town01 --output",
                "simulate town01/sequence_01.yaml --frames 2 --output",
            ),
        ),
        after=("imported scenario",),
        prints=("drive a", "stage 02"),
        makes=("town01/from_above.png", "study/town01_01/metadata.yaml"),
    ),
    "study of an own city": Recipe(
        ".venv/bin/cns-drake study stages town --quick",
        # The other tasks are those of the recipe study.
        changes=(("--quick", "--quick --task change"),),
        after=("repair stages",),
        makes=("town_change/results.csv",),
        by_night=True,
    ),
    "repair stages": Recipe(
        _CITY + "town --repair-stages",
        after=("start a city",),
    ),
    "a city anew": Recipe(
        _CITY + "worlds/metropolis",
        changes=(("worlds/metropolis", "town"),),
        after=("start a city",),
    ),
    "reproduce": Recipe(
        ".venv/bin/cns-drake reproduce metropolis --output output",
        changes=(("reproduce metropolis", "reproduce town"),),
        after=("own city",),
        all_methods=True,
    ),
    "reproduce all": Recipe(
        "cns-drake reproduce --output output",
        changes=(("reproduce", "reproduce town"),),
        after=("own city",),
        all_methods=True,
    ),
    "diagram script": Recipe(
        ".venv/bin/python diagrams/metropolis_01.py",
        changes=(
            ("--frames 200", "--frames 2"),
            ("metropolis_01", "suburbia_01"),
            # The page of a whole city takes as long as all the rest.
            (" --recording suburbia_01.html", ""),
        ),
        makes=(
            "recordings/suburbia_01/metadata.yaml",
            "recordings/suburbia_01/suburbia_01_0.mcap",
        ),
        by_night=True,
    ),
    "evaluation": Recipe(
        ".venv/bin/cns-eval tcr output/metropolis_01",
        changes=(_FIRST, _LAST, ("stage_04", "stage_02")),
        after=("own city",),
        prints=("TCR_sym of only the routes", "AUC"),
    ),
    "odometry": Recipe(
        "base: metropolis_04\nimu:",
        file="odometry.yaml",
        changes=(
            ("metropolis_04", "town/sequence_02.yaml"),
            ("vehicles: 20}", "vehicles: 4}}\nframes: 20"),
        ),
    ),
    "odometry drive": Recipe(
        ".venv/bin/cns-drake simulate odometry.yaml",
        after=("odometry", "start a city"),
        prints=("output/odometry: 20 frames",),
    ),
    "KISS-ICP settings": Recipe("mapping: {voxel_size", file="kiss.yaml"),
    "KISS-ICP": Recipe(
        "kiss_icp_pipeline output/odometry",
        changes=(("\nevo_ape", "\n# evo_ape"),),  # A program of its own.
        after=("KISS-ICP settings", "odometry drive"),
        prints=("truth/odometry",),
        makes=("results/latest/odometry_poses_tum.txt",),
        by_night=True,
    ),
    "RKO-LIO settings": Recipe("voxel_size: 2.0\n", file="rko.yaml"),
    "films": Recipe(
        ".venv/bin/cns-drake film metropolis_01 --output film.webp",
        changes=(
            ("metropolis_01", "town/sequence_01.yaml --size 64x36"),
            (" film.webp", " film.webp --seconds 1 --traffic 0"),
            ("metropolis_04", "town/sequence_02.yaml --size 64x36"),
            ("71 --seconds 8", "1 --seconds 1 --traffic 0"),
            ("docs/pictures/drive.webp", "drive.webp"),
        ),
        after=("own city",),
        makes=("film.webp", "drive.webp"),
        by_night=True,
    ),
    "scores": Recipe(
        ".venv/bin/cns-eval scores kitti",
        changes=(("sequences/04", "sequences/02"),),
        after=("exports",),
        makes=("scores.csv",),
    ),
    "table of an entrant": Recipe("experiment,map,database", file="mine.csv"),
    "compare": Recipe(
        ".venv/bin/cns-eval compare mine.csv",
        after=("table of an entrant",),
        prints=("mine ", "layered-overlap "),
    ),
    "compare shipped tables": Recipe(
        ".venv/bin/cns-eval compare --metric relative_auc_strict",
        prints=("layered-overlap, loss in 12 cities ", "survives"),
    ),
    "figure of a comparison": Recipe(
        ".venv/bin/cns-eval compare --output survival.pdf",
        makes=("survival.pdf",),
    ),
    "figure in Python": Recipe(
        "from pathlib import Path\n\nfrom evaluation import PrintStyle",
        changes=(('"results.csv"', '"mine.csv"'),),
        after=("table of an entrant",),
        file="figure.py",
        command=".venv/bin/python figure.py",
        makes=("matrix.pdf",),
    ),
    "means of a table": Recipe(
        "from pathlib import Path\n\nfrom evaluation import Results, means",
        changes=(('"results.csv"', '"mine.csv"'),),
        after=("table of an entrant",),
        file="means.py",
        command=".venv/bin/python means.py",
        prints=("('mine', False) 0.895",),
    ),
    "Python": Recipe(
        "from evaluation import open_drive\n",
        changes=(_LAST,),
        after=("own city",),
        file="read.py",
        command=".venv/bin/python read.py",
        prints=("1700000001500000000", "'tree_"),
    ),
    "own diagram": Recipe(
        "import numpy as np\nfrom pydrake",
        file="own_diagram.py",
        command=".venv/bin/python own_diagram.py",
        prints=("the nearest 7.90 m ahead",),
    ),
    "exports": Recipe(
        ".venv/bin/cns-drake export output/metropolis_04 --format cns",
        changes=(_FIRST, _LAST),
        after=("own city",),
        makes=(
            "cns/Town/02/gt.csv",
            "cns/Town/02/imu.csv",
            "cns/Town/02/pcd/1700000000000000000.pcd",
            "cns/transformation_lidar.yaml",
            "cns/transformation_imu.yaml",
            "cns/export.yaml",
            "kitti/sequences/02/velodyne/000000.bin",
            "kitti/sequences/02/labels/000000.label",
            "kitti/sequences/02/times.txt",
            "kitti/sequences/02/calib.txt",
            "kitti/sequences/02/first_pose.txt",
            "kitti/sequences/02/poses.txt",
            "kitti/poses/02.txt",
            "mulran/town_02/global_pose.csv",
            "tum/town_02/base_link.tum",
            "tum/town_02/lidar.tum",
            "changed/sequences/02/labels/000000.label",
        ),
    ),
    "scenario": Recipe("map: town ", file="drive.yaml"),
    "drive": Recipe(
        ".venv/bin/cns-drake simulate drive.yaml",
        changes=(("--output", "--frames 2 --output"),),
        after=("scenario", "start a city"),
        prints=("recordings/drive: 2 frames",),
    ),
    "scenario with a base": Recipe(
        "base: riverside_01  # has all",
        file="rough.yaml",
        changes=(
            ("riverside_01", "town/sequence_01.yaml"),
            ("frames: 200", "frames: 2"),
        ),
    ),
    "drive with a base": Recipe(
        ".venv/bin/cns-drake simulate rough.yaml",
        after=("scenario with a base", "start a city"),
        prints=("recordings/rough: 2 frames",),
    ),
    "drive with a camera": Recipe(
        ".venv/bin/cns-drake simulate riverside_01 --camera",
        changes=(
            ("riverside_01", "town/sequence_01.yaml"),
            ("640x480", "64x48"),
            ("--frames 41", "--frames 2"),
        ),
        after=("start a city",),
        prints=("pictures/town_01: 2 frames",),
    ),
    "scenario with a camera": Recipe(
        "base: riverside_01\ncameras", file="c.yaml"
    ),
    "drive with options": Recipe(
        ".venv/bin/cns-drake simulate riverside_01 --ride A",
        changes=(
            ("riverside_01", "town/sequence_01.yaml"),
            ("--output", "--frames 2 --output"),
        ),
        after=("start a city",),
        prints=("recordings/town_01: 2 frames",),
    ),
    "first drive": Recipe(
        ".venv/bin/cns-drake simulate riverside_01 --frames 200",
        changes=(
            ("--frames 200", "--frames 2"),
            ("riverside_01", "town/sequence_01.yaml"),
        ),
        after=("start a city",),
        prints=("tutorial/town_01: 2 frames",),
        makes=("tutorial.html",),
    ),
    "a look first": Recipe(
        "python3 -m venv .venv && .venv/bin/pip install ./evaluation .\n",
        changes=(
            (
                "python3 -m venv .venv && "
                ".venv/bin/pip install ./evaluation .\n",
                "",
            ),
            ("--frames 200", "--frames 2"),
            ("riverside_01", "town/sequence_01.yaml"),
        ),
        after=("start a city",),
        prints=("first/town_01: 2 frames",),
        makes=("drive.html",),
    ),
    "a first scan": Recipe(
        "from matplotlib import pyplot as plt\n\nfrom evaluation",
        changes=(("riverside_01", "town_01"), ("100", "1")),
        after=("a look first",),
        file="scan.py",
        command=".venv/bin/python scan.py",
        makes=("scan.png",),
    ),
    "decay": Recipe(
        "maps: riverside\ndrives: stages",
        changes=(
            ("riverside", "town"),
            ("0, 0.3, 0.6", "0, 0.6"),
            ("[place, change]", "[place]"),
        ),
        file="decay.yaml",
    ),
    "first finding": Recipe(
        ".venv/bin/cns-drake study decay.yaml",
        after=("decay", "start a city"),
        prints=("decay/index.html",),
        makes=("decay/results.csv",),
    ),
    "tutorial's study": Recipe(
        "cns-drake reproduce riverside --output output",
        changes=(("reproduce riverside", "reproduce town"),),
        after=("own city",),
        all_methods=True,
    ),
    "data sheet": Recipe(
        "rings_deg: [[10.0, -10.0, 48]]\ncolumns: 512", file="unit.yaml"
    ),
    "another unit": Recipe(
        ".venv/bin/cns-drake simulate riverside_01 --lidar unit.yaml",
        changes=(
            ("--frames 100", "--frames 2"),
            ("riverside_01", "town/sequence_01.yaml"),
        ),
        after=("start a city", "data sheet"),
        prints=("mine/town_01: 2 frames",),
    ),
    "two units": Recipe(
        "world: town/stage_02.sdf\nwaypoints: tour.csv\nspeeds: {cruise: 8}\n",
        file="sensors.yaml",
        command=".venv/bin/cns-drake simulate sensors.yaml --frames 2 "
        "--output sensors",
        after=("waypoints", "start a city", "data sheet"),
        prints=("sensors/sensors: 2 frames",),
    ),
    "units as a factor": Recipe(
        "maps: [riverside]\nquery:\n  lidars:", file="units.yaml"
    ),
    "own beams": Recipe(
        "import numpy as np\n\nfrom cns_drake import SpinningPattern",
        file="beams.py",
        command=".venv/bin/python beams.py",
        prints=("8 rings, 5760 beams per revolution",),
    ),
    "noise of an IMU": Recipe("accelerometer_noise_density", file="imu.yaml"),
    "scenario of a world": Recipe(
        "world: town/stage_02.sdf\nwaypoints: tour.csv\nspeeds: {cruise: 8, ",
        file="tour.yaml",
    ),
    "waypoints": Recipe("x,y", file="tour.csv"),
    "tour": Recipe(
        ".venv/bin/cns-drake simulate tour.yaml",
        changes=(("--output", "--frames 2 --output"),),
        after=("scenario of a world", "waypoints", "start a city"),
        prints=("recordings/tour: 2 frames",),
    ),
    "scans": Recipe(
        ".venv/bin/cns-drake scan town",
        changes=(("--pose 200", "--pose 90"),),
        after=("start a city",),
        prints=("before.pcd: ", "after.pcd: ", "TCR_sym"),
        makes=("before.pcd", "after.pcd"),
    ),
    "varied drives": Recipe(
        "drives: stages          # riverside_01",
        changes=(
            ("maps: riverside", "maps: town"),
            ("count: 20", "count: 2"),
            ("0, 1, 2", "0"),
        ),
        file="vary.yaml",
    ),
    "recording varied drives": Recipe(
        ".venv/bin/cns-drake generate --vary vary.yaml",
        changes=(
            ("--vary", "--frames 40 --vary"),
            ("riverside_01", "town_01"),
            ("riverside_02", "town_02"),
        ),
        after=("varied drives", "start a city"),
        prints=("varied/town_01_missing_0p6_0", "AUC"),
        makes=("varied/scenarios/town_01_missing_0p6_0.yaml",),
    ),
    "trend": Recipe(
        ".venv/bin/cns-drake study trend --output",
        changes=(
            (
                "study trend",
                "study trend town --set database.city.missing=[0,0.6]"
                " --set seeds=0",
            ),
        ),
        after=("start a city",),
        prints=("trend/index.html",),
        makes=("trend/results.csv",),
    ),
    "study of redrawn cities": Recipe(
        ".venv/bin/cns-drake study redrawn.yaml",
        changes=(("--output", "--method solid --output"),),
        after=("redrawn cities", "start a city"),
        prints=("random/index.html",),
    ),
    "experiments": Recipe(
        ".venv/bin/cns-drake study --list",
        prints=("map-pairs", "cases:"),
    ),
    "season and age": Recipe(
        "name: season-and-age",
        changes=(
            ("[suburbia, riverside]", "town"),
            ("[1, 2, 3]", "[1]"),
            ("leaves: [1.0, 0.0]", "leaves: [1.0]"),
        ),
        file="season_and_age.yaml",
    ),
    "study": Recipe(
        ".venv/bin/cns-drake study season_and_age.yaml",
        after=("season and age", "start a city"),
        prints=("seasons/index.html",),
        makes=("seasons/results.csv", "seasons/queries.csv"),
    ),
    "study in pandas": Recipe(
        "import pandas as pd",
        after=("study",),
        file="seasons.py",
        command=".venv/bin/python seasons.py",
        makes=("seasons.png",),
        by_night=True,
    ),
    "study of recordings": Recipe(
        ".venv/bin/cns-drake study stages output",
        after=("own city",),
        prints=("recorded/index.html",),
        makes=("recorded/results.csv",),
    ),
    "cases": Recipe(
        "about: What do leaves and snow cost",
        changes=(("suburbia", "town"),),
        file="winter.yaml",
    ),
    "sessions": Recipe(
        "name: how-many-drives",
        changes=(("suburbia", "town"),),
        file="how_many_drives.yaml",
    ),
    "fleet": Recipe(
        "name: fleet",
        changes=(("suburbia", "town"),),
        file="fleet.yaml",
    ),
    "ladder": Recipe(
        ".venv/bin/cns-drake study ladder metropolis",
        # All causes of the ladder take many minutes.
        changes=(("ladder metropolis --quick", "winter.yaml"),),
        after=("cases", "start a city"),
        prints=("ladder/index.html",),
        makes=("ladder/results.csv",),
    ),
    "age": Recipe(
        ".venv/bin/cns-drake age suburbia",
        changes=(
            ("age suburbia", "age town"),
            ("1 5 20", "1 2 --no-pictures"),
        ),
        after=("start a city",),
        makes=("old_suburbia/history.csv", "old_suburbia/rates.csv"),
    ),
    "years": Recipe(
        ".venv/bin/cns-drake study years suburbia",
        changes=(
            ("suburbia --quick", "town --quick --set query.city.years=[0,20]"),
        ),
        after=("start a city",),
        prints=("years/index.html",),
        makes=("years/results.csv",),
    ),
    "aged drive": Recipe(
        ".venv/bin/cns-drake simulate suburbia_02 --set city.years=20",
        changes=(
            ("suburbia_02", "town/sequence_02.yaml"),
            ("years=20", "years=2 --frames 3"),
        ),
        after=("start a city",),
        makes=("aged/town_02/metadata.yaml", "aged.html"),
    ),
    "help: age": Recipe(
        "cns-drake age suburbia",
        changes=(
            ("age suburbia", "age town"),
            ("1 5 20", "1"),
            ("old_suburbia", "pictured"),
        ),
        after=("start a city",),
        makes=("pictured/history.csv", "pictured/pictures/film.jpg"),
    ),
    "scattered losses": Recipe(
        ".venv/bin/cns-drake generate --vary worlds/downtown/hard",
        changes=(
            ("worlds/downtown/hard.yaml", "vary.yaml --frames 40"),
            ("downtown_01_1", "town_01_missing_0p6_0"),
            ("downtown_04_1", "town_02"),
        ),
        after=("varied drives", "start a city"),
        prints=("hard/town_02", "AUC"),
    ),
    "cleared map": Recipe(
        ".venv/bin/cns-drake reproduce metropolis_cleared --output cleared",
        changes=(("reproduce metropolis_cleared", "reproduce town"),),
        after=("own city",),
        all_methods=True,
    ),
    "redrawn cities": Recipe(
        "both: {city: {redraw: [1, 2, 3]}}\nmaps: riverside",
        changes=(("riverside", "town"), ("1, 2, 3", "1, 2")),
        file="redrawn.yaml",
    ),
    "drives through redrawn cities": Recipe(
        ".venv/bin/cns-drake generate --vary redrawn.yaml",
        changes=(("--vary", "--frames 3 --vary"),),
        after=("redrawn cities", "start a city"),
        prints=("redrawn/town_02_",),
        makes=("redrawn/cities/town_c1/stage_*.sdf",),
    ),
    "scheduler": Recipe(
        ".venv/bin/dask scheduler",
        changes=(("scheduler", "scheduler --host 127.0.0.1 --port 0"),),
        ready=r"Scheduler at: +(?P<scheduler>tcp://\S+)",
    ),
    "workers": Recipe(
        ".venv/bin/dask worker",
        changes=(
            ("tcp://head:8786", "{scheduler}"),
            ("--nworkers 8", "--nworkers 1"),
        ),
        after=("scheduler",),
        ready="Registered to",
    ),
    "cluster": Recipe(
        ".venv/bin/cns-drake generate --output /shared",
        changes=(
            ("generate", "generate tour.yaml --frames 2"),
            ("/shared/output", "shared"),
            ("tcp://head:8786", "{scheduler}"),
        ),
        after=("workers", "scenario of a world", "waypoints", "start a city"),
        prints=("shared/tour",),
        makes=("shared/tour/metadata.yaml",),
    ),
    "Slurm": Recipe(
        "#!/bin/bash",
        changes=(
            ("tcp://$(hostname):8786", "{scheduler}"),
            (".venv/bin/dask scheduler --port 8786", "sleep 0"),
            ("srun ", ""),
            ("--vary vary.yaml", "tour.yaml --frames 2"),
            ("output output", "output slurm"),
        ),
        after=(
            "scheduler",
            "scenario of a world",
            "waypoints",
            "start a city",
        ),
        file="cluster.sh",
        command=".venv/bin/dask --version && bash cluster.sh",
        makes=("slurm/tour/metadata.yaml",),
    ),
    "method": Recipe(
        "import numpy as np\n\nfrom evaluation.methods", file="heights.py"
    ),
    # What becomes of it in tables and pages: test_metric_family.
    "own metric": Recipe(
        "import numpy as np\n\nfrom evaluation import register_metric",
        file="ranks.py",
        command=".venv/bin/python ranks.py",
    ),
    "score matrix": Recipe(
        "import numpy as np\n\nfrom evaluation import (",
        # A program that knows how far each place is away is always right.
        changes=(_FIRST, _LAST, ('np.load("scores.npy")', "-distances")),
        after=("own city",),
        file="scored.py",
        command=".venv/bin/python scored.py",
        prints=("1.0 Interval(low=", ")\n1.0 1.0"),
    ),
    "linter": Recipe(
        ".venv/bin/ruff check",
        # Type-checks the examples of the documents by the rules of this
        # project.
        after=("method", "Python", "own diagram", "own beams"),
        prints=("All checks passed!", "already formatted"),
    ),
    "own method, check": Recipe(
        "from evaluation import check_method",
        after=("method",),
        file="check_heights.py",
        command=".venv/bin/python check_heights.py",
    ),
    "own method in Python": Recipe(
        "from evaluation import recognise",
        changes=(_FIRST, _LAST),
        after=("method", "own city"),
        file="recognise_heights.py",
        command=".venv/bin/python recognise_heights.py",
    ),
    "recognise": Recipe(
        "from evaluation import open_drive, recognise",
        changes=(_FIRST, _LAST),
        after=("own city",),
        file="recognise.py",
        command=".venv/bin/python recognise.py",
        prints=("Interval(low=",),
    ),
    "own method": Recipe(
        ".venv/bin/cns-eval pr output/metropolis_01",
        changes=(_FIRST, _LAST),
        after=("method", "own city"),
        prints=("heights", "AUC"),
    ),
    "own method in a study": Recipe(
        ".venv/bin/cns-drake study ladder suburbia --quick --method",
        changes=(
            ("ladder suburbia --quick", "decay.yaml"),
            ("ring++", "solid"),
        ),
        after=("method", "decay", "start a city"),
        prints=("mine/index.html",),
    ),
    "overlap": Recipe(
        ".venv/bin/cns-eval pr --truth",
        changes=(_FIRST, _LAST),
        after=("own city",),
        prints=("a match shows 50% of the query's scan",),
        makes=("overlaps.csv",),
    ),
    "exact overlap": Recipe(
        ".venv/bin/cns-drake truth metropolis_01 metropolis_04 --format",
        changes=(
            (
                "metropolis_01 metropolis_04",
                "town/sequence_01.yaml town/sequence_02.yaml",
            ),
        ),
        after=("own city",),
        prints=("exact/overlaps.csv",),
        makes=("exact/overlaps.csv",),
    ),
    "localisation": Recipe(
        ".venv/bin/cns-eval localise output/metropolis_01 "
        "output/metropolis_04 --method gicp --start",
        changes=(_FIRST, _LAST),
        after=("own city",),
        prints=("within 0.3 m and 1 deg",),
        makes=("localisation/localisation.csv",),
    ),
    "home: place recognition": Recipe(
        ".venv/bin/cns-drake reproduce suburbia --output output",
        changes=(("reproduce suburbia", "reproduce town"),),
        after=("own city",),
        all_methods=True,
    ),
    "home: localisation": Recipe(
        ".venv/bin/cns-eval localise output/suburbia_01 "
        "output/suburbia_02 --method gicp --track",
        changes=(
            ("suburbia_01", "town_01"),
            ("suburbia_02", "town_02"),
            ("output localisation", "output tracked"),
        ),
        after=("own city",),
        makes=("tracked/track.png",),
    ),
    "pairs": Recipe(
        ".venv/bin/cns-drake pairs riverside_01 riverside_02 --output",
        changes=(
            (
                "riverside_01 riverside_02",
                "town/sequence_01.yaml town/sequence_02.yaml",
            ),
        ),
        after=("own city",),
        prints=("pairs/training_queries_baseline2.pickle",),
        makes=("pairs/runs/town_0[12]/000000.bin",),
    ),
    "map truth": Recipe(
        ".venv/bin/cns-drake truth metropolis_01 metropolis_04 --output",
        changes=(
            (
                "metropolis_01 metropolis_04",
                "town/sequence_01.yaml town/sequence_02.yaml --spacing 20",
            ),
        ),
        after=("own city",),
        prints=("maps",),
        makes=("maps/A/truth.npy", "maps/index.html"),
    ),
    "map update": Recipe(
        ".venv/bin/cns-eval map-update",
        after=("map truth",),
        prints=("mean IoU", "by structure"),
    ),
    "map sessions": Recipe(
        ".venv/bin/cns-drake export output/metropolis_01 "
        "output/metropolis_04 --format map-sessions",
        changes=(_FIRST, _LAST),
        after=("own city",),
        prints=("two_sessions",),
        makes=("two_sessions/A/map.ply",),
    ),
    "own data": Recipe(
        ".venv/bin/cns-eval tcr kitti",
        changes=(("sequences/04", "sequences/02"),),
        after=("exports",),
        prints=("TCR_sym", "ring++"),
    ),
    "own scans and poses": Recipe(
        "from pathlib import Path\n\nimport numpy as np\nfrom scipy.spatial",
        after=("own city",),
        file="convert.py",
        command=".venv/bin/python convert.py",
        makes=("mine/sequences/0[12]/velodyne/000039.bin",),
    ),
    "own scans, check": Recipe(
        "from evaluation import check_data_set",
        after=("own scans and poses",),
        file="check_drives.py",
        command=".venv/bin/python check_drives.py",
    ),
    "own scans, pairs": Recipe(
        ".venv/bin/cns-eval pr mine/sequences/01 mine",
        after=("own scans and poses",),
        prints=("AUC", "AUROC"),
    ),
    "own scans, report": Recipe(
        ".venv/bin/cns-eval report mine",
        after=("own scans and poses",),
        prints=("my_report/index.html", "my_study/index.html"),
        all_methods=True,
    ),
}

_LISTED = "film city import list simulate generate scan export pairs truth"
# Pieces that cannot run here: first words, of one or several -> reason.
NOT_RUN: dict[str | tuple[str, ...], str] = {
    ("pip install", ".venv/bin/pip install"): "installs from the network; "
    "test_plugins and `.ci/run` install what others do not",
    "pip uninstall": "takes away what the tests test, or test_plugins does it",
    ".venv/bin/python -m pytest": "tests in a test; `.ci/run` runs all of them",
    tuple(f"cns-drake {word}" for word in _LISTED.split()): (
        "a list of commands; recipes run them on a small city"
    ),
    "cns-drake reproduce metropolis": "in that list; the recipe reproduce",
    ("cns-drake study", ".venv/bin/cns-drake study docs/examples"): (
        "takes from minutes to hours in shipped cities"
    ),
    "cns-drake train": "needs an extra, and minutes; test_training trains",
    "cns-eval ": "a list of commands; recipes run them on small drives",
    ".venv/bin/cns-eval pr --method": "needs PyTorch, or weights that do not "
    "ship; test_own_methods and test_bevplace have some of their own",
    ".venv/bin/cns-eval pr data/": "needs scans that cannot be shipped",
    ".venv/bin/python docs/reference_pages.py": "writes into this project; "
    "test_fields compares the pages with what is there",
    ".venv/bin/python docs/fill_numbers.py": "writes into this project; "
    "test_numbers compares the pages with their files",
    ".venv/bin/python tests/edges/refresh.py": "writes into this project; "
    "test_edges compares the pins with what the programs do",
    ".venv/bin/python docs/draw.py": "writes into this project; test_pictures "
    "compares the pictures with their data",
    "name: my-sessions": "needs recordings of a user; test_recorded_studies "
    "has some",
    "python3 -m venv .venv\n": "installs from the network; test_wheel installs "
    "the same",
    "python3 -m venv .venv && .venv/bin/pip install -e": "installs from the "
    "network and runs these tests; `.ci/run` takes this very line",
    "python3 -m venv .venv && .venv/bin/pip install ./evaluation . &&": (
        "installs from the network; `.ci/run` installs the wheels"
    ),
    "apt install": "changes the system; `.ci/run` installs the same packages",
    ".venv/bin/cns-drake simulate suburbia_01 --frames 200": (
        "simulates a shipped city for minutes; the workflow `site.yml` runs it"
    ),
    "[build-system]\nrequires": "test_plugins installs it",
    "import numpy as np\n\nfrom evaluation import DataSet": (
        "test_plugins installs it"
    ),
    ".ci/oldest": "installs from the network; the workflow runs it",
    "rko_lio output/odometry": "test_rko_lio runs it in its own environment",
    "npm ci": "installs from the network; `.ci/run` does it",
    ".venv/bin/mypy && .venv/bin/lint-imports": (
        "these read this project, not an example; `.ci/run` runs them"
    ),
    "mcap recover": "a program of others",
    "ros2 bag": "needs ROS 2; test_mcap_recorder and others read "
    "recordings with rosbags' reader of rosbag2 folders",
    ".venv/bin/cns-drake study ladder suburbia --quick --output": "measures "
    "20 causes, for many minutes; the recipe ladder has fewer",
    ".venv/bin/cns-drake study map-pairs": "ages and surveys a whole city, for "
    "minutes; the recipe map truth has a small one",
    ".venv/bin/cns-drake study trend --set": "measures 58 versions of a "
    "shipped city; the recipe trend has two of a small one",
    ".venv/bin/cns-drake study fresh": "draws shipped cities and drives "
    "through them, for many minutes; test_fresh_cities draws a small one",
    "netconvert --osm-files": "SUMO, and a file that is not shipped",
    ".venv/bin/cns-drake simulate neukolln": "needs the trace; "
    "test_scenario_traffic has one in degrees",
    ".venv/bin/cns-drake study stages --method heights.py": "drives through "
    "shipped cities, for an hour",
    ".venv/bin/cns-drake study stages --task place --method bevplace": "needs "
    "weights, too",
    ".venv/bin/cns-drake study ladder suburbia --quick --task": "needs "
    "weights, too",
    "import numpy as np, torch": "needs PyTorch and these weights, too",
    ".venv/bin/cns-drake train": "needs that extra, too",
    "import pickle": "needs a trainer's class; test_pair_export has it",
    "python -m pydrake.visualization.meldis": "a server, which does not end; "
    "test_example_diagrams runs the scenario",
    ".venv/bin/python diagrams/hardware_scenario.py": "runs in real time; "
    "test_example_diagrams runs it, too",
    ".venv/bin/cns-drake truth suburbia_01": "drives through a shipped city, "
    "for minutes",
    ".venv/bin/cns-eval report data/CNS": "needs the authors' drives; "
    "test_recorded_study has some in their layout",
    ".venv/bin/cns-eval tcr data/MulRan": "needs data sets that cannot be "
    "shipped",
    ".venv/bin/python tests/benchmarks/real_or_simulated.py": "likewise",
    "evo_rpe tum": "a program of its own",
    "lidars: typing.Mapping": "lines of an example of Drake's",
    "for _, lidar in scenario": "likewise",
    "@misc{song2025city": "a citation",
}
