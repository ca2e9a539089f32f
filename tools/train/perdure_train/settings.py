"""What the network looks for, and the shape of its input and heads."""

CLASSES = ["car", "van", "person", "bicycle", "chair", "dining table", "monitor", "couch"]
# Where a yaw shows in the picture; of the others no azimuth is reported.
AZIMUTH_CLASSES = ["car", "van", "bicycle", "chair", "monitor", "couch"]
WIDTH, HEIGHT = 320, 240
STRIDES = [8, 16, 32]
BINS = 12  # of azimuth, 30 degrees each
# By how many strides a cell may lie outside the object that it finds: what is smaller than a cell
# often holds no cell's centre at all.
REACH = 0.5


def grid(stride):
    """Rows and columns of cells: the last row may reach beyond the image (240 / 32 is 7.5)."""
    return -(-HEIGHT // stride), -(-WIDTH // stride)
