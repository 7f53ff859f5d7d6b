"""The charts of these pages."""

from __future__ import annotations

from collections.abc import Collection, Mapping
import csv
import itertools
from pathlib import Path
import re
from typing import Any

from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.transforms import BboxTransformTo, ScaledTranslation
import numpy as np
from scipy.signal import welch
from sklearn.isotonic import isotonic_regression

from cns_drake.motion import RoadProfile
from cns_drake.sensors import ImuErrors, ImuNoise
from docs.picture_parts import (
    DPI,
    FONT,
    ROOT,
    WIDTH,
    add_heading,
    make_plain,
)
from evaluation.methods import method_facts, shipped_methods
from evaluation.results import (
    CANNOT_SHOW,
    INK,
    MARGIN,
    OWN,
    PALE,
    STAGE,
    SURVIVES,
    Results,
    Row,
    Survival,
    draw_chart,
    in_table_order,
    judge_survival,
    listed,
    method_style,
    method_styles,
    rank_methods,
    title,
)

METHOD_STYLES = {
    name: style
    for name in in_table_order(shipped_methods())
    if (style := method_style(name))
}
# The methods that this project made; all others are published ones.
OURS = {
    name
    for name in shipped_methods()
    if (facts := method_facts(name)) and not facts.source
}


def survival(path: Path) -> str:
    """Draws what methods retain of their AUC strict; returns the title.

    Cities are the units: a point is the mean over a city's pairs, and a bar is
    the 95 % interval over the cities, if there are eight. The points stand
    below the bar, each city's at a height of its own, so that none hides
    another or the bar's ends.
    """
    rows = kept_rows()
    # The best method without geometric verification is on top.
    ranked = {gate: rank_methods(rows[gate]) for gate in rows}
    order = [one.method for one in ranked[False]][::-1]
    styles = method_styles(order)
    figure = Figure(figsize=(WIDTH, 6.6), layout="constrained")
    panels = figure.subplots(1, 2, sharey=True)
    for axes, gate in zip(panels, (False, True), strict=True):
        for one in ranked[gate]:
            y = order.index(one.method)
            colour = styles[title(one.method)][0]
            ends = 100.0 * np.array([one.interval.low, one.interval.high])
            above = [y + _INTERVAL_ABOVE] * 2
            axes.plot(ends, above, "|-", color=INK, lw=2, ms=7, mew=2)
            axes.plot(100.0 * one.value, above[0], "|", color=INK, ms=13, mew=4)
            for city, (marker, _, below) in _CITY_MARKERS.items():
                some = [
                    row.value
                    for row in rows[gate]
                    if (row.map, row.method) == (city, one.method)
                ]
                at = 100.0 * np.mean(some)
                axes.plot(at, y - below, marker, color=colour, ms=6)
        axes.axvline(
            100.0 * (1.0 - MARGIN), color=INK, lw=1.5, ls=":", zorder=0
        )
        axes.axvline(100.0, color=PALE, lw=1, zorder=0)
        axes.set(xlim=(-4.0, 119.0), ylim=(-0.7, len(order) - 0.45))
        axes.set_xlabel("retained AUC strict [%]")
        verified = "with" if gate else "without"
        axes.set_title(f"{verified} verification", loc="left")
        make_plain(axes)
    names = [f"{title(n)}*" if n in OURS else title(n) for n in order]
    panels[0].set_yticks(range(len(order)), names)
    signs = "  ".join(
        f"{sign} {city.capitalize()}"
        for city, (_, sign, _) in _CITY_MARKERS.items()
    )
    figure.supxlabel(
        f"{signs}\n┃ mean over pairs, with a 95 % interval over cities   "
        "⋮ survives from here on",
        fontsize=12,
    )
    finding = survival_title(
        {gate: judge_survival(some) for gate, some in rows.items()}
    )
    add_heading(figure, finding)
    figure.savefig(path, dpi=DPI)
    return finding


# Distance of an interval above the middle of a method's row [rows].
_INTERVAL_ABOVE = 0.28
# Of each shipped city: its marker, a character that looks like it, and the
# marker's distance below the middle of a method's row [rows].
_CITY_MARKERS = {
    "downtown": ("o", "●", -0.07),
    "metropolis": ("s", "■", 0.08),
    "riverside": ("^", "▲", 0.23),
    "suburbia": ("D", "◆", 0.38),
}


def survival_title(found: Mapping[bool, Collection[Survival]]) -> str:
    """Returns a title: which methods survive, without and with verification.

    Args:
        found: whether geometric verification was used -> whether methods
            survive.
    """
    every = [one for some in found.values() for one in some]
    if all(one.verdict == CANNOT_SHOW for one in every):
        return f"{every[0].cities} cities cannot show what survives rebuilding"

    def named(some: Collection[Survival]) -> str:
        names = sorted(one.method for one in some if one.verdict == SURVIVES)
        marked = [f"{title(n)}{'*' * (n in OURS)}" for n in names]
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
    figure = Figure(figsize=(WIDTH, 6.6), layout="constrained")
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
    make_plain(axes)
    add_heading(
        figure,
        "How long BTC's map lasts depends\n"
        "on where new street furniture stands",
    )
    figure.savefig(path, dpi=DPI)


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
    order = [one.method for one in rank_methods(every)]
    figure = Figure(figsize=(WIDTH, 13.6), layout="constrained")
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
                for one in rank_methods(rows) if rows else ():
                    y = order.index(one.method) + 0.25 * (k - 1)
                    colour = METHOD_STYLES[one.method][0]
                    ends = [one.interval.low, one.interval.high]
                    axes.plot(ends, [y, y], color=colour, lw=3, alpha=0.45)
                    axes.plot(one.value, y, color=colour, **look)
            axes.set(xlim=(-0.05, 1.05), ylim=(len(order) - 0.5, -0.5))
            axes.set_xticks((0.0, 0.5, 1.0), ("0", "0.5", "1"))
            axes.set_yticks(range(len(order)), [title(n) for n in order])
            axes.set_title(f"{radius:g} m")
            make_plain(axes)
        panels[0].set_title(f"radius {radii[0]:g} m")
    add_heading(
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
    figure.savefig(path, dpi=DPI)


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
    figure = Figure(figsize=(WIDTH, 6.4), layout="constrained")
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
        make_plain(axes, "both")
    for axes in grid[:, 1]:
        _name_lines(figure, axes, 0.095, FONT["font.size"])
    for axes in grid[1]:
        axes.set_xlabel("age of the map [years]")
    figure.supylabel("retained AUC [%]", fontsize=13)
    add_heading(figure, "BTC fails in each city as its map grows old")
    figure.savefig(path, dpi=DPI)


def _name_lines(figure: Figure, axes: Axes, gap: float, size: float) -> None:
    """Writes the names of lines at their ends, to the right of the panel.

    Names that would overlap are moved apart, as little as possible. Lines
    without a label get no name.

    Args:
        figure: the figure that the panel is in.
        axes: the panel. The limits of its axes must be final.
        gap: least distance between two names, as a part of the panel's height.
        size: size of the letters [pt].
    """
    lines = [line for line in axes.lines if str(line.get_label())[:1] != "_"]
    bottom, top = axes.get_ylim()
    values = [np.asarray(line.get_ydata(), dtype=float) for line in lines]
    known = [y[np.isfinite(y)] for y in values]
    ends = [y[-1] if len(y) else bottom for y in known]
    heights = (np.array(ends) - bottom) / (top - bottom)
    order = np.argsort(heights, kind="stable")
    # In steps of the gap, names in order must not descend.
    steps = gap * np.arange(len(lines))
    moved = isotonic_regression(heights[order] - steps)
    moved = np.clip(moved, 0.0, max(1.0 - steps[-1], 0.0)) + steps
    for index, height in zip(order, moved, strict=True):
        line = lines[index]
        # In inches from the panel's edge, so that letters have room.
        inches = figure.dpi_scale_trans + ScaledTranslation(
            1.0, height, BboxTransformTo(axes.bbox)
        )
        axes.plot(
            [0.1, 0.25, 0.4], [0.0] * 3, transform=inches, clip_on=False,
            color=line.get_color(), linestyle=line.get_linestyle(),
            linewidth=line.get_linewidth(), marker=line.get_marker(),
            markersize=line.get_markersize(), markevery=[1],
        )  # fmt: skip
        axes.text(
            0.48, 0.0, line.get_label(), fontsize=size, color=INK, va="center",
            transform=inches,
        )  # fmt: skip


def sessions(path: Path) -> None:
    """Draws R@1 of a map of January in NCLT, and as predicted in Suburbia."""
    with open(ROOT / "docs/notes/nclt_sessions.csv", newline="") as file:
        rows = list(csv.DictReader(file))
    figure = Figure(figsize=(WIDTH, 4.4), layout="constrained")
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
    make_plain(axes, "both")
    axes.legend(loc="lower right", frameon=False)
    add_heading(figure, "Leaves cost nothing in Suburbia")
    figure.savefig(path, dpi=DPI)


def upkeep(
    path: Path,
    experiment: str,
    conditions: Mapping[str, str],
    panels: Mapping[str, Mapping[str, str]],
    finding: str,
) -> None:
    """Draws what methods reach with each database, a panel a metric.

    Values are means over realisations of cities, with their 95 % intervals.

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
        figsize=(WIDTH, 2.2 + 0.7 * len(conditions)), layout="constrained"
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
            condition: rank_methods(rows)
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
        make_plain(axes)
    add_heading(figure, finding)
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
    figure.savefig(path, dpi=DPI)


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
    add_heading(drawn.figure, "Weather, lateral offset\nand sensor cost most")
    drawn.figure.savefig(path, dpi=220)


def noise(path: Path) -> None:
    """Draws the Allan deviation of an IMU and the spectrum of roads."""
    figure = Figure(figsize=(WIDTH, 8.6), layout="constrained")
    top, bottom = figure.subplots(2)
    _allan(top)
    _spectra(bottom)
    figure.savefig(path, dpi=DPI)


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


def _table(page: str, after: str) -> list[list[str]]:
    """Returns the cells of the first table after some words of a page."""
    text = (ROOT / page).read_text().partition(after)[2]
    lines = text[text.index("\n|") :].lstrip().partition("\n\n")[0].split("\n")
    del lines[1]
    return [re.split(r" *\| *", line)[1:-1] for line in lines]
