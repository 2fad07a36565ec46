"""The gate's network: sentences from frames, three layers of a model of English, one ONNX graph in 8 bits."""
