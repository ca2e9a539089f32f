"""Finding about a network: its family, the tensors to cut at, and the content of model.json."""

from dataclasses import dataclass, field

# Input of each family, as in the code of its authors.
INPUTS = {
    "yolov5": {"fit": "letterbox_centre", "pad": 114, "colour": "rgb", "scale": 1 / 255, "mean": [0, 0, 0]},
    "yolox": {"fit": "letterbox_top_left", "pad": 114, "colour": "bgr", "scale": 1.0, "mean": [0, 0, 0]},
    "fastestdet": {"fit": "resize", "colour": "bgr", "scale": 1 / 255, "mean": [0, 0, 0]},
    "nanodet": {"fit": "resize", "colour": "bgr", "scale": [1 / 57.375, 1 / 57.12, 1 / 58.395],
                "mean": [103.53, 116.28, 123.675]},
    "ssd": {"fit": "resize", "colour": "rgb", "scale": 1 / 128, "mean": [127, 127, 127]},
    "detr": {"fit": "resize", "colour": "rgb", "scale": [1 / 58.395, 1 / 57.12, 1 / 57.375],
             "mean": [123.675, 116.28, 103.53]},
}
INPUTS["picodet"] = {"fit": "resize", "colour": "rgb", "scale": [1 / 58.395, 1 / 57.12, 1 / 57.375],
                     "mean": [123.675, 116.28, 103.53]}
INPUTS["rtmdet"] = {"fit": "letterbox_top_left", "pad": 114, "colour": "bgr",
                    "scale": [1 / 57.375, 1 / 57.12, 1 / 58.395], "mean": [103.53, 116.28, 123.675]}
INPUTS["yolo-fastestv2"] = INPUTS["fastestdet"]
INPUTS["yolov7"] = INPUTS["yolov8"] = INPUTS["yolov5"]


@dataclass
class Finding:
    family: str
    classes: int
    cuts: dict = field(default_factory=dict)     # {tensor of the graph: its name in model.json}
    keys: dict = field(default_factory=dict)     # content of model.json: activation, levels …
    notes: list = field(default_factory=list)    # sentences for people
    compared: str = ""                           # result of the comparison with the file's decoding
    disagreement: float = None
    input: dict = field(default_factory=dict)    # differences from the family's usual input
