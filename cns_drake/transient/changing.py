"""Temporary changes to a world: parked cars, snow, furniture, leaves."""

from dataclasses import replace
import math

import numpy as np
from pydrake.math import RigidTransform, RollPitchYaw
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components
import shapely
from shapely import Polygon
from shapely.geometry.base import BaseGeometry

from cns_drake.base.elementary import product, sin
from cns_drake.city.furniture.parked_cars import PARKED_CARS
from cns_drake.city.geometry.structures import Model, part_triangles
from cns_drake.city.geometry.upper_sides import (
    from_above,
    quartered,
    turned_up,
    unit_normals,
)
from cns_drake.scenarios.scenario import TransientConfig
from cns_drake.scene.surfaces import TriangleSurface
from cns_drake.scene.world import World
from cns_drake.transient import putting_up
from cns_drake.transient.ground_surface import GROUND_CLASSES, GroundSurface
from cns_drake.transient.height_limit import limit_heights
from cns_drake.transient.obstacles import Obstacles
from cns_drake.transient.scene_editing import (
    Look,
    SceneEditing,
    Surroundings,
    change_rng,
)
from cns_drake.transient.world_structures import (
    LoadedPart,
    LoadedStructure,
    read_structures,
    triangle_corners,
)

_PARKED_CARS = "parked_cars"
_PARKED = frozenset({"car", "truck", "bus"})
# Share of the changed bays whose car has gone.
_GONE = 0.3
# Share of the changed bays whose car has moved. All others get another car.
_MOVED = 0.2
# Greatest free length of a bay in front of a car and behind it [m].
_LENGTHWISE = 0.5
# Greatest free width of a bay beside a car [m].
_SIDEWAYS = 0.25
# Greatest turn of a car relative to its bay [rad].
_SKEW = 0.03
# Distance between cars and all other objects [m].
_GAP = 0.05
# Least distance between the new and the old place of a moved car [m].
_LEAST_MOVE = 0.1
_CAR_TRIES = 12
# Body types of parked vehicles -> weight in the random choice.
_FORMS = {
    "city_car": 3,
    "hatchback": 4,
    "saloon": 3,
    "estate": 3,
    "suv": 3,
    "pickup": 1,
    "van": 2,
}


class Bay:
    """The free rectangle around a parked car; bays do not overlap.

    Attributes:
        middle: (2,) middle of the car [m].
        yaw: heading of the bay's long axis [rad].
        reach: (4,) distances from the middle to the front, back, left and right
            end of the bay [m].
    """

    def __init__(self, car: LoadedStructure):
        """Makes a bay of the size of the car."""
        hull = shapely.MultiPoint(car.p_WPs[:, :2])
        corners = shapely.get_coordinates(hull.minimum_rotated_rectangle)[:4]
        sides = np.diff(corners, axis=0)[:2]
        lengths = np.linalg.norm(sides, axis=1)
        along = sides[int(lengths.argmax())]
        self.middle = corners.mean(axis=0)
        self.yaw = math.atan2(along[1], along[0])
        self.reach = np.repeat([lengths.max() / 2, lengths.min() / 2], 2)

    def box(self, beyond: np.ndarray | float = 0.0) -> Polygon:
        """Returns the rectangle of the bay as seen from above, enlarged [m].

        Args:
            beyond: lengths by which the bay is enlarged at the front, back,
                left and right, (4,), or one length for all sides [m].
        """
        front, back, left, right = self.reach + beyond
        c, s = math.cos(self.yaw), math.sin(self.yaw)
        corners = np.array(
            [(front, left), (-back, left), (-back, -right), (front, -right)]
        )
        return Polygon(
            product(corners, np.array([[c, s], [-s, c]])) + self.middle
        )

    def grow(
        self, car: LoadedStructure, cars: Obstacles, others: Obstacles
    ) -> None:
        """Enlarges the bay up to other objects, and halfway to other cars.

        The bay grows by at most 0.5 m in front and behind, and by at most 0.25
        m on each side.

        Args:
            car: the car in the bay.
            cars: areas of all parked cars.
            others: areas of all other objects.
        """
        own = (car.name,)
        box = self.box()
        growth = np.zeros(4)
        for k, most in enumerate((_LENGTHWISE,) * 2 + (_SIDEWAYS,) * 2):
            reach = np.zeros(4)
            reach[k] = 2 * most + _GAP
            around = self.box(reach)
            room = min(
                cars.distance(box, around, own) / 2,
                others.distance(box, around, own),
                most + _GAP,
            )
            growth[k] = max(room - _GAP, 0.0)
        self.reach = self.reach + growth

    def place(
        self, half_size: np.ndarray, rng: np.random.Generator
    ) -> tuple[np.ndarray, float] | None:
        """Returns a random place for a car in the bay.

        Args:
            half_size: (2,) half the length and half the width of the car [m].
            rng: the random generator.

        Returns:
            The middle (2,) [m] and yaw [rad] of the car; None if the car is too
            big for the bay.
        """
        skew = float(rng.uniform(-_SKEW, _SKEW))
        across = rng.uniform(size=2)
        turned = rng.uniform() < 0.5
        c, s = math.cos(skew), abs(math.sin(skew))
        half = half_size * c + half_size[::-1] * s
        low, high = half - self.reach[1::2], self.reach[::2] - half
        if (low > high).any():
            return None
        c, s = math.cos(self.yaw), math.sin(self.yaw)
        x, y = low + across * (high - low)
        offset = np.array([c * x - s * y, s * x + c * y])
        yaw = self.yaw + skew + np.pi * turned
        return self.middle + offset, float(yaw)


def make_bays(around: Surroundings) -> dict[str, Bay]:
    """Returns name -> bay, for all parked cars near a drive."""
    cars = {car.name: car for car in around.of_classes(_PARKED)}
    bays = {name: Bay(car) for name, car in cars.items()}
    if not bays:
        return {}
    standing = Obstacles((n, bay.box()) for n, bay in bays.items())
    others = around.obstacles(ignored=_PARKED | GROUND_CLASSES)
    grown = {}
    for name, car in cars.items():
        grown[name] = Bay(car)
        grown[name].grow(car, standing, others)
    # Two bays that meet at a corner both keep their size.
    boxes = [bay.box() for bay in grown.values()]
    names = list(grown)
    first, second = shapely.STRtree(boxes).query(boxes, "intersects")
    for a, b in zip(first, second, strict=True):
        if a != b:
            grown[names[a]] = bays[names[a]]
    return grown


def change_parked_cars(around: Surroundings, share: float) -> None:
    """Changes some of the parked cars.

    A changed car is removed, moved in its bay, or replaced by another car.

    Args:
        around: surroundings of the drive, which are changed.
        share: share of the cars that are changed, from 0 to 1.
    """
    editing = around.editing
    bays = make_bays(around)
    if not bays:
        editing.note("parked_cars: the world has no car, truck or bus")
    cars = [around.things[name] for name in bays]
    for car, rng in around.chosen(_PARKED_CARS, cars, share):
        bay = bays[car.name]
        fate = rng.uniform()
        if fate < _GONE:
            editing.remove(car, _PARKED_CARS)
        elif fate < _GONE + _MOVED:
            X_new = _moved_car(bay, car, around.ground, rng)
            editing.move(car, X_new, f"parked_{car.name}", _PARKED_CARS)
        else:
            _replace_car(around, car, bay, rng)


def _moved_car(
    bay: Bay,
    car: LoadedStructure,
    ground: GroundSurface,
    rng: np.random.Generator,
) -> RigidTransform:
    """Returns the transform X_new of a car's points to its new place in W."""
    own = Bay(car)
    half_size = own.reach[::2]
    middle, yaw = own.middle, own.yaw + np.pi  # At least, it turns round.
    for _ in range(_CAR_TRIES):
        found = bay.place(half_size, rng)
        if (
            found is not None
            and np.linalg.norm(found[0] - own.middle) >= _LEAST_MOVE
        ):
            middle, yaw = found
            break
    X_WC = RigidTransform(RollPitchYaw(0, 0, own.yaw), [*own.middle, 0])
    rise = ground.rise(own.middle, middle)
    X_new = RigidTransform(RollPitchYaw(0, 0, yaw), [*middle, rise])
    return X_new @ X_WC.inverse()


def _replace_car(
    around: Surroundings,
    car: LoadedStructure,
    bay: Bay,
    rng: np.random.Generator,
) -> None:
    """Puts another car in a bay; leaves the bay empty if it is too small."""
    editing = around.editing
    forms = list(_FORMS)
    shares = np.array(list(_FORMS.values()), float)
    for k in rng.choice(len(forms), len(forms), False, shares / shares.sum()):
        builder = PARKED_CARS[forms[k]]
        model = builder.build(rng)
        low, high = _extent(model)
        found = bay.place((high - low) / 2, rng)
        if found is None:
            continue
        middle, yaw = found
        R = RollPitchYaw(0, 0, yaw)
        # The origin of the model is not exactly in the middle of the car.
        offset = R.ToRotationMatrix() @ [*((low + high) / 2), 0.0]
        z = car.bottom + around.ground.rise(Bay(car).middle, middle)
        X_WS = RigidTransform(R, [*middle, z] - offset)
        editing.remove(car, _PARKED_CARS)
        editing.add(
            f"parked_{car.name}",
            builder.semantic_class,
            model,
            X_WS,
            _PARKED_CARS,
        )
        return
    editing.remove(car, _PARKED_CARS)


def _extent(model: Model) -> tuple[np.ndarray, np.ndarray]:
    """Returns the least and the greatest x and y (2,) of a car's model [m]."""
    corners = np.concatenate(
        [part_triangles(part, model.meshes)[0] for part in model.parts]
    )[:, :2]
    return corners.min(axis=0), corners.max(axis=0)


_SNOW = "snow"
# Reflectivity of snow near 900 nm: Warren, "Optical properties of snow", 1982.
_LOOK = Look((0.93, 0.95, 0.97), 0.9, "snow")
# Snow slides off steeper surfaces: cosine of 45 degrees.
_LEAST_UP = 0.707
# Smaller surfaces bear no snow [m^2].
_LEAST_AREA = 0.3
_BARE = frozenset(
    {"vegetation", "trunk", "pole", "traffic-sign", "fence", "bicycle", "road"}
)
# Longest side of triangles at the edge of a cleared road [m].
_FINE = 0.7
# A bank of snow along a kerb: distance from the kerb of its edge on the road
# [m].
_BANK_ON_ROAD = 0.3
# Distance from the kerb of the bank's crest, beyond the kerb [m].
_BANK_CREST = 0.3
# Distance from the kerb of the bank's edge beyond the kerb [m].
_BANK_BEYOND = 1.1
# Greatest height of the bank as a multiple of the depth of snow.
_BANK_RATIO = 2.5
# Greatest height of the bank above the snow [m].
_BANK_ABOVE_SNOW = 0.9
_SPACING = 1.5
# Wavelengths of the bank's height along the street [m].
_WAVES = (9.0, 3.7)


def lay_snow(around: Surroundings, ground: GroundSurface, depth: float) -> None:
    """Covers surfaces with snow, except roads, plants and thin objects.

    Roads are cleared, and get banks of snow along their kerbs.

    Args:
        around: surroundings of the drive, which are changed.
        ground: the ground as it was before any other change.
        depth: depth of the snow [m].
    """
    editing = around.editing
    for thing in around.things.values():
        if thing.semantic_class in _BARE:
            continue
        is_ground = thing.semantic_class in GROUND_CLASSES
        if not is_ground and not thing.outline.intersects(ground.near):
            continue
        changed = False
        for part in thing.parts:
            if is_ground and not _is_below_road(part, ground):
                editing.cover_part(part, np.array([0.0, 0.0, depth]), _LOOK)
                changed = True
            else:
                changed |= _cover_with_snow(
                    editing, part, ground, depth, is_ground
                )
        if changed:
            editing.blame(thing.name, _SNOW)
    if ground.carriageway.is_empty:
        editing.note(
            "snow: no structure of class road along the drive: no road is "
            "cleared, and no bank lies along a kerb"
        )
    else:
        _lay_banks(around, ground, depth)


def _is_below_road(part: LoadedPart, ground: GroundSurface) -> bool:
    """Returns whether a piece of ground continues below a carriageway."""
    corners = turned_up(triangle_corners(part))
    corners = corners[unit_normals(corners)[:, 2] > 0.0]
    inner = ground.carriageway.buffer(-0.5)
    if inner.is_empty or len(corners) == 0:
        return False
    shapely.prepare(inner)
    return bool(shapely.intersects(from_above(corners), inner).any())


def _cover_with_snow(
    editing: SceneEditing,
    part: LoadedPart,
    ground: GroundSurface,
    depth: float,
    is_ground: bool,
) -> bool:
    """Covers the faces of a part that are open to the sky with snow.

    It returns whether there are any.
    """
    corners = triangle_corners(part)
    if is_ground:
        corners = turned_up(corners)
    corners = corners[unit_normals(corners)[:, 2] > _LEAST_UP]
    if is_ground:
        corners = _triangles_beside(corners, ground)
    if len(corners) == 0:
        return False
    vertices, triangles = _merge_corners(corners)
    triangles = triangles[_is_large(vertices, triangles)]
    if len(triangles) == 0:
        return False
    edges = triangles[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2)
    keys = np.sort(edges, axis=1)
    _, first, count = np.unique(
        keys, axis=0, return_index=True, return_counts=True
    )
    rim = edges[first[count == 1]]
    up = len(vertices)
    slab = np.concatenate(
        [
            triangles + up,
            np.column_stack([rim[:, 0], rim[:, 1], rim[:, 1] + up]),
            np.column_stack([rim[:, 0], rim[:, 1] + up, rim[:, 0] + up]),
        ]
    )
    risen = vertices + np.array([0.0, 0.0, depth])
    raised = np.concatenate([vertices, risen])
    editing.add_triangles(part, f"{part.name}_snow", raised, slab, _LOOK)
    return True


def _triangles_beside(corners: np.ndarray, ground: GroundSurface) -> np.ndarray:
    """Returns the triangles beside the carriageway, finer along its edge."""
    corners = corners[shapely.intersects(from_above(corners), ground.near)]
    road = ground.carriageway
    shapely.prepare(road)
    done = [np.zeros((0, 3, 3))]
    while len(corners):
        areas = from_above(corners)
        meets = shapely.intersects(areas, road)
        done.append(corners[~meets])
        corners = corners[meets]
        corners = corners[~shapely.covers(road, areas[meets])]
        sides = np.linalg.norm(
            corners - np.roll(corners, -1, axis=1), axis=2
        ).max(axis=1)
        fine = sides <= _FINE
        last = corners[fine]
        middles = last[:, :, :2].mean(axis=1)
        done.append(last[~shapely.contains_xy(road, middles)])
        corners = quartered(corners[~fine])
    return np.concatenate(done)


def _merge_corners(corners: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Returns vertices and triangles; equal corners become one vertex."""
    rounded = np.round(corners.reshape(-1, 3), 4)
    _, first, inverse = np.unique(
        rounded, axis=0, return_index=True, return_inverse=True
    )
    return corners.reshape(-1, 3)[first], inverse.reshape(-1, 3)


def _is_large(vertices: np.ndarray, triangles: np.ndarray) -> np.ndarray:
    """Returns which triangles belong to areas large enough to bear snow."""
    edges = triangles[:, [0, 1, 1, 2]].reshape(-1, 2)
    graph = coo_matrix(
        (np.ones(len(edges)), (edges[:, 0], edges[:, 1])),
        (len(vertices),) * 2,
    )
    piece = connected_components(graph, directed=False)[1][triangles[:, 0]]
    a, b, c = np.moveaxis(vertices[triangles], 1, 0)
    areas = np.linalg.norm(np.cross(b - a, c - a), axis=1) / 2
    return np.bincount(piece, areas)[piece] >= _LEAST_AREA


def _lay_banks(
    around: Surroundings, ground: GroundSurface, depth: float
) -> None:
    phases = change_rng(around.seed, _SNOW, "banks").uniform(0, 2 * np.pi, 4)
    way = around.drive.buffer(1.4 + _BANK_ON_ROAD)
    shapely.prepare(way)
    meshes = []
    for kerb in ground.kerbs(_SPACING):
        xy, out = kerb.points, kerb.outwards
        road = ground.heights(xy - 0.1 * out, of_road=True)
        beside = ground.heights(xy + _BANK_BEYOND * out, of_road=False)
        beside = np.where(np.isfinite(beside), beside, road)
        waves = (
            sin(2 * np.pi * (xy / _WAVES[0]) + phases[:2]).sum(axis=1)
            + sin(2 * np.pi * (xy / _WAVES[1]) + phases[2:]).sum(axis=1)
        ) / 4
        most = min(_BANK_RATIO * depth, _BANK_ABOVE_SNOW + depth)
        crest = beside + depth + (most - depth) * (0.6 + 0.4 * waves)
        # The profile of the bank: on the road, on the crest, on the snow beside
        # it.
        profile = np.stack(
            [
                np.column_stack([xy - _BANK_ON_ROAD * out, road]),
                np.column_stack([xy, (road + crest) / 2]),
                np.column_stack([xy + _BANK_CREST * out, crest]),
                np.column_stack(
                    [xy + _BANK_BEYOND * out, beside + depth - 0.01]
                ),
            ],
            axis=1,
        )
        free = np.isfinite(road) & ~shapely.contains_xy(way, xy)
        use = np.flatnonzero(free[:-1] & free[1:])
        here, there = profile[use], profile[use + 1]
        for k in range(3):
            a, b = here[:, k], there[:, k]
            c, d = there[:, k + 1], here[:, k + 1]
            meshes += [np.stack([a, d, c], 1), np.stack([a, c, b], 1)]
    if meshes:
        corners = np.concatenate(meshes)
        if np.median(unit_normals(corners)[:, 2]) < 0.0:
            corners = corners[:, ::-1]
        around.editing.add_mesh(
            "snow_banks", "terrain", *_merge_corners(corners), _LOOK, _SNOW
        )


_FURNITURE = frozenset({"pole", "traffic-sign"})
# Least distance by which furniture moves [m].
_LEAST_SHIFT = 0.3
# Greatest distance by which furniture moves [m].
_MOST_SHIFT = 2.0
_TURN = 0.15  # [rad]
# If the height of the ground differs by more than this, there is a kerb in
# between [m].
_KERB = 0.1
_TRIES = 24
# Of a shrub without wood of its own, this share of the surface stays as twigs.
_TWIGS = 0.1


def change_world(
    world: World,
    config: TransientConfig,
    drive: BaseGeometry,
    kept_free: BaseGeometry,
) -> World:
    """Applies the temporary changes of a scenario to a world.

    Args:
        world: the world, not yet part of a diagram; its SceneGraph is changed.
        config: the section `transient` of the scenario.
        drive: the path of the vehicle, seen from above [m].
        kept_free: the area that must stay free of new objects, seen from above
            [m].

    Raises:
        InputError: a mesh cannot be read, or there are more structures than
            instance ids.
    """
    if config.is_off:
        return world
    around = Surroundings(
        SceneEditing(world),
        read_structures(world),
        drive,
        kept_free,
        config.seed,
    )
    if config.roadsides > 0.0:
        # New objects along roadsides are changed like all others.
        putting_up.fill_roadsides(around, config.roadsides)
        rest = config.replaced(roadsides=0.0)
        return change_world(around.editing.finish(), rest, drive, kept_free)
    if config.height_limit is not None:
        # Scaffolds and snow need the new roofs, and leaves the new plants.
        limit_heights(around, config.height_limit)
        rest = config.replaced(height_limit=None)
        return change_world(around.editing.finish(), rest, drive, kept_free)
    if config.parked_cars > 0.0:
        change_parked_cars(around, config.parked_cars)
    if config.leaves < 1.0:
        _thin_leaves(around, config.leaves)
    if config.furniture > 0.0:
        _move_furniture(around, config.furniture)
    if config.scaffolds > 0.0:
        putting_up.put_up_scaffolds(around, config.scaffolds)
    if config.works > 0.0:
        putting_up.put_up_works(around, config.works)
    if config.snow > 0.0:
        # Snow comes last, so that it covers new objects as well.
        ground = around.ground
        world = around.editing.finish()
        around = replace(
            around, editing=SceneEditing(world), things=read_structures(world)
        )
        lay_snow(around, ground, config.snow)
    return around.editing.finish()


def _move_furniture(around: Surroundings, share: float) -> None:
    """Moves a share of poles, lamps and signs by up to 2 m.

    An object without room around it stays, and none crosses a kerb.
    """
    wanted = around.of_classes(_FURNITURE)
    if not wanted:
        around.editing.note(
            "furniture: the world has no pole and no traffic sign"
        )
    obstacles = around.obstacles(ignored=GROUND_CLASSES)
    for thing, rng in around.chosen("furniture", wanted, share):
        foot = thing.footprint
        middle = np.array(foot.centroid.coords[0])
        for _ in range(_TRIES):
            angle, turn = rng.uniform(-1, 1, 2) * (np.pi, _TURN)
            by = rng.uniform(_LEAST_SHIFT, _MOST_SHIFT)
            offset = by * np.array([math.cos(angle), math.sin(angle)])
            rise = around.ground.rise(middle, middle + offset)
            if abs(rise) < _KERB and obstacles.is_free(
                shapely.affinity.translate(foot, *offset), (thing.name,)
            ):
                X_new = (
                    RigidTransform([*(middle + offset), rise])
                    @ RigidTransform(RollPitchYaw(0, 0, turn), np.zeros(3))
                    @ RigidTransform([*-middle, 0.0])
                )
                around.editing.move(
                    thing, X_new, f"new_{thing.name}", "furniture"
                )
                break


def _thin_leaves(around: Surroundings, share: float) -> None:
    """Removes the leaves of all vegetation except for a share of them.

    Plants with the same mesh lose the same leaves of it, but look different
    because they are turned and scaled.
    """
    changed = False
    for plant in around.of_classes({"vegetation"}):
        leafy = [
            part
            for part in plant.parts
            if part.material.kind == "leaves"
            and isinstance(part.geometry.surface, TriangleSurface)
        ]
        left = share
        if len(leafy) == len(plant.parts):
            left = max(share, _TWIGS)
        for part in leafy:
            surface = part.geometry.surface
            assert isinstance(surface, TriangleSurface)
            count = len(surface.triangles)
            # The key is the size of the mesh, not its path, so that the result
            # does not depend on where the file is.
            order = change_rng(around.seed, "leaves", str(count)).permutation(
                count
            )
            around.editing.keep_triangles(
                part, np.sort(order[: round(left * count)])
            )
        if leafy:
            changed = True
            around.editing.blame(plant.name, "leaves")
    if not changed:
        around.editing.note(
            "leaves: no structure of class vegetation has leaves that are "
            "triangles"
        )
