"""What a member of the family of temporary changes says of itself."""

from collections.abc import Callable
from dataclasses import dataclass
import enum
from typing import Any

from cns_drake.transient.surroundings import Surroundings


class Phase(enum.IntEnum):
    """When an effect is applied: each phase sees the changes of the former."""

    # Objects that all other effects change like any other.
    MORE_OBJECTS = 1
    # The shapes of buildings and plants, on which other effects depend.
    SHAPES = 2
    # Effects that do not depend on each other.
    OBJECTS = 3
    # What covers everything else.
    COVER = 4


@dataclass(frozen=True)
class Effect:
    """A temporary change of a world, which a field of scenarios asks for.

    A module of this package has an effect as its constant `EFFECT`, and is
    found by this.

    Attributes:
        field: field of the scenario's section `transient`
            (`cns_drake.scenarios.TransientConfig`). With the field's default,
            the effect is off.
        phase: when the effect is applied.
        apply: changes the surroundings of a drive; the arguments are these
            surroundings and the value of the field.
        order: place among the effects of its phase, on which the numbers of new
            structures depend.
    """

    field: str
    phase: Phase
    apply: Callable[[Surroundings, Any], None]
    order: int = 0
