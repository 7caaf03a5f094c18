"""Live pages of a folder of touches."""

import shutil
from contextlib import ExitStack, closing
from dataclasses import replace

import numpy as np
import pytest

import edge
from edge import demo
from edge.app.sinks.page import Page
from edge.touch.frame import Frame
from edge.touch.layout import SkinLayout
from tests.edge.app.kept import kept_meta

LAYOUT = SkinLayout(
    rows=4,
    cols=6,
    threshold_counts=100,
    dead=(5,),
    counts_per_newton=1000.0,
)
TOUCH = edge.load(demo.FOLDER / "foam-block-fixed.npz")


def frames(count=10_000, touched_from=0):
    for i in range(count):
        image = np.zeros((4, 6), np.uint16)
        if i >= touched_from:
            image[1, 2:4] = 500, 600
        valid = np.ones((4, 6), bool)
        valid[3, 0] = False
        yield Frame(counts=image, valid=valid, t=i * 0.05)


@pytest.fixture
def serve(tmp_path):
    """Serve a page of the folder `tmp_path`, with further options."""
    with ExitStack() as stack:

        def run(layout=LAYOUT, **options):
            options = {"folder": tmp_path, **options}
            page = Page("127.0.0.1:0", layout, title="pad", **options)
            stack.enter_context(closing(page.server))
            return page

        yield run


@pytest.fixture
def page(serve):
    return serve()


@pytest.fixture
def touch_folder(tmp_path):
    """A folder with a touch that was kept because its decision was unsure."""
    meta = {**TOUCH.meta, **kept_meta({}, softness=("hard", 0.55, "short"))}
    edge.save(tmp_path / "kept-1.npz", replace(TOUCH, meta=meta))
    return tmp_path


@pytest.fixture
def add_touch(touch_folder):
    """Keep another touch."""
    return lambda: shutil.copy(touch_folder / "kept-1.npz", touch_folder / "kept-2.npz")


@pytest.fixture
def kept_page(touch_folder, serve):
    return serve(choices={"softness": ["soft", "hard"]}, decides=True)
