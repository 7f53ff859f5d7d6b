"""The images of a recording's first camera."""

from functools import cached_property

import numpy as np

from cns_drake.base.errors import InputError
from cns_drake.drives import mcap_messages, ros_types
from cns_drake.drives.mcap_file import LOCATION
from cns_drake.drives.mcap_topics import McapTopics

# `image_transport` adds this to the names of topics of depth images.
_DEPTH = "/compressedDepth"


class McapImages:
    """The images of the first topic of compressed images, if there is one."""

    def __init__(self, topics: McapTopics):
        self._topics = topics
        found = topics.find(ros_types.COMPRESSED_IMAGE)
        cameras = [topic for topic in found if not topic.endswith(_DEPTH)]
        self._topic = cameras[0] if cameras else None

    @property
    def stamps_ns(self) -> np.ndarray:
        """(M,) int64 stamp of each image, sorted [ns].

        Raises:
            InputError: an image has no stamp.
        """
        return self._sorted[0]

    def image(self, index: int) -> bytes:
        """Returns image `index`, in the order of the stamps, as encoded."""
        if self._topic is None:
            raise IndexError(f"image {index} of 0")
        place = self._sorted[1][index]
        return self._topics.message(self._topic, place).data.tobytes()

    @cached_property
    def _sorted(self) -> tuple[np.ndarray, np.ndarray]:
        """Stamps (M,) [ns] and places of the images, sorted by stamp."""
        topic = self._topic
        if topic is None:
            return np.zeros(0, np.int64), np.zeros(0, LOCATION)
        places = self._topics.file.locate(topic)
        stamps_ns = self._topics.logged_stamps_ns(topic)
        if stamps_ns is None:
            stamps_ns = np.zeros(len(places), np.int64)
            with self._topics.faults(topic):
                for index, data in self._topics.file.visit(places):
                    stamps_ns[index] = mcap_messages.read_stamp(data) or 0
        if (stamps_ns == 0).any():
            raise InputError(
                f"{self._topics.path}: {topic}: an image has no stamp"
            )
        order = np.argsort(stamps_ns, kind="stable")
        return stamps_ns[order], places[order]
