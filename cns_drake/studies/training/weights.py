"""Makes a file of weights for the method `learned`."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass
import json
from pathlib import Path
from typing import Any

import numpy as np

from cns_drake.base import (
    Cluster,
    Job,
    __version__,
    check_writable,
    completing,
    fingerprint,
    make_folder,
    resumable,
    run_jobs,
)
from cns_drake.studies.training.batches import HIDDEN_DEG, TrainingScans
from cns_drake.studies.training.city_scans import scan_city
from cns_drake.studies.training.descent import train
from cns_drake.studies.training.network import import_jax
from cns_drake.studies.training.sampled_city import DRAWN_STREETS, SampledCity
from evaluation.methods import SEEN_SHARES, WEIGHTS_VERSION
from evaluation.study import MakePart, Part

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
    """

    cities: int
    steps: int
    seed: int = 1
    change: bool = True
    returns: bool = True
    driver: bool = True
    drawn_streets: bool = False
    graded: bool = False

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
    check_writable(output)
    work = output.absolute().with_name(output.name + ".training")
    make_folder(work)
    drawn = plan.drawn()
    parts = [Part(work / f"city_{one.number:03d}.data") for one in drawn]
    jobs = [
        Job(
            f"city {one.number} ({one.map_name})",
            MakePart(part, scan_city, (one, work / f"city_{one.number:03d}")),
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
    with resumable():
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
    picture = output.with_suffix(".png")
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
