"""Objects in parks and yards: swings, slides, picnic tables, hoops."""

from __future__ import annotations

import numpy as np

from cns_drake.city.geometry.object_parts import (
    Builder,
    assemble,
    block,
    one_mesh,
    post,
)
from cns_drake.city.geometry.structures import Model

_COLOURS = ((0.7, 0.2, 0.16), (0.2, 0.38, 0.62), (0.78, 0.62, 0.18))
_WOOD = (0.52, 0.38, 0.25)


def basketball_hoop(rng: np.random.Generator) -> Model:
    """Returns a basketball hoop on a post; its board faces +x."""
    height = float(rng.uniform(3.4, 3.7))
    steel = (0.35, 0.37, 0.4)
    return assemble(
        post("post", 0.07, height, rgb=steel),
        block("arm", (0.9, 0.1, 0.1), (0.4, 0, height - 0.3), rgb=steel),
        block("board", (0.05, 1.8, 1.05), (0.85, 0, height), rgb=_COLOURS[0]),
        block("rim", (0.46, 0.46, 0.03), (1.12, 0, height - 0.4)),
    )


PLAYGROUND = {
    "swing": one_mesh("swing", _COLOURS, y=(0.92, 1.12)),
    "slide": one_mesh("slide", _COLOURS, z=(0.9, 1.1)),
    "picnic_table": one_mesh("picnic_table", [_WOOD], y=(0.9, 1.15)),
    "basketball_hoop": Builder("pole", basketball_hoop),
}
