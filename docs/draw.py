"""Draws the pictures of these pages.

python docs/draw.py            lists those that are older than their data
python docs/draw.py NAME ...   draws these, and notes what they show

`docs/pictures.yaml` has a function of this file for each picture, or a command,
and the files that it shows. Commands run in the root of the repository; what
they made before is taken as it is.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
import csv
import hashlib
import io
import itertools
from pathlib import Path
import re
import subprocess
import sys
import tempfile
from types import SimpleNamespace
from typing import Any

from matplotlib import rc_context
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
import numpy as np
from PIL import Image, ImageDraw, ImageFont
from scipy.signal import welch
from scipy.spatial import cKDTree
import yaml

from cns_drake import Scenario, load_scenario, make_station
from cns_drake.ageing.aged_pictures import air_view
from cns_drake.motion.road_profile import RoadProfile
from cns_drake.pictures.aerial_pictures import draw_drives
from cns_drake.pictures.camera_views import View, load_views
from cns_drake.pictures.stage_pictures import draw_stages
from cns_drake.pictures.stage_scene import StageScene
from cns_drake.scenarios.planning import plan_drive
from cns_drake.scenarios.shipped import shipped_maps
from cns_drake.scene.map_folder import MapFolder
from cns_drake.scene.semantics import CLASS_IDS
from cns_drake.sensors.camera.config import CameraSection
from cns_drake.sensors.imu.noise import ImuErrors, ImuNoise
from cns_drake.sensors.lidar.config import WeatherConfig
from evaluation.map_update.labels import Label
from evaluation.map_update.sessions import read_session
from evaluation.methods.layered_overlap import (
    LayeredOverlap,
    LayeredOverlapConfig,
)
from evaluation.report import point_rendering
from evaluation.results.charts.kinds import draw_chart
from evaluation.results.figure_text import name_lines
from evaluation.results.headlines import SURVIVES, listed, survivors
from evaluation.results.keys import OWN, STAGE
from evaluation.results.ranking import rank_methods
from evaluation.results.styles import (
    GONE,
    INK,
    METHOD_STYLES,
    NEW,
    PALE,
    unit_rgb,
)
from evaluation.results.table import Results, Row
from evaluation.results.table_forms import title

# The methods that this project made; all others are published ones.
OURS = {"layered-overlap", "learned"}
ROOT = Path(__file__).resolve().parents[1]
PICTURES = ROOT / "docs/pictures"
REGISTRY = ROOT / "docs/pictures.yaml"
# What a picture of a shipped city shows.
_CITY = ("stage_*.sdf", "meshes/*", "sequence_*.yaml")
# Charts are this wide [inches], and shown 830, 700 or 390 pixels wide.
_WIDTH = 7.0
_FONT = {"font.size": 13, "axes.titlesize": "medium", "svg.hashsalt": "cns"}
_DPI = 160
# Size of a camera's view [pixels].
_TILE = (704, 396)


def digest(data: Sequence[str]) -> str:
    """Returns the digest of data: names of cities, or patterns of files.

    Of a page, only its tables count.
    """
    whole = hashlib.sha256()
    for name in data:
        patterns = [f"worlds/{name}/{part}" for part in _CITY]
        for pattern in [name] if "/" in name else patterns:
            paths = sorted(ROOT.glob(pattern))
            if not paths:
                raise FileNotFoundError(pattern)
            for path in paths:
                content = path.read_bytes()
                if path.suffix == ".md":
                    content = b"".join(re.findall(rb"(?m)^\|.*", content))
                head = f"{path.relative_to(ROOT)} {len(content)}\n"
                whole.update(head.encode() + content)
    return whole.hexdigest()[:12]


def stale() -> list[str]:
    """Returns a line for each picture that is older than its data."""
    return [
        f"{name} is older than {', '.join(entry['data'])}: "
        f"run .venv/bin/python docs/draw.py {name}"
        for name, entry in yaml.safe_load(REGISTRY.read_text()).items()
        if entry["digest"] != digest(entry["data"])
    ]


def main(names: Sequence[str]) -> None:
    """Draws pictures, or lists the stale ones."""
    if not names:
        print("\n".join(stale()) or "all pictures show their data")
    for name in names:
        entry = yaml.safe_load(REGISTRY.read_text())[name]
        data, made = entry.pop("data"), entry.pop("digest")
        command, draw = entry.pop("command", None), entry.pop("draw", None)
        if command and not (ROOT / entry.get("file", " ")).exists():
            subprocess.run(command, shell=True, check=True, cwd=ROOT)
        if draw:
            with rc_context(_FONT):
                globals()[draw](PICTURES / name, **entry)
        head, mark, rest = REGISTRY.read_text().partition(f"\n{name}:")
        rest = rest.replace(f"digest: {made}", f"digest: {digest(data)}", 1)
        REGISTRY.write_text(head + mark + rest)


# Charts.


def survival(path: Path) -> str:
    """Draws what methods retain of their AUC strict; returns the title.

    Cities are the units: a point is the mean over a city's pairs, and a bar is
    the 95 % t interval over the cities.
    """
    rows = kept_rows()
    # The best method without geometric verification is on top.
    ranked = {gate: rank_methods(rows[gate])[0] for gate in rows}
    order = [one.method for one in ranked[False]][::-1]
    figure = Figure(figsize=(_WIDTH, 5.4), layout="constrained")
    panels = figure.subplots(1, 2, sharey=True)
    for axes, gate in zip(panels, (False, True), strict=True):
        for one in ranked[gate]:
            y = order.index(one.method)
            colour = METHOD_STYLES[one.method][0]
            ends = 100.0 * np.array([one.interval.low, one.interval.high])
            axes.plot(ends, [y, y], color=INK, lw=2, zorder=2)
            axes.plot(100.0 * one.value, y, "|", color=INK, ms=18, mew=3.5)
            for city, (marker, _) in _CITY_MARKERS.items():
                some = [
                    row.value
                    for row in rows[gate]
                    if (row.map, row.method) == (city, one.method)
                ]
                at = 100.0 * np.mean(some)
                axes.plot(at, y, marker, mec="white", mfc=colour, ms=9)
        axes.axvline(100.0 * SURVIVES, color=INK, lw=1, ls=":", zorder=0)
        axes.axvline(100.0, color=PALE, lw=1, zorder=0)
        axes.set_xlim(-4.0, 119.0)
        axes.set_xlabel("retained AUC strict [%]")
        verified = "with" if gate else "without"
        axes.set_title(f"{verified} verification", loc="left")
        _plain(axes)
    names = [f"{title(n)}*" if n in OURS else title(n) for n in order]
    panels[0].set_yticks(range(len(order)), names)
    signs = "  ".join(
        f"{sign} {city.capitalize()}"
        for city, (_, sign) in _CITY_MARKERS.items()
    )
    figure.supxlabel(
        f"{signs}\n┃ mean over pairs, with a 95 % interval over cities   "
        "⋮ survives from here on",
        fontsize=12,
    )
    finding = survival_title(
        {gate: survivors(some) for gate, some in ranked.items()}
    )
    _head(figure, finding)
    figure.savefig(path, dpi=_DPI)
    return finding


# Of each shipped city: its marker, and a character that looks like it.
_CITY_MARKERS = {
    "downtown": ("o", "●"),
    "metropolis": ("s", "■"),
    "riverside": ("^", "▲"),
    "suburbia": ("D", "◆"),
}


def survival_title(found: Mapping[bool, Collection[str]]) -> str:
    """Returns a title: which methods survive, without and with verification.

    Args:
        found: whether geometric verification was used -> methods that survive.
    """

    def named(some: Collection[str]) -> str:
        marked = [f"{title(n)}{'*' * (n in OURS)}" for n in sorted(some)]
        return listed(marked).lower() if marked else "no method"

    alone, verified = named(found[False]), named(found[True])
    if alone == verified:
        return f"{alone.capitalize()} survives a rebuilt city"
    return (
        f"{alone.capitalize()} survives a rebuilt city;\n"
        f"with geometric verification, {verified} does"
    )


def kept_rows() -> dict[bool, list[Row]]:
    """Returns the retained shares of AUC strict, one for each pair and method.

    Returns:
        Whether geometric verification was used -> rows of the shipped table.
    """
    file = ROOT / "evaluation/results/baselines/stages.csv"
    found = Results.read(file).where({STAGE: OWN}, metric="kept_strict")
    return {gate: list(found.where(gate=gate).rows) for gate in (False, True)}


def assumptions(path: Path) -> None:
    """Draws what BTC retains after 40 years, by where new furniture stands."""
    head, *rows = _table("docs/ageing.md", "In the row *none*")
    colour, _, marker = METHOD_STYLES["btc"]
    figure = Figure(figsize=(_WIDTH, 6.6), layout="constrained")
    axes = figure.subplots()
    ticks: dict[float, str] = {}
    y = 0.0
    for place, *cells in rows:
        axes.text(1.0, y, place, va="center", fontweight="bold")
        for city, cell in zip(head[1:-1], cells[:-1], strict=True):
            if "(" in cell:
                y += 1.0
                mean, *ends = map(int, re.findall(r"\d+", cell))
                axes.plot(ends, [y, y], color=colour, lw=3, alpha=0.4)
                axes.plot(mean, y, marker, color=colour, ms=8)
                ticks[y] = city
        y += 1.4
    axes.set_yticks(list(ticks), ticks.values())
    axes.set(xlim=(0.0, 122.0), ylim=(y - 0.7, -0.7))
    axes.axvline(100.0, color=PALE, zorder=0)
    axes.set_xlabel("retained AUC of BTC in a map 40 years old [%]")
    axes.set_title(f"{head[0]}:", loc="left")
    _plain(axes)
    _head(
        figure,
        "How long BTC's map lasts depends\n"
        "on where new street furniture stands",
    )
    figure.savefig(path, dpi=_DPI)


def ranking(path: Path) -> None:
    """Draws mean AUC strict and AUC for each radius of a match.

    Means are over pairs of drives, and their 95 % intervals over cities.
    """
    metrics = {"auc_strict": "AUC strict", "auc": "AUC"}
    gates = {
        False: "without geometric verification",
        True: "with geometric verification",
    }
    # Cities -> how their means look.
    kinds: dict[str, dict[str, Any]] = {
        "shipped": {"marker": "o", "ms": 6},
        "fresh": {"marker": "o", "ms": 6, "mfc": "white"},
        "plans": {"marker": "D", "ms": 5},
    }
    # Metric, gate, cities and radius -> rows.
    found: dict[tuple[str, bool, str, float], list[Row]] = {}
    with open(ROOT / "docs/notes/ranking.csv", newline="") as stream:
        for line, metric in itertools.product(csv.DictReader(stream), metrics):
            row = Row(
                experiment="ranking",
                map=line["map"],
                database=line["database"],
                query=line["query"],
                seed=int(line["seed"]),
                factors={"version": line["version"]},
                task="place",
                method=line["method"],
                gate=line["gate"] == "1",
                protocol="own",
                metric=metric,
                value=float(line[metric]),
            )
            place = metric, row.gate, line["cities"], float(line["radius"])
            found.setdefault(place, []).append(row)
    radii = sorted({radius for *_, radius in found})
    every = [row for rows in found.values() for row in rows]
    order = [one.method for one in rank_methods(every)[0]]
    figure = Figure(figsize=(_WIDTH, 13.6), layout="constrained")
    blocks = list(itertools.product(metrics, gates))
    parts = figure.subfigures(len(blocks), 1)
    for part, (metric, gate) in zip(parts, blocks, strict=True):
        part.suptitle(
            f"{metrics[metric]}, {gates[gate]}", x=0.01, ha="left", fontsize=14
        )
        panels = part.subplots(1, len(radii), sharex=True, sharey=True)
        for axes, radius in zip(panels, radii, strict=True):
            for k, (kind, look) in enumerate(kinds.items()):
                rows = found.get((metric, gate, kind, radius), [])
                for one in rank_methods(rows)[0] if rows else ():
                    y = order.index(one.method) + 0.25 * (k - 1)
                    colour = METHOD_STYLES[one.method][0]
                    ends = [one.interval.low, one.interval.high]
                    axes.plot(ends, [y, y], color=colour, lw=3, alpha=0.45)
                    axes.plot(one.value, y, color=colour, **look)
            axes.set(xlim=(-0.05, 1.05), ylim=(len(order) - 0.5, -0.5))
            axes.set_xticks((0.0, 0.5, 1.0), ("0", "0.5", "1"))
            axes.set_yticks(range(len(order)), [title(n) for n in order])
            axes.set_title(f"{radius:g} m")
            _plain(axes)
        panels[0].set_title(f"radius {radii[0]:g} m")
    _head(
        figure,
        "Layered overlap is best with geometric\n"
        "verification; without it, the radius decides",
    )
    handles = [
        Line2D([], [], color=INK, ls="", **one) for one in kinds.values()
    ]
    interval = Line2D([], [], color=INK, lw=3, alpha=0.45)
    figure.legend(
        [*handles, interval],
        ["shipped cities", "fresh cities", "other streets", "95 % interval"],
        loc="outside lower center", ncols=2, frameon=False,
    )  # fmt: skip
    figure.savefig(path, dpi=_DPI)


def years(path: Path) -> None:
    """Draws the table of what the age of a map costs."""
    cells = re.findall(
        r"^\| (\w*) ?\| (\d+) \| [\d.]+ \| [\d.]+ % \| (\d+) % \((\d+)–(\d+)\) "
        r"\| (\d+) % \| (\d+) % \| [\d–]*?(\d+) % \|$",
        (ROOT / "docs/ageing.md").read_text(),
        re.MULTILINE,
    )
    cities = [row[0] for row in cells if row[0]]
    shown = np.array([row[1:] for row in cells], float)
    figure = Figure(figsize=(_WIDTH, 6.4), layout="constrained")
    grid = figure.subplots(2, 2, sharex=True, sharey=True)
    for axes, city, rows in zip(
        grid.flat, cities, np.split(shown, len(cities)), strict=True
    ):
        x, mean, low, high, solid, ringpp, others = rows.T
        bars = METHOD_STYLES["btc"][0]
        axes.fill_between(x, low, high, color=bars, alpha=0.15, lw=0)
        for y, name, text in (
            (others, None, "the other three"),
            (ringpp, "ring++", "RING++"),
            (solid, "solid", "SOLiD"),
            (mean, "btc", "BTC"),
        ):
            colour, style, marker = METHOD_STYLES.get(name, (PALE, "-", "."))
            axes.plot(x, y, style, color=colour, marker=marker, label=text)
        axes.set_title(city, loc="left")
        axes.set_ylim(0.0, 110.0)
        axes.set_xticks(x)
        _plain(axes, "both")
    for axes in grid[:, 1]:
        name_lines(figure, axes, 0.095, _FONT["font.size"])
    for axes in grid[1]:
        axes.set_xlabel("age of the map [years]")
    figure.supylabel("retained AUC [%]", fontsize=13)
    _head(figure, "BTC fails in each city as its map grows old")
    figure.savefig(path, dpi=_DPI)


def sessions(path: Path) -> None:
    """Draws R@1 of a map of January in NCLT, and as predicted in Suburbia."""
    with open(ROOT / "docs/notes/nclt_sessions.csv", newline="") as file:
        rows = list(csv.DictReader(file))
    figure = Figure(figsize=(_WIDTH, 4.4), layout="constrained")
    axes = figure.subplots()
    for where, name in (("suburbia", "layered-overlap"), ("nclt", "btc")):
        colour, style, marker = METHOD_STYLES[name]
        days, middle, low, high = np.array(
            [
                [float(row[key]) for key in ("days", "r1", "low", "high")]
                for row in rows
                if row["where"] == where
            ]
        ).T
        axes.fill_between(days, low, high, color=colour, alpha=0.15, lw=0)
        label = {"suburbia": "Suburbia, predicted", "nclt": "NCLT"}[where]
        axes.plot(days, middle, style, color=colour, marker=marker, label=label)
    axes.axvspan(107, 288, color=PALE, alpha=0.25, lw=0)
    axes.text(197, 0.03, "leaves in Suburbia", ha="center", color=INK)
    axes.set_xlabel("days after the map of January 2012")
    axes.set_ylabel("R@1")
    axes.set_ylim(0.0, 1.02)
    _plain(axes, "both")
    axes.legend(loc="lower right", frameon=False)
    _head(figure, "Leaves cost nothing in Suburbia")
    figure.savefig(path, dpi=_DPI)


def upkeep(
    path: Path,
    experiment: str,
    conditions: Mapping[str, str],
    panels: Mapping[str, Mapping[str, str]],
    finding: str,
) -> None:
    """Draws what methods reach with each database, a panel a metric.

    Values are means over realisations of cities, with their 95 % t intervals.

    Args:
        path: where to save the picture.
        experiment: whose rows of `docs/notes/upkeep.csv` to draw.
        conditions: condition -> its name in the picture, in order.
        panels: title of each panel -> values of columns of its rows.
        finding: title of the picture.
    """
    with open(ROOT / "docs/notes/upkeep.csv", newline="") as stream:
        lines = [
            line
            for line in csv.DictReader(stream)
            if line["experiment"] == experiment
        ]
    figure = Figure(
        figsize=(_WIDTH, 2.2 + 0.7 * len(conditions)), layout="constrained"
    )
    shown: set[str] = set()
    grid = figure.subplots(1, len(panels), sharey=True, squeeze=False)[0]
    for axes, (name, wanted) in zip(grid, panels.items(), strict=True):
        of_condition: dict[str, list[Row]] = {}
        for line in lines:
            if wanted.items() <= line.items():
                row = _realisation(line)
                of_condition.setdefault(line["condition"], []).append(row)
        found = {
            condition: rank_methods(rows)[0]
            for condition, rows in of_condition.items()
        }
        measured = {one.method for some in found.values() for one in some}
        shown |= measured - {""}
        # What a fleet notices depends on no method.
        here = [one for one in (*METHOD_STYLES, "") if one in measured]
        for condition, some in found.items():
            for one in some:
                colour = METHOD_STYLES[one.method][0] if one.method else INK
                y = list(conditions).index(condition)
                y += 0.7 * ((here.index(one.method) + 0.5) / len(here) - 0.5)
                ends = one.interval.low, one.interval.high
                axes.plot(ends, [y, y], color=colour, lw=3, alpha=0.45)
                axes.plot(one.value, y, color=colour, marker="o", ms=5)
        axes.set(xlim=(-0.03, 1.03), ylim=(len(conditions) - 0.5, -0.5))
        axes.set_xticks((0.0, 0.5, 1.0), ("0", "0.5", "1"))
        axes.set_yticks(range(len(conditions)), list(conditions.values()))
        axes.set_title(name)
        _plain(axes)
    _head(figure, finding)
    methods = [name for name in METHOD_STYLES if name in shown]
    handles = [
        Line2D([], [], color=METHOD_STYLES[name][0], marker="o", ms=5, lw=3,
               alpha=0.8)
        for name in methods
    ]  # fmt: skip
    figure.legend(
        handles,
        [title(name) for name in methods],
        loc="outside lower center", ncols=3, frameon=False,
    )  # fmt: skip
    figure.savefig(path, dpi=_DPI)


def _realisation(line: Mapping[str, str]) -> Row:
    """Returns a line of `upkeep.csv` as a row whose city is its realisation.

    Realisations of cities are the units of a ranking's intervals.
    """
    return Row(
        experiment=line["experiment"],
        map=f"{line['map']} {line['seed']}",
        database="",
        query=line["query"],
        seed=int(line["seed"]),
        factors={},
        task=line["task"],
        method=line["method"],
        gate=line["gate"] == "1",
        protocol="",
        metric=line["metric"],
        value=float(line["value"]),
    )


def ladder(path: Path) -> None:
    """Draws the ladder of Suburbia."""
    results = Results.read(ROOT / "docs/notes/ladder_suburbia.csv")
    chart = {"kind": "matrix", "over": "cause", "metric": "kept"}
    drawn = draw_chart(chart, results, 480)
    _head(drawn.figure, "Weather, lateral offset\nand sensor cost most")
    drawn.figure.savefig(path, dpi=220)


def noise(path: Path) -> None:
    """Draws the Allan deviation of an IMU and the spectrum of roads."""
    figure = Figure(figsize=(_WIDTH, 8.6), layout="constrained")
    top, bottom = figure.subplots(2)
    _allan(top)
    _spectra(bottom)
    figure.savefig(path, dpi=_DPI)


def _allan(axes: Axes) -> None:
    """Draws the deviations of all axes over those of the densities."""
    # Kalibr's example of an ADIS16448, for three hours.
    densities = {"accelerometer": (0.01, 2e-4), "gyroscope": (0.005, 4e-6)}
    noises = ImuNoise(
        accelerometer_noise_density=0.01,
        accelerometer_random_walk=2e-4,
        gyroscope_noise_density=0.005,
        gyroscope_random_walk=4e-6,
        seed=3,
    )
    rate = 100
    num_samples = 1054 * 1024
    errors = ImuErrors(noises, rate).measure(0, np.zeros((num_samples, 6)))
    # The integral of what an IMU at rest measures.
    angle = np.cumsum(errors, axis=0)
    sizes = np.unique(np.geomspace(1, len(angle) / 9, 50).astype(int))
    taus = sizes / rate
    spreads = np.array(
        [
            np.std(angle[2 * n :] - 2 * angle[n:-n] + angle[: -2 * n], axis=0)
            / (np.sqrt(2.0) * n)
            for n in sizes
        ]
    )
    for k, (name, (white, walk)) in enumerate(densities.items()):
        colour = (INK, PALE)[k]
        axes.loglog(taus, spreads[:, 3 * k : 3 * k + 3], colour, lw=1.2)
        axes.loglog(taus, white / np.sqrt(taus), "k--", lw=0.8)
        axes.loglog(taus, walk * np.sqrt(taus / 3.0), "k:", lw=0.8)
        at = (1.4e-2, (0.16, 0.004)[k])
        axes.annotate(f"{name} [{('m/s²', 'rad/s')[k]}]", at, color=colour)
    given = [
        Line2D([], [], color="black", lw=0.8, ls=style) for style in ("--", ":")
    ]
    words = ("given white noise", "given random walk")
    axes.legend(given, words, loc="lower right", frameon=False, borderpad=0.0)
    axes.set_ylim(1e-6, 0.4)
    axes.set_xlabel("averaging time [s]")
    axes.set_ylabel("Allan deviation")
    axes.set_title("An IMU at rest has the noise that it was given", loc="left")


def _spectra(axes: Axes) -> None:
    """Draws the spectra of roads along lines over those of their classes."""
    step = 0.1
    window = 600.0
    along = np.arange(0.0, 3000.0, step)
    for k, roughness in enumerate("ABCDE"):
        profile = RoadProfile(roughness, 0)
        spectra = []
        for angle in (0.0, 0.5, np.pi / 4, 1.9):
            way = np.outer(along, [np.cos(angle), np.sin(angle)])
            heights = profile.heights(way + 300.0 * angle)
            frequency, spectrum = welch(
                heights, 1.0 / step, nperseg=int(window / step)
            )
            spectra.append(spectrum)
        inside = (frequency > 1.0 / 150.0) & (frequency < 4.0)
        shown = np.mean(spectra, axis=0)[inside]
        axes.loglog(frequency[inside], shown, INK, lw=1.2, alpha=0.3 + 0.15 * k)
        waves = np.array([1.0 / 90.0, 1.0 / 0.35])
        axes.loglog(waves, 16e-6 * 4.0**k * (waves / 0.1) ** -2, "k--", lw=0.8)
        axes.annotate(f"class {roughness}", (4.4, shown[-1]), va="center")
    axes.annotate("dashed: ISO 8608", (8e-3, 3e-8))
    axes.set_xlim(right=13.0)
    axes.set_xlabel("spatial frequency [1/m]")
    axes.set_ylabel("spectral density of heights [m³]")
    axes.set_title("Roads are as rough as their ISO 8608 class", loc="left")


def layers(path: Path) -> None:
    """Draws a query, its layers, and these laid over a place, 01 to 04."""
    drives = [load_scenario(f"metropolis_{n}") for n in ("04", "01")]
    query_way, way = map(plan_drive, drives)
    moments = np.arange(0.0, way.duration, 0.1)
    away = way.positions(moments) - query_way.positions(20.0)
    nearest = moments[np.linalg.norm(away, axis=1).argmin()]
    scans = []
    for drive, time in zip(drives, (20.0, nearest), strict=True):
        scan, _ = scans_at(drive, np.array([time]))[0]
        scans.append(np.stack([scan[axis] for axis in "xyz"], axis=1))
    method = LayeredOverlap(LayeredOverlapConfig())
    query, place = map(method.describe, scans)
    (X_PQ,) = method.relative_poses(query, method.build_database([place]), [0])
    cells = [
        0.5 * np.stack(np.divmod(one.cells.astype(int), 256), axis=1) - 63.75
        for one in (query, place)
    ]
    moved = cells[0] @ X_PQ[:2, :2].T + X_PQ[:2, 3]
    figure = Figure(figsize=(_WIDTH, 4.0), layout="constrained")
    panels = figure.subplots(1, 3, sharey=True)
    p = scans[0][np.argsort(scans[0][:, 2])]
    panels[0].scatter(*p.T[:2], 0.5, p[:, 2], cmap="viridis", lw=0, vmax=8)
    colours = ("#b9c2ce", "#7d8997", INK, "#8e44ad", "#00918f")
    names = ("low", "middle", "high", "poles", "kerbs")
    for k, name in enumerate(names):
        some = cells[0][query.starts[k] : query.starts[k + 1]]
        size = 9 if name == "poles" else 3
        panels[1].scatter(*some.T, size, colours[k], lw=0, label=name)
    for one, other, colour, text in (
        (moved, cells[1], NEW, "new"), (cells[1], moved, GONE, "gone"),
    ):  # fmt: skip
        # A cell meets those in 3 x 3.
        both = cKDTree(other).query(one, p=np.inf)[0] <= 0.75
        lone = one[~both]
        panels[2].scatter(*lone.T, 2, color=unit_rgb(colour), lw=0, label=text)
        panels[2].scatter(*one[both].T, 2, INK, lw=0)
    panels[2].scatter([], [], 2, INK, label="both")
    words = ("a query", "its layers", "over the place")
    for axes, text in zip(panels, words, strict=True):
        axes.set(xlim=(-40, 40), ylim=(-40, 40), aspect="equal", xlabel="x [m]")
        axes.set_title(text, loc="left")
        if axes is not panels[0]:
            axes.legend(
                loc="upper left", bbox_to_anchor=(-0.1, -0.26), ncols=2,
                markerscale=3, frameon=False, handletextpad=0.0,
                columnspacing=0.5,
            )  # fmt: skip
    panels[0].set_ylabel("y [m]")
    figure.savefig(path, dpi=_DPI, bbox_inches="tight", pad_inches=0.05)


# Photographs.


def street(path: Path, rows: Sequence[dict[str, Any]]) -> None:
    """Draws what a camera sees, in rows of a drive and its times [s].

    Other keys of a row are changed fields of the drive.
    """
    camera = CameraSection(
        width=1280, height=720, rate=1, fov_y_deg=48.7, xyz=(0.5, 0.0, 1.6)
    )
    pictures = []
    for row in rows:
        fields = {n: v for n, v in row.items() if n not in ("drive", "times")}
        scenario = load_scenario(row["drive"]).replaced(
            cameras={"front": camera}
        )
        diagram = make_station(scenario.with_fields(fields, path))
        context = diagram.CreateDefaultContext()
        pictures.append([])
        for time in row["times"]:
            context.SetTime(float(time))
            image = diagram.GetOutputPort("front_image").Eval(context)
            pictures[-1].append(np.ascontiguousarray(image.data[:, :, :3]))
    _tile(pictures, path, 960 if len(rows[0]["times"]) == 1 else _TILE[0])


def growth(path: Path, city: str) -> None:
    """Draws all stages of a city from the air, two in a row."""
    folder = MapFolder(shipped_maps()[city])
    view = load_views(folder.views)["aerial"]
    pictures = [
        _named(StageScene(file).photograph(view, *_TILE), f"stage {stage}")
        for stage, file in folder.stages().items()
    ]
    rows = [pictures[k : k + 2] for k in range(0, len(pictures), 2)]
    _tile(rows, path)


def stages(path: Path, city: str) -> None:
    """Draws a street of a city in its first and last stage, and scans."""
    folder = MapFolder(shipped_maps()[city])
    found = list(folder.stages().items())
    shown = {f"stage {n}": file for n, file in (found[0], found[-1])}
    draw_stages(shown, load_views(folder.views)["street"], path)


def drives(path: Path, city: str) -> None:
    """Draws the drives of a city from above."""
    files = MapFolder(shipped_maps()[city]).recordable_drives()
    found = [load_scenario(file) for file in files]
    draw_drives({s.name.replace("_", " "): s for s in found}, path)


def towns(
    path: Path, files: Sequence[str], names: Sequence[str], options: str = ""
) -> None:
    """Draws imported files from the air in clear air, side by side."""
    pictures = []
    for file, name in zip(files, names, strict=True):
        with tempfile.TemporaryDirectory() as draft:
            folder = _imported(file, options, draft)
            drive = load_scenario(folder.drives()[-1])
            scene = StageScene(drive.world_file)
            view = air_view(SimpleNamespace(trajectory=plan_drive(drive)))
            picture = scene.photograph(view, 640, 480, haze_length=np.inf)
            pictures.append(_named(picture, name, 20 * len(files)))
    _tile([pictures], path, 640)


def quarter(path: Path, file: str, time: float, options: str = "") -> None:
    """Draws an imported file: from the air, a scan, a street in two stages."""
    figure = Figure(figsize=(_WIDTH, 4.7), layout="constrained")
    (air, above), streets = figure.subplots(2, 2)
    with tempfile.TemporaryDirectory() as draft:
        folder = _imported(file, options, draft)
        drive = load_scenario(folder.drives()[-1])
        trajectory = plan_drive(drive)
        X_WB = trajectory.pose(time)
        eye = X_WB.translation() + np.array([0.0, 0.0, 2.0])
        target = eye + 30.0 * X_WB.rotation().matrix()[:, 0]
        view = View(position=tuple(eye), target=tuple(target), fov_y_deg=55)
        for axes, (stage, world) in zip(
            streets, folder.stages().items(), strict=True
        ):
            scene = StageScene(world)
            axes.imshow(scene.photograph(view, *_TILE))
            axes.set_title(f"stage {stage}", loc="left")
        wide = air_view(SimpleNamespace(trajectory=trajectory))
        air.imshow(scene.photograph(wide, *_TILE))
        scan, X_WS = scans_at(drive, np.array([time]))[0]
    p_W = X_WS @ np.stack([scan[axis] for axis in "xyz"])
    order = np.argsort(p_W[2])
    x, y, z = p_W[:, order] - X_WS.translation()[:, None]
    above.scatter(x, y, 0.6, z, cmap="viridis", lw=0, vmin=-2, vmax=8)
    above.set(xlim=(-53, 53), ylim=(-30, 30), aspect="equal")
    air.set_title("from the air", loc="left")
    above.set_title("a scan, 106 m wide", loc="left")
    for axes in figure.axes:
        axes.set_xticks([])
        axes.set_yticks([])
    figure.savefig(path, dpi=_DPI, pil_kwargs={"quality": 82})


def _imported(file: str, options: str, draft: str) -> MapFolder:
    folder = Path(draft) / Path(file).name.partition(".")[0].lower()
    command = [sys.executable, "-m", "cns_drake", "import", file]
    command += [*options.split(), "--output", str(folder)]
    subprocess.run(command, check=True)
    return MapFolder(folder)


# Scans.


def scans_at(scenario: Scenario, times: np.ndarray) -> list[tuple]:
    """Returns a scan at each time, its points in S, and X_WS."""
    diagram = make_station(scenario)
    context = diagram.CreateDefaultContext()
    lidar = diagram.GetSubsystemByName("lidar")
    result = []
    for time in times:
        context.SetTime(time)
        scan = diagram.GetOutputPort("lidar_scan").Eval(context).copy()
        own = lidar.GetMyContextFromRoot(context)
        result.append((scan, lidar.GetOutputPort("X_WS").Eval(own)))
    return result


def _in_world(scenario: Scenario, times: np.ndarray) -> list[tuple]:
    """Returns a scan at each time, its points in W, and from where."""
    result = []
    for scan, X_WS in scans_at(scenario, times):
        p_W = X_WS @ np.stack([scan[axis] for axis in "xyz"])
        for axis, values in zip("xyz", p_W, strict=True):
            scan[axis] = values
        result.append((scan, X_WS.translation()))
    return result


def weather(path: Path) -> None:
    """Draws the same scan in each weather, what it scatters in red."""
    kinds = {
        "clear": WeatherConfig(),
        "fog, 60 m": WeatherConfig(visibility=60.0),
        "rain, 25 mm/h": WeatherConfig(rain=25.0),
        "snowfall, 4 mm/h": WeatherConfig(snowfall=4.0),
    }
    figure = Figure(figsize=(_WIDTH, 7.9), layout="constrained")
    for axes, (name, kind) in zip(
        figure.subplots(2, 2).flat, kinds.items(), strict=True
    ):
        scenario = load_scenario("metropolis_04").with_lidar_preset("os1-64")
        scenario = scenario.with_returns("calibrated")
        scenario = scenario.model_copy(update={"weather": kind})
        scan, p_WS = _in_world(scenario, np.array([18.0]))[0]
        is_weather = scan["label"] == CLASS_IDS["outlier"]
        solid, drops = scan[~is_weather], scan[is_weather]
        shade = np.sqrt(np.clip(solid["intensity"], 0.0, 100.0))
        axes.scatter(
            solid["x"], solid["y"], 0.35, shade, cmap="viridis", lw=0, vmax=9
        )
        axes.scatter(drops["x"], drops["y"], 1.2, "#ff4040", lw=0)
        axes.set_title(
            f"{name}: {len(solid):,} points\nand {len(drops):,} of weather",
            loc="left",
        )
        _set_view(axes, p_WS, 60.0)
    figure.savefig(path, dpi=_DPI, pil_kwargs={"quality": 80})


def intensity(path: Path) -> None:
    """Draws the intensity of two seconds from above."""
    scenario = load_scenario("metropolis_04").with_lidar_preset("os1-128")
    times = 6.0 + 0.1 * np.arange(20)
    found = _in_world(scenario.with_returns("calibrated"), times)
    cloud = np.concatenate([scan for scan, _ in found])
    cloud = cloud[cloud["z"] < 2.5]
    cloud = cloud[np.argsort(cloud["z"], kind="stable")]
    figure = Figure(figsize=(10.0, 10.0), layout="constrained")
    axes = figure.subplots()
    axes.scatter(
        cloud["x"], cloud["y"], 0.3, np.sqrt(cloud["intensity"]), cmap="gray",
        lw=0, vmin=0, vmax=8,
    )  # fmt: skip
    _set_view(axes, found[len(found) // 2][1], 22.0)
    figure.savefig(path, dpi=90, pil_kwargs={"quality": 80})


# What commands make.


def taken(path: Path, file: str, below: str = "") -> None:
    """Takes a picture that a command made, and another one below it."""
    files = [ROOT / one for one in (file, below) if one]
    shown = [Image.open(one).convert("RGB") for one in files]
    width = max(one.width for one in shown)
    whole = Image.new("RGB", (width, sum(one.height for one in shown)), "white")
    for k, one in enumerate(shown):
        whole.paste(one, (0, sum(other.height for other in shown[:k])))
    whole.thumbnail((1400, 1600))
    whole.save(path, quality=82)


def maps(path: Path, file: str, middle: Sequence[float]) -> None:
    """Draws a street in the maps of two drives, by the labels of map-truth."""
    colours = np.zeros((5, 3))
    colours[[Label.UNOBSERVED, Label.NEWLY_SEEN]] = (196, 200, 208)
    colours[[Label.KEPT, Label.GONE, Label.NEW]] = (120, 126, 134), GONE, NEW
    figure = Figure(figsize=(_WIDTH, 2.7), layout="constrained")
    words = "older map: gone is red", "newer map: new is blue"
    view = point_rendering.View(-60.0, 28.0, 12.0)
    for axes, side, text in zip(
        figure.subplots(1, 2), "AB", words, strict=True
    ):
        folder = (ROOT / file).parent / side
        points = read_session(folder).points
        labels = np.load(folder / "truth.npy")
        near = (np.abs(points - middle) < (42.0, 26.0, 26.0)).all(axis=1)
        rgb = colours[labels[near]].astype(np.uint8)
        axes.imshow(point_rendering.render(points[near], rgb, view).image)
        axes.set_title(text, loc="left")
        axes.set_axis_off()
    figure.savefig(path, dpi=_DPI, bbox_inches="tight")


def screenshot(
    path: Path, file: str, size: Sequence[int], script: str = "0"
) -> None:
    """Takes a picture of a page that a command made, after a script in it."""
    sys.path.append(str(ROOT / "tests"))
    from helpers.browser import chromium

    software = ("--use-angle=swiftshader", "--enable-unsafe-swiftshader")
    with (
        tempfile.TemporaryDirectory() as profile,
        chromium(Path(profile), *software) as browser,
    ):
        browser.open(f"file://{ROOT / file}", *size)
        browser.wait_for('!document.getElementById("loading")')
        browser.evaluate(script)
        browser.evaluate("new Promise((done) => setTimeout(done, 5000))")
        shown = Image.open(io.BytesIO(browser.picture()))
        shown.convert("RGB").save(path, quality=85)


# Common parts.


def _table(page: str, after: str) -> list[list[str]]:
    """Returns the cells of the first table after some words of a page."""
    text = (ROOT / page).read_text().partition(after)[2]
    lines = text[text.index("\n|") :].lstrip().partition("\n\n")[0].split("\n")
    del lines[1]
    return [re.split(r" *\| *", line)[1:-1] for line in lines]


def _head(figure: Figure, finding: str) -> None:
    figure.suptitle(finding, fontsize=17, fontweight="bold", x=0.01, ha="left")


def _plain(axes: Axes, grid: str = "x") -> None:
    axes.grid(axis=grid, color="#dddddd")
    axes.set_axisbelow(True)
    axes.tick_params(length=0)
    axes.spines[["top", "right", "left"]].set_visible(False)


def _set_view(axes: Axes, middle: np.ndarray, span: float) -> None:
    axes.set_facecolor("black")
    axes.set_aspect("equal")
    axes.set_xlim(middle[0] - span, middle[0] + span)
    axes.set_ylim(middle[1] - span, middle[1] + span)
    axes.set_xticks([])
    axes.set_yticks([])


def _named(picture: np.ndarray, name: str, size: int = 26) -> np.ndarray:
    """Returns a picture with its name in the corner, `size` pixels high."""
    image = Image.fromarray(picture)
    ImageDraw.Draw(image).text(
        (14, 8), name, INK, ImageFont.load_default(size),
        stroke_width=3, stroke_fill="white",
    )  # fmt: skip
    return np.asarray(image)


def _tile(
    rows: Sequence[Sequence[np.ndarray]], path: Path, width: int = _TILE[0]
) -> None:
    """Writes pictures of one size, side by side and in rows."""
    height = width * rows[0][0].shape[0] // rows[0][0].shape[1]
    gap = 6
    size = len(rows[0]) * (width + gap) - gap, len(rows) * (height + gap) - gap
    whole = Image.new("RGB", size, "white")
    for i, row in enumerate(rows):
        for k, picture in enumerate(row):
            shown = Image.fromarray(picture).resize((width, height))
            whole.paste(shown, (k * (width + gap), i * (height + gap)))
    whole.save(path, quality=82 if path.suffix == ".jpg" else 70)


if __name__ == "__main__":
    main(sys.argv[1:])
