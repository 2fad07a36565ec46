"""What models on torch share: device, precision, loading of weights, batches of pictures and texts."""
