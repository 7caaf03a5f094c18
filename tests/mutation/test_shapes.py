"""Code is found by its shape, whatever has been renamed, reformatted or moved."""

import pytest

from tests.mutation import shapes

STOOD = "edge/a.py:limit"
SHAPE = "if values[0] > self.most: ..."
CODE = """
def limit(self, values):
    low = min(values)
    if values[0] > self.most:
        raise ValueError(low)
    return low
"""


@pytest.fixture
def tree(tmp_path):
    def write(file, text):
        path = tmp_path / file
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text)
        shapes.trees.cache_clear()
        return tmp_path

    yield write
    shapes.trees.cache_clear()


def text(root):
    return shapes.without(shapes.find(SHAPE, STOOD, root), "if False: ...", root)


def test_the_condition_goes_and_its_block_stays(tree):
    said = text(tree("edge/a.py", CODE))
    assert "if False:\n        raise ValueError(low)" in said
    assert "values[0]" not in said


@pytest.mark.parametrize(
    "changed",
    [
        CODE.replace("values", "z"),
        CODE.replace("self.most", "settings.largest"),
        CODE.replace("values[0] > self.most", "(\n        values[0]  # the first\n> self.most)"),
    ],
    ids=["local name", "attribute", "layout"],
)
def test_a_rename_and_a_new_layout_change_nothing(tree, changed):
    assert "if False:" in text(tree("edge/a.py", changed))


def test_a_moved_function_is_found_in_its_new_file(tree):
    assert shapes.find(SHAPE, STOOD, tree("train/elsewhere.py", CODE)).file == "train/elsewhere.py"


def test_among_places_of_one_shape_the_one_with_the_names_is_meant(tree):
    tree("edge/a.py", CODE.replace("self.most", "self.least").replace("limit", "other"))
    assert shapes.find(SHAPE, STOOD, tree("edge/b.py", CODE)).file == "edge/b.py"


def test_two_places_alike_are_told_apart_by_nobody(tree):
    tree("edge/b.py", CODE)
    with pytest.raises(LookupError, match=r"two places look alike .*b.py:4, edge/c.py:4"):
        shapes.find(SHAPE, STOOD, tree("edge/c.py", CODE))


@pytest.mark.parametrize("other", [">=", "<"])
def test_another_comparison_is_another_shape(tree, other):
    with pytest.raises(LookupError, match="nothing looks like"):
        shapes.find(SHAPE, STOOD, tree("edge/a.py", CODE.replace(">", other)))


def test_a_name_stands_for_the_same_thing_throughout(tree):
    root = tree("edge/a.py", "def f(a, b):\n    return a * a - b\n")
    with pytest.raises(LookupError):
        shapes.find("x * y - y", "edge/a.py:f", root)
    assert shapes.find("x * x - y", "edge/a.py:f", root).names.keys() == {"x", "y"}
