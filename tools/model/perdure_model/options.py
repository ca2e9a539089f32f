"""Parses the command line."""

import argparse
import math
import re
from pathlib import Path

import numpy as np

from . import sayings
from .class_names import names_of
from .faults import UNAVAILABLE, USAGE, Fault

LARGEST_SIDE = 8192


class Parser(argparse.ArgumentParser):
    """A parser that prints errors in the format of this program."""

    def error(self, message):
        raise Fault(f"{message}; perdure model import --help tells the options", USAGE)


def parsed(arguments):
    parser = Parser(prog="perdure_model", description=__doc__)
    parser.add_argument("network", type=Path)
    parser.add_argument("--out", type=Path, required=True)
    parser.add_argument("--shown", type=Path, help="what messages call the file of --out")
    parser.add_argument("--reference", type=Path)
    parser.add_argument("--y-first", action="store_true")
    parser.add_argument("--onnx-runtime", action="store_true", help="the program has it beside OpenCV")
    parser.add_argument("--priors", type=Path)
    parser.add_argument("--variances", default="0.1,0.2")
    for name in ("classes", "family", "size", "input", "camera", "anchors", "boxes", "bins", "cell-offset", "colour",
                 "fit", "scale", "mean", "pad"):
        parser.add_argument(f"--{name}", default="")
    return parser.parse_args(arguments)


class Request:
    """The parsed command line."""

    def __init__(self, args):
        self.family, self.boxes, self.y_first = args.family, args.boxes, args.y_first
        self.onnx_runtime = args.onnx_runtime
        if self.family not in ("", *sayings.FAMILIES):
            refuse("--family", self.family, f"is not known; known are {', '.join(sayings.FAMILIES)}")
        self.bins = count_of("--bins", args.bins)
        self.cell_offset = number_of("--cell-offset", args.cell_offset)
        self.size, self.camera = size_of("--size", args.size), size_of("--camera", args.camera)
        self.new_size = args.input if args.input == "camera" else size_of("--input", args.input)
        if self.new_size == "camera" and not self.camera:
            raise Fault("--input camera takes the shape of the camera's pictures; give one with --image", USAGE)
        self.anchors = anchors_of(args.anchors)
        self.variances = numbers_of("--variances", args.variances)
        if len(self.variances) != 2:
            refuse("--variances", args.variances, "are two numbers V,V: of centre and size")
        self.input = input_of(args)
        self.names = names_of(args.classes) if args.classes else None
        self.priors = priors_of(args.priors) if args.priors else None


def refuse(option, text, why):
    raise Fault(f"{option} {text}: {why}", USAGE)


def size_of(option, text):
    """Parses a size such as 640x480. Returns None if `text` is empty."""
    if not text:
        return None
    sides = re.fullmatch("([0-9]{1,5})x([0-9]{1,5})", text)
    pair = [int(side) for side in sides.groups()] if sides else [0]
    if min(pair) < 1 or max(pair) > LARGEST_SIDE:
        refuse(option, text, f"is not WIDTHxHEIGHT in pixels, such as 640x480 (at most {LARGEST_SIDE} each)")
    return pair


def count_of(option, text):
    if not text:
        return None
    if not re.fullmatch("[0-9]{1,4}", text) or int(text) < 1:
        refuse(option, text, "is not a whole number above 0")
    return int(text)


def numbers_of(option, text, whole=None):
    """Parses numbers that commas separate. `whole` is the complete value of the option, of which
    `text` is a part."""
    values = []
    for part in text.split(","):
        try:
            values.append(float(part))
        except ValueError:
            values.append(math.nan)
        if not math.isfinite(values[-1]):
            refuse(option, whole or text, f"{part or 'an empty place'} is not a number")
    return values


def number_of(option, text):
    values = numbers_of(option, text) if text else [None]
    if len(values) != 1:
        refuse(option, text, "is one number")
    return values[0]


def anchors_of(text):
    groups = [numbers_of("--anchors", group, text) for group in text.split("/")] if text else []
    if any(len(group) % 2 for group in groups):
        refuse("--anchors", text, "are pairs W,H,W,H,… of each level, with / between levels")
    return [list(zip(group[::2], group[1::2])) for group in groups] or None


def input_of(args):
    """Returns the user's options for the network's input, as in model.json."""
    said = {"colour": args.colour, "fit": args.fit, "pad": number_of("--pad", args.pad)}
    said["scale"] = numbers_of("--scale", args.scale) if args.scale else None
    said["mean"] = numbers_of("--mean", args.mean) if args.mean else None
    if said["scale"] and len(said["scale"]) == 1:
        said["scale"] = said["scale"][0]
    return {key: value for key, value in said.items() if value not in ("", None)}


def priors_of(path):
    try:
        priors = np.loadtxt(path, ndmin=2)
    except OSError:
        raise Fault(f"the file of priors {path} is missing or cannot be read", UNAVAILABLE)
    except ValueError as e:
        raise Fault(f"{path} cannot be read as priors ({e}); a line x y width height for each")
    if priors.shape[1] != 4 or not (priors[:, 2:] > 0).all():
        raise Fault(f"{path} does not hold priors; a line x y width height for each, in shares of the image")
    return priors
