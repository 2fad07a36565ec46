"""The default backends: small models shipped with the package, numpy and onnxruntime only."""
