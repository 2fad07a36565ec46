"""Open words on a CPU without torch: small copies of published models, run by onnxruntime."""
