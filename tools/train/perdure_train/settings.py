"""Classes of the network, and the shape of its input and heads."""

CLASSES = ["car", "van", "person", "bicycle", "chair", "dining table", "monitor", "couch"]
# Classes whose yaw is visible in the picture; no azimuth is reported for the others.
AZIMUTH_CLASSES = ["car", "van", "bicycle", "chair", "monitor", "couch"]
WIDTH, HEIGHT = 320, 240
STRIDES = [8, 16, 32]
BINS = 12  # azimuth bins of 30 degrees each
# Largest distance of a cell outside its object, in strides. Objects smaller than a cell often
# contain no cell centre.
REACH = 0.5


def grid(stride):
    """Rows and columns of cells; the last row may extend beyond the image (240 / 32 is 7.5)."""
    return -(-HEIGHT // stride), -(-WIDTH // stride)
