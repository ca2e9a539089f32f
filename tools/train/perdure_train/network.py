"""The network: plain 3x3 residual blocks, three strides, a light top-down neck, shared heads."""

import math

import torch
from torch import nn

from .settings import BINS, CLASSES, STRIDES


class _ReLU(torch.autograd.Function):
    """ReLU whose backward pass is vectorised for bf16 too (torch 1.13's is not)."""

    @staticmethod
    def forward(ctx, x):
        y = x.clamp_min(0)
        ctx.save_for_backward(y)
        return y

    @staticmethod
    def backward(ctx, gradient):
        (y,) = ctx.saved_tensors
        if y.dtype != torch.bfloat16:
            return gradient * y.sign()
        # The bits of a positive number are a positive integer; clamping and negation give a mask of
        # all ones.
        mask = y.view(torch.int16).clamp_max(1).neg()
        return (mask & gradient.to(y.dtype).view(torch.int16)).view(torch.bfloat16)


class ReLU(nn.Module):
    def forward(self, x):
        if torch.onnx.is_in_onnx_export() or not torch.is_grad_enabled():
            return torch.relu(x)
        return _ReLU.apply(x)


def conv(inputs, outputs, stride=1, size=3, relu=True):
    layers = [
        nn.Conv2d(inputs, outputs, size, stride, size // 2, bias=False),
        nn.BatchNorm2d(outputs, momentum=0.03),
    ]
    return nn.Sequential(*layers, ReLU()) if relu else nn.Sequential(*layers)


class Block(nn.Module):
    def __init__(self, width):
        super().__init__()
        self.first = conv(width, width)
        self.second = conv(width, width, relu=False)
        self.relu = ReLU()

    def forward(self, x):
        return self.relu(x + self.second(self.first(x)))


class Trunk(nn.Module):
    """A convolution that all strides share, with a separate batch norm for each stride. Activations
    differ between strides; shared statistics made boxes a tenth too high."""

    def __init__(self, width):
        super().__init__()
        self.convolution = nn.Conv2d(width, width, 3, padding=1, bias=False)
        self.norms = nn.ModuleList([nn.BatchNorm2d(width, momentum=0.03) for _ in STRIDES])
        self.relu = ReLU()

    def forward(self, x, level):
        return self.relu(self.norms[level](self.convolution(x)))


def upsampled(small, rows):
    """Doubles the size, then cuts the height to `rows`, which can be one less."""
    large = nn.functional.interpolate(small, scale_factor=2.0, mode="nearest")
    return large if large.shape[2] == rows else large[:, :, :rows]


class Network(nn.Module):
    """Maps images (N, 3, 240, 320), RGB in [0, 1] minus 0.5, to one (logits, box, azimuth, spread)
    for each stride.

    logits: K + 1, background first. box: softplus of the distances to the left, top, right and
    bottom from the cell's centre, minus REACH, in strides. azimuth: BINS logits, then BINS
    residuals in units of half a bin. spread: softplus of the uncertainty of each side, in strides.
    """

    def __init__(self, widths=(16, 32, 64, 80, 64), neck=48):
        super().__init__()
        stem, w4, w8, w16, w32 = widths
        self.stride4 = nn.Sequential(conv(3, stem, 2), conv(stem, w4, 2), Block(w4))
        self.stride8 = nn.Sequential(conv(w4, w8, 2), Block(w8), Block(w8))
        self.stride16 = nn.Sequential(conv(w8, w16, 2), Block(w16))
        self.stride32 = conv(w16, w32, 2)
        self.lateral = nn.ModuleList([conv(w, neck, size=1, relu=False) for w in (w8, w16, w32)])
        self.smooth = nn.ModuleList([conv(neck, neck) for _ in range(2)])
        self.class_trunk = Trunk(neck)
        self.box_trunk = Trunk(neck)
        self.logits = nn.Conv2d(neck, len(CLASSES) + 1, 1)
        self.box = nn.Conv2d(neck, 4, 1)
        self.azimuth = nn.Conv2d(neck, 2 * BINS, 1)
        self.spread = nn.Conv2d(neck, 4, 1)
        self._initialise()

    def _initialise(self):
        for m in self.modules():
            if isinstance(m, nn.Conv2d):
                nn.init.kaiming_normal_(m.weight, mode="fan_out", nonlinearity="relu")
        for head in (self.logits, self.box, self.azimuth, self.spread):
            nn.init.normal_(head.weight, std=0.01)
            nn.init.zeros_(head.bias)
        nn.init.constant_(self.box.bias, 1.0)
        nn.init.constant_(self.spread.bias, -1.0)
        with torch.no_grad():  # one cell in a hundred contains an object
            self.logits.bias[0] = math.log(99.0 * len(CLASSES))

    def forward(self, images):
        c8 = self.stride8(self.stride4(images))
        c16 = self.stride16(c8)
        c32 = self.stride32(c16)
        p32 = torch.relu(self.lateral[2](c32))
        p16 = self.smooth[1](self.lateral[1](c16) + upsampled(p32, int(c16.shape[2])))
        p8 = self.smooth[0](self.lateral[0](c8) + upsampled(p16, int(c8.shape[2])))
        outputs = []
        for level, feature in enumerate((p8, p16, p32)):
            shape = self.box_trunk(feature, level)
            logits = self.logits(self.class_trunk(feature, level))
            outputs.append((logits, self.box(shape), self.azimuth(shape), self.spread(shape)))
        return outputs


TENSORS = [[f"{part}{stride}" for part in ("logits", "box", "azimuth", "spread")] for stride in STRIDES]
