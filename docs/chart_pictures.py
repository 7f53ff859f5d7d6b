"""The charts of these pages."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.transforms import BboxTransformTo, ScaledTranslation
import numpy as np
from scipy.optimize import isotonic_regression
from scipy.signal import welch
from scipy.stats import spearmanr
import yaml

from cns_drake.motion import RoadProfile
from cns_drake.sensors import ImuErrors, ImuNoise
from docs.fill_numbers import csv_rows
from docs.picture_parts import DPI, ROOT, STYLE, WIDTH, add_heading, make_plain
from evaluation.methods import shipped_methods
from evaluation.results import (
    INK,
    PALE,
    PrintStyle,
    Results,
    Row,
    draw_chart,
    in_table_order,
    method_style,
    rank_methods,
    title,
)

METHOD_STYLES = {
    name: style
    for name in in_table_order(shipped_methods())
    if (style := method_style(name))
}


def assumptions(path: Path) -> None:
    """Draws what BTC retains after 40 years, by where new furniture stands."""
    places = {
        "none": "none",
        "in place": "where the old ones stood",
        "0.2 m": "displaced by 0.2 m",
        "2 m": "displaced by 0.2 m to 2 m, as shipped",
    }
    colour, _, marker = METHOD_STYLES["btc"]
    figure = Figure(figsize=(WIDTH, 7.6), layout="constrained")
    axes = figure.subplots()
    ticks: dict[float, str] = {}
    y = 0.0
    for place, text in places.items():
        axes.text(1.0, y, text, va="center", fontweight="bold")
        old = _retained_in_old_map(place)
        for city, shares in old.items():
            y += 1.0
            mean, *ends = (100.0 * share for share in shares)
            axes.plot(ends, [y, y], color=colour, lw=3, alpha=0.4)
            axes.plot(mean, y, marker, color=colour, ms=8)
            ticks[y] = city.capitalize()
        y += 1.4
    axes.set_yticks(list(ticks), ticks.values())
    axes.set(xlim=(0.0, 142.0), ylim=(y - 0.7, -0.7))
    axes.axvline(100.0, color=PALE, zorder=0)
    axes.set_xlabel(
        "retained AUC of BTC in a map 40 years old [%]\n"
        "line: 95 % interval over the streets of the city"
    )
    axes.set_title("new lamps, signs, signals and benches:", loc="left")
    make_plain(axes)
    add_heading(
        figure,
        "Retained AUC of BTC in a map of 40 years",
    )
    figure.savefig(path, dpi=DPI)


def _retained_in_old_map(furniture: str) -> dict[str, np.ndarray]:
    """Returns city -> what BTC retains of its AUC after 40 years (3,).

    That is the mean over the realisations of the share, and of both limits of
    its interval.

    Args:
        furniture: where new street furniture stands.
    """
    found: dict[str, list[list[float]]] = {}
    for row in csv_rows("ageing.csv"):
        if (row["method"], row["years"], row["furniture"]) == (
            "btc",
            "40",
            furniture,
        ) and (row["season"], row["turned"]) == ("same", "1"):
            ends = ("", "_low", "_high")
            cells = [float(row[f"relative_auc{end}"]) for end in ends]
            found.setdefault(row["map"], []).append(cells)
    return {city: np.mean(some, axis=0) for city, some in found.items()}


def survival(path: Path) -> None:
    """Draws which places six methods still find, by road networks."""
    rows = [
        row
        for row in csv_rows("network_survival.csv")
        if (row["pairs"], row["verified"]) == ("first", "1")
    ]
    found = sorted(
        (row for row in rows if row["part"] == "found"),
        key=lambda row: float(row["loss"]),
    )
    figure = Figure(figsize=(WIDTH, 4.4), layout="constrained")
    axes = figure.subplots()
    axes.axvspan(90.0, 110.0, color=PALE, alpha=0.2, lw=0)
    for y, row in enumerate(found):
        colour, _, marker = METHOD_STYLES[row["method"]]
        kept, *ends = (
            100.0 * (1.0 - float(row[name])) for name in ("loss", "low", "high")
        )
        axes.plot(ends, [y, y], color=colour, lw=5, alpha=0.4)
        axes.plot(kept, y, marker, color=colour, ms=8)
        shares = [
            100.0 * (1.0 - float(one["loss"]))
            for one in rows
            if (one["part"], one["method"]) == ("network", row["method"])
        ]
        axes.plot(shares, [y + 0.35] * len(shares), "|", color=INK, ms=6)
    axes.set_yticks(range(len(found)), [title(row["method"]) for row in found])
    axes.set(xlim=(-2.0, 110.0), ylim=(len(found) - 0.4, -0.6))
    axes.set_xlabel(
        "places that are still found [%]; bar: 95 % interval;\n"
        "tick: a road network; grey: where methods survive"
    )
    make_plain(axes)
    add_heading(figure, "Places that are still found in rebuilt cities")
    figure.savefig(path, dpi=DPI)


def ranking(path: Path) -> None:
    """Draws the ranks of methods over the radius of a match, by AUC strict.

    Means are over the pairs of the shipped cities.
    """
    found: dict[tuple[bool, float], list[Row]] = {}
    for line in csv_rows("ranking.csv"):
        if line["cities"] != "shipped":
            continue
        row = Row(
            experiment="ranking",
            map=line["map"],
            database=line["database"],
            query=line["query"],
            seed=int(line["seed"]),
            factors={},
            task="place",
            method=line["method"],
            verified=line["verified"] == "1",
            protocol="own",
            metric="auc_strict",
            value=float(line["auc_strict"]),
        )
        found.setdefault((row.verified, float(line["radius"])), []).append(row)
    radii = sorted({radius for _, radius in found})
    figure = Figure(figsize=(WIDTH, 5.0), layout="constrained")
    panels = figure.subplots(1, 2, sharey=True)
    for axes, verified in zip(panels, (False, True), strict=True):
        ranked = [
            {one.method: one for one in rank_methods(found[verified, radius])}
            for radius in radii
        ]
        for method in ranked[-1]:
            colour, style, marker = METHOD_STYLES[method]
            ranks = [1 + list(some).index(method) for some in ranked]
            axes.plot(
                range(len(radii)), ranks, style, color=colour, marker=marker,
                ms=9, lw=2.5, label=title(method),
            )  # fmt: skip
            axes.text(
                len(radii) - 0.8, ranks[-1],
                f"{title(method)} {ranked[-1][method].value:.2f}",
                va="center", fontsize=11,
            )  # fmt: skip
        number = len(ranked[-1])
        axes.set(ylim=(number + 0.5, 0.5), xlim=(-0.3, len(radii) + 2.2))
        axes.set_xticks(range(len(radii)), [f"{one:g}" for one in radii])
        axes.set_yticks(range(1, number + 1), range(1, number + 1))
        axes.set_xlabel("radius of a match [m]", loc="left")
        word = "with" if verified else "without"
        axes.set_title(f"{word} verification", loc="left")
        make_plain(axes, "y")
    panels[0].set_ylabel("rank by AUC strict (at the right: its mean)")
    add_heading(figure, "Ranks of methods over the radius of a match")
    figure.savefig(path, dpi=DPI)


def years(path: Path) -> None:
    """Draws the table of what the age of a map costs."""
    rows = csv_rows("years.csv")
    cities = list(dict.fromkeys(row["map"].capitalize() for row in rows))
    columns = (
        "years", "btc", "btc_least", "btc_most", "solid", "ring++",
        "others_best",
    )  # fmt: skip
    shown = np.array([[float(row[name]) for name in columns] for row in rows])
    shown[:, 1:] *= 100.0
    figure = Figure(figsize=(WIDTH, 6.4), layout="constrained")
    grid = figure.subplots(2, 2, sharex=True, sharey=True)
    for axes, city, some in zip(
        grid.flat, cities, np.split(shown, len(cities)), strict=True
    ):
        x, mean, least, most, solid, ringpp, others = some.T
        bars = METHOD_STYLES["btc"][0]
        axes.fill_between(x, least, most, color=bars, alpha=0.15, lw=0)
        for y, name, text in (
            (others, None, "the other three"),
            (ringpp, "ring++", "RING++"),
            (solid, "solid", "SOLiD"),
            (mean, "btc", "BTC"),
        ):
            colour, style, marker = METHOD_STYLES.get(name, (PALE, "-", "."))
            axes.plot(x, y, style, color=colour, marker=marker, label=text)
        axes.axhline(90.0, color=INK, lw=1.2, ls=(0, (4, 3)), zorder=1)
        axes.set_title(city, loc="left")
        axes.set_ylim(0.0, 110.0)
        axes.set_xticks(x)
        make_plain(axes, "both")
    for axes in grid[:, 1]:
        _name_lines(figure, axes, 0.095, STYLE["font.size"])
    grid[0, 0].text(5.0, 7.0, "dashed: 90 %, a tenth lost", fontsize=11)
    for axes in grid[1]:
        axes.set_xlabel("age of the map [years]")
    figure.supylabel("retained AUC [%]", fontsize=13)
    add_heading(figure, "BTC fails in each city as its map grows old")
    figure.savefig(path, dpi=DPI)


def visible_change(path: Path) -> None:
    """Draws AUC in 58 versions of Riverside over two measures of change.

    A line joins the means of six groups of versions, in the order of the
    measure. Beside it is Spearman's rank correlation of 1 - AUC.
    """
    rows = csv_rows("versions.csv")
    measures = {
        "tcr_sym": "TCR_sym",
        "visible_change_added": "visible change, without parallax",
    }
    figure = Figure(figsize=(WIDTH, 7.2), layout="constrained")
    panels = figure.subplots(2, sharex=True, sharey=True)
    for axes, (measure, words) in zip(panels, measures.items(), strict=True):
        axes.set_ylim(0.0, 1.0)
        for method, (colour, style, marker) in METHOD_STYLES.items():
            x, y = np.array(
                [
                    [float(row[measure]), float(row["auc"])]
                    for row in rows
                    if row["method"] == method
                ]
            ).T
            order = np.argsort(x, kind="stable")
            groups = np.array_split(order, 6)
            fit = spearmanr(x, 1.0 - y).statistic
            axes.plot(
                x, y, marker, color=colour, ms=3, alpha=0.35, mew=0,
                label="_points",
            )  # fmt: skip
            axes.plot(
                [x[some].mean() for some in groups],
                [y[some].mean() for some in groups],
                style, color=colour, lw=2.5,
                label=f"{title(method)}: {fit:.2f}",
            )  # fmt: skip
        axes.set_xlabel(words)
        axes.tick_params(labelbottom=True)
        make_plain(axes, "both")
        _name_lines(figure, axes, 0.11, STYLE["font.size"])
    panels[0].set_title("at the right: rank correlation of 1 - AUC", loc="left")
    figure.supylabel("AUC in 58 versions of Riverside", fontsize=13)
    add_heading(figure, "AUC over two measures of change")
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
    moved = isotonic_regression(heights[order] - steps).x
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
    """Draws R@1 of a map of January in NCLT, in Suburbia and on campuses."""
    rows = csv_rows("nclt_sessions.csv")
    figure = Figure(figsize=(WIDTH, 4.6), layout="constrained")
    axes = figure.subplots()
    # No method has these colours.
    looks = {
        "suburbia": ("#777777", "--", "predicted\n(Suburbia)"),
        "campus": ("#777777", ":", "simulated\n(4 campuses)"),
        "nclt": (INK, "-", "measured\n(NCLT)"),
    }
    for where, (colour, style, label) in looks.items():
        found: dict[float, list[list[float]]] = {}
        for row in rows:
            if row["where"].startswith(where):
                cells = (row[key] or "nan" for key in ("r1", "low", "high"))
                numbers = [float(cell) for cell in cells]
                found.setdefault(float(row["days"]), []).append(numbers)
        days = list(found)
        middle, low, high = np.transpose(
            [np.mean(some, axis=0) for some in found.values()]
        )
        if where == "campus":  # The range over campuses.
            low, high = (
                np.array(
                    [end(r1 for r1, *_ in some) for some in found.values()]
                )
                for end in (min, max)
            )
        axes.fill_between(days, low, high, color=colour, alpha=0.15, lw=0)
        axes.plot(days, middle, style, color=colour, marker="o", label=label)
    axes.axvspan(107, 288, color=PALE, alpha=0.25, lw=0)
    axes.text(197, 0.03, "leaves", ha="center", color=INK)
    axes.set_xlabel("days after the map of January 2012")
    axes.set_ylabel("R@1")
    axes.set_ylim(0.0, 1.02)
    make_plain(axes, "both")
    _name_lines(figure, axes, 0.16, STYLE["font.size"])
    add_heading(figure, "R@1 of a map of January 2012")
    figure.savefig(path, dpi=DPI)


def fleet(path: Path) -> None:
    """Draws the share of changes that so many cars a year notice."""
    noticed: dict[int, list[float]] = {}
    for line in csv_rows("upkeep.csv"):
        wanted = line["experiment"], line["task"], line["metric"]
        if wanted == ("fleet", "seen", "seen_here"):
            share = 100.0 * float(line["value"])
            noticed.setdefault(int(line["condition"]), []).append(share)
    figure = Figure(figsize=(WIDTH, 3.4), layout="constrained")
    axes = figure.subplots()
    shares = {}
    for cars, values in sorted(noticed.items()):
        value = float(np.mean(values))
        shares[cars] = round(value)
        axes.plot(values, [cars] * len(values), "|", color="#777777", ms=16)
        axes.plot(value, cars, "o", color=INK, ms=10)
        axes.text(
            value, cars - 0.28, f"{shares[cars]} %", ha="center",
            fontweight="bold",
        )  # fmt: skip
    # A gap where a number of cars was not measured.
    names = [f"{cars} {'car' if cars == 1 else 'cars'}" for cars in shares]
    axes.set_yticks(list(shares), names)
    axes.set(xlim=(0.0, 100.0), ylim=(max(shares) + 0.5, 0.3))
    axes.set_xlabel("changes noticed [%];  | one realisation of a city")
    make_plain(axes)
    add_heading(figure, "Changes that a fleet notices")
    figure.savefig(path, dpi=DPI)


def upkeep(
    path: Path,
    experiment: str,
    conditions: Mapping[str, str],
    panels: Mapping[str, Mapping[str, str]],
    finding: str,
) -> None:
    """Draws what methods reach with each database, a panel a metric.

    Values are means over realisations of cities, and ticks the realisations.

    Args:
        path: where to save the picture.
        experiment: whose rows of `docs/notes/upkeep.csv` to draw.
        conditions: condition -> its name in the picture, in order.
        panels: title of each panel -> values of columns of its rows.
        finding: title of the picture.
    """
    lines = [
        line
        for line in csv_rows("upkeep.csv")
        if line["experiment"] == experiment
    ]
    figure = Figure(
        figsize=(WIDTH, 2.2 + 0.7 * len(conditions)), layout="constrained"
    )
    # The last number of a panel and the first of the next stand apart.
    figure.get_layout_engine().set(wspace=0.06)
    shown: set[str] = set()
    grid = figure.subplots(1, len(panels), sharey=True, squeeze=False)[0]
    for axes, (name, wanted) in zip(grid, panels.items(), strict=True):
        found: dict[str, dict[str, list[float]]] = {}
        for line in lines:
            if wanted.items() <= line.items():
                some = found.setdefault(line["condition"], {})
                value = float(line["value"])
                some.setdefault(line["method"], []).append(value)
        measured = {one for some in found.values() for one in some}
        shown |= measured - {""}
        # What a fleet notices depends on no method.
        here = [one for one in (*METHOD_STYLES, "") if one in measured]
        for condition, some in found.items():
            for method, values in some.items():
                colour = METHOD_STYLES[method][0] if method else INK
                y = list(conditions).index(condition)
                y += 0.7 * ((here.index(method) + 0.5) / len(here) - 0.5)
                axes.plot(
                    values, [y] * len(values), "|", color=colour, ms=6,
                    alpha=0.6,
                )  # fmt: skip
                axes.plot(np.mean(values), y, color=colour, marker="o", ms=5)
        axes.set(xlim=(-0.03, 1.03), ylim=(len(conditions) - 0.5, -0.5))
        axes.set_xticks((0.0, 0.5, 1.0), ("0", "0.5", "1"))
        axes.set_yticks(range(len(conditions)), list(conditions.values()))
        axes.set_title(name)
        make_plain(axes)
    add_heading(figure, finding)
    methods = [name for name in METHOD_STYLES if name in shown]
    handles = [
        Line2D([], [], color=METHOD_STYLES[name][0], marker="o", ms=5, ls="")
        for name in methods
    ]  # fmt: skip
    handles.append(Line2D([], [], color=INK, marker="|", ms=8, ls=""))
    figure.legend(
        handles,
        [*map(title, methods), "one realisation"],
        loc="outside lower center", ncols=4 - len(methods) // 4, frameon=False,
        handletextpad=0.3, columnspacing=1.0,
    )  # fmt: skip
    figure.savefig(path, dpi=DPI)


def ladder(path: Path) -> None:
    """Draws the ladder of Suburbia, what costs most on top."""
    results = Results.read(ROOT / "docs/notes/ladder.csv")
    rows = results.where(map="suburbia", metric="relative_auc").rows
    shares: dict[object, list[float]] = {}
    for row in rows:
        shares.setdefault(row["cause"], []).append(row.value)
    folder = ROOT / "evaluation/study/experiments/causes"
    titles = {
        file.stem: yaml.safe_load(file.read_text())["title"]
        for file in folder.glob("*.yaml")
    }
    named = [
        replace(row, factors={**row.factors, "cause": name})
        for row in sorted(rows, key=lambda row: np.mean(shares[row["cause"]]))
        if (name := titles.get(str(row["cause"]), "All at once"))
        and row["cause"] != "none"
    ]
    draw_chart(
        {"kind": "matrix", "over": "cause", "metric": "relative_auc"},
        Results.of(named),
        printed=PrintStyle(WIDTH, title=False),
    ).save(path.with_suffix(""), [path.suffix[1:]])


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
