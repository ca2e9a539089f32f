"""Changes the input size of a convolutional network, by scaling the sizes that are stored in the
file."""

import math

import numpy as np

from .faults import USAGE, Fault


def of_camera(size, camera, step):
    """Returns a size with about as many pixels as `size` and the camera's aspect ratio, in
    multiples of `step`."""
    height = math.sqrt(size[0] * size[1] * camera[1] / camera[0])
    return [max(step, round(n / step) * step) for n in (height * camera[0] / camera[1], height)]


class Reshaping:
    def __init__(self, graph, old, new):
        self.graph, self.old, self.new = graph, old, new

    def pair(self, rows, columns):
        """Returns a grid of cells at the new input size; None if `rows` and `columns` are not the
        old size divided by a stride."""
        if rows < 1 or columns < 1 or rows * self.old[0] != columns * self.old[1] or self.old[1] % rows:
            return None
        stride = self.old[1] // rows
        if self.new[0] % stride or self.new[1] % stride:
            return None
        return [self.new[1] // stride, self.new[0] // stride]

    def count(self, cells):
        """Returns a number of cells at the new input size; None if `cells` is not the number of
        cells of a stride."""
        stride = math.isqrt(self.old[0] * self.old[1] // cells) if cells > 0 else 0
        if stride == 0 or self.old[0] % stride or self.old[1] % stride:
            return None
        grid = self.pair(self.old[1] // stride, self.old[0] // stride)
        return grid[0] * grid[1] if grid and cells * stride * stride == self.old[0] * self.old[1] else None

    def target(self, target, given):
        """Returns the target of a Reshape at the new size. `given` is the shape of its input at the
        old size."""
        shape = [given[i] if n == 0 else int(n) for i, n in enumerate(target)]
        if -1 in shape:
            shape[shape.index(-1)] = -int(np.prod(given)) // int(np.prod(shape))
        if len(shape) >= 4 and (grid := self.pair(*shape[-2:])) and self.ends(given, shape[-2:]):
            return shape[:-2] + grid
        for at, n in enumerate(shape):
            product = int(np.prod(given[-2:])) if len(given) >= 4 else 0
            if (n == product or n in given) and n > 1 and (cells := self.count(n)) and self.spatial(given, n):
                return shape[:at] + [cells] + shape[at + 1:]
        return None

    def ends(self, given, grid):
        return list(given[-2:]) == list(grid) or grid[0] * grid[1] in given

    def spatial(self, given, cells):
        return len(given) >= 4 and given[-2] * given[-1] == cells or cells in given[1:]

    def constant_of(self, node, index, value):
        """Gives the node its own constant, because other nodes may share the old one."""
        name = f"{node.outputs[0]}_input{index}"
        self.graph.constants[name] = value
        node.inputs[index] = name

    def reshape(self, node):
        target, given = self.graph.constant(node.inputs[1]), self.graph.shape(node.inputs[0])
        if target is None or given is None:
            return
        found = self.target(list(target), given)
        if found is not None:
            self.constant_of(node, 1, np.array(found, np.int64))

    def resize(self, node):
        sizes = self.graph.constant(node.inputs[3]) if len(node.inputs) > 3 and node.inputs[3] else None
        grid = self.pair(int(sizes[-2]), int(sizes[-1])) if sizes is not None and sizes.size == 4 else None
        if grid:
            self.constant_of(node, 3, np.array([*sizes[:-2], *grid], np.int64))

    def pool(self, node):
        """Converts a pool over its whole tensor to a global one, which fits every size."""
        given = self.graph.shape(node.inputs[0])
        kernel, strides = node.attributes.get("kernel_shape"), node.attributes.get("strides", [1, 1])
        if given and list(given[2:]) == list(kernel) and not any(node.attributes.get("pads", [0])) and \
                (strides == [1, 1] or strides == kernel):
            node.kind, node.attributes = "GlobalAveragePool", {}

    def run(self):
        ways = {"Reshape": self.reshape, "Resize": self.resize, "AveragePool": self.pool}
        for node in self.graph.nodes:
            if node.kind in ways and not node.domain:
                ways[node.kind](node)
        kind, (batch, channels, _, _) = self.graph.inputs[self.graph.image]
        self.graph.inputs[self.graph.image] = (kind, [batch, channels, self.new[1], self.new[0]])
        self.graph.shapes = {}
        self.graph.infer_shapes()


def first_at_odds(graph, outputs):
    """Returns the first operator that cannot be computed at the new size; "" if all can."""
    _, _, height, width = graph.inputs[graph.image][1]
    image = np.zeros((1, 3, height, width), np.float32)
    values, stuck = graph.evaluate({graph.image: image}, outputs)
    return next((kind for kind in stuck), "") if any(o not in values for o in outputs) else ""


def reshape(path, graph, found, old, new):
    """Changes the input size of the graph from `old` to `new`. `found` is the finding, already cut
    at its heads. Raises Fault if the network is not convolutional."""
    levels = found.keys.get("levels")
    if found.family == "fastestdet":
        raise Fault(f"{path} is a fastestdet, which says sizes in shares of the input that it was trained with; "
                    "leave --input out")
    if found.keys.get("outputs") or not levels:
        raise Fault(f"{path} ({found.family}) gives whole boxes for an input of {old[0]}x{old[1]}; --input needs a "
                    "network whose heads are convolutions: export it again at the size that is wanted")
    largest = max(level["stride"] for level in levels)
    step = min(largest, 32) if found.family in ("nanodet", "picodet") else largest
    if any(n % step for n in new):
        raise Fault(f"--input {new[0]}x{new[1]}: its sides must be multiples of {step} for this network", USAGE)
    Reshaping(graph, old, new).run()
    outputs = list(found.cuts.values())
    stuck = first_at_odds(graph, outputs)
    for level in levels:
        for name in (v for k, v in level.items() if k != "stride" and v in outputs):
            shape = graph.shape(name)
            cells = [-(-new[1] // level["stride"]), -(-new[0] // level["stride"])]
            if stuck or shape is None or list(shape[2:]) != cells:
                why = f"its operator {stuck} is of one size" if stuck else f"{name} is {shape}, not of {cells} cells"
                raise Fault(f"{path} cannot be given an input of {new[0]}x{new[1]}: {why}; leave --input out, or "
                            "export it again at that size")
