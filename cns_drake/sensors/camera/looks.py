"""What surfaces look like to a camera: textures that code makes from seeds.

A texture is a brightness by which the colour of a surface is multiplied. The
mean of a texture is 1, so that the mean colour of the surface stays the same.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
import functools
import io

import numpy as np

# Pixels of a side of a texture.
_SIDE = 512
# Gamma: an sRGB value is about this root of the light (IEC 61966-2-1).
GAMMA = 2.2


@dataclass(frozen=True)
class Look:
    """How a surface looks to a camera: a repeated texture, and a roughness.

    Attributes:
        size: side of the square on a surface that one copy of the texture
            covers [m].
        paint: function that makes the texture from a random generator: an
            array (N, N, channels) of brightness. The mean may have any value.
            There are 1, 3 or 4 channels; the fourth is 0 where the surface has
            holes.
        roughness: roughness of the surface, from 0 (a mirror) to 1 (chalk).
        is_face: whether one copy of the texture, which has colours of its own,
            covers the whole of each geometry instead of being repeated.
    """

    size: float
    paint: Callable[[np.random.Generator], np.ndarray]
    roughness: float = 1.0
    is_face: bool = False


def tiling_noise(rng: np.random.Generator, slope: float) -> np.ndarray:
    """Returns noise (N, N, 1) that repeats, of mean 0 and deviation 1.

    The amplitude of a wave is proportional to its wave number to the power of
    -`slope`.
    """
    number = np.hypot(*np.meshgrid(*[np.fft.fftfreq(_SIDE, 1 / _SIDE)] * 2))
    number[0, 0] = np.inf
    waves = np.fft.fft2(rng.normal(size=number.shape)) / number**slope
    values = np.fft.ifft2(waves).real
    return (values / values.std())[:, :, None]


def _asphalt(rng: np.random.Generator) -> np.ndarray:
    cracks = np.abs(tiling_noise(rng, 1.8)) < 0.012
    worn = 0.10 * tiling_noise(rng, 1.4) + 0.16 * tiling_noise(rng, 0.2)
    return (1.0 + worn) * np.where(
        cracks & (tiling_noise(rng, 1.5) > 0.6), 0.6, 1.0
    )


def _stones(
    rng: np.random.Generator,
    across: int,
    rows: int,
    joint: tuple[float, float],
    spread: float,
) -> np.ndarray:
    """Returns a texture (N, N, 1) of rows of stones, each of random brightness.

    `across` and `rows` count the stones, and `joint` contains the width and the
    brightness of the joints between the stones. Every other row is shifted by
    half a stone. The standard deviation of the stones' brightness is `spread`.
    """
    y, x = np.indices((_SIDE, _SIDE)) / _SIDE
    row = (y * rows).astype(int)
    place = x * across + 0.5 * (row % 2)
    stones = 1.0 + spread * rng.normal(size=(rows, across))
    shade = stones[row, place.astype(int) % across]
    edge = np.minimum((place % 1) / across, (y * rows % 1) / rows) < joint[0]
    shade = np.where(edge, joint[1], shade)[:, :, None]
    return shade * (1.0 + 0.07 * tiling_noise(rng, 0.5))


def _grass(rng: np.random.Generator) -> np.ndarray:
    blades = 1.0 + 0.28 * tiling_noise(rng, 0.4) + 0.10 * tiling_noise(rng, 1.5)
    dry = 0.12 * tiling_noise(rng, 1.2)
    return (
        np.maximum(blades, 0.2)
        * (1.0 + dry * (1.0, 0.2, 0.3))
        * (1.0, 1.1, 0.7)
    )


def _plaster(rng: np.random.Generator) -> np.ndarray:
    streaks = tiling_noise(rng, 1.2).mean(axis=0, keepdims=True)
    return (
        1.0
        + 0.05 * tiling_noise(rng, 1.5)
        + 0.04 * tiling_noise(rng, 0.3)
        + 0.1 * streaks
    )


def _bark(rng: np.random.Generator) -> np.ndarray:
    stretched = tiling_noise(rng, 0.8)[np.arange(_SIDE) // 8]
    return np.maximum(1.0 + 0.3 * stretched, 0.3)


def _panes(rng: np.random.Generator) -> np.ndarray:
    """Returns the image that panes mirror: sky, clouds, opposite houses."""
    sky = np.clip(0.4 + 1.2 * tiling_noise(rng, 1.8), 0.0, 4.0)
    return (0.5 + sky * (0.85, 0.95, 1.05)) * (
        1.0 + 0.1 * tiling_noise(rng, 0.8)
    )


def _leaves(rng: np.random.Generator) -> np.ndarray:
    """Returns leaves, with gaps between them."""
    from PIL import Image, ImageDraw

    picture = Image.new("F", (_SIDE, _SIDE))
    pen = ImageDraw.Draw(picture)
    turn = np.linspace(0.0, 2.0 * np.pi, 9)
    for place in rng.uniform(0, _SIDE, (900, 2)):
        long = rng.uniform(14, 22)
        angle = rng.uniform(0.0, np.pi)
        leaf = long * np.exp(1j * angle) * (np.cos(turn) + 0.45j * np.sin(turn))
        shade = rng.uniform(0.55, 1.5)
        for dx in (-_SIDE, 0, _SIDE):
            for dy in (-_SIDE, 0, _SIDE):
                x, y = leaf.real + place[0] + dx, leaf.imag + place[1] + dy
                pen.polygon(list(zip(x, y, strict=True)), fill=shade)
    light = np.asarray(picture)[:, :, None]
    return np.concatenate([light * (1.05, 1.2, 0.6), light > 0.0], axis=2)


def _sign_painter(
    ground: str,
    shape: Sequence[tuple[float, float]] = (),
    colour: str = "white",
    text: str = "",
) -> Callable[[np.random.Generator], np.ndarray]:
    """Returns a function that paints a sign: a polygon and white text."""
    from PIL import Image, ImageDraw, ImageFont

    def paint(_rng: np.random.Generator) -> np.ndarray:
        picture = Image.new("RGB", (_SIDE, _SIDE), ground)
        pen = ImageDraw.Draw(picture)
        if shape:
            pen.polygon([(_SIDE * x, _SIDE * y) for x, y in shape], colour)
        font = ImageFont.load_default(_SIDE / max(3.0, len(text) * 0.7))
        middle = _SIDE / 2, _SIDE / 2
        pen.text(middle, text, "white", font, "mm", stroke_width=6)
        return (np.asarray(picture) / 255.0) ** GAMMA

    return paint


def _octagon(radius: float) -> list[tuple[float, float]]:
    turn = np.pi / 8.0 + np.arange(8) * np.pi / 4.0
    x, y = 0.5 + radius * np.cos(turn), 0.5 + radius * np.sin(turn)
    return list(zip(x.tolist(), y.tolist(), strict=True))


def _signals(_rng: np.random.Generator) -> np.ndarray:
    """Returns two signals side by side: one shows red, the other green."""
    y, x = np.indices((_SIDE, _SIDE)) / _SIDE
    light = np.full((_SIDE, _SIDE, 3), 0.006)
    for row, rgb in enumerate(((1, 0.03, 0.02), (1, 0.5, 0), (0.02, 0.9, 0.4))):
        for column, lit in enumerate((0, 2)):
            away = np.hypot(
                (2.0 * x - column - 0.5) * 0.52, (y - (row + 0.5) / 3.0) * 1.18
            )
            shown = np.array(rgb) * (1.0 if row == lit else 0.03)
            light[away < 0.13] = shown
    return light


# Name of a look, as in `worlds/shapes/materials.yaml` -> the look.
LOOKS = {
    "stop": Look(
        1.0, _sign_painter("white", _octagon(0.5), "#b01818", "STOP"), 0.6, True
    ),
    "yield": Look(
        1.0,
        _sign_painter("#b01818", [(0.2, 0.12), (0.8, 0.12), (0.5, 0.72)]),
        0.6,
        True,
    ),
    "way": Look(
        1.0,
        _sign_painter(
            "#164a9c",
            [
                (0.42, 0.82),
                (0.42, 0.45),
                (0.28, 0.45),
                (0.5, 0.17),
                (0.72, 0.45),
                (0.58, 0.45),
                (0.58, 0.82),
            ],
        ),
        0.6,
        True,
    ),
    "name": Look(1.0, _sign_painter("#164a9c", text="MAIN STREET"), 0.6, True),
    "signals": Look(1.0, _signals, 0.6, True),
    "asphalt": Look(6.0, _asphalt),
    "paving": Look(
        4.8, lambda rng: _stones(rng, 8, 8, (0.004, 0.6), spread=0.06)
    ),
    "brick": Look(
        2.25,
        lambda rng: _stones(rng, 9, 30, (0.0055, 1.5), spread=0.2),
    ),
    "grass": Look(5.0, _grass),
    "plaster": Look(9.0, _plaster),
    "paint": Look(9.0, _plaster, 0.4),
    "bark": Look(1.5, _bark),
    "panes": Look(16.0, _panes, 0.3),
    "leaves": Look(2.0, _leaves),
    "hedge": Look(2.0, lambda rng: np.maximum(_leaves(rng)[:, :, :3], 0.3)),
}


@functools.cache
def texture(name: str) -> tuple[bytes, float]:
    """Returns the texture of a look as PNG, and a factor for its brightness.

    Args:
        name: a key of `LOOKS`.

    Returns:
        The PNG, gamma-encoded; and the factor. The brightness of a pixel is its
        linear value, from 0 to 1, times the factor, so that the mean brightness
        is 1. For a texture that covers a whole geometry (`is_face`), the factor
        is 1, and the mean brightness can have any value.
    """
    from PIL import Image

    seed = sum(name.encode())
    light = LOOKS[name].paint(np.random.default_rng(seed))
    white = 1.0
    if light.shape[2] == 1:
        light = np.repeat(light, 3, axis=2)
    if not LOOKS[name].is_face:
        shown = light[:, :, :3].mean(axis=2) > 0.0
        light[:, :, :3] /= light[shown][:, :3].mean()
        white = float(np.quantile(light[:, :, :3], 0.995))
    light[:, :, :3] = np.clip(light[:, :, :3] / white, 0.0, 1.0) ** (1 / GAMMA)
    stream = io.BytesIO()
    Image.fromarray(np.round(255.0 * light).astype(np.uint8)).save(
        stream, "PNG"
    )
    return stream.getvalue(), white
