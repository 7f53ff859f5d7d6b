"""Trains the method `learned` on scans of randomly generated cities.

In a batch, scans of one drive are queries for places of another drive through
the same city. The training compares queries and places in the same way as the
method. The loss is the cross entropy between a softmax over all places of the
batch and the target weights of the places. The target weight of a place grows
with the exact overlap of its scan with the query's scan, or falls with its
distance from the query, so that more similar places rank higher.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass
import json
from pathlib import Path
from typing import Any

import numpy as np
from scipy.linalg import block_diag

from cns_drake.base.errors import InputError
from cns_drake.base.files import check_writable, completing, make_folder
from cns_drake.base.jobs.cluster import Cluster
from cns_drake.base.jobs.fingerprint import fingerprint
from cns_drake.base.jobs.running import Job, run_jobs
from cns_drake.base.progress import track
from cns_drake.base.terminal import resumable
from cns_drake.base.version import __version__
from cns_drake.studies.training_drives import (
    DRAWN_STREETS,
    SampledCity,
    scan_city,
)
from evaluation.methods.learned import (
    FEATURES,
    FREQUENCIES,
    HEADINGS,
    LAYERS,
    SEEN_SHARES,
    TURNS,
    WEIGHTS_VERSION,
)
from evaluation.methods.polar_images import SECTORS
from evaluation.study.parts import MakePart, Part

# Number of cities in a batch.
_CITIES = 2
# Number of clusters of queries in each of these cities.
_CLUSTERS = 4
# Number of queries in a cluster; every query comes with a place near and one
# further along.
_QUERIES = 5
# The queries of a cluster lie within this distance [m].
_CLUSTER = 40.0
# Greatest distance of a right place [m].
_RIGHT_WITHIN = 7.5
# Least distance of a wrong place [m]; places in between do not count.
_WRONG_FROM = 11.0
# Greatest distance of the places further along [m].
_ALONG = 35.0
# Standard deviation of the Gaussian by which weights fall with distance [m].
_DEVIATION = 4.0
# A query counts if its most similar place has at least this overlap.
_LEAST_OVERLAP = 0.2
# Right places have at least this share of the greatest overlap.
_NEAR_BEST = 0.9
# Their weights are this power of the share.
_WEIGHT_POWER = 16
_TEMPERATURE = 0.05
# Share of the images with an occluded sector.
_HIDDEN_SHARE = 0.4
# Least and greatest angle of an occluded sector.
_HIDDEN_DEG = (30.0, 120.0)
# Share of the images with lost pixels.
_LOST_SHARE = 0.3
# Greatest share of the pixels of an image that are lost.
_MOST_LOST = 0.3
# Rate of learning after the warm-up.
_RATE = 2e-3
# Rate of learning in the end.
_LEAST_RATE = 2e-5
# Number of steps of the warm-up.
_WARM_UP = 30
_DECAYS = (0.9, 0.99)
_GRADIENT = 1.0
_KEPT_EVERY = 50

Parameters = dict[str, Any]


@dataclass(frozen=True)
class TrainingScans:
    """Scans of several drives through several cities.

    Attributes:
        images: (N, RINGS, SECTORS, CHANNELS) uint8 polar images, see
            `evaluation.methods.polar_images.polar_image`.
        xy: (N, 2) positions of the sensors [m].
        cities: (N,) number of the city.
        drives: (N,) number of the drive in its city.
        overlaps: (N, N) share of each scan that is visible from the place of
            each other scan. None if distances, and not overlaps, determine
            which places are right.
    """

    images: np.ndarray
    xy: np.ndarray
    cities: np.ndarray
    drives: np.ndarray
    overlaps: np.ndarray | None = None

    @classmethod
    def of(cls, parts: Sequence["TrainingScans"]) -> "TrainingScans":
        """Joins the scans of several cities into one object.

        Args:
            parts: the scans of each city. The result numbers the cities in
                this order.
        """
        overlaps = [part.overlaps for part in parts]
        return cls(
            np.concatenate([part.images for part in parts]),
            np.concatenate([part.xy for part in parts]),
            np.repeat(np.arange(len(parts)), [len(p.xy) for p in parts]),
            np.concatenate([part.drives for part in parts]),
            None if overlaps[0] is None else block_diag(*overlaps),
        )


@dataclass(frozen=True)
class Batch:
    """Images of Q queries and P places, with the ground truth.

    Attributes:
        images: (Q + P, RINGS, SECTORS, CHANNELS) uint8 polar images, queries
            first.
        weights: (Q, P) weights of right places, with sum 1 in each row.
        counts: (Q, P) whether a place takes part in the softmax of the loss.
    """

    images: np.ndarray
    weights: np.ndarray
    counts: np.ndarray


class Sampler:
    """Samples batches of scans for training.

    A batch depends only on the seed and on the number of its step.
    """

    def __init__(self, scans: TrainingScans, seed: int):
        """Finds the drives that share a city.

        Args:
            scans: all scans.
            seed: seed of the random sampling.

        Raises:
            InputError: no city has two drives.
        """
        self._scans = scans
        self._seed = seed
        self._groups = {
            int(city): {
                int(drive): np.flatnonzero(
                    (scans.cities == city) & (scans.drives == drive)
                )
                for drive in np.unique(scans.drives[scans.cities == city])
            }
            for city in np.unique(scans.cities)
        }
        self._groups = {
            city: drives
            for city, drives in self._groups.items()
            if len(drives) > 1
        }
        if not self._groups:
            raise InputError("training: no city has two drives that meet")

    def batch(self, step: int) -> Batch:
        """Returns the batch of a training step.

        Args:
            step: number of the step.
        """
        rng = np.random.default_rng([self._seed, step])
        queries: list[int] = []
        places: list[int] = []
        wanted = _CITIES * _CLUSTERS * _QUERIES
        keys = list(self._groups)
        size = min(_CITIES, len(keys))
        cities = [keys[k] for k in rng.permutation(len(keys))[:size]]
        for turn in range(100):
            # Some clusters lie where the two drives do not meet.
            of_query, of_places = self._cluster(cities[turn % size], rng)
            room = wanted - len(queries)
            queries += of_query[:room]
            places += of_places[: 2 * room]
            if len(queries) == wanted:
                break
        else:
            raise InputError("training: the drives of a city hardly meet")
        scans = self._scans
        distance = np.linalg.norm(
            scans.xy[queries][:, None] - scans.xy[places], axis=2
        )
        same = scans.cities[queries][:, None] == scans.cities[places]
        if scans.overlaps is None:
            right = same & (distance <= _RIGHT_WITHIN)
            weights = np.exp(-0.5 * (distance / _DEVIATION) ** 2) * right
            counts = right | ~same | (distance >= _WRONG_FROM)
        else:
            shared = scans.overlaps[np.ix_(queries, places)].astype(float)
            part = shared / shared.max(axis=1, keepdims=True)
            weights = np.where(part >= _NEAR_BEST, part**_WEIGHT_POWER, 0.0)
            counts = np.ones_like(same)
        images = scans.images[[*queries, *places]]
        _augment(images, rng)
        return Batch(
            images,
            (weights / weights.sum(axis=1, keepdims=True)).astype(np.float32),
            counts,
        )

    def _cluster(
        self, city: int, rng: np.random.Generator
    ) -> tuple[list[int], list[int]]:
        """Returns neighbouring queries, with a right and a wrong place each."""
        xy = self._scans.xy
        drives = list(self._groups[city].values())
        first, second = rng.permutation(len(drives))[:2]
        asked, asked_of = drives[first], drives[second]
        center = xy[asked[int(rng.integers(len(asked)))]]
        near = asked[np.linalg.norm(xy[asked] - center, axis=1) <= _CLUSTER]
        queries: list[int] = []
        places: list[int] = []
        for query in rng.permutation(near)[:_QUERIES].tolist():
            away = np.linalg.norm(xy[asked_of] - xy[query], axis=1)
            is_right, is_wrong = away <= _RIGHT_WITHIN, away >= _WRONG_FROM
            if self._scans.overlaps is not None:
                shared = self._scans.overlaps[query, asked_of].astype(float)
                is_right = shared >= max(
                    _LEAST_OVERLAP, _NEAR_BEST * shared.max()
                )
                is_wrong = ~is_right
            right = asked_of[is_right]
            along = asked_of[is_wrong & (away <= _ALONG)]
            if len(right) and len(along):
                queries.append(query)
                places += [int(rng.choice(right)), int(rng.choice(along))]
        return queries, places


def _augment(images: np.ndarray, rng: np.random.Generator) -> None:
    """Augments images in place: random yaws, occluded sectors, lost pixels."""
    is_mirrored = rng.random() < 0.5
    for number, image in enumerate(images):
        if is_mirrored:
            image = image[:, ::-1]
        image = np.roll(image, int(rng.integers(SECTORS)), axis=1)
        if rng.random() < _HIDDEN_SHARE:
            width = rng.uniform(*_HIDDEN_DEG) / 360.0 * SECTORS
            image[:, : int(width)] = 0
            image = np.roll(image, int(rng.integers(SECTORS)), axis=1)
        if rng.random() < _LOST_SHARE:
            share = rng.uniform(0.0, _MOST_LOST)
            image[rng.random(image.shape[:2]) < share] = 0
        images[number] = image


def import_jax() -> None:
    """Imports JAX, an optional dependency.

    Raises:
        InputError: it is not installed.
    """
    try:
        import jax  # noqa: F401
    except ImportError as error:
        raise InputError(
            "train: it needs JAX: pip install 'cns-drake[train]'"
        ) from error


def start_parameters(seed: int) -> Parameters:
    """Returns random weights of the network, with which training starts.

    Their variance follows He et al., ICCV 2015.
    """
    rng = np.random.default_rng([seed, 0xC0DE])
    found: Parameters = {}
    for number, (before, after, _, _) in enumerate(LAYERS):
        scale = (2.0 / (9 * before)) ** 0.5
        kernel = scale * rng.standard_normal((9 * before, after))
        found[f"kernel_{number}"] = kernel.astype(np.float32)
        found[f"bias_{number}"] = np.zeros(after, np.float32)
    return found


def features(parameters: Parameters, images: Any) -> Any:
    """Returns the network's feature maps of images, as a JAX array.

    Args:
        parameters: weights of the network.
        images: (N, RINGS, SECTORS, CHANNELS) polar images.

    Returns:
        (N, TURNS, FEATURES), of unit length for each image.
    """
    import jax
    from jax import lax
    import jax.numpy as jnp

    cells = images.astype(jnp.float32) / 255.0
    for number, (before, after, down, along) in enumerate(LAYERS):
        cells = jnp.concatenate(
            [cells[:, :, -1:], cells, cells[:, :, :1]], axis=2
        )
        cells = jnp.pad(cells, ((0, 0), (1, 1), (0, 0), (0, 0)))
        cells = lax.conv_general_dilated(
            cells,
            parameters[f"kernel_{number}"].reshape(3, 3, before, after),
            (down, along),
            "VALID",
            dimension_numbers=("NHWC", "HWIO", "NHWC"),
        )
        cells += parameters[f"bias_{number}"]
        if number < len(LAYERS) - 1:
            cells = jax.nn.relu(cells)
    maps = cells.transpose(0, 2, 1, 3).reshape(len(images), TURNS, FEATURES)
    length = jnp.sqrt((maps**2).sum(axis=(1, 2), keepdims=True) + 1e-12)
    return maps / length


def scores(queries: Any, places: Any) -> Any:
    """Returns the similarity of Q queries and P places, (Q, P), as a JAX array.

    The similarity is the correlation of two feature maps at the best heading.

    Args:
        queries: (Q, TURNS, FEATURES) feature maps, see `features`.
        places: (P, TURNS, FEATURES) feature maps.
    """
    import jax.numpy as jnp

    own, others = (
        jnp.fft.rfft(maps, axis=1)[:, :FREQUENCIES]
        for maps in (queries, places)
    )
    products = jnp.einsum("qfc,pfc->qpf", jnp.conj(own), others)
    turned = jnp.fft.irfft(products * (HEADINGS / TURNS), n=HEADINGS, axis=2)
    return turned.max(axis=2)


def train(
    scans: TrainingScans,
    steps: int,
    seed: int,
    state: Path,
    digest: str = "",
    on_step: Callable[[int, Parameters], None] = lambda step, values: None,
) -> tuple[Parameters, np.ndarray]:
    """Trains the network of the method `learned`; can continue a training.

    Args:
        scans: images of the scans, and which scans show the same place.
        steps: number of batches.
        seed: seed of all random numbers.
        state: file with the state of the training. If the file exists, the
            training continues from this state.
        digest: digest of the scans.
        on_step: is called with the number of each step and the weights.

    Returns:
        The weights; and (steps, 2), for each step the loss and the share of
        queries whose top-ranked place is right.

    Raises:
        InputError: no city has two drives that meet, the state is damaged or
            belongs to a training with other arguments, or JAX is not installed.
    """
    import_jax()
    import jax
    import jax.numpy as jnp

    def loss(values: Parameters, images: Any, weights: Any, counts: Any) -> Any:
        maps = features(values, images)
        found = scores(maps[: len(weights)], maps[len(weights) :])
        logits = jnp.where(counts, found / _TEMPERATURE, -1e9)
        cross = -(weights * jax.nn.log_softmax(logits, axis=1)).sum(axis=1)
        best = jnp.take_along_axis(
            weights, logits.argmax(axis=1)[:, None], axis=1
        )
        return cross.mean(), (best > 0.0).mean()

    @jax.jit
    def update(
        values: Parameters,
        first: Parameters,
        second: Parameters,
        step: Any,
        images: Any,
        weights: Any,
        counts: Any,
    ) -> Any:
        """Takes one step of Adam; compiled by JAX.

        Args:
            values: weights of the network.
            first: running means of the gradients.
            second: running means of the squared gradients.
            step: number of the step, from 0.
            images, weights, counts: fields of a `Batch`: its polar images, the
                weights of the right places, and which places take part in the
                softmax.

        Returns:
            The new `values`, `first` and `second`; the loss of the batch before
            the step; and the share of its queries whose top-ranked place was
            right.
        """
        (value, right), slope = jax.value_and_grad(loss, has_aux=True)(
            values, images, weights, counts
        )
        length = jnp.sqrt(sum((one**2).sum() for one in slope.values()))
        slope = {
            name: one * jnp.minimum(1.0, _GRADIENT / (length + 1e-9))
            for name, one in slope.items()
        }
        # Adam (Kingma and Ba, ICLR 2015); the rate falls like a cosine.
        progress = (step + 1.0) / steps
        rate = _LEAST_RATE + 0.5 * (_RATE - _LEAST_RATE) * (
            1.0 + jnp.cos(jnp.pi * progress)
        )
        rate *= jnp.minimum(1.0, (step + 1.0) / _WARM_UP)
        one, two = _DECAYS
        first = {k: one * first[k] + (1 - one) * v for k, v in slope.items()}
        second = {
            k: two * second[k] + (1 - two) * v**2 for k, v in slope.items()
        }
        values = {
            k: v
            - rate
            * (first[k] / (1 - one ** (step + 1.0)))
            / (jnp.sqrt(second[k] / (1 - two ** (step + 1.0))) + 1e-8)
            for k, v in values.items()
        }
        return values, first, second, value, right

    sampler = Sampler(scans, seed)
    made_of = {
        "training": [WEIGHTS_VERSION, digest, len(scans.xy), steps, seed]
    }
    kept = Part(state)
    start = start_parameters(seed)
    zero = {name: np.zeros_like(one) for name, one in start.items()}
    moments = (start, zero, zero)
    curve = []
    if state.exists():
        if not kept.is_current(made_of):
            raise InputError(
                f"{state}: damaged, or the state of another training; delete it"
            )
        moments, curve = kept.read()
    begin = len(curve)
    for step in track(range(begin, steps), "training", steps - begin, "steps"):
        batch = sampler.batch(step)
        *new, value, right = update(
            *moments,
            np.float32(step),
            batch.images,
            batch.weights,
            batch.counts,
        )
        moments = tuple(new)
        curve.append((float(value), float(right)))
        if (step + 1) % _KEPT_EVERY == 0 or step + 1 == steps:
            known = [{k: np.asarray(v) for k, v in one.items()} for one in new]
            kept.write(made_of, (tuple(known), curve))
            on_step(step + 1, moments[0])
    values = {name: np.asarray(one) for name, one in moments[0].items()}
    return values, np.array(curve)


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
        graded: whether exact overlaps determine which places are right, instead
            of distances.
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
    def of_minutes(cls, minutes: float, **fields: Any) -> "TrainingPlan":
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
    scans = TrainingScans.of(
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
    least = float(seen.min()) * (1.0 - _HIDDEN_DEG[1] / 360.0)
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


def _draw_curve(curve: np.ndarray, stem: Path) -> None:
    """Draws the loss, and the share of right answers, over the steps."""
    from matplotlib.figure import Figure

    from evaluation.results.drawing import save

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
    save(figure, stem, ("png",))
