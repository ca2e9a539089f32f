"""A network's graph: loads it, fixes its input, folds constants, cuts it and writes it."""

import warnings

import numpy as np
import onnx
from onnx import TensorProto, helper, numpy_helper, shape_inference

from .faults import DATA, UNAVAILABLE, Fault
from .numpy_ops import OPS

LARGEST_CONSTANT = 1 << 22  # number of values
KEEPS_SHAPE = ("HardSwish", "Mish")


class Node:
    """A node. Inputs and outputs are names ("" for an omitted input); attributes are Python
    values."""

    def __init__(self, kind, inputs, outputs, attributes=None, domain="", name=""):
        self.kind, self.inputs, self.outputs = kind, list(inputs), list(outputs)
        self.attributes, self.domain, self.name = dict(attributes or {}), domain, name

    @classmethod
    def of(cls, proto):
        attributes = {}
        for a in proto.attribute:
            value = helper.get_attribute_value(a)
            if isinstance(value, bytes):
                value = value.decode(errors="replace")
            elif isinstance(value, TensorProto):
                value = numpy_helper.to_array(value)
            attributes[a.name] = list(value) if a.type == a.INTS or a.type == a.FLOATS else value
        domain = "" if proto.domain == "ai.onnx" else proto.domain
        return cls(proto.op_type, proto.input, proto.output, attributes, domain, proto.name)


class Graph:
    def __init__(self, nodes, constants, inputs, outputs, opset, metadata):
        self.nodes, self.constants, self.outputs = nodes, constants, outputs
        self.inputs = inputs  # {name: (element type, dimensions)}; unknown: None
        self.opset, self.metadata = opset, metadata
        self.shapes, self.types = {}, {}
        self.image = ""

    # -- reading ------------------------------------------------------------------------------

    @classmethod
    def load(cls, path):
        try:
            with warnings.catch_warnings():  # protobuf warns about incomplete reads
                warnings.simplefilter("error", RuntimeWarning)
                model = onnx.load(str(path))
        except FileNotFoundError as e:
            raise Fault(f"{e.filename or path} is missing; give an .onnx file (weights kept in a second file must lie "
                        "beside it)", UNAVAILABLE)
        except Exception as e:  # errors of protobuf, or others if the file is truncated
            raise Fault(f"{path} is not a whole ONNX file ({str(e).splitlines()[0] if str(e) and not isinstance(e, SystemError) else 'cut or damaged'}); "
                        "export or copy it again", DATA)
        graph = model.graph
        if not graph.node or not graph.output:
            raise Fault(f"{path} is not a whole ONNX file (it has no operators); export or copy it again", DATA)
        constants = {i.name: numpy_helper.to_array(i) for i in graph.initializer}
        inputs = {}
        for i in graph.input:
            if i.name not in constants:
                tensor = i.type.tensor_type
                inputs[i.name] = (tensor.elem_type, [d.dim_value or None for d in tensor.shape.dim])
        read = {i for n in graph.node for i in n.input}
        # Removes inputs without a reader, which some simplifiers leave behind.
        inputs = {name: what for name, what in inputs.items() if name in read} or inputs
        opset = max([o.version for o in model.opset_import if o.domain in ("", "ai.onnx")] or [1])
        metadata = {p.key: p.value for p in model.metadata_props}
        nodes = [Node.of(n) for n in graph.node]
        loaded = cls(nodes, constants, inputs, [o.name for o in graph.output], opset, metadata)
        for info in [*graph.value_info, *graph.output]:  # for operators without shape inference
            tensor = info.type.tensor_type
            loaded.types[info.name] = tensor.elem_type
            if tensor.HasField("shape") and all(d.dim_value for d in tensor.shape.dim):
                loaded.shapes[info.name] = [d.dim_value for d in tensor.shape.dim]
        return loaded

    def fix_input(self, path, size):
        """Selects the image among the inputs and sets its size, (width, height)."""
        images = [n for n, (_, d) in self.inputs.items() if len(d) == 4]
        if len(images) != 1:
            raise Fault(f"{path} has {len(images)} inputs that could be an image ({', '.join(self.inputs) or 'none'}); "
                        "a detector that takes one image [1,3,height,width] is needed")
        self.image = images[0]
        kind, (batch, channels, height, width) = self.inputs[self.image]
        if channels not in (3, None):
            what = "has its channels last" if width == 3 else f"has {channels} channels"
            raise Fault(f"the input {self.image} of {path} {what}; export with [1,3,height,width] "
                        "(tf2onnx: --inputs-as-nchw NAME; else three colour channels are needed)")
        if kind not in (TensorProto.FLOAT, TensorProto.FLOAT16):
            raise Fault(f"the input {self.image} of {path} is {TensorProto.DataType.Name(kind).lower()}; export with "
                        "float32 inputs")
        if batch not in (1, None):
            raise Fault(f"{path} is fixed at {batch} images at once; export with batch size 1")
        if size and (width not in (None, size[0]) or height not in (None, size[1])):
            raise Fault(f"the input of {path} is fixed at {width}x{height}; leave --size out, or export again at "
                        f"{size[0]}x{size[1]}")
        width, height = width or (size and size[0]), height or (size and size[1])
        if not width or not height:
            raise Fault(f"the input of {path} has no fixed size; say --size WIDTHxHEIGHT (what it was trained with, "
                        "640x640 for most)")
        self.inputs[self.image] = (TensorProto.FLOAT, [1, 3, height, width])
        self.to_float32()
        return width, height

    def to_float32(self):
        """Converts all values of half or double precision to float32."""
        other, kinds = (np.float16, np.float64), (TensorProto.FLOAT16, TensorProto.DOUBLE)
        self.types = {k: TensorProto.FLOAT if t in kinds else t for k, t in self.types.items()}
        self.constants = {k: v.astype(np.float32) if v.dtype in other else v for k, v in self.constants.items()}
        for node in self.nodes:
            for key, value in node.attributes.items():
                if isinstance(value, np.ndarray) and value.dtype in other:
                    node.attributes[key] = value.astype(np.float32)
            if node.kind == "Cast" and node.attributes.get("to") in kinds:
                node.attributes["to"] = TensorProto.FLOAT

    # -- looking ------------------------------------------------------------------------------

    def producers(self):
        return {o: n for n in self.nodes for o in n.outputs if o}

    def consumers(self):
        found = {}
        for node in self.nodes:
            for name in node.inputs:
                found.setdefault(name, []).append(node)
        return found

    def constant(self, name):
        return self.constants.get(name)

    def origin(self, name):
        """Returns the exporter's names of a convolution: of its output, its weights and its
        bias."""
        node = next((n for n in self.nodes if name in n.outputs), None)
        return " ".join([name, *(node.inputs[1:] if node else [])])

    def ancestors(self, names, stops=()):
        """Returns the nodes on which the tensors `names` depend, in the graph's order. Nodes on
        which only the tensors `stops` depend are left out."""
        producers, wanted, todo = self.producers(), set(), list(names)
        while todo:
            name = todo.pop()
            node = producers.get(name)
            if node is not None and name not in stops and id(node) not in wanted:
                wanted.add(id(node))
                todo += [i for i in node.inputs if i]
        return [n for n in self.nodes if id(n) in wanted]

    # -- simplifying --------------------------------------------------------------------------

    def infer_shapes(self):
        try:
            model = self.to_model()
            for node in model.graph.node:  # an undeclared opset would stop the inference
                if node.op_type in KEEPS_SHAPE:
                    node.op_type = "Relu"
                    del node.attribute[:]
            model = shape_inference.infer_shapes(model, data_prop=True)
        except Exception:  # unknown operators, or an inconsistent graph
            return
        for info in [*model.graph.value_info, *model.graph.output]:
            tensor = info.type.tensor_type
            if tensor.HasField("shape"):
                shape = [d.dim_value if d.HasField("dim_value") else None for d in tensor.shape.dim]
                self.types[info.name] = tensor.elem_type
                if None not in shape or info.name not in self.shapes:
                    self.shapes[info.name] = shape
        for name, (kind, dims) in self.inputs.items():
            self.shapes[name], self.types[name] = dims, kind

    def shape(self, name):
        """Returns the shape of a tensor; None if the shape or one of its dimensions is unknown."""
        if name in self.constants:
            return list(self.constants[name].shape)
        shape = self.shapes.get(name)
        return None if shape is None or None in shape else shape

    def rename_uses(self, old, new):
        for node in self.nodes:
            node.inputs = [new if i == old else i for i in node.inputs]

    def changes_nothing(self, node):
        if node.domain or node.kind not in ("Identity", "Dropout", "Cast"):
            return False
        if node.kind == "Cast":
            source = node.inputs[0]
            return node.attributes.get("to") == TensorProto.FLOAT and self.types.get(source) == TensorProto.FLOAT
        return True

    def fold_once(self):
        before, kept = len(self.nodes), []
        for node in self.nodes:
            if self.changes_nothing(node) and node.outputs[0] not in self.outputs:
                self.rename_uses(node.outputs[0], node.inputs[0])
                continue
            values = self.value_of(node)
            if values is None:
                kept.append(node)
            else:
                self.constants.update({o: v for o, v in zip(node.outputs, values) if o})
        self.nodes = kept
        return len(kept) < before

    def value_of(self, node):
        """Returns the outputs of a node that depends only on constants and known shapes; None for
        others."""
        if node.domain or any(o in self.outputs for o in node.outputs):
            return None
        if node.kind == "Shape" and self.shape(node.inputs[0]) is not None:
            return [np.array(self.shape(node.inputs[0]), np.int64)]
        if node.kind not in OPS or not all(i == "" or i in self.constants for i in node.inputs):
            return None
        try:
            values = OPS[node.kind]([self.constants.get(i) for i in node.inputs], node.attributes, self.opset)
        except Exception:
            return None
        values = [np.asarray(v) for v in values]
        return values if all(v.size <= LARGEST_CONSTANT for v in values) else None

    def fold(self):
        self.infer_shapes()
        for _ in range(8):  # each round may give more shapes
            if not self.fold_once():
                break
            self.infer_shapes()

    def keep(self, outputs):
        """Makes these tensors the outputs, and removes the nodes that they do not need."""
        self.outputs = list(outputs)
        self.nodes = self.ancestors(outputs)
        used = {i for n in self.nodes for i in n.inputs} | set(outputs)
        self.constants = {k: v for k, v in self.constants.items() if k in used}
        self.inputs = {k: v for k, v in self.inputs.items() if k in used or k == self.image}

    def rename(self, old, new):
        """Renames a tensor wherever it occurs. Does nothing if the name does not exist."""
        for node in self.nodes:
            node.inputs = [new if i == old else i for i in node.inputs]
            node.outputs = [new if o == old else o for o in node.outputs]
        self.outputs = [new if o == old else o for o in self.outputs]
        self.image = new if self.image == old else self.image
        for known in (self.shapes, self.types, self.constants, self.inputs):
            if old in known:
                known[new] = known.pop(old)

    # -- evaluating ---------------------------------------------------------------------------

    def evaluate(self, known, until=None):
        """Computes all tensors that depend only on `known` and the constants. Returns (values, the
        operators without an implementation). Stops when all of `until` are computed."""
        values, stuck = dict(known), []
        left = {}  # {tensor: number of nodes that still need it}, to free memory early
        if until is not None:
            for node in self.nodes:
                for name in node.inputs:
                    left[name] = left.get(name, 0) + 1
        for node in self.nodes:
            if all(o in values or not o for o in node.outputs):
                continue
            inputs = [None if i == "" else values.get(i, self.constants.get(i)) for i in node.inputs]
            if any(i is None and name for i, name in zip(inputs, node.inputs)):
                continue
            try:
                found = OPS[node.kind](inputs, node.attributes, self.opset) if not node.domain else None
            except Exception:
                found = None
            if found is None:
                stuck.append(node.kind)
                continue
            values.update(zip(node.outputs, found))
            for name in node.inputs:
                left[name] = left.get(name, 0) - 1
                if left[name] == 0 and until is not None and name not in until:
                    values.pop(name, None)
        return values, stuck

    # -- writing ------------------------------------------------------------------------------

    def to_model(self):
        nodes = []
        for index, node in enumerate(self.nodes):
            attributes = {k: numpy_helper.from_array(v) if isinstance(v, np.ndarray) else v
                          for k, v in node.attributes.items() if not isinstance(v, onnx.GraphProto)}
            nodes.append(helper.make_node(node.kind, node.inputs, node.outputs, name=f"{node.kind}_{index}",
                                          domain=node.domain, **attributes))
        used = {i for n in self.nodes for i in n.inputs} | set(self.outputs)
        initialisers = [numpy_helper.from_array(v, k) for k, v in self.constants.items() if k in used]
        inputs = [helper.make_tensor_value_info(k, t, d) for k, (t, d) in self.inputs.items()]
        outputs = [helper.make_tensor_value_info(o, self.types.get(o, TensorProto.FLOAT), self.shapes.get(o))
                   for o in self.outputs]
        graph = helper.make_graph(nodes, "perdure", inputs, outputs, initialisers)
        model = helper.make_model(graph, opset_imports=[helper.make_opsetid("", self.opset)])
        model.ir_version = 7
        return model
