"""The acceleration of a vehicle behind another one: Treiber's IDM."""

from __future__ import annotations

from cns_drake.base.compiled import compiled

# Greatest braking [m/s^2].
HARDEST_BRAKING = 8.0
# Smaller gaps count as this one [m].
_NO_GAP = 0.05


@compiled
def free_acceleration(v: float, v0: float, a: float, b: float) -> float:
    """Returns the acceleration on a free road [m/s^2].

    Above the wanted speed it is at most the comfortable braking.

    Args:
        v: speed [m/s].
        v0: wanted speed [m/s].
        a, b: greatest acceleration and comfortable braking [m/s^2].
    """
    if v0 < 0.01:
        return -b
    return max(a * (1.0 - (v / v0) ** 4), -b)


@compiled
def interaction(
    v: float,
    gap: float,
    approach: float,
    a: float,
    b: float,
    s0: float,
    T: float,
) -> float:
    """Returns the loss of acceleration behind a vehicle [m/s^2].

    That is a (s* / gap)^2 with s* = s0 + max(0, v T + v dv / (2 sqrt(a b))).

    Args:
        v: speed [m/s].
        gap: from bumper to bumper [m].
        approach: dv, its speed minus that of the vehicle ahead [m/s].
        a, b: greatest acceleration and comfortable braking [m/s^2].
        s0: gap at standstill [m].
        T: headway [s].
    """
    wanted = s0 + max(0.0, v * T + v * approach / (2.0 * (a * b) ** 0.5))
    return a * (wanted / max(gap, _NO_GAP)) ** 2


@compiled
def idm_acceleration(
    v: float,
    v0: float,
    gap: float,
    approach: float,
    a: float,
    b: float,
    s0: float,
    T: float,
) -> float:
    """Returns the acceleration behind a vehicle; see the parts above."""
    wanted = free_acceleration(v, v0, a, b)
    wanted -= interaction(v, gap, approach, a, b, s0, T)
    return max(wanted, -HARDEST_BRAKING)
