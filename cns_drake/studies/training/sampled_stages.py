"""Random stages of a city: earlier ones lack buildings and trees."""

from collections.abc import Sequence
from typing import Any

import numpy as np
from scipy.spatial import cKDTree

from cns_drake.city import City

# Names of all stages, from older to newer.
STAGES = ("01", "02", "03")
# Classes of what comes and goes with a building, as in the shipped cities.
_BESIDE = frozenset(
    {
        "bicycle",
        "car",
        "fence",
        "other-object",
        "pole",
        "traffic-sign",
        "truck",
        "vegetation",
    }
)
# It goes with the nearest building up to this distance [m].
_BESIDE_WITHIN = 20.0


def draw_stages(city: City, rng: np.random.Generator) -> dict[str, dict]:
    """Returns random stages of a city, as the content of `stages.yaml`.

    The last stage is the whole city. In earlier stages, whole buildings are
    missing. Objects that stand, grow or park beside a missing building are
    missing, too, unless another building is nearer. Some other trees are also
    missing, and a few buildings and trees are lower than in the last stage.

    Args:
        city: the city.
        rng: random generator.
    """
    buildings = [s for s in city.structures if s.semantic_class == "building"]
    trees = [s for s in city.structures if s.kind == "tree"]
    beside = [s for s in city.structures if s.semantic_class in _BESIDE]
    near = cKDTree([s.xyz[:2] for s in buildings]).query(
        [s.xyz[:2] for s in beside], distance_upper_bound=_BESIDE_WITHIN
    )[1]
    stages: dict[str, dict] = {}
    gone: set[str] = set()
    for stage in reversed(STAGES[:-1]):
        cleared = set(
            _clustered_names(buildings, float(rng.uniform(0.1, 0.5)), rng)
        )
        absent = [
            *(s.name for s in buildings if s.name in cleared),
            *(
                s.name
                for s, k in zip(beside, near, strict=True)
                if k < len(buildings) and buildings[k].name in cleared
            ),
            *_random_names(trees, float(rng.uniform(0.0, 0.4)), rng),
        ]
        absent = [name for name in dict.fromkeys(absent) if name not in gone]
        gone.update(absent)
        lower = {
            "houses": {
                "height": float(rng.uniform(4.0, 9.0)),
                "structures": _random_names(
                    buildings, rng.uniform(0.0, 0.1), rng
                ),
            },
            "trees": {
                "height": float(rng.uniform(3.0, 6.0)),
                "structures": _random_names(trees, rng.uniform(0.0, 0.2), rng),
            },
        }
        stages[stage] = {
            "story": "Lots that are built on later, at random.",
            "absent": {"": absent} if absent else {},
            "lower": {k: v for k, v in lower.items() if v["structures"]},
        }
    return {
        **{stage: stages[stage] for stage in STAGES[:-1]},
        STAGES[-1]: {"story": "The whole city."},
    }


def _random_names(
    structures: Sequence[Any], share: float, rng: np.random.Generator
) -> list[str]:
    chosen = rng.random(len(structures)) < share
    return [s.name for s, one in zip(structures, chosen, strict=True) if one]


def _clustered_names(
    structures: Sequence[Any], share: float, rng: np.random.Generator
) -> list[str]:
    """Returns a share of structures: half at random, half near a place."""
    xy = np.array([s.xyz[:2] for s in structures])
    center = xy[int(rng.integers(len(xy)))]
    order = np.argsort(np.linalg.norm(xy - center, axis=1), kind="stable")
    near = [structures[k].name for k in order[: int(0.5 * share * len(order))]]
    return sorted({*near, *_random_names(structures, 0.5 * share, rng)})
