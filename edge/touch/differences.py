"""In what a skin differs from the one that a model was made for."""

import math

from edge.touch.layout import SkinLayout, for_device


def differences(model: SkinLayout, device: SkinLayout) -> list[str]:
    """Sentences that say in what a device's skin differs from the model's, where they
    can still be used together.

    Raises:
        InputError: they cannot, see `for_device`.
    """
    for_device(model, device)
    sentences = []
    dead = set(device.dead) - set(model.dead)
    if dead:
        sentences.append(f"{len(dead)} taxels are dead that were alive in training")
    if device.counts_per_newton != model.counts_per_newton:
        sentences.append(
            f"a newton is {device.counts_per_newton:g} counts, and "
            f"{model.counts_per_newton:g} in training; forces are converted"
        )
    steps = zip(device.pitch, model.pitch, strict=True)
    if not all(math.isclose(*pair, rel_tol=0.02) for pair in steps):
        sentences.append(
            f"taxels are {_millimetres(device.pitch)} apart, and "
            f"{_millimetres(model.pitch)} in training"
        )
    return sentences


def _millimetres(pitch: tuple[float, float]) -> str:
    return " x ".join(f"{1e3 * step:g}" for step in pitch) + " mm"
