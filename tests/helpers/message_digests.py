"""Prints a digest of the messages of each topic of a recording.

python tests/helpers/message_digests.py FOLDER
"""

import hashlib
from pathlib import Path
import sys

from mcap.reader import make_reader


def message_digests(folder: Path) -> dict[str, str]:
    """Returns topic -> digest of its messages and their times."""
    digests: dict[str, hashlib._Hash] = {}
    for file in sorted(folder.glob("*.mcap")):
        with file.open("rb") as stream:
            for _, channel, message in make_reader(stream).iter_messages():
                digest = digests.setdefault(channel.topic, hashlib.sha256())
                digest.update(message.log_time.to_bytes(8, "little"))
                digest.update(message.data)
    return {topic: one.hexdigest() for topic, one in digests.items()}


if __name__ == "__main__":
    for topic, digest in sorted(message_digests(Path(sys.argv[1])).items()):
        print(topic, digest)
