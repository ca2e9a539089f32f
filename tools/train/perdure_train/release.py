"""Exports and calibrates a network: writes the ONNX file and the model.json that describes it."""

import json
import math

import numpy as np
import torch

from . import measure, scores
from .data import Pictures, chunk_folders
from .export import write_onnx
from .network import Network, TENSORS
from .settings import AZIMUTH_CLASSES, BINS, CLASSES, HEIGHT, REACH, STRIDES, WIDTH
from .training import settle_statistics

NAME = f"perdure_{WIDTH}x{HEIGHT}"
DEMO_SIZE = (480, 360)  # larger, with the same weights, because people in the demo are small
SCENES = 12  # scenes of the calibration set
THRESHOLD = 0.05


def name_of(width, height):
    return f"perdure_{width}x{height}"


def description(temperature=1.0, clutter_rate=0.5, box_sigma=0.0, azimuth_sigma=0.35,
                spread_scale=1.0, side_insets=None, size=(WIDTH, HEIGHT)):
    levels = [
        {"stride": stride, "box": box, "logits": logits, "azimuth": azimuth, "spread": spread}
        for stride, (logits, box, azimuth, spread) in zip(STRIDES, TENSORS)
    ]
    return {
        "comment": "Perdure's own network, trained by tools/train on simulated pictures only: see "
                   "models/README.md. Written by tools/train/train.",
        "name": name_of(*size),
        "family": "perdure",
        "input": {"width": size[0], "height": size[1], "fit": "letterbox_top_left", "pad": 114,
                  "colour": "rgb", "scale": 1 / 255, "mean": [127.5, 127.5, 127.5]},
        "classes": CLASSES,
        "azimuth": {"bins": BINS, "sigma": azimuth_sigma, "classes": AZIMUTH_CLASSES},
        "reach": REACH,
        "spread_scale": spread_scale,
        "levels": levels,
        "box_sigma": box_sigma,
        "box_extent": "outline",
        "side_insets": side_insets or {},
        "calibration": {"temperature": temperature, "clutter_rate": clutter_rate},
    }


def write_description(path, **values):
    text = json.dumps(description(**values), indent=2)
    path.write_text(text + "\n")


def fit_calibration(odds, labels):
    """Temperature T and shift b of softmax([0, odds / T + b]) that maximise the likelihood of
    `labels`."""
    odds = torch.tensor(odds, dtype=torch.float64)
    labels = torch.tensor(labels)
    log_t = torch.zeros(1, dtype=torch.float64, requires_grad=True)
    shift = torch.zeros(1, dtype=torch.float64, requires_grad=True)
    search = torch.optim.LBFGS([log_t, shift], max_iter=100, line_search_fn="strong_wolfe")

    def cost():
        search.zero_grad()
        z = torch.cat([torch.zeros(len(odds), 1), odds / log_t.exp() + shift], 1)
        value = torch.nn.functional.cross_entropy(z, labels)
        value.backward()
        return value

    search.step(cost)
    return float(log_t.exp()), float(shift)


def robust_sigma(values, floor, ceiling):
    """Standard deviation from the median of the absolute values."""
    if len(values) < 20:
        return ceiling
    return float(np.clip(1.4826 * np.median(np.abs(values)), floor, ceiling))


def azimuth_sigma_of(frames):
    """Robust standard deviation of the azimuth. Errors near 180° are excluded."""
    errors = np.concatenate(
        [scores.azimuth_errors(frames, CLASSES.index(name))[0] for name in AZIMUTH_CLASSES]
    )
    return robust_sigma(errors[errors < math.pi / 2], 0.05, 0.6)


def release(options, program):
    """Writes OUT/NAME.onnx and OUT/model.json from the run's checkpoint."""
    state = torch.load(options.cache / options.name / "checkpoint.pt", map_location="cpu")
    network = Network()
    network.load_state_dict(state["slow"])
    pictures = Pictures(chunk_folders(options.cache / "train"), augment=False)
    settle_statistics(network, pictures)
    options.out.mkdir(parents=True, exist_ok=True)
    model, says = options.out / f"{NAME}.onnx", options.out / "model.json"
    write_onnx(network, model)
    write_description(says)

    def look(clutter_rate):
        frames, _ = measure.frames_of(program, options.cache, "calibration", SCENES, model,
                                      clutter_rate, THRESHOLD, options.threads)
        return frames

    # The shift moves the background's logit and so changes which boxes pass the threshold.
    # Therefore the fit is repeated.
    shift, temperature = 0.0, 1.0
    for _ in range(2):
        temperature, more = fit_calibration(*scores.outcomes(look(0.5)))
        shift += more * temperature
        write_onnx(network, model, background_shift=-shift)
    frames = look(0.5)
    odds, labels = scores.outcomes(frames)
    temperature, _ = fit_calibration(odds, labels)
    clutter_rate = float(np.clip((labels == 0).mean(), 0.01, 0.99))
    values = {
        "temperature": round(temperature, 3),
        "clutter_rate": round(clutter_rate, 3),
        "box_sigma": round(robust_sigma(scores.side_errors(frames), 0.01, 1.0), 3),
        "azimuth_sigma": round(azimuth_sigma_of(frames), 3),
        "spread_scale": round(robust_sigma(scores.side_ratios(frames), 0.1, 10.0), 3),
        "side_insets": {
            name: [round(float(x), 3) for x in scores.side_insets(frames, k)]
            for k, name in enumerate(CLASSES)
        },
    }
    write_description(says, **values)
    demo = options.out / "demo"
    demo.mkdir(exist_ok=True)
    write_onnx(network, demo / f"{name_of(*DEMO_SIZE)}.onnx", -shift, DEMO_SIZE)
    write_description(demo / "model.json", size=DEMO_SIZE, **values)
    print(f"step {state['step']}: {model} {model.stat().st_size} bytes, {values}")
