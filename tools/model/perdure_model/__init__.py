"""`perdure model import`: looks at an ONNX graph, repairs it for OpenCV 4.6, writes model.json."""
