"""Builds the objects of `objects.yaml`, whose parts are given by formulas."""

from collections.abc import Iterator, Mapping
from functools import partial
import math
from pathlib import Path
from typing import Any

import numpy as np

from cns_drake.base.yaml_files import parse_yaml
from cns_drake.city.formulas import FUNCTIONS, value_of
from cns_drake.city.geometry.structures import (
    ROOT_DEPTH,
    Builder,
    CylinderShape,
    MeshShape,
    Model,
    Part,
    SphereShape,
    assemble,
    bar,
    block,
    post,
    triple,
)

_FILE = parse_yaml(Path(__file__).with_name("objects.yaml").read_bytes())
_COLOURS = _FILE.pop("colours")
# Keys of a part that are no formulas, or are evaluated once for all of its
# copies.
_PLAIN = frozenset({"name", "mesh", "repeat", "if", "draw", "parts"})
_Names = dict[str, Any]


def _functions(rng: np.random.Generator) -> _Names:
    """Returns the functions and colours that all formulas may use."""

    def uniform(low: float = 0.0, high: float = 1.0) -> float:
        return float(rng.uniform(low, high))

    def tinted(rgb: list[float], low: float, high: float) -> list[float]:
        tint = rng.uniform(low, high, 3)
        return np.round(np.multiply(rgb, tint), 3).tolist()

    return {
        **FUNCTIONS,
        **_COLOURS,
        "cos": math.cos,
        "sin": math.sin,
        "pi": math.pi,
        "uniform": uniform,
        "whole": lambda low, below: int(rng.integers(low, below)),
        "pick": lambda choices: choices[int(rng.integers(len(choices)))],
        "around": lambda size: round(uniform(-size, size), 3),
        "stretch": lambda low, high: round(uniform(low, high), 3),
        "tinted": tinted,
    }


def _build(
    entry: Mapping[str, Any], rng: np.random.Generator, **parameters: Any
) -> Model:
    """Returns an object from its description.

    Raises:
        TypeError: the object has no such parameter.
    """
    names = _functions(rng)
    known = entry.get("parameters", {})
    for name in parameters:
        if name not in known:
            raise TypeError(f"there is no parameter {name}")
    for name, formula in known.items():
        drawn = value_of(formula, names)
        names[name] = parameters.get(name, drawn)
    return assemble(*_parts(entry, names))


def _parts(group: Mapping[str, Any], names: _Names) -> Iterator[Part]:
    """Yields the parts of a group of parts, such as a whole object."""
    for name, formula in group.get("draw", {}).items():
        names[name] = value_of(formula, names)
    if "parts" not in group:
        yield _part(group, names)
        return
    for entry in group["parts"]:
        for k in range(value_of(entry.get("repeat", 1), names)):
            inner = dict(names)
            if "repeat" in entry:
                inner["k"] = k
                inner["spread"] = partial(_spread, k)
            if value_of(entry.get("if", True), inner):
                yield from _parts(entry, inner)


def _spread(k: int, distance: float, count: int) -> float:
    """Returns the place of the k-th of some things in a row centred on 0."""
    return distance * (k - (count - 1) / 2)


def _part(entry: Mapping[str, Any], names: _Names) -> Part:
    given = {
        key: value_of(formula, names)
        for key, formula in entry.items()
        if key not in _PLAIN
    }
    name, turn = entry["name"].format_map(names), given.get("turn", 0.0)
    at = given.get("at", (0.0, 0.0, 0.0))
    rgb = triple(given["rgb"]) if "rgb" in given else None
    if "post" in given:
        radius, height = given["post"]
        return post(name, radius, height, (at[0], at[1]), rgb)
    if "bar" in given:
        return bar(name, given["from"], given["to"], given["bar"], rgb)
    if "box" in given:
        return block(name, given["box"], at, turn, rgb)
    if "pillar" in given:
        x, y, height = given["pillar"]
        middle = (at[0], at[1], (height - ROOT_DEPTH) / 2)
        return block(name, (x, y, height + ROOT_DEPTH), middle, turn, rgb)
    shape: MeshShape | CylinderShape | SphereShape
    if "cylinder" in given:
        shape = CylinderShape(*given["cylinder"])
    elif "sphere" in given:
        shape = SphereShape(given["sphere"])
    else:
        mesh = entry["mesh"].format_map(names)
        shape = MeshShape(mesh, triple(given.get("scale", (1.0, 1.0, 1.0))))
    rpy = triple(given.get("rpy", (0.0, 0.0, turn)))
    return Part(name, shape, triple(at), rpy, rgb)


# Kind of object, such as `street_lights` -> name of an object -> its builder.
DESCRIBED: dict[str, dict[str, Builder]] = {
    kind: {
        name: Builder(entry["class"], partial(_build, entry))
        for name, entry in entries.items()
    }
    for kind, entries in _FILE.items()
}
