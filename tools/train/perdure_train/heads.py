"""Decodes the outputs of the heads: cells, boxes and azimuths, for training and tests."""

import math

import torch
from torch.nn import functional

from .settings import BINS, REACH, STRIDES, grid

HALF_BIN = math.pi / BINS


def cells():
    """Centres (A, 2) in pixels of the input and strides (A,) of all cells, stride 8 first."""
    centres, strides = [], []
    for stride in STRIDES:
        rows, columns = grid(stride)
        y, x = torch.meshgrid(torch.arange(rows), torch.arange(columns), indexing="ij")
        centre = (torch.stack((x, y), -1).reshape(-1, 2).float() + 0.5) * stride
        centres.append(centre)
        strides.append(torch.full((len(centre),), float(stride)))
    return torch.cat(centres), torch.cat(strides)


def flat(outputs):
    """Logits, box, azimuth and spread, each as one float32 (N, A, channels)."""
    parts = []
    for part in range(len(outputs[0])):
        maps = [level[part].float().flatten(2) for level in outputs]
        parts.append(torch.cat(maps, 2).transpose(1, 2))
    return parts


def boxes_of(raw, centres, strides):
    """Corners (…, A, 4) in pixels of the input. The lower corner may exceed the upper one by at
    most a stride."""
    distance = (functional.softplus(raw) - REACH) * strides[:, None]
    return torch.cat((centres - distance[..., :2], centres + distance[..., 2:]), -1)


def spread_of(raw):
    """Scale of the Laplace distribution of each side's error, in strides."""
    return functional.softplus(raw) + 0.01


def wrapped(angle):
    return torch.remainder(angle + math.pi, 2 * math.pi) - math.pi


def iou(a, b):
    """IoU of boxes of broadcastable shapes (…, 4)."""
    low, high = torch.maximum(a[..., :2], b[..., :2]), torch.minimum(a[..., 2:], b[..., 2:])
    common = (high - low).clamp_min(0).prod(-1)
    return common / (area(a) + area(b) - common).clamp_min(1e-6)


def area(boxes):
    """Area of boxes; 0 if the sides are in the wrong order."""
    return (boxes[..., 2:] - boxes[..., :2]).clamp_min(0).prod(-1)
