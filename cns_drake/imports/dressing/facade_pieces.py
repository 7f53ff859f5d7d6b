"""The faces of a dressed wall: openings, plinth, cornice, balconies, signs."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass, field, replace

import numpy as np

from cns_drake.city.facades import details
from cns_drake.city.geometry.mesh import Mesh
from cns_drake.imports.dressing.facade_plan import (
    FacadePlan,
    balcony_windows,
    opened_to_floor,
)
from cns_drake.imports.dressing.reliefs import boxes_on, framed, open_wall
from cns_drake.imports.dressing.wall_panels import Panel

_PLINTH_REACH = 0.06
_CORNICE_REACH = 0.28
_GUTTER, _GUTTER_REACH = 0.15, 0.14
_SIGN_REACH, _SIGN_HEIGHT = 0.15, 0.5
_BALCONY_REACH, _BALCONY_WIDTH = 1.15, 3.0
_AWNING_REACH, _AWNING_HEIGHT = 1.1, 0.55
_SILL_HEIGHT, _SILL_BESIDE, _SILL_REACH = 0.08, 0.08, 0.07
# Windows farther from drives have no sills, or no frames, or lie on their wall
# and not in recesses, and walls have no plinths [m].
_SILLS_WITHIN, _FRAMES_WITHIN, _RECESSES_WITHIN = 12.0, 20.0, 25.0
# Nothing lower than this may hang over a car's path, within this distance of
# its middle [m].
_TALLEST_CAR, _BESIDE = 4.0, 2.5
# Cornices of lower walls would collide with doors [m].
_LEAST_WALL = 2.5


@dataclass
class Faces:
    """Faces of a building by material, and counts of added details.

    Attributes:
        quads: material -> (K, 4, 3) arrays [m].
        triangles: material -> (M, 3, 3) arrays [m].
        counts: kind of detail added at random -> number.
    """

    quads: dict[str, list[np.ndarray]] = field(default_factory=dict)
    triangles: dict[str, list[np.ndarray]] = field(default_factory=dict)
    counts: Counter[str] = field(default_factory=Counter)

    def add(self, material: str, faces: np.ndarray) -> None:
        """Adds quads (K, 4, 3) or triangles (M, 3, 3) [m]."""
        if len(faces):
            group = self.quads if faces.shape[1] == 4 else self.triangles
            group.setdefault(material, []).append(faces)

    def meshes(self) -> dict[str, Mesh]:
        """Returns a mesh for each material."""
        found = {}
        for material in sorted({*self.quads, *self.triangles}):
            quads = self.quads.get(material, [])
            triangles = self.triangles.get(material, [])
            vertices = np.concatenate(
                [some.reshape(-1, 3) for some in (*quads, *triangles)]
            )
            ends = 4 * sum(map(len, quads))
            four = np.arange(ends).reshape(-1, 4).tolist()
            three = np.arange(ends, len(vertices)).reshape(-1, 3).tolist()
            faces = (*map(tuple, four), *map(tuple, three))
            found[material] = Mesh(vertices, faces)
        return found


def add_facade(
    faces: Faces,
    plan: FacadePlan,
    to_drive: float,
    rng: np.random.Generator,
) -> None:
    """Adds all faces of a wall.

    Args:
        faces: of the building.
        plan: of the wall.
        to_drive: distance from the wall to the nearest drive [m].
        rng: of the building.
    """
    panel, style = plan.panel, plan.style
    has_balconies = style.balconies and bool(rng.random() < 0.6)
    if has_balconies:
        plan = opened_to_floor(plan, balcony_windows(plan))
    has_recesses = to_drive < _RECESSES_WITHIN
    wall = open_wall(panel, plan.openings, has_recesses)
    if wall is None:
        faces.add("body", panel.triangles)
    else:
        plan = replace(plan, openings=wall.openings)
        faces.add("body", wall.quads)
        faces.add("body", wall.triangles)
        is_glass = ~plan.openings.is_door | plan.shop
        faces.add("doors", wall.backs[~is_glass])
        if to_drive < _FRAMES_WITHIN:
            frames, panes = framed(panel, plan.openings.chosen(is_glass))
            faces.add("frames", frames)
            faces.add("glass", panes)
        else:
            faces.add("glass", wall.backs[is_glass])
        if to_drive < _SILLS_WITHIN:
            _add_sills(faces, plan)
        faces.counts["windows"] += int((~plan.openings.is_door).sum())
        faces.counts["doors"] += int(plan.openings.is_door.sum())
        if has_balconies:
            _add_balconies(faces, plan, to_drive)
        if plan.shop:
            _add_signs(faces, plan, to_drive, rng)
    if to_drive < _RECESSES_WITHIN:
        _add_plinth(faces, plan)
    _add_cornice(faces, plan)


def _add_sills(faces: Faces, plan: FacadePlan) -> None:
    o = plan.openings.chosen(~plan.openings.is_door)
    low = o.z0 - _SILL_HEIGHT
    is_sill = low > 0.05
    x0, x1 = (o.x0 - _SILL_BESIDE)[is_sill], (o.x1 + _SILL_BESIDE)[is_sill]
    sills = boxes_on(
        plan.panel, x0, x1, low[is_sill], o.z0[is_sill], _SILL_REACH
    )
    faces.add("trim", sills)


def _add_plinth(faces: Faces, plan: FacadePlan) -> None:
    panel, style = plan.panel, plan.style
    top = plan.ground + style.plinth
    if (
        style.plinth
        and plan.stands_on_ground
        and plan.top_is_free
        and 0.1 < top < panel.height
        and panel.outline is None
    ):
        start, end = _between(plan, top)
        reach = _PLINTH_REACH
        start[start == 0.0] -= reach
        end[end == panel.length] += reach
        faces.add("trim", boxes_on(panel, start, end, 0.0, top, reach))
        faces.counts["plinths"] += 1


def _add_cornice(faces: Faces, plan: FacadePlan) -> None:
    panel, style = plan.panel, plan.style
    if (
        style.cornice
        and plan.top_is_free
        and panel.height > _LEAST_WALL
        and panel.outline is None
    ):
        is_gutter = style.cornice < _GUTTER
        reach = _GUTTER_REACH if is_gutter else _CORNICE_REACH
        low = panel.height - style.cornice
        cornice = boxes_on(
            panel, -reach, panel.length + reach, low, panel.height, reach
        )
        faces.add("trim", cornice)
        faces.counts["gutters" if is_gutter else "cornices"] += 1


def _between(plan: FacadePlan, top: float) -> tuple[np.ndarray, np.ndarray]:
    """Returns the stretches of a wall without openings below a height."""
    o = plan.openings
    low = o.z0 < top + 0.05
    order = np.argsort(o.x0[low])
    start = np.append(0.0, o.x1[low][order])
    end = np.append(o.x0[low][order], plan.panel.length)
    wide = end - start > 0.05
    return start[wide], end[wide]


def _add_balconies(faces: Faces, plan: FacadePlan, to_drive: float) -> None:
    o, panel = plan.openings, plan.panel
    width = min(_BALCONY_WIDTH, 1.5 * plan.spacing)
    for k in np.flatnonzero(balcony_windows(plan)):
        middle = (o.x0[k] + o.x1[k]) / 2.0
        x0 = max(0.1, middle - width / 2.0)
        x1 = min(panel.length - 0.1, middle + width / 2.0)
        z = float(o.z0[k]) - 0.02
        if _in_the_way(z - plan.ground, _BALCONY_REACH, to_drive):
            continue
        mesh = details.balcony(x0, x1, _BALCONY_REACH, z)
        faces.add("trim", _placed(mesh, panel))
        faces.counts["balconies"] += 1


def _add_signs(
    faces: Faces,
    plan: FacadePlan,
    to_drive: float,
    rng: np.random.Generator,
) -> None:
    """Adds the signs and awnings above shop windows."""
    o, panel = plan.openings, plan.panel
    shops = np.flatnonzero(plan.street_openings)
    if not len(shops):
        return
    z = float(o.z1[shops].max()) + 0.06
    height = min(_SIGN_HEIGHT, panel.height - z - 0.05)
    if height > 0.15:
        start, end = float(o.x0[shops].min()), float(o.x1[shops].max())
        sign = boxes_on(panel, start, end, z, z + height, _SIGN_REACH)
        faces.add("sign", sign)
    faces.counts["shop windows"] += len(shops)
    low = z - _AWNING_HEIGHT
    has_awning = rng.random(len(shops)) < 0.4
    if _in_the_way(low - plan.ground, _AWNING_REACH, to_drive):
        return
    for k in shops[has_awning]:
        limits = (float(o.x0[k]), float(o.x1[k]), _AWNING_REACH, low, z)
        faces.add("sign", _placed(details.awning(*limits), panel))
        faces.counts["awnings"] += 1


def _in_the_way(height: float, reach: float, to_drive: float) -> bool:
    return height < _TALLEST_CAR and to_drive < reach + _BESIDE


def _placed(mesh: Mesh, panel: Panel) -> np.ndarray:
    """Returns a mesh (x along a wall, y outwards, z up) as (M, 3, 3) [m]."""
    x, y, z = mesh.vertices.T
    return panel.place(x, z, y)[mesh.triangles()[:, ::-1]]
