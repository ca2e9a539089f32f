"""Image augmentation with consistent ground truth: crops, scale, mirroring, light, blur, noise."""

import numpy as np
from PIL import Image

from .settings import HEIGHT, WIDTH

MIN_SIDE = 10.0  # longer side in pixels; smaller objects are ignored


def crop(image, truth, rng):
    """Scales a window of the picture to full size. The area outside the picture becomes grey."""
    zoom = np.exp(rng.uniform(np.log(0.7), np.log(1.6)))
    width, height = WIDTH / zoom, HEIGHT / zoom
    x = rng.uniform(min(0, WIDTH - width), max(0, WIDTH - width))
    y = rng.uniform(min(0, HEIGHT - height), max(0, HEIGHT - height))
    left, top = max(x, 0), max(y, 0)
    right, bottom = min(x + width, WIDTH), min(y + height, HEIGHT)
    to = [round((left - x) * zoom), round((top - y) * zoom)]
    size = (max(1, round((right - left) * zoom)), max(1, round((bottom - top) * zoom)))
    part = Image.fromarray(image).resize(size, Image.BILINEAR, box=(left, top, right, bottom))
    if size == (WIDTH, HEIGHT):
        result = np.array(part)
    else:
        grey = int(rng.integers(40, 200))
        canvas = Image.new("RGB", (WIDTH, HEIGHT), (grey, grey, grey))
        canvas.paste(part, tuple(to))
        result = np.array(canvas)
    return result, moved(truth, x, y, zoom)


def moved(truth, x, y, zoom):
    """Clips boxes to the new border. Boxes of which little remains are marked as ignored."""
    boxes = (truth["boxes"] - np.array([x, y, x, y], np.float32)) * zoom
    area = np.prod(boxes[:, 2:] - boxes[:, :2], axis=1)
    boxes = np.clip(boxes, 0, [WIDTH, HEIGHT, WIDTH, HEIGHT]).astype(np.float32)
    sides = boxes[:, 2:] - boxes[:, :2]
    keep = (sides.min(1) > 1) & (sides.prod(1) > 0.03 * area)
    cut = (sides.prod(1) < 0.25 * area) | (sides.max(1) < MIN_SIDE)
    truth = dict(truth, boxes=boxes, ignored=truth["ignored"] | cut)
    return {name: values[keep] for name, values in truth.items()}


def mirrored(image, truth):
    boxes = truth["boxes"][:, [2, 1, 0, 3]] * np.float32([-1, 1, -1, 1])
    boxes += np.float32([WIDTH, 0, WIDTH, 0])
    return image[:, ::-1], dict(truth, boxes=boxes, azimuths=np.pi - truth["azimuths"])


def coloured(image, rng):
    """Changes exposure, contrast and white balance, and sometimes removes colour. `image`: float, 0
    to 255."""
    if rng.random() < 0.15:
        image = np.repeat(image.mean(2, keepdims=True), 3, axis=2)
    gain = np.exp(rng.normal(0, 0.2)) * np.exp(rng.normal(0, 0.06, 3))
    if rng.random() < 0.3:
        image = 255 * (np.maximum(image, 0) / 255) ** np.exp(rng.normal(0, 0.25))
    return image * gain.astype(np.float32) + np.float32(rng.normal(0, 6))


def blurred(image, rng):
    axis = int(rng.integers(0, 2))
    return (np.roll(image, 1, axis) + 2 * image + np.roll(image, -1, axis)) / 4


def augmented(image, truth, rng, crops=0.75):
    """Returns a randomly changed uint8 image (240, 320, 3) and its ground truth. A share `crops` of
    the pictures is cropped and scaled. The result depends only on the arguments and `rng`."""
    if rng.random() < crops:
        image, truth = crop(image, truth, rng)
    if rng.random() < 0.5:
        image, truth = mirrored(image, truth)
    image = coloured(image.astype(np.float32), rng)
    if rng.random() < 0.2:
        image = blurred(image, rng)
    if rng.random() < 0.5:
        noise = rng.standard_normal(image.shape, np.float32)
        image = image + noise * np.float32(rng.uniform(0, 7))
    return np.clip(image, 0, 255).astype(np.uint8), truth
