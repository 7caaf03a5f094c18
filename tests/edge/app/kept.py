"""The metadata of touches that a run kept."""


def kept_meta(labels, **answers):
    """Labels, and decisions as task=(label, confidence, flags)."""
    decided = {
        task: {"label": label, "confidence": sure, "flags": list(flags)}
        for task, (label, sure, *flags) in answers.items()
    }
    return {"labels": labels, "decided": decided}
