"""Makes a file of weights for the method `learned`."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
import json
from pathlib import Path
import shutil
from typing import Any

import numpy as np

from cns_drake.ground_truth import VisibleSurfaces, sights_of
from cns_drake.simulation import SimulatedDrive
from cns_drake.training.batches import HIDDEN_DEG, TrainingScans
from cns_drake.training.descent import train
from cns_drake.training.network import import_jax
from cns_drake.training.sampled_city import DRAWN_STREETS, SampledCity
from evaluation.base import (
    Cluster,
    InputError,
    Job,
    MakePart,
    Part,
    Reporter,
    __version__,
    check_writable,
    completing,
    figure_style,
    fingerprint,
    make_folder,
    poses,
    run_jobs,
    terminal,
    track,
)
from evaluation.drives import cloud_at, sample_frames
from evaluation.methods import SEEN_SHARES, WEIGHTS_VERSION, polar_image

# The streets of the cities, in turn. Metropolis is kept for tests.
MAPS = ("riverside", "suburbia", "downtown")
# Cities for each minute of one core.
_CITIES_A_MINUTE = 0.3
# Batches for each minute of one core.
_STEPS_A_MINUTE = 60


@dataclass(frozen=True)
class TrainingPlan:
    """The data and the length of a training.

    Attributes:
        cities: number of cities.
        steps: number of batches.
        seed: seed of all random numbers.
        change: whether drives see different stages and temporary changes.
        returns: whether some drives have calibrated returns and weather.
        driver: whether drivers wander and change lanes.
        drawn_streets: whether the streets of the cities are sampled at random.
        graded: whether exact overlaps, and not distances, determine which
            places are right.
        lidars: LiDARs of the drives, see `SampledCity`.
    """

    cities: int
    steps: int
    seed: int = 1
    change: bool = True
    returns: bool = True
    driver: bool = True
    drawn_streets: bool = False
    graded: bool = False
    lidars: tuple[str | Mapping[str, Any], ...] = ()

    @classmethod
    def of_minutes(cls, minutes: float, **fields: Any) -> TrainingPlan:
        """Returns a plan that takes about the given minutes on one core."""
        cities = max(2, round(_CITIES_A_MINUTE * minutes))
        steps = max(10, round(_STEPS_A_MINUTE * minutes))
        return cls(**{"cities": cities, "steps": steps, **fields})

    def drawn(self) -> list[SampledCity]:
        """Returns the cities on which the network is trained."""
        return [
            SampledCity(
                DRAWN_STREETS
                if self.drawn_streets
                else MAPS[number % len(MAPS)],
                self.seed,
                number,
                change=self.change,
                returns=self.returns,
                driver=self.driver,
                graded=self.graded,
                lidars=self.lidars,
            )
            for number in range(self.cities)
        ]


def make_weights(
    plan: TrainingPlan,
    output: Path,
    command: str,
    cluster: Cluster,
) -> Path:
    """Trains the method `learned` on random cities; writes its weights.

    The folder `<output>.training` keeps the scans and the state, so that an
    interrupted training can be continued.

    Args:
        plan: cities, drives and steps.
        output: file of weights.
        command: command line that is stored in the file.
        cluster: runs the jobs.

    Returns:
        Path of the picture of the training curve: `output` with the ending
        `.png`.

    Raises:
        InputError: JAX is not installed, a file cannot be written, or cities
            could not be generated.
    """
    import_jax()
    picture = output.with_suffix(".png")
    for file in (output, picture):
        check_writable(file)
    work = output.absolute().with_name(output.name + ".training")
    make_folder(work)
    drawn = plan.drawn()
    parts = [Part(work / f"city_{one.number:03d}.data") for one in drawn]
    jobs = [
        Job(
            f"city {one.number} ({one.map_name})",
            MakePart(part, _scan_city, (one, work / f"city_{one.number:03d}")),
        )
        for one, part in zip(drawn, parts, strict=True)
    ]
    run_jobs(jobs, cluster)
    scans = TrainingScans.joined(
        [
            TrainingScans(
                one["images"],
                one["xy"],
                one["drives"],
                one["drives"],
                one.get("overlaps"),
            )
            for one in (part.read() for part in parts)
        ]
    )
    digest = fingerprint({"cities": [part.identity() for part in parts]})
    with terminal.resumable():
        values, curve = train(
            scans, plan.steps, plan.seed, work / "state.data", digest
        )
    seen = scans.images.any(axis=(1, 3)).mean(axis=1)
    least = float(seen.min()) * (1.0 - HIDDEN_DEG[1] / 360.0)
    made_by = {
        "command": command,
        "version": __version__,
        "digest": digest,
        "scans": len(scans.xy),
        "plan": asdict(plan),
    }
    write_weights(output, values, (least, float(seen.max())), made_by)
    _draw_curve(curve, picture.with_suffix(""))
    return picture


def write_weights(
    path: Path,
    values: Mapping[str, np.ndarray],
    seen: tuple[float, float],
    made_by: Mapping[str, Any],
) -> None:
    """Writes a file of weights for the method `learned`.

    Args:
        path: the file.
        values: name -> weights, as `train` returns them.
        seen: share of the sectors of a scan's polar image that contain points;
            the least and the greatest value over all training scans.
        made_by: description of the training, ready for JSON.
    """
    arrays: dict[str, Any] = {
        "version": np.int64(WEIGHTS_VERSION),
        "made_by": json.dumps(made_by),
        SEEN_SHARES: np.array(seen, np.float32),
        **{name: np.asarray(one) for name, one in values.items()},
    }
    with completing(path) as part_file, open(part_file, "wb") as stream:
        np.savez(stream, **arrays)


@figure_style()
def _draw_curve(curve: np.ndarray, stem: Path) -> None:
    """Draws the loss, and the share of right answers, over the steps."""
    from matplotlib.figure import Figure

    from evaluation.results import save_figure

    size = max(1, len(curve) // 40)
    kept = curve[: len(curve) // size * size].reshape(-1, size, 2).mean(axis=1)
    steps = (np.arange(len(kept)) + 0.5) * size
    figure = Figure(figsize=(6.0, 4.2), layout="constrained")
    loss, right = figure.subplots(2, 1, sharex=True)
    loss.plot(steps, kept[:, 0])
    right.plot(steps, kept[:, 1])
    loss.set(ylabel="loss", ylim=(0.0, None))
    right.set(
        xlabel="step",
        ylabel="right top-ranked places in a batch",
        ylim=(0.0, 1.0),
    )
    save_figure(figure, stem, ("png",))


# Distance between two scans [m].
_SCAN_SPACING = 6.0
# As in the protocol of the paper [m].
_MAX_RANGE = 100.0
# Scans farther apart count as having no overlap [m].
_FARTHEST_OVERLAP = 50.0
# The overlap is estimated from about this number of points of a scan.
_OVERLAP_POINTS = 1000


def _scan_city(
    reporter: Reporter, drawn: SampledCity, folder: Path
) -> dict[str, np.ndarray]:
    """Simulates the drives through a city, without recording them.

    Args:
        folder: folder to which the map of the city is written; the folder is
            removed at the end.

    Returns:
        `images` (N, RINGS, SECTORS, CHANNELS) uint8 polar images of the scans,
        `xy` (N, 2) positions of the sensors [m] and `drives` (N,) number of
        each scan's drive. If the field `graded` of the city is true, also
        `overlaps` (N, N) float16, the share of each scan that is visible from
        the place of each other scan.
    """
    images, xy, numbers = [], [], []
    taken: list[_TakenScan] = []
    try:
        drawn.write(folder)
        for number, scenario in enumerate(drawn.drives(folder)):
            try:
                drive = SimulatedDrive(scenario)
            except InputError as error:
                # A draw may be impossible, such as a U-turn in a narrow road.
                reporter.note(f"{scenario.name} left out: {error}")
                continue
            frames = sample_frames(drive.X_WS[:, :3, 3], _SCAN_SPACING)
            height = next(iter(scenario.lidars.values())).xyz[2]
            for frame in track(
                frames, f"simulating {scenario.name}", len(frames), "scans"
            ):
                points = cloud_at(drive, int(frame), 1, _MAX_RANGE)
                images.append(polar_image(points, height))
                xy.append(drive.X_WS[frame, :2, 3])
                numbers.append(number)
                taken.append(
                    _TakenScan(drive, int(frame), _overlap_sample(points))
                )
        found = {"overlaps": _overlaps(taken, reporter)} if drawn.graded else {}
    finally:
        shutil.rmtree(folder, ignore_errors=True)
    return {
        "images": np.stack(images),
        "xy": np.stack(xy),
        "drives": np.array(numbers),
        **found,
    }


@dataclass(frozen=True)
class _TakenScan:
    """A scan of a drive, with some of its points in the LiDAR's frame."""

    drive: SimulatedDrive
    frame: int
    points: np.ndarray


def _overlap_sample(points: np.ndarray) -> np.ndarray:
    return points[:: max(1, len(points) // _OVERLAP_POINTS)].astype(float)


def _overlaps(scans: Sequence[_TakenScan], reporter: Reporter) -> np.ndarray:
    """Returns which share of each scan is visible from every other scan.

    The share is exact (see `exact_overlap`). It is 0 for two scans of one drive
    and for scans over 50 m apart.

    Returns:
        (N, N) float16: a row for each scan, a column for each place.
    """
    result = np.zeros((len(scans), len(scans)), np.float16)
    X_WSs = np.stack([one.drive.X_WS[one.frame] for one in scans])
    places = track(enumerate(scans), "comparing scans", len(scans), "scans")
    for column, place in places:
        seen = VisibleSurfaces(sights_of(place.drive)(place.frame), _MAX_RANGE)
        X_PW = poses.inverse(X_WSs[column])
        apart = np.linalg.norm(X_WSs[:, :2, 3] - X_WSs[column, :2, 3], axis=1)
        for row in np.flatnonzero(apart <= _FARTHEST_OVERLAP).tolist():
            if scans[row].drive is not place.drive:
                X_PS = X_PW @ X_WSs[row]
                p_P = scans[row].points @ X_PS[:3, :3].T + X_PS[:3, 3]
                result[row, column] = seen.share_of(p_P)
    return result
