"""Computes the figures of the model card, and writes its table."""

import math

import numpy as np

from . import scores
from .settings import AZIMUTH_CLASSES, CLASSES

BARS = {"ap50": 0.65, "ap50_car": 0.75, "recall_over_24": 0.90, "azimuth_car_deg": 15.0,
        "calibration_error": 0.05, "cpu_ms": 20.0, "bytes": 2_000_000}


def class_figures(frames, k):
    ap, count = scores.class_average_precision(frames, k)
    found, counted = scores.recall(frames, k, 24)
    errors, ratios = scores.azimuth_errors(frames, k)
    with_azimuth = CLASSES[k] in AZIMUTH_CLASSES and len(errors) > 0
    return {
        "truths": count,
        "ap50": ap,
        "ap50_by_size": {name: scores.class_average_precision(frames, k, size)[0]
                         for name, size in scores.SIZES.items()},
        "recall_over_24": found / counted if counted else math.nan,
        "found_over_24": found,
        "truths_over_24": counted,
        "azimuth_deg": float(np.degrees(np.median(errors))) if with_azimuth else math.nan,
        "azimuth_flips": float((errors > math.pi / 2).mean()) if with_azimuth else math.nan,
        "azimuth_ratio": float(np.median(np.abs(ratios)) * 1.4826) if with_azimuth else math.nan,
    }


def figures_of(frames, cpu_ms, size):
    by_class = {name: class_figures(frames, k) for k, name in enumerate(CLASSES)}
    odds, labels = scores.outcomes(frames)
    total = {key: sum(c[key] for c in by_class.values()) for key in ("found_over_24", "truths_over_24")}
    return {
        "frames": len(frames),
        "boxes": len(labels),
        "ap50": float(np.nanmean([c["ap50"] for c in by_class.values()])),
        "ap50_car": by_class["car"]["ap50"],
        "recall_over_24": total["found_over_24"] / max(total["truths_over_24"], 1),
        "azimuth_car_deg": by_class["car"]["azimuth_deg"],
        "calibration_error": scores.calibration_error(scores.probabilities(odds), labels),
        "clutter_share": float((labels == 0).mean()),
        "box_sigma": float(np.median(np.abs(scores.side_errors(frames))) * 1.4826),
        "cpu_ms": cpu_ms,
        "bytes": size,
        "by_class": by_class,
    }


def _number(value, digits=2):
    return "" if isinstance(value, float) and math.isnan(value) else f"{value:.{digits}f}"


def table_of(figures):
    lines = [f"{figures['frames']} frames, {figures['boxes']} boxes, clutter "
             f"{figures['clutter_share']:.2f}, box_sigma {figures['box_sigma']:.3f}", "",
             "| | measured | bar | |", "| --- | --- | --- | --- |"]
    names = {"ap50": "AP50, mean of the classes", "ap50_car": "AP50, cars",
             "recall_over_24": "recall over 24 px, lax threshold",
             "azimuth_car_deg": "median azimuth error, cars, degrees",
             "calibration_error": "expected calibration error", "cpu_ms": "CPU ms a frame",
             "bytes": "bytes of the ONNX file"}
    for key, bar in BARS.items():
        rises = key in ("ap50", "ap50_car", "recall_over_24")
        met = figures[key] >= bar if rises else figures[key] <= bar
        digits = 3 if key.startswith(("ap", "recall", "cal")) else 1 if key != "bytes" else 0
        lines.append(f"| {names[key]} | {figures[key]:.{digits}f} | {bar:g} | "
                     f"{'met' if met else 'not met'} |")
    lines += ["", "| class | truths | AP50 | 10–24 px | 24–64 px | over 64 px | recall over 24 px | "
              "azimuth error, deg | turned round | error / sigma |",
              "| --- | --- | --- | --- | --- | --- | --- | --- | --- | --- |"]
    for name, c in figures["by_class"].items():
        sizes = " | ".join(_number(c["ap50_by_size"][s]) for s in scores.SIZES)
        lines.append(
            f"| {name} | {c['truths']} | {_number(c['ap50'])} | {sizes} | "
            f"{_number(c['recall_over_24'])} | {_number(c['azimuth_deg'], 1)} | "
            f"{_number(c['azimuth_flips'])} | {_number(c['azimuth_ratio'])} |")
    return "\n".join(lines)
