"""Public functions take empty collections, or say in a line what is missing.

The doors of all packages list them, and classes. Each is called with an empty
collection for every parameter that is one; an array is empty in the first of
its usual shapes and types that the function takes.
"""

from collections import abc
import importlib
import inspect
import itertools
import typing

from helpers.door_contract import ROOT, listed
import numpy as np
import pytest
import shapely

from cns_drake.sensors import POINT_DTYPE
from evaluation.base import InputError
from evaluation.localisation import QUERY

PACKAGES = sorted(
    ".".join(stub.parent.relative_to(ROOT).parts)
    for house in ("evaluation", "worlds", "cns_drake")
    for stub in (ROOT / house).glob("*/__init__.pyi")
)
COLLECTIONS = (
    abc.Sequence, abc.Iterable, abc.Collection, abc.Mapping, abc.Set, list,
    tuple, dict, set,
)  # fmt: skip
SHAPES = ((0,), (0, 2), (0, 3), (0, 3, 3), (0, 4, 4), (0, 2, 2), (0, 0))
# Points of a scan, and results of a localisation.
RECORDS = [*POINT_DTYPE.descr, *QUERY.descr]
# Functions of three numbers, an image, an outline, elevations, polygons, poses,
# a drive, and of one choice, drive or method at least: their sequences cannot
# be empty.
NEVER_EMPTY = (
    "cns_drake.recording.make_compressed_image",
    "cns_drake.recording.make_image",
    "cns_drake.sensors.SpinningPattern",
    "evaluation.base.revolved",
    "evaluation.recognition.common_blocks",
    "evaluation.recognition.joined_scans",
    "evaluation.recognition.pose_error",
    "evaluation.results.make_page_drive",
    "worlds.shapes.block",
    "worlds.shapes.cut_ears",
    "worlds.shapes.pick_key",
    "worlds.shapes.roll_pitch_yaw",
    "worlds.shapes.triple",
)
# Type of another parameter -> a value.
VALUES = {
    float: 1.0,
    int: 1,
    bool: False,
    str: "a",
    np.random.Generator: np.random.default_rng(0),
    shapely.Polygon: shapely.box(0, 0, 1, 1),
    shapely.geometry.base.BaseGeometry: shapely.box(0, 0, 1, 1),
}


def empties(hint):
    """Returns empty values for a parameter; None if it is no collection."""
    if typing.get_origin(hint) in (typing.Union, type(int | str)):
        found = [empties(one) for one in typing.get_args(hint)]
        return next((one for one in found if one), None)
    if hint is np.ndarray:
        arrays = [np.zeros(shape) for shape in SHAPES]
        return [*arrays, np.zeros(0, int), np.zeros(0, RECORDS)]
    origin = typing.get_origin(hint) or hint
    if origin is tuple and Ellipsis not in typing.get_args(hint):
        return None
    if origin in COLLECTIONS:
        is_map = issubclass(origin, abc.Mapping)
        return [{} if is_map else set() if issubclass(origin, abc.Set) else ()]
    return None


def calls(function):
    """Returns the possible arguments of a call; none if one is not known."""
    try:
        is_class = inspect.isclass(function)
        hints = typing.get_type_hints(
            function.__init__ if is_class else function
        )
        parameters = inspect.signature(function).parameters
    except (NameError, ValueError):
        # A name for type checkers alone, or a class without a signature.
        return []
    choices, has_empty = {}, False
    for name, one in parameters.items():
        if one.default is not one.empty or one.kind in (
            one.VAR_KEYWORD, one.VAR_POSITIONAL,
        ):  # fmt: skip
            continue
        found = empties(hints.get(name))
        has_empty |= found is not None
        if typing.get_origin(hints.get(name)) is typing.Literal:
            found = typing.get_args(hints[name])
        if found is None and hints.get(name) in VALUES:
            found = [VALUES[hints[name]]]
            if hints[name] is float:  # Limits are in ascending order.
                found = [1.0 + len(choices)]
        if found is None:
            return []
        choices[name] = found
    if not has_empty:
        return []
    return [
        dict(zip(choices, some, strict=True))
        for some in itertools.product(*choices.values())
    ]


def functions():
    seen = {}
    for package in PACKAGES:
        door = importlib.import_module(package)
        for name in listed(package):
            function = getattr(door, name)
            is_one = inspect.isfunction(function) or inspect.isclass(function)
            if inspect.isabstract(function):
                continue
            if is_one and calls(function):
                seen.setdefault(function, f"{package}.{name}")
    return {k: name for k, name in seen.items() if name not in NEVER_EMPTY}


FUNCTIONS = functions()


@pytest.mark.parametrize("function", FUNCTIONS, ids=FUNCTIONS.get)
def test_a_public_function_takes_empty_collections(
    function, tmp_path, monkeypatch
):
    monkeypatch.chdir(tmp_path)
    faults = []
    for arguments in calls(function):
        try:
            function(**arguments)
        except Exception as error:
            faults.append(error)
        else:
            return
    told = [str(one) for one in faults if isinstance(one, InputError)]
    assert told, faults
    assert "\n" not in told[0]
