"""A fitted pipeline to model.onnx and golden.npz."""
