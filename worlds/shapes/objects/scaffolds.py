"""Scaffolds that stand in front of buildings."""

import numpy as np

from worlds.shapes.models import Model, Part
from worlds.shapes.object_models import assemble, bar, block, post

# Distances of a scaffold's inner and outer uprights from the front [m].
SCAFFOLD_ROWS = (0.25, 1.15)
# Greatest length of a scaffold [m].
LONGEST_SCAFFOLD = 25.0
# Greatest height of a scaffold [m].
HIGHEST_SCAFFOLD = 16.0
# Height of a lift of a scaffold [m].
_LIFT = 2.0
# Length of a bay of a scaffold, about [m].
_BAY = 2.5
# Share of the scaffolds that have a net.
_NETTED = 0.4
_STEEL = (0.6, 0.61, 0.62)
_WOOD = (0.62, 0.5, 0.35)
_NET = (0.35, 0.52, 0.42)


def scaffold(length: float, height: float, rng: np.random.Generator) -> Model:
    """Returns a scaffold along x: uprights, ledgers, decks, sometimes a net.

    Args:
        length: length of the scaffold [m].
        height: height of the facade [m].
        rng: random generator for the variant of the scaffold.
    """
    lifts = max(int(height / _LIFT), 1)
    bays = max(round(length / _BAY), 1)
    inner, outer = SCAFFOLD_ROWS
    xs = np.linspace(-length / 2, length / 2, bays + 1)
    top = lifts * _LIFT + 1.0
    parts: list[Part] = [
        post(f"standard_{row}_{k:02d}", 0.03, top, (float(x), y), _STEEL)
        for row, y in enumerate(SCAFFOLD_ROWS)
        for k, x in enumerate(xs)
    ]
    for k in range(1, lifts + 1):
        z = k * _LIFT
        parts.append(
            block(
                f"deck_{k}",
                (length, outer - inner - 0.1, 0.05),
                (0.0, (inner + outer) / 2, z),
                rgb=_WOOD,
            )
        )
        parts += [
            bar(
                f"rail_{k}_{j}",
                (-length / 2, outer, z + up),
                (length / 2, outer, z + up),
                0.025,
                _STEEL,
            )
            for j, up in enumerate((0.5, 1.0))
        ]
    if rng.uniform() < _NETTED:
        parts.append(
            block(
                "net",
                (length, 0.01, top - _LIFT),
                (0.0, outer + 0.05, (top + _LIFT) / 2),
                rgb=_NET,
            )
        )
    return assemble(*parts)
