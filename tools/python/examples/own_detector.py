#!/usr/bin/env python3
"""Example of an inference service: finds orange cones by their colour, and evaluates the filter's
predictions. own_detector.py [camera]

`detect` may call any network. Its class needs a prior in config/class_priors.yaml.
"""
import sys

import numpy as np
import perdure


def spans(there, gap=3):
    """First and last index of each run of True; runs closer than `gap` are merged."""
    places = np.flatnonzero(there)
    cuts = np.flatnonzero(np.diff(places) > gap)
    return list(zip(places[np.r_[0, cuts + 1]], places[np.r_[cuts, -1]])) if len(places) else []


class Cones:
    name = "orange"
    classes = ["cone"]

    @staticmethod
    def orange(image):
        blue, green, red = np.moveaxis(image.astype(int), 2, 0)
        return (red > 150) & (red > green + 50) & (green > blue)

    def detect(self, image):
        if image.ndim == 2:
            return []  # a grey image has no colour information
        orange = self.orange(image)
        found = []
        for x1, x2 in spans(orange.any(0)):
            for y1, y2 in spans(orange[:, x1 : x2 + 1].any(1)):
                filled = orange[y1 : y2 + 1, x1 : x2 + 1].mean()
                if y2 - y1 < 6 or filled < 0.3:
                    continue
                found.append(
                    perdure.Detection(
                        box=(x1, y1, x2 + 1, y2 + 1),
                        activations=perdure.activations([[filled]])[0],
                    )
                )
        return found

    def look(self, image, expected):
        """Top-down likelihood for predicted cones that `detect` did not report. A cone fills half
        of its box with orange; elsewhere one pixel in fifty is orange. Each of a few independent
        pixels therefore contributes log(p_cone / p_elsewhere). This method is optional.
        """
        if image.ndim == 2:
            return np.full(len(expected), np.nan)
        orange, there, elsewhere, independent = self.orange(image), 0.5, 0.02, 4
        shares = []
        for prediction in expected:
            x1, y1, x2, y2 = prediction.box.astype(int)
            shares.append(orange[y1 : y2 + 1, x1 : x2 + 1].mean())
        shares = np.array(shares)
        return independent * (
            shares * np.log(there / elsewhere)
            + (1 - shares) * np.log((1 - there) / (1 - elsewhere))
        )


if __name__ == "__main__":
    perdure.publish(Cones(), camera=sys.argv[1] if len(sys.argv) > 1 else "cam0")
