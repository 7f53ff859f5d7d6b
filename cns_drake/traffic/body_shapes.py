"""Bodies of vehicles and pedestrians, made of simple shapes and meshes."""

import math
from typing import NamedTuple

import numpy as np
from pydrake.geometry import Box, Capsule, Cylinder, Mesh, Shape
from pydrake.math import RigidTransform, RotationMatrix

from cns_drake.traffic.traffic_plan import VehicleKind
from worlds.shapes import OBJECT_MESHES, PAINTS, TRIM, WHITE

Rgb = tuple[float, float, float]
Point = tuple[float, float, float]
_CLOTHES: tuple[Rgb, ...] = (
    (0.16, 0.18, 0.25),
    (0.35, 0.1, 0.12),
    (0.2, 0.3, 0.24),
    (0.5, 0.45, 0.36),
    (0.65, 0.66, 0.68),
    (0.1, 0.1, 0.11),
)
_SKIN: tuple[Rgb, ...] = ((0.85, 0.68, 0.57), (0.55, 0.38, 0.28))
_METAL: Rgb = (0.3, 0.31, 0.33)


class BodyShape(NamedTuple):
    """One shape of a limb, with its pose and colour.

    Attributes:
        name: name of the shape.
        shape: Drake's shape S.
        X_LS: pose of the shape in the frame L of its limb.
        rgb: colour, from 0 to 1.
    """

    name: str
    shape: Shape
    X_LS: RigidTransform
    rgb: Rgb


class Limb(NamedTuple):
    """A rigid part of a body; the part swings about the y axis of its joint.

    Attributes:
        name: name of the limb.
        joint: position of the limb's joint in the frame of the body [m].
        swing: amplitude of the limb's swing at walking speed [rad], negative if
            the limb first swings backwards.
        shapes: the shapes of which the limb consists.
    """

    name: str
    joint: Point
    swing: float
    shapes: tuple[BodyShape, ...]


def _mesh_shape(name: str, mesh: str, rgb: Rgb) -> BodyShape:
    """Returns a shape by the name of its mesh among the objects' meshes."""
    shape = Mesh(str(OBJECT_MESHES / f"{mesh}.obj"))
    return BodyShape(name, shape, RigidTransform(), rgb)


def _box_shape(name: str, size: Point, middle: Point, rgb: Rgb) -> BodyShape:
    """Returns a box of a given size around its middle [m]."""
    return BodyShape(name, Box(*size), RigidTransform(middle), rgb)


def _round_shape(
    name: str,
    radius: float,
    start: Point,
    end: Point,
    rgb: Rgb,
    kind: type[Capsule] | type[Cylinder] = Capsule,
) -> BodyShape:
    """Returns a capsule, or a cylinder, around the axis from start to end.

    Args:
        radius: radius [m].
        start, end: ends of the axis in the limb's frame [m].
        rgb: colour.
        kind: whether it is a capsule or a cylinder.
    """
    p, q = np.array(start, float), np.array(end, float)
    shape = kind(radius, math.dist(start, end))
    R = RotationMatrix.MakeFromOneVector(q - p, 2)
    return BodyShape(name, shape, RigidTransform(R, (p + q) / 2), rgb)


def vehicle_limbs(
    kind: VehicleKind, rng: np.random.Generator
) -> tuple[Limb, ...]:
    """Returns the shapes of a vehicle, as a tuple with one limb.

    A vehicle has no moving parts. The frame of the limb is on the ground below
    the middle of the vehicle's box.

    Args:
        kind: kind of the vehicle.
        rng: random generator for the vehicle's colour and variant.
    """
    paint = PAINTS[int(rng.integers(len(PAINTS)))]
    if kind.name in ("bicycle", "motorcycle"):
        shapes = _two_wheeler(kind.name, paint, rng)
    else:
        name = kind.name
        found = [
            _mesh_shape("body", f"{name}_body", paint),
            _mesh_shape("trim", f"{name}_trim", TRIM),
        ]
        if name == "box_truck":
            found.append(_mesh_shape("box", f"{name}_box", WHITE))
        shapes = tuple(found)
    return (Limb("body", (0.0, 0.0, 0.0), 0.0, shapes),)


def _two_wheeler(
    name: str, paint: Rgb, rng: np.random.Generator
) -> tuple[BodyShape, ...]:
    """Returns a bicycle or a motorcycle with its rider."""
    coat = _CLOTHES[int(rng.integers(len(_CLOTHES)))]
    heavy = name == "motorcycle"
    radius, width = (0.31, 0.13) if heavy else (0.34, 0.04)
    axle = 0.72 if heavy else 0.52
    seat = 0.82 if heavy else 0.95
    shapes = [
        _round_shape(
            f"wheel_{k}", radius, (x, -width / 2, radius),
            (x, width / 2, radius), TRIM, Cylinder,
        )
        for k, x in enumerate((-axle, axle))
    ]  # fmt: skip
    if heavy:
        shapes += [
            _box_shape("engine", (0.6, 0.32, 0.4), (0.0, 0.0, 0.45), _METAL),
            _box_shape("tank", (0.55, 0.3, 0.22), (0.2, 0.0, 0.76), paint),
            _box_shape("seat", (0.7, 0.26, 0.12), (-0.38, 0.0, 0.74), TRIM),
        ]
    else:
        bars = (
            ((-axle, 0, radius), (-0.2, 0, 0.9)),
            ((-0.2, 0, 0.85), (0.4, 0, 0.85)),
            ((0.4, 0, 0.95), (axle, 0, radius)),
            ((-0.12, 0, 0.3), (0.4, 0, 0.82)),
        )
        shapes += [
            _round_shape(f"frame_{k}", 0.02, start, end, paint)
            for k, (start, end) in enumerate(bars)
        ]
    hip, shoulder = (-0.25, 0.0, seat + 0.08), (0.0, 0.0, seat + 0.5)
    skin = _SKIN[int(rng.integers(len(_SKIN)))]
    head = (0.06, 0.0, seat + 0.75)
    shapes += [
        _round_shape("torso", 0.15, hip, shoulder, coat),
        _round_shape(
            "head", 0.1, head, (0.06, 0, seat + 0.8), TRIM if heavy else skin
        ),
    ]  # fmt: skip
    for side, y in (("left", 0.17), ("right", -0.17)):
        shoulder, hand = (0.0, y, seat + 0.45), (0.42, 1.4 * y, seat + 0.1)
        knee, foot = (0.15, y, seat - 0.12), (0.0, y, 0.4)
        hip_joint = (-0.2, y, seat)
        shapes += [
            _round_shape(f"{side}_thigh", 0.07, hip_joint, knee, TRIM),
            _round_shape(f"{side}_shank", 0.055, knee, foot, TRIM),
            _round_shape(f"{side}_arm", 0.045, shoulder, hand, coat),
        ]
    return tuple(shapes)


def walker_limbs(rng: np.random.Generator) -> tuple[Limb, ...]:
    """Returns the five limbs of a pedestrian, which consist of ten capsules.

    The body's frame is on the ground, with x in the pedestrian's heading. An
    arm swings together with the leg on the other side.
    """
    h = float(rng.uniform(0.92, 1.06))
    coat, trousers = (
        _CLOTHES[int(k)] for k in rng.integers(len(_CLOTHES), size=2)
    )
    skin = _SKIN[int(rng.integers(len(_SKIN)))]
    trunk = (
        _round_shape(
            "torso", 0.16 * h, (0, 0, 1.0 * h), (0, 0, 1.27 * h), coat
        ),
        _round_shape(
            "head", 0.095 * h, (0.01, 0, 1.53 * h), (0.01, 0, 1.58 * h), skin
        ),
    )
    limbs = [Limb("trunk", (0.0, 0.0, 0.0), 0.0, trunk)]
    for side, sign in (("left", 1.0), ("right", -1.0)):
        knee, ankle = (0.03, 0.0, -0.42 * h), (0.0, 0.0, -0.82 * h)
        leg = (
            _round_shape("thigh", 0.075 * h, (0, 0, 0), knee, trousers),
            _round_shape("shank", 0.055 * h, knee, ankle, trousers),
        )
        elbow, hand = (-0.02, 0.0, -0.29 * h), (0.06, 0.0, -0.52 * h)
        arm = (
            _round_shape("upper", 0.045 * h, (0, 0, 0), elbow, coat),
            _round_shape("lower", 0.038 * h, elbow, hand, coat),
        )
        hip, shoulder = (
            (0.0, 0.09 * sign, 0.9 * h),
            (0.0, 0.2 * sign * h, 1.36 * h),
        )
        limbs += [
            Limb(f"{side}_leg", hip, 0.36 * sign, leg),
            Limb(f"{side}_arm", shoulder, -0.36 * sign, arm),
        ]
    return tuple(limbs)
