"""`perdure model import`: reads an ONNX graph, repairs it for OpenCV 4.6, and writes model.json."""
