"""Draws one scan in four kinds of weather, and intensity from above.

python docs/weather_pictures.py docs/pictures
"""

from __future__ import annotations

from pathlib import Path
import sys

from matplotlib.axes import Axes
from matplotlib.figure import Figure
import numpy as np

from cns_drake import Scenario, load_scenario, make_station
from cns_drake.scene.semantics import CLASS_IDS
from cns_drake.sensors.lidar.config import WeatherConfig

WEATHER = {
    "clear": WeatherConfig(),
    "fog, 60 m": WeatherConfig(visibility=60.0),
    "rain, 25 mm/h": WeatherConfig(rain=25.0),
    "snowfall, 4 mm/h": WeatherConfig(snowfall=4.0),
}
# When the car is at a junction and on a boulevard [s], and how many scans
# from there on are laid over each other.
_TIME, _DRIVE_TIME = 18.0, 6.0
_NUM_SCANS = 20
_SPAN, _NEAR = 60.0, 22.0


def scan_at(
    scenario: Scenario, times: np.ndarray
) -> list[tuple[np.ndarray, np.ndarray]]:
    """Returns a scan at each time, its points in the world, and from where."""
    diagram = make_station(scenario)
    context = diagram.CreateDefaultContext()
    lidar = diagram.GetSubsystemByName("lidar")
    result = []
    for time in times:
        context.SetTime(time)
        scan = diagram.GetOutputPort("lidar_scan").Eval(context).copy()
        own = lidar.GetMyContextFromRoot(context)
        X_WS = lidar.GetOutputPort("X_WS").Eval(own)
        p_S = np.stack([scan[axis] for axis in "xyz"])
        for axis, values in zip("xyz", X_WS @ p_S, strict=True):
            scan[axis] = values
        result.append((scan, X_WS.translation()))
    return result


def draw_weather(folder: Path) -> None:
    """Draws the same scan in each weather, what it scatters in red."""
    figure = Figure(figsize=(10.0, 10.4), layout="constrained")
    for axes, (name, weather) in zip(
        figure.subplots(2, 2).flat, WEATHER.items(), strict=True
    ):
        scenario = load_scenario("metropolis_04").with_lidar_preset("os1-64")
        scenario = scenario.with_returns("calibrated")
        scenario = scenario.model_copy(update={"weather": weather})
        scan, p_WS = scan_at(scenario, np.array([_TIME]))[0]
        is_weather = scan["label"] == CLASS_IDS["outlier"]
        solid, drops = scan[~is_weather], scan[is_weather]
        shade = np.sqrt(np.clip(solid["intensity"], 0.0, 100.0))
        axes.scatter(
            solid["x"], solid["y"], 0.35, shade, cmap="viridis", lw=0, vmax=9
        )
        axes.scatter(drops["x"], drops["y"], 1.2, "#ff4040", lw=0)
        axes.set_title(
            f"{name}: {len(solid)} points of surfaces, {len(drops)} of weather",
            fontsize=10,
        )
        _set_view(axes, p_WS, _SPAN)
    figure.savefig(folder / "weather.jpg", dpi=90, pil_kwargs={"quality": 80})


def draw_intensity(folder: Path) -> None:
    """Draws the intensity of some seconds from above."""
    scenario = load_scenario("metropolis_04").with_lidar_preset("os1-128")
    times = _DRIVE_TIME + 0.1 * np.arange(_NUM_SCANS)
    found = scan_at(scenario.with_returns("calibrated"), times)
    cloud = np.concatenate([scan for scan, _ in found])
    cloud = cloud[cloud["z"] < 2.5]
    cloud = cloud[np.argsort(cloud["z"], kind="stable")]
    middle = found[_NUM_SCANS // 2][1]
    figure = Figure(figsize=(10.0, 10.0), layout="constrained")
    axes = figure.subplots()
    axes.scatter(
        cloud["x"], cloud["y"], 0.3, np.sqrt(cloud["intensity"]), cmap="gray",
        lw=0, vmin=0, vmax=8,
    )  # fmt: skip
    _set_view(axes, middle, _NEAR)
    figure.savefig(folder / "intensity.jpg", dpi=90, pil_kwargs={"quality": 80})


def _set_view(axes: Axes, middle: np.ndarray, span: float) -> None:
    axes.set_facecolor("black")
    axes.set_aspect("equal")
    axes.set_xlim(middle[0] - span, middle[0] + span)
    axes.set_ylim(middle[1] - span, middle[1] + span)
    axes.set_xticks([])
    axes.set_yticks([])


if __name__ == "__main__":
    draw_weather(Path(sys.argv[1]))
    draw_intensity(Path(sys.argv[1]))
