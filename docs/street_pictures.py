"""Draws what a camera sees in three streets of each city.

python docs/street_pictures.py docs/pictures
"""

from __future__ import annotations

from pathlib import Path
import sys

import numpy as np
from PIL import Image

from cns_drake import load_scenario, make_station
from cns_drake.sensors.camera.config import CameraSection

# When the car is there [s].
PLACES = {
    "downtown_04": (12, 40, 70),
    "metropolis_04": (6, 18, 45),
    "riverside_02": (10, 35, 60),
    "suburbia_02": (10, 30, 55),
}
_CAMERA = CameraSection(
    width=1280, height=720, rate=1, fov_y=0.85, xyz=(0.5, 0.0, 1.6)
)


def main(folder: Path) -> None:
    """Writes the twelve pictures."""
    for drive, times in PLACES.items():
        scenario = load_scenario(drive).replaced(cameras={"front": _CAMERA})
        diagram = make_station(scenario)
        context = diagram.CreateDefaultContext()
        for number, time in enumerate(times, start=1):
            context.SetTime(float(time))
            image = diagram.GetOutputPort("front_image").Eval(context)
            pixels = np.ascontiguousarray(image.data[:, :, :3])
            city = drive.partition("_")[0]
            Image.fromarray(pixels).resize((960, 540)).save(
                folder / f"street_{city}_{number}.webp", quality=70
            )


if __name__ == "__main__":
    main(Path(sys.argv[1]))
