"""Reads pictures with boxes, classes and azimuths from a folder of `perdure simulate`."""

import csv
import json
import math
from pathlib import Path

import numpy as np
from PIL import Image

from .settings import CLASSES, HEIGHT, WIDTH

MIN_SIDE = 10.0  # longer side in pixels of the input; smaller objects are ignored
HIDDEN = 0.05  # visible share of the outline within the image below which an object is invisible
IGNORED = 0.25  # visible share below which an object counts neither as a miss nor as a false alarm


def table(file):
    """Numeric rows of a CSV, without its header and rows that are not numbers."""
    with open(file, newline="") as stream:
        return [row for row in csv.reader(stream) if row and not row[0].startswith("#")]


def rotation(w, x, y, z):
    return np.array([
        [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
        [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
        [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
    ])


def listed(text, key):
    """Returns the numbers of `key: [..]` in a sensor.yaml."""
    numbers = text[text.index(key) :]
    return [float(x) for x in numbers[numbers.index("[") + 1 : numbers.index("]")].split(",")]


class Lens:
    """Pinhole camera with radial and tangential distortion, from EuRoC's sensor.yaml."""

    def __init__(self, text):
        self.fx, self.fy, self.cx, self.cy = listed(text, "intrinsics:")
        self.k1, self.k2, self.p1, self.p2 = listed(text, "distortion_coefficients:")

    def hull(self, points_C):
        """Box (x1, y1, x2, y2) around the images of points in front of the camera, or None."""
        if points_C[:, 2].min() < 0.5:
            return None
        x, y = points_C[:, 0] / points_C[:, 2], points_C[:, 1] / points_C[:, 2]
        r = x * x + y * y
        if r.max() > 2.0:  # outside the valid range of the polynomial
            return None
        radial = 1 + self.k1 * r + self.k2 * r * r
        u = self.fx * (x * radial + 2 * self.p1 * x * y + self.p2 * (r + 2 * x * x)) + self.cx
        v = self.fy * (y * radial + self.p1 * (r + 2 * y * y) + 2 * self.p2 * x * y) + self.cy
        return np.array([u.min(), v.min(), u.max(), v.max()])


def corners(thing, centre, yaw):
    """The eight corners of the cuboid in the world."""
    unit = np.array([[a, b, c] for a in (-0.5, 0.5) for b in (-0.5, 0.5) for c in (-0.5, 0.5)])
    c, s = math.cos(yaw), math.sin(yaw)
    return (unit * thing["size"]) @ np.array([[c, s, 0], [-s, c, 0], [0, 0, 1]]) + centre


class Poses:
    """Poses of the camera in the world, by time."""

    def __init__(self, mav0):
        rows = np.array(
            [[float(x) for x in row[:8]]
             for row in table(mav0 / "state_groundtruth_estimate0" / "data.csv")]
        )
        self.times, self.rows = rows[:, 0], rows[:, 1:]
        text = (mav0 / "cam0" / "sensor.yaml").read_text()
        self.T_BC = np.array(listed(text, "data:")).reshape(4, 4)
        self.lens = Lens(text)

    def at(self, time_ns):
        """R_WC and p_WC of the state that is nearest in time."""
        row = self.rows[np.abs(self.times - time_ns).argmin()]
        R_WB = rotation(*row[3:7])
        return R_WB @ self.T_BC[:3, :3], R_WB @ self.T_BC[:3, 3] + row[:3]


def azimuth(R_WC, p_WC, centre, yaw):
    """KITTI's alpha in the gravity-levelled camera: rotation_y minus the bearing."""
    forward = np.array([R_WC[0, 2], R_WC[1, 2]])
    forward /= max(np.linalg.norm(forward), 1e-9)
    right = np.array([forward[1], -forward[0]])
    front = np.array([math.cos(yaw), math.sin(yaw)])
    ray = np.asarray(centre[:2]) - p_WC[:2]
    rotation_y = math.atan2(-front @ forward, front @ right)
    return math.remainder(rotation_y - math.atan2(ray @ right, ray @ forward), 2 * math.pi)


def key_at(thing, time_ns):
    """Centre and yaw at a time, interpolated linearly between the dense keys of a moving object."""
    keys = thing["keys"]
    after = next((i for i, key in enumerate(keys) if key["time_ns"] > time_ns), len(keys))
    before = keys[max(after - 1, 0)]
    if not thing["moves"] or after in (0, len(keys)):
        return np.array(before["centre"]), before["yaw"]
    share = (time_ns - before["time_ns"]) / (keys[after]["time_ns"] - before["time_ns"])
    centre = np.array(before["centre"]) * (1 - share) + np.array(keys[after]["centre"]) * share
    return centre, before["yaw"]


def judged(row, scale):
    """Box in pixels of the input, clipped to the image, and whether to ignore it; or None."""
    full = np.array([float(x) for x in row[3:7]]) * scale
    box = np.clip(full, 0, [WIDTH, HEIGHT, WIDTH, HEIGHT])
    sides, whole = box[2:] - box[:2], full[2:] - full[:2]
    if sides.min() < 1:
        return None
    seen = float(row[2])
    inside = min(1.0, seen * whole.prod() / sides.prod())
    if inside < HIDDEN or seen < 0.01:
        return None
    return box, bool(inside < IGNORED or sides.max() < MIN_SIDE or sides.min() < 3)


def hull_of(thing, seen, R_WC, p_WC, time_ns, lens, scale):
    """Box of the cuboid's image in pixels of the input if the object is completely visible;
    otherwise four times NaN."""
    hull = lens.hull((corners(thing, *key_at(thing, time_ns)) - p_WC) @ R_WC)
    if hull is None or seen < 0.95:
        return [math.nan] * 4
    hull = hull * scale
    inside = hull[0] > 0 and hull[1] > 0 and hull[2] < WIDTH and hull[3] < HEIGHT
    return [round(float(x), 2) for x in hull] if inside else [math.nan] * 4


def read_folder(folder):
    """Images (N, 240, 320, 3) and the ground truth of each frame, for data.Chunk."""
    mav0 = Path(folder) / "mav0"
    things = {t["id"]: t for t in json.loads((Path(folder) / "objects_truth.json").read_text())["objects"]}
    poses = Poses(mav0)
    rows = {}
    for row in table(Path(folder) / "visibility_truth.csv")[1:]:
        rows.setdefault(int(row[0]), []).append(row)
    images, frames = [], []
    for i, (stamp, name) in enumerate(table(mav0 / "cam0" / "data.csv")):
        with Image.open(mav0 / "cam0" / "data" / name.strip()) as picture:
            scale = np.array([WIDTH / picture.width, HEIGHT / picture.height] * 2)
            images.append(np.array(picture.convert("RGB").resize((WIDTH, HEIGHT), Image.BOX)))
        R_WC, p_WC = poses.at(float(stamp))
        frame = {"boxes": [], "classes": [], "azimuths": [], "ignored": [], "hulls": []}
        for row in rows.get(i, []):
            thing, judgement = things[int(row[1])], judged(row, scale)
            if judgement is None or thing["looks_like"] not in CLASSES:
                continue
            frame["boxes"].append([round(float(x), 2) for x in judgement[0]])
            frame["ignored"].append(judgement[1])
            frame["classes"].append(CLASSES.index(thing["looks_like"]))
            frame["hulls"].append(hull_of(thing, float(row[2]), R_WC, p_WC, float(stamp),
                                          poses.lens, scale))
            frame["azimuths"].append(round(azimuth(R_WC, p_WC, *key_at(thing, float(stamp))), 4))
        frames.append(frame)
    return np.stack(images), frames
