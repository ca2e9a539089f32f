"""Writes the network as an ONNX file for OpenCV 4.6, with folded batch norm and named outputs."""

import copy

import onnx
import torch
from onnx import helper, numpy_helper
from torch import nn
from torch.nn.utils import fusion

from .network import TENSORS, Trunk
from .settings import HEIGHT, WIDTH


class _Affine(nn.Module):
    """A batch norm that is not folded, because several strides share its convolution."""

    def __init__(self, norm):
        super().__init__()
        scale = norm.weight / torch.sqrt(norm.running_var + norm.eps)
        self.scale = nn.Parameter(scale.view(1, -1, 1, 1))
        self.shift = nn.Parameter((norm.bias - norm.running_mean * scale).view(1, -1, 1, 1))

    def forward(self, x):
        return x * self.scale + self.shift


def _fold(module):
    """Folds batch norms into their preceding convolutions, for all modules below `module`."""
    for name, child in module.named_children():
        if isinstance(child, Trunk):
            child.norms = nn.ModuleList([_Affine(norm) for norm in child.norms])
        elif isinstance(child, nn.Sequential) and len(child) >= 2 and isinstance(child[1], nn.BatchNorm2d):
            fused = fusion.fuse_conv_bn_eval(child[0], child[1])
            setattr(module, name, nn.Sequential(fused, *list(child)[2:]))
        else:
            _fold(child)


def folded(network):
    network = copy.deepcopy(network).float().eval()
    _fold(network)
    return network


class _Flat(nn.Module):
    def __init__(self, network):
        super().__init__()
        self.network = network

    def forward(self, images):
        return tuple(t for level in self.network(images) for t in level)


def _without_identities(model):
    """Removes Identity nodes of constants, which OpenCV 4.6 does not support. torch 1.13 adds them
    as second names of tensors that are used twice; the first name replaces them."""
    renamed = {n.output[0]: n.input[0] for n in model.graph.node if n.op_type == "Identity"}
    nodes = [n for n in model.graph.node if n.op_type != "Identity"]
    for node in nodes:
        for i, name in enumerate(node.input):
            while name in renamed:
                name = renamed[name]
            node.input[i] = name
    del model.graph.node[:]
    model.graph.node.extend(nodes)
    return model


def write_onnx(network, path, background_shift=0.0, size=(WIDTH, HEIGHT)):
    """Writes the ONNX file for images of `size`, width first; the weights do not depend on it.
    `background_shift` is added to the background's logit, so model.json needs no key for it."""
    network = folded(network)
    with torch.no_grad():
        network.logits.bias[0] += background_shift
    names = [name for level in TENSORS for name in level]
    torch.onnx.export(
        _Flat(network),
        torch.zeros(1, 3, size[1], size[0]),
        str(path),
        opset_version=11,
        input_names=["images"],
        output_names=names,
        do_constant_folding=True,
    )
    model = _without_identities(onnx.load(str(path)))
    model.doc_string = ""
    for node in model.graph.node:
        node.doc_string = ""
    onnx.checker.check_model(model)
    onnx.save(model, str(path))
    return names
