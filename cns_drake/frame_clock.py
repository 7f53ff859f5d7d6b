"""When frames are."""

# Time between frames [s]: the paper's 20 Hz.
FRAME_PERIOD = 0.05
# Stamp of frame 0 [ns]. Not zero, which tf2 takes for "latest", and not the
# clock's time, so that the same scenario gives the same bytes.
START_NS = 1_700_000_000_000_000_000
