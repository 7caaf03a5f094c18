"""Labels of trials: those of a file made printable, and tasks whose labels are made of
two others' labels, as a category is softness by mobility."""

import logging
from collections.abc import Mapping
from dataclasses import dataclass

LOG = logging.getLogger(__name__)

Labels = Mapping[str, str]
"""{task: label} of a trial."""


def plain(labels: Labels, path: str) -> dict[str, str]:
    """Labels of a file without blanks at their ends, and with _ for what cannot be
    printed; a warning says so."""
    texts = []
    for text in (*labels, *labels.values()):
        letters = [c if c.isprintable() else "_" for c in text.strip()]
        texts.append("".join(letters) or "_")
    read = dict(zip(texts, texts[len(labels) :], strict=False))
    LOG.warning(f"{path}: the labels {dict(labels)} are read as {read}")
    return read


@dataclass(frozen=True)
class Product:
    """A task whose labels are those of its two factors, joined by a hyphen.

    Attributes:
        task: the product, such as category.
        factors: the two tasks, in the order of their labels in the product's.
    """

    task: str
    factors: tuple[str, str]

    def label(self, labels: Labels) -> str | None:
        """The product's label that follows from a trial's labels of both factors; None
        where it lacks one.

        >>> CATEGORY.label({"softness": "soft", "mobility": "fixed"})
        'soft-fixed'
        """
        if not labels.keys() >= set(self.factors):
            return None
        return "-".join(labels[factor] for factor in self.factors)

    def completed(self, labels: Labels) -> dict[str, str]:
        """A trial's labels, with those of the product or of its factors that follow from
        the others.

        >>> CATEGORY.completed({"category": "soft-fixed"})
        {'softness': 'soft', 'mobility': 'fixed', 'category': 'soft-fixed'}
        """
        implied: dict[str, str] = {}
        joined = self.label(labels)
        if labels.get(self.task, "").count("-") == 1:
            names = labels[self.task].split("-")
            implied = dict(zip(self.factors, names, strict=True))
        elif joined is not None:
            implied = {self.task: joined}
        return {**implied, **labels}

    def contradiction(self, labels: Labels) -> str:
        """A sentence on a trial whose label of the product is another than that of its
        factors; empty elsewhere."""
        implied = self.label(self.completed(labels))
        label = labels.get(self.task, implied)
        if implied is None or label == implied:
            return ""
        return (
            f"{self.task}={label!r} contradicts {' and '.join(self.factors)}, which say "
            f"{implied!r}"
        )


CATEGORY = Product("category", ("softness", "mobility"))
"""The paper's categories."""
