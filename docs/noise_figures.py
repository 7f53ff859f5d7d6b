"""Draws the Allan deviation of an IMU and the spectrum of roads.

python docs/noise_figures.py docs/pictures/noise.png
"""

from __future__ import annotations

from pathlib import Path
import sys

from matplotlib.axes import Axes
from matplotlib.figure import Figure
import numpy as np
from scipy.signal import welch

from cns_drake.motion.road_profile import RoadProfile
from cns_drake.sensors.imu.noise import ImuErrors, ImuNoise

# Kalibr's example of an ADIS16448, for three hours.
_NOISE = ImuNoise(
    accelerometer_noise_density=0.01,
    accelerometer_random_walk=2e-4,
    gyroscope_noise_density=0.005,
    gyroscope_random_walk=4e-6,
    seed=3,
)
_RATE, _NUM_BLOCKS, _BLOCK = 100, 1054, 1024
_STEP, _WINDOW = 0.1, 600.0


def draw_allan(axes: Axes) -> None:
    """Draws the deviations of all axes over those of the densities."""
    errors = ImuErrors(_NOISE, _RATE)
    # The integral of what an IMU at rest measures.
    angle = np.cumsum(
        np.concatenate([errors.of_block(k) for k in range(_NUM_BLOCKS)]), axis=0
    )
    sizes = np.unique(np.geomspace(1, len(angle) / 9, 50).astype(int))
    taus = sizes / _RATE
    spreads = [
        np.std(angle[2 * n :] - 2 * angle[n:-n] + angle[: -2 * n], axis=0)
        / (np.sqrt(2.0) * n)
        for n in sizes
    ]
    for colour, rows, white, walk, name in (
        ("C0", slice(0, 3), 0.01, 2e-4, "accelerometer [m/s$^2$]"),
        ("C1", slice(3, 6), 0.005, 4e-6, "gyroscope [rad/s]"),
    ):
        axes.loglog(taus, np.array(spreads)[:, rows], colour, lw=0.8)
        axes.plot([], [], colour, label=name)
        axes.loglog(taus, white / np.sqrt(taus), "k--", lw=0.6)
        axes.loglog(taus, walk * np.sqrt(taus / 3.0), "k:", lw=0.6)
    axes.set_ylim(1e-6, 0.3)
    axes.set_xlabel("averaging time [s]")
    axes.set_ylabel("Allan deviation")
    axes.legend()


def draw_spectra(axes: Axes) -> None:
    """Draws the spectra of roads along lines over those of their classes."""
    along = np.arange(0.0, 3000.0, _STEP)
    for k, roughness in enumerate("ABCDE"):
        profile = RoadProfile(roughness, 0)
        spectra = []
        for angle in (0.0, 0.5, np.pi / 4, 1.9):
            direction = [np.cos(angle), np.sin(angle)]
            heights = profile.heights(
                np.outer(along, direction) + 300.0 * angle
            )
            frequency, spectrum = welch(
                heights, 1.0 / _STEP, nperseg=int(_WINDOW / _STEP)
            )
            spectra.append(spectrum)
        inside = (frequency > 1.0 / 150.0) & (frequency < 4.0)
        axes.loglog(
            frequency[inside],
            np.mean(spectra, axis=0)[inside],
            lw=0.8,
            label=f"class {roughness}",
        )
        waves = np.array([1.0 / 90.0, 1.0 / 0.35])
        axes.loglog(waves, 16e-6 * 4.0**k * (waves / 0.1) ** -2, "k--", lw=0.6)
    axes.set_xlabel("waves a metre [1/m]")
    axes.set_ylabel("spectral density of heights [m$^3$]")
    axes.legend(fontsize=8)


def main() -> None:
    figure = Figure(figsize=(10.0, 4.0), layout="constrained")
    left, right = figure.subplots(1, 2)
    draw_allan(left)
    draw_spectra(right)
    figure.savefig(Path(sys.argv[1]), dpi=80)


if __name__ == "__main__":
    main()
