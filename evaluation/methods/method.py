"""The interface of place-recognition methods."""

import abc
from collections.abc import Sequence
import contextlib
import inspect
from pathlib import Path
import re
from typing import ClassVar, Generic, Literal, TypeVar

import numpy as np
from pydantic import ConfigDict, NonNegativeFloat

from evaluation.base import InputError, InputModel, poses
from evaluation.drives import LidarField

Descriptor = TypeVar("Descriptor")
Database = TypeVar("Database")

# The beginning of a factor that is a setting of a method.
SETTINGS = "methods."

# Which of a place's merged scans stands for the place and gives its pose.
PlaceScan = Literal["middle", "first"]


class MethodConfig(InputModel):
    """The parameters that all methods share.

    If your method has further parameters, derive its class of parameters from
    this class.

    Attributes:
        sensor_height: height of the LiDAR above the ground [m]. The default is
            the height on the CNS vehicle.
        place: which of several merged scans gives a place its pose: the scan in
            the `middle`, or the `first`. By default the protocol decides.
            Methods that describe single scans do not use this parameter.
        center_scores: whether each place's mean score over all queries is
            subtracted from its scores. This lowers hubs: places that score high
            with every query. It needs all queries at once, and no second stage.

    Example:
        from evaluation import MethodConfig

        class HeightsConfig(MethodConfig):
            rings: int = 40
    """

    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False)

    sensor_height: NonNegativeFloat = 1.6
    place: PlaceScan | None = None
    center_scores: bool = False


class Method(abc.ABC, Generic[Descriptor, Database]):
    """A place-recognition method: describes and compares scans.

    A cloud is (N, 3) float64, finite, in the frame of the LiDAR at the place
    [m]. If the method names `point_fields`, the cloud is a structured array
    (N,) instead. This array contains `x`, `y` and `z` as float64, and the named
    fields with the types that they have in the recording. A cloud is read-only,
    because all methods of a run share it.

    Attributes:
        name: name of the method on the command line.
        title: name of the method in tables and charts, as its authors write it;
            by default `name`.
        style: colour (`#RRGGBB`), line style and marker in charts, in the terms
            of Matplotlib; by default one of several that no other method has.
        source: publication of the method; empty for one that is not published.
        version: counts the changes of the method's results for the same clouds
            and parameters. Raise it with each such change: a study then
            measures the method again.
        standard: whether a shipped method runs by default.
        order: place of the method in tables, counted upwards; methods with the
            same number are sorted by name.
        Config: type of its parameters.
        scans_per_place: number of consecutive scans that are merged into the
            described cloud. The cloud is in the frame of the scan that stands
            for the place.
        point_fields: fields of points that the method needs besides x, y and z,
            such as intensity, ring, t or label.
        batch_size: number of clouds for one call of `describe_batch`.
        skips_places: whether scores may be NaN (no candidate) even if every
            place is compared (`exhaustive`). If false, such a NaN is an error.
        rerank_best: number of top-ranked places that a second stage, `rerank`,
            compares by their points; 0 without a second stage.
        divides: whether a database that is too large for the memory can be
            searched part by part. If so, the score and the pose of a place must
            not depend on other places, except through `shortlist`. A method
            with a second stage cannot divide.
        config: the parameters in use.

    Example:
        from evaluation import make_method

        method = make_method("scan-context++", {})
        database = method.build_database([method.describe_place(points)])
        scores = method.score(method.describe(points), database)
    """

    name: ClassVar[str]
    title: ClassVar[str] = ""
    style: ClassVar[tuple[str, str, str] | None] = None
    source: ClassVar[str] = ""
    version: ClassVar[int] = 1
    standard: ClassVar[bool] = False
    order: ClassVar[int] = 100
    Config: ClassVar[type[MethodConfig]] = MethodConfig
    scans_per_place: ClassVar[int] = 1
    point_fields: ClassVar[tuple[str, ...]] = ()
    batch_size: ClassVar[int] = 1
    skips_places: ClassVar[bool] = False
    rerank_best: ClassVar[int] = 0
    divides: ClassVar[bool] = False
    # The Python file of a user's own method.
    _file: ClassVar[Path | None] = None

    def __init__(self, config: MethodConfig | None = None):
        self.config = self.Config() if config is None else config
        if self.config.center_scores and self.rerank_best:
            raise InputError(
                f"{self.name}: center_scores: its second stage scores only"
                " some places"
            )

    @abc.abstractmethod
    def describe(self, points: np.ndarray) -> Descriptor:
        """Returns the descriptor of a query's cloud.

        Do not change a descriptor later: of a long drive, descriptors are read
        again from a file.
        """

    def describe_place(self, points: np.ndarray) -> Descriptor:
        """Returns a place's descriptor; by default the same as for a query."""
        return self.describe(points)

    def describe_batch(
        self, clouds: Sequence[np.ndarray], *, of_places: bool
    ) -> list[Descriptor]:
        """Returns the descriptors of several clouds.

        Override this function if your method describes several clouds faster
        than one by one.

        Args:
            clouds: up to `batch_size` clouds.
            of_places: whether the clouds are of places, and not of queries.
        """
        describe_one = self.describe_place if of_places else self.describe
        return [describe_one(cloud) for cloud in clouds]

    def for_lidar(self, field: LidarField | None) -> "Method":
        """Returns the method adapted to a LiDAR; by default the method itself.

        Args:
            field: number of rings and vertical field of view of the LiDAR; None
                if they are unknown.
        """
        return self

    def assumption(self, field: LidarField | None) -> str | None:
        """Returns a note on what the method assumes about a LiDAR.

        The result is None if there is nothing to say, which is the default.

        Args:
            field: number of rings of the LiDAR, and lowest and highest
                elevation [deg]; None if they are unknown.
        """
        return None

    @property
    def describes_alike(self) -> bool:
        """Whether the method describes places and queries in the same way."""
        return type(self).describe_place is Method.describe_place

    @classmethod
    def estimates_poses(cls) -> bool:
        """Returns whether the method estimates a query's pose at a place."""
        return (
            cls.relative_pose is not Method.relative_pose
            or cls.relative_poses is not Method.relative_poses
        )

    @abc.abstractmethod
    def build_database(self, places: Sequence[Descriptor]) -> Database:
        """Returns a database with all places, indexed for searches."""

    @abc.abstractmethod
    def score(
        self, query: Descriptor, database: Database, *, exhaustive: bool = False
    ) -> np.ndarray:
        """Returns how similar a query is to every place of a database.

        Args:
            query: descriptor of the query, made by `describe`.
            database: database of D places, made by `build_database`.
            exhaustive: whether to also compare places that a search would skip
                only to save time.

        Returns:
            (D,) float64, higher is more similar; NaN for a place that is no
            candidate, see `skips_places`.
        """

    def score_in_drive(
        self,
        queries: Sequence[Descriptor],
        database: Database,
        *,
        exhaustive: bool = False,
    ) -> np.ndarray:
        """Returns how similar a query is to every place, given earlier queries.

        Override this function if your method matches sequences of scans instead
        of single scans. By default, only the present query is used.

        Args:
            queries: descriptors of a drive's queries, from the first to the
                present one; a list, or a sequence that reads them from a file.
            database: see `score`.
            exhaustive: see `score`.

        Returns:
            As `score`.
        """
        return self.score(queries[-1], database, exhaustive=exhaustive)

    @property
    def num_shortlisted(self) -> int | None:
        """Number of entries that a search chooses from the whole database.

        None, the default, if each place is compared.
        """
        return None

    def shortlist(self, query: Descriptor, database: Database) -> np.ndarray:
        """Returns how well a query fits the best entries of part of a database.

        A place may have one entry or several. The search compares the
        `num_shortlisted` best entries of all parts, see `score_best`. A method
        that `divides` and has a search must define both `shortlist` and
        `score_best`.

        Returns:
            (K,) decreasing, K at most `num_shortlisted`.
        """
        raise NotImplementedError

    def score_best(
        self, query: Descriptor, database: Database, number: int
    ) -> np.ndarray:
        """Returns the scores of a part of a database, like `score`.

        Args:
            query: see `score`.
            database: part of a database, made by `build_database`.
            number: how many entries of `shortlist` to compare, beginning with
                the first.
        """
        raise NotImplementedError

    def rerank(
        self,
        query: np.ndarray,
        places: Sequence[np.ndarray],
        scores: np.ndarray,
    ) -> np.ndarray:
        """Returns new scores for the top-ranked places, from a second stage.

        The second stage compares points. Only the top-ranked places remain
        candidates.

        Args:
            query: cloud of the query.
            places: clouds of the K top-ranked places; K is at most
                `rerank_best`.
            scores: (K,) scores of these places by `score`, decreasing.

        Returns:
            (K,) float64, higher is more similar; NaN for a place that is no
            candidate.
        """
        return scores

    def relative_pose(
        self, query: Descriptor, database: Database, place: int
    ) -> np.ndarray | None:
        """Returns the pose X_PQ (4, 4) of a query's LiDAR Q at a place.

        P is the LiDAR at the place. The result is None if the method does not
        estimate poses.
        """
        if type(self).relative_poses is Method.relative_poses:
            return None
        found = self.relative_poses(query, database, [place])
        check_number(self, "relative_poses", found, 1)
        return found[0]

    def relative_poses(
        self, query: Descriptor, database: Database, places: Sequence[int]
    ) -> list[np.ndarray | None]:
        """Returns the `relative_pose` of a query at each of several places.

        Override this function if your method estimates several poses faster
        than one by one.
        """
        return [self.relative_pose(query, database, place) for place in places]


def check_class(method: type[Method]) -> None:
    """Checks a method's class and its attributes, see `Method`.

    Raises:
        InputError: it is no complete subclass of Method, or an attribute is
            impossible. The error begins with the name of the attribute.
    """
    if not (isinstance(method, type) and issubclass(method, Method)):
        raise InputError("no subclass of Method")
    if inspect.isabstract(method):
        missing = ", ".join(sorted(method.__abstractmethods__))
        raise InputError(f"lacks {missing}")
    kind = method.Config
    if not (isinstance(kind, type) and issubclass(kind, MethodConfig)):
        raise InputError(f"Config: {kind!r} is no MethodConfig")
    for name, least in (
        ("scans_per_place", 1),
        ("batch_size", 1),
        ("rerank_best", 0),
    ):
        value = getattr(method, name)
        if not isinstance(value, int) or value < least:
            raise InputError(
                f"{name}: {value!r} is no whole number from {least}"
            )
    if method.divides and method.rerank_best:
        raise InputError(
            "divides: a database that is searched part by part keeps no clouds"
            " for rerank_best; set one of the two"
        )
    for name in ("title", "source"):
        value = getattr(method, name)
        if not (isinstance(value, str) and value.isprintable()):
            raise InputError(f"{name}: {value!r} is no text of one line")
    fields = method.point_fields
    if not (
        isinstance(fields, tuple | list)
        and all(isinstance(field, str) and field for field in fields)
        and len({*"xyz", *fields}) == 3 + len(fields)
    ):
        raise InputError(
            f"point_fields: {fields!r} is no tuple of names besides x, y and z"
        )
    if method.style is not None and not _is_style(method.style):
        raise InputError(
            f"style: {method.style!r} is not a colour #RRGGBB, a line style and"
            " a marker"
        )


def _is_style(style: object) -> bool:
    # Slow to import.
    from matplotlib.lines import Line2D

    return (
        isinstance(style, tuple)
        and len(style) == 3
        and all(isinstance(one, str) for one in style)
        and re.fullmatch("#[0-9A-Fa-f]{6}", style[0]) is not None
        and style[1] in Line2D.lineStyles
        and style[2] in Line2D.markers
    )


def check_number(
    method: Method, function: str, found: object, number: int
) -> None:
    """Checks that a method has returned the right number of values.

    Args:
        method: the method.
        function: name of the method's function, for the error message.
        found: the returned values.
        number: how many values the function must return.

    Raises:
        InputError: the function has returned another number of values, or no
            sequence.
    """
    count = len(found) if isinstance(found, Sequence | np.ndarray) else None
    if count != number:
        raise InputError(
            f"{method.name}: {function} returned {type(found).__name__} of"
            f" length {count} instead of {number}"
        )


def checked_scores(
    method: Method, function: str, scores: object, number: int
) -> np.ndarray:
    """Returns the scores of a method as a float64 array of shape (number,).

    Raises:
        InputError: the scores have another shape, are no numbers or infinite,
            or are complex or masked: a conversion would drop the imaginary part
            or the mask.
    """
    fault = ""
    try:
        values = np.asarray(scores)
    except ValueError:  # Rows of different lengths.
        values = np.empty(0)
    if isinstance(scores, np.ma.MaskedArray):
        fault = " with a mask (NaN says that a place is no candidate)"
    elif values.dtype.kind in "cSU":
        fault = f" and type {values.dtype}"
    elif values.shape == (number,):
        with contextlib.suppress(TypeError, ValueError):
            found = values.astype(np.float64)
            if not np.isinf(found).any():
                return found
            fault = " with an infinite score (NaN: the place is no candidate)"
    raise InputError(
        f"{method.name}: {function} returned {type(scores).__name__} of shape"
        f" {values.shape}{fault} instead of {number} numbers"
    )


def checked_pose(method: Method, X_PQ: object) -> np.ndarray | None:
    """Returns a method's estimate after checking that it is a pose, or None.

    Args:
        method: the method, for the error message.
        X_PQ: result of `Method.relative_pose`: a pose (4, 4) or None.

    Raises:
        InputError: `X_PQ` is neither a pose nor None.
    """
    if X_PQ is None:
        return None
    pose = np.asarray(X_PQ)
    if pose.shape != (4, 4) or pose.dtype.kind != "f":
        raise InputError(
            f"{method.name}: relative_pose returned {type(X_PQ).__name__} of"
            f" shape {pose.shape} instead of (4, 4) floats or None"
        )
    if not poses.is_pose(pose):
        raise InputError(
            f"{method.name}: relative_pose returned no pose: a rotation, and a"
            " last row 0 0 0 1"
        )
    return pose
