"""Assignment of cells to objects, and the loss functions.

The assignment follows Feng et al., "TOOD: Task-aligned One-stage Object Detection" (ICCV 2021).
Among the cells inside an object's box, it selects those with the best current class score and box.
Their quality is the target probability of the class; the background receives the rest. Soft targets
with a plain cross-entropy are a proper score, so that the probabilities are nearly calibrated.
"""

import torch
from torch.nn import functional

from .heads import HALF_BIN, area, boxes_of, iou, spread_of, wrapped
from .settings import AZIMUTH_CLASSES, BINS, CLASSES, REACH

TOP = 10
WITH_AZIMUTH = torch.tensor([name in AZIMUTH_CLASSES for name in CLASSES])
WEIGHTS = {"class": 1.0, "box": 5.0, "side": 1.0, "bin": 1.0, "residual": 1.0, "spread": 0.3}


def inside(centres, boxes, margin):
    """Whether a cell's centre is in a box (N, G, A). Each side is first moved outwards by `margin`
    (A,)."""
    x, y = centres[:, 0], centres[:, 1]
    b = boxes[..., None]
    return (
        (x > b[..., 0, :] - margin) & (x < b[..., 2, :] + margin)
        & (y > b[..., 1, :] - margin) & (y < b[..., 3, :] + margin)
    )


@torch.no_grad()
def assign(probabilities, boxes, centres, strides, truth):
    """Quality (N, A) in [0, 1] and object index (N, A); quality 0 is background."""
    wanted = truth["mask"] & ~truth["ignored"]
    overlap = iou(truth["boxes"][:, :, None], boxes[:, None])  # shape (N, G, A)
    classes = (truth["classes"] + 1)[:, :, None].expand(-1, -1, boxes.shape[1])
    score = probabilities.transpose(1, 2).gather(1, classes)
    candidate = inside(centres, truth["boxes"], REACH * strides) & wanted[:, :, None]
    fit = (score.sqrt() * overlap.pow(6) + 1e-12) * candidate
    best = fit.topk(TOP, dim=2)
    chosen = torch.zeros_like(fit).scatter_(2, best.indices, 1.0) * (fit > 0)
    owner = (overlap * chosen).argmax(1)  # if chosen twice: the box of largest overlap
    fit = fit * chosen
    scale = (overlap * chosen).amax(2, keepdim=True) / fit.amax(2, keepdim=True).clamp_min(1e-12)
    quality = (fit * scale).gather(1, owner[:, None]).squeeze(1)
    return quality.clamp(0, 1), owner


def class_loss(logits, quality, classes, ignored):
    log_p = functional.log_softmax(logits, -1)
    target = log_p.gather(2, (classes + 1)[..., None]).squeeze(-1)
    cost = -(quality * target + (1 - quality) * log_p[..., 0])
    return (cost * ~ignored).sum()


def box_loss(boxes, target, strides, weight):
    low = torch.minimum(boxes[:, :2], target[:, :2])
    high = torch.maximum(boxes[:, 2:], target[:, 2:])
    hull = (high - low).prod(-1).clamp_min(1e-6)
    overlap = iou(boxes, target)
    union = (area(boxes) + area(target)) / (1 + overlap)
    giou = overlap - (hull - union) / hull
    side = functional.smooth_l1_loss(
        boxes / strides[:, None], target / strides[:, None], reduction="none", beta=0.5
    ).mean(-1)
    return ((1 - giou) * weight).sum(), (side * weight).sum()


def spread_loss(raw, boxes, target, strides, weight):
    """Negative log-likelihood of the sides' errors under a Laplace distribution. It trains only the
    estimated uncertainty and not the boxes (after Kendall and Gal, "What uncertainties do we need
    in Bayesian deep learning", NIPS 2017)."""
    error = (boxes.detach() - target).abs() / strides[:, None]
    scale = spread_of(raw)
    return ((error / scale + scale.log()).mean(-1) * weight).sum()


def azimuth_loss(raw, angle, weight):
    """The two bins nearest to the target share it by distance. Each bin has its own residual."""
    bins, residuals = raw.split(BINS, -1)
    position = torch.remainder(angle / (2 * HALF_BIN), BINS)
    lower = position.floor().long() % BINS
    share = position - position.floor()
    log_p = functional.log_softmax(bins, -1)
    bin_cost, residual_cost = 0.0, 0.0
    for index, part in ((lower, 1 - share), ((lower + 1) % BINS, share)):
        i = index[:, None]
        target = wrapped(angle - index * 2 * HALF_BIN) / HALF_BIN
        error = functional.smooth_l1_loss(
            residuals.gather(1, i).squeeze(1), target, reduction="none", beta=0.3
        )
        bin_cost = bin_cost - (log_p.gather(1, i).squeeze(1) * part * weight).sum()
        residual_cost = residual_cost + (error * part * weight).sum()
    return bin_cost, residual_cost


def losses(parts, truth, centres, strides):
    """Returns the terms of the loss by name, divided by the sum of the assigned qualities."""
    logits, raw_boxes, raw_azimuth, raw_spread = parts
    boxes = boxes_of(raw_boxes, centres, strides)
    quality, owner = assign(logits.detach().softmax(-1), boxes.detach(), centres, strides, truth)
    classes = truth["classes"].gather(1, owner)
    hidden = inside(centres, truth["boxes"], REACH * strides)
    hidden = hidden & (truth["mask"] & truth["ignored"])[:, :, None]
    ignored = hidden.any(1) & (quality == 0)
    total = quality.sum().clamp_min(1.0)
    terms = {"class": class_loss(logits, quality, classes, ignored)}

    n, a = (quality > 0).nonzero(as_tuple=True)
    g, weight = owner[n, a], quality[n, a]
    terms["box"], terms["side"] = box_loss(boxes[n, a], truth["boxes"][n, g], strides[a], weight)
    terms["spread"] = spread_loss(
        raw_spread[n, a], boxes[n, a], truth["boxes"][n, g], strides[a], weight
    )
    turned = WITH_AZIMUTH[classes[n, a]].float() * weight
    terms["bin"], terms["residual"] = azimuth_loss(
        raw_azimuth[n, a], truth["azimuths"][n, g], turned
    )
    return {name: WEIGHTS[name] * value / total for name, value in terms.items()}
