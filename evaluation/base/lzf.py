"""LZF, by which PCL compresses point clouds."""

import numpy as np

from evaluation.base.compilation import compiled


@compiled
def unpack_lzf(packed: np.ndarray, plain: np.ndarray) -> bool:
    """Expands LZF data; returns whether the data are sound and fill `plain`.

    Format: each sequence begins with a control byte c. If c < 32, then c + 1
    literal bytes follow. Otherwise the sequence copies earlier bytes. The upper
    three bits of c are the length minus two; if they are 7, the next byte is
    added to the length. The lower five bits and one more byte are the distance
    back minus one.
    """
    source = 0
    target = 0
    while source < len(packed):
        control = int(packed[source])
        source += 1
        if control < 32:
            length = control + 1
            if source + length > len(packed) or target + length > len(plain):
                return False
            for _ in range(length):
                plain[target] = packed[source]
                source += 1
                target += 1
            continue
        length = control >> 5
        if length == 7:
            if source >= len(packed):
                return False
            length += int(packed[source])
            source += 1
        if source >= len(packed):
            return False
        distance = ((control & 31) << 8) + int(packed[source]) + 1
        source += 1
        length += 2
        if distance > target or target + length > len(plain):
            return False
        # Bytes are copied one by one: source and target may overlap.
        for _ in range(length):
            plain[target] = plain[target - distance]
            target += 1
    return target == len(plain)
