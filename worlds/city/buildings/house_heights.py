"""Storeys and wall heights of houses with pitched roofs."""

from worlds.city.facades.wing_roofs import ridge_rise

# Height of a storey [m].
STOREY_M = 2.65
# Vertical thickness of a roof [m].
ROOF_M = 0.2


def storeys_for(
    height: float, floor: float, span: float, pitch_deg: float
) -> int:
    """Returns how many storeys (1 to 4) suit a house with a pitched roof.

    The roof fills the height between the topmost storey and the ridge. The
    number of storeys makes the pitch of this roof as close to `pitch_deg` as
    possible.

    Args:
        height: height of the ridge [m].
        floor: height of the ground floor [m].
        span: width of the roof across the ridge [m].
        pitch_deg: wanted pitch of the roof [deg].
    """
    wanted = ridge_rise(span, pitch_deg)
    room = height - ROOF_M - floor - 0.15
    counts = [n for n in (1, 2, 3, 4) if room - n * STOREY_M > 0.1 * span]
    return min(
        counts or [1], key=lambda n: round(abs(room - n * STOREY_M - wanted), 6)
    )


def wall_top_for(
    height: float, floor: float, span: float, storeys: int
) -> float:
    """Returns the height of the top of the walls of a house [m].

    The walls are as high as the storeys need, unless the roof would then be too
    low; in this case, the walls are lower than the storeys need.

    Args:
        height, floor, span: see `storeys_for`.
        storeys: number of storeys, as from `storeys_for`.
    """
    wanted = floor + storeys * STOREY_M + 0.15
    return min(wanted, height - ROOF_M - 0.08 * span)
