"""The pictures of cities, scans and programs on these pages."""

from __future__ import annotations

from collections.abc import Sequence
import io
from pathlib import Path
import subprocess
import sys
import tempfile
from typing import Any

from matplotlib.figure import Figure
from matplotlib.lines import Line2D
import numpy as np
from PIL import Image
from pydrake.math import RigidTransform
from scipy.spatial import cKDTree

from cns_drake import Scenario, load_scenario, make_station
from cns_drake.pictures import (
    StageScene,
    View,
    air_view,
    draw_drives,
    draw_stages,
    load_views,
)
from cns_drake.scenarios import plan_drive
from cns_drake.sensors import CameraSection, WeatherConfig
from docs.fill_numbers import csv_rows
from docs.picture_parts import (
    DPI,
    ROOT,
    TILE,
    WIDTH,
    set_dark_view,
    with_name,
    write_tiles,
)
from evaluation import make_method, open_drive
from evaluation.base import GONE_RGB, NEW_RGB, UNSEEN_RGB
from evaluation.map_update import Label, read_session
from evaluation.methods import LayeredOverlap, LayeredOverlapConfig
from evaluation.results import (
    INK,
    OWN,
    PALE,
    STAGE,
    OrthographicView,
    render,
    title,
    unit_rgb,
)
from worlds.maps import MapFolder, shipped_maps
from worlds.shapes import CLASS_IDS


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
    write_tiles(pictures, path, 960 if len(rows[0]["times"]) == 1 else TILE[0])


def growth(path: Path, city: str) -> None:
    """Draws all stages of a city from the air, two in a row."""
    folder = MapFolder(shipped_maps()[city])
    view = load_views(folder.views)["aerial"]
    pictures = [
        with_name(
            StageScene(file).photograph(view, *TILE, haze_length=np.inf),
            f"stage {stage}",
        )
        for stage, file in folder.stages().items()
    ]
    rows = [pictures[k : k + 2] for k in range(0, len(pictures), 2)]
    write_tiles(rows, path)


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
            view = air_view(plan_drive(drive))
            picture = scene.photograph(view, 640, 480, haze_length=np.inf)
            pictures.append(with_name(picture, name, 20 * len(files)))
    write_tiles([pictures], path, 640)


def quarter(path: Path, file: str, time: float, options: str = "") -> None:
    """Draws an imported file: from the air, a scan, a street in two stages."""
    figure = Figure(figsize=(WIDTH, 4.7), layout="constrained")
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
            axes.imshow(scene.photograph(view, *TILE))
            axes.set_title(f"stage {stage}", loc="left")
        wide = air_view(trajectory)
        air.imshow(scene.photograph(wide, *TILE))
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
    figure.savefig(path, dpi=DPI, pil_kwargs={"quality": 82})


def _imported(file: str, options: str, draft: str) -> MapFolder:
    folder = Path(draft) / Path(file).name.partition(".")[0].lower()
    command = [sys.executable, "-m", "cns_drake", "import", file]
    command += [*options.split(), "--output", str(folder)]
    subprocess.run(command, check=True)
    return MapFolder(folder)


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
        X_WS = lidar.GetOutputPort("X_WS").Eval(own)
        # A copy: the port writes the next pose into the same object.
        result.append((scan, RigidTransform(X_WS)))
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
    figure = Figure(figsize=(WIDTH, 7.9), layout="constrained")
    for axes, (name, kind) in zip(
        figure.subplots(2, 2).flat, kinds.items(), strict=True
    ):
        scenario = load_scenario("metropolis_04").with_lidar("os1-64")
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
        set_dark_view(axes, p_WS, 60.0)
    figure.savefig(path, dpi=DPI, pil_kwargs={"quality": 80})


def intensity(path: Path) -> None:
    """Draws the intensity of two seconds from above."""
    scenario = load_scenario("metropolis_04").with_lidar("os1-128")
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
    set_dark_view(axes, found[len(found) // 2][1], 22.0)
    figure.savefig(path, dpi=90, pil_kwargs={"quality": 80})


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
    figure = Figure(figsize=(WIDTH, 4.0), layout="constrained")
    panels = figure.subplots(1, 3, sharey=True)
    panels[0].scatter(*scans[0].T[:2], 0.5, INK, lw=0)
    colours = ("#b9c2ce", "#7d8997", INK, "#8e44ad", "#00918f")
    names = ("low", "middle", "high", "poles", "kerbs")
    for k, name in enumerate(names):
        some = cells[0][query.starts[k] : query.starts[k + 1]]
        size = 9 if name == "poles" else 3
        panels[1].scatter(*some.T, size, colours[k], lw=0, label=name)
    for one, other, colour, text in (
        (moved, cells[1], NEW_RGB, "new"),
        (cells[1], moved, GONE_RGB, "gone"),
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
    figure.savefig(path, dpi=DPI, bbox_inches="tight", pad_inches=0.05)


def one_query(
    path: Path,
    drives: Sequence[str],
    file: str,
    frame: int,
    methods: Sequence[str],
    notes: Sequence[tuple[int, str, float, float, float, float]],
) -> None:
    """Draws a query, its place, and another one that a method preferred.

    Args:
        path: the picture.
        drives: recordings of the query and of the places.
        file: the table of queries.
        frame: that of the query.
        methods: one that finds the place, and one that does not. In the place
            that it prefers, the query lies as this method estimates.
        notes: panel, text and its position, and the point that it is about.
    """
    queries, places = (open_drive(ROOT / folder) for folder in drives)
    answers = {
        row["method"]: row
        for row in csv_rows(file)
        if row["query_frame"] == str(frame)
        and (row["query"], row["database"]) == (queries.session, places.session)
        and (row[STAGE], row["protocol"], row["verified"])
        == (OWN, "random-yaw", "0")
    }
    found = [int(answers[name]["match_frame"]) for name in methods]
    away = [float(answers[name]["distance"]) for name in methods]
    scans = [
        np.stack([scan[axis] for axis in "xyz"], axis=1).astype(float)
        for scan in (queries.scan(frame), *map(places.scan, found))
    ]
    method = make_method(methods[1], {})
    described = [method.describe(scans[k]) for k in (0, 2)]
    wrong = method.build_database(described[1:])
    poses = [
        np.linalg.inv(places.X_WS[found[0]]) @ queries.X_WS[frame],
        *method.relative_poses(described[0], wrong, [0]),
    ]
    figure = Figure(figsize=(WIDTH, 7.9), layout="constrained")
    panels = figure.subplots(2, 2).ravel()
    # What is higher than the cars' bonnets.
    high = [scan[scan[:, 2] > -1.0] for scan in scans]
    panels[0].scatter(*high[0].T[:2], 1.5, INK, lw=0)
    for axes, X_PQ, place in zip(panels[2:], poses, high[1:], strict=True):
        moved = high[0] @ X_PQ[:3, :3].T + X_PQ[:3, 3]
        for one, other, colour in (
            (place, moved, GONE_RGB),
            (moved, place, NEW_RGB),
        ):
            both = cKDTree(other[:, :2]).query(one[:, :2])[0] <= 1.0
            axes.scatter(*one[~both].T[:2], 1.5, color=unit_rgb(colour), lw=0)
            axes.scatter(*one[both].T[:2], 1.5, color=INK, lw=0)
    for axes in panels[[0, 2, 3]]:
        axes.set(xlim=(-55, 55), ylim=(-55, 55), aspect="equal")
        axes.plot(0.0, 0.0, "^", color="#e69f00", mec=INK, ms=9)
    panels[1].set_aspect("equal", adjustable="datalim")
    for drive, shade in ((places, PALE), (queries, INK)):
        panels[1].plot(*drive.X_WS[:, :2, 3].T, color=shade, lw=1.5)
    p_W = [queries.X_WS[frame], *places.X_WS[found]]
    panels[1].plot(*p_W[0][:2, 3], "^", color="#e69f00", mec=INK, ms=9)
    panels[1].plot(*p_W[2][:2, 3], "X", color=INK, ms=9)
    words = (
        "the query, today",
        "where it is, and the answer",
        f"its place, {away[0]:.1f} m away",
        f"{title(methods[1])}'s answer, {away[1]:.0f} m away",
    )
    for axes, text in zip(panels, words, strict=True):
        axes.set_xticks([])
        axes.set_yticks([])
        axes.set_title(text, loc="left")
    for panel, text, x, y, *point in notes:
        panels[panel].annotate(
            text, point, (x, y), fontsize=12, color=INK,
            ha="center", va="center",
            bbox={"fc": "white", "ec": "none", "alpha": 0.85, "pad": 1.0},
            arrowprops={"arrowstyle": "-", "color": INK, "lw": 0.8},
        )  # fmt: skip
    handles = [
        Line2D([], [], color=unit_rgb(rgb), marker="o", ls="", ms=7)
        for rgb in (NEW_RGB, GONE_RGB)
    ]
    handles.insert(0, Line2D([], [], color=INK, marker="o", ls="", ms=7))
    figure.legend(
        handles, ("in both", "only in the query", "only in the place"),
        loc="outside lower center", ncols=3, frameon=False,
    )  # fmt: skip
    figure.savefig(path, dpi=DPI, bbox_inches="tight", pad_inches=0.05)


def taken(path: Path, file: str, below: str = "") -> None:
    """Takes a picture that a command made, and another one below it."""
    files = [ROOT / one for one in (file, below) if one]
    shown = [Image.open(one).convert("RGBA") for one in files]
    width = max(one.width for one in shown)
    whole = Image.new("RGB", (width, sum(one.height for one in shown)), "white")
    for k, one in enumerate(shown):
        whole.paste(one, (0, sum(other.height for other in shown[:k])), one)
    whole.thumbnail((1400, 1600))
    whole.save(path, quality=82)


def maps(path: Path, file: str, middle: Sequence[float]) -> None:
    """Draws a street in the maps of two drives, by the labels of `truth`."""
    colours = np.zeros((5, 3))
    colours[[Label.UNOBSERVED, Label.NEWLY_SEEN]] = UNSEEN_RGB
    colours[[Label.KEPT, Label.GONE, Label.NEW]] = (
        (120, 126, 134),
        GONE_RGB,
        NEW_RGB,
    )
    figure = Figure(figsize=(WIDTH, 2.7), layout="constrained")
    words = "older map: gone is violet", "newer map: new is red"
    view = OrthographicView(-60.0, 28.0, 12.0)
    for axes, side, text in zip(
        figure.subplots(1, 2), "AB", words, strict=True
    ):
        folder = (ROOT / file).parent / side
        points = read_session(folder).points
        labels = np.load(folder / "truth.npy")
        near = (np.abs(points - middle) < (42.0, 26.0, 26.0)).all(axis=1)
        rgb = colours[labels[near]].astype(np.uint8)
        axes.imshow(render(points[near], rgb, view).image)
        axes.set_title(text, loc="left")
        axes.set_axis_off()
    figure.savefig(path, dpi=DPI, bbox_inches="tight")


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
