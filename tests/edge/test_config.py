"""One way to say what is wrong with a value: the sentence names file, key, wish and
value."""

from dataclasses import dataclass, field

import pytest

from edge.config import (
    ConfigTable,
    limited,
    parse_json,
    parse_toml,
    read_toml,
    short_text,
)
from edge.errors import InputError

HUGE = 10**5000
BEYOND_FLOATS = 10**400


def mistake(check):
    with pytest.raises(InputError) as caught:
        check(
            ConfigTable(
                {"a": "x", "n": 7, "h": HUGE, "f": BEYOND_FLOATS},
                "my.toml",
                "read.",
            )
        )
    return str(caught.value)


@pytest.mark.parametrize(
    ("check", "sentence"),
    [
        (lambda t: t.whole("a"), "my.toml: read.a must be a whole number from 0 to"),
        (lambda t: t.whole("n", allowed=(1, 2)), "read.n must be one of 1, 2, not 7"),
        (
            lambda t: t.whole("n", allowed=range(0x70, 0x78), form="#04x"),
            "must be 0x70 to 0x77",
        ),
        (lambda t: t.whole("z"), "my.toml: read.z is missing"),
        (
            lambda t: t.whole("h", allowed=range(9)),
            "0 to 8, not a number of thousands of digits",
        ),
        (lambda t: t.number("a"), "read.a must be a finite number, not 'x'"),
        (
            lambda t: t.number("n", low=8),
            "read.n must be a number of at least 8, not 7",
        ),
        (
            lambda t: t.number("n", low=7, open_low=True),
            "must be a number above 7, not 7",
        ),
        (lambda t: t.number("n", low=0, high=5), "must be a number from 0 to 5, not 7"),
        (lambda t: t.number("f"), "read.f must be a finite number, not 1000000"),
        (
            lambda t: t.number("h"),
            "must be a finite number, not a number of thousands of digits",
        ),
        (lambda t: t.flag("n"), "read.n must be true or false, not 7"),
        (lambda t: t.text("n"), "read.n must be text, not 7"),
        (lambda t: t.choice("a", ("b", "c")), "read.a must be one of b, c, not 'x'"),
        (lambda t: t.numbers("n", 3), "read.n must be a list of 3 numbers, not 7"),
        (lambda t: t.wholes("a"), "read.a must be a list of whole numbers"),
        (lambda t: t.texts("n"), "read.n must be a list of texts"),
        (lambda t: t.pair("n"), "read.n must be [row, col], not 7"),
        (lambda t: t.table("n"), "my.toml: read.n must be a table, not 7"),
        (
            lambda t: ConfigTable(7, "a.npz: meta.arm"),
            "a.npz: meta.arm must be a table, not 7",
        ),
        (lambda t: t.tables("n", "bus"), "read.n must be a list of tables, not 7"),
        (
            lambda t: (t.whole("n"), t.refuse_unknown()),
            "unknown key read.a; allowed: n",
        ),
    ],
)
def test_each_mistake_is_one_sentence(check, sentence):
    assert sentence in mistake(check)


def test_what_is_right_is_taken_as_it_is():
    table = ConfigTable({"n": 1, "t": "x", "l": [1, 2.5], "null": None}, "f")
    assert table.number("n") == 1.0
    assert table.text("t") == "x"
    assert table.numbers("l") == (1.0, 2.5)
    assert table.whole("null", 3) == 3  # JSON's null is as good as none
    table.refuse_unknown()


@dataclass
class Example:
    n: int = field(metadata={"allowed": range(9)})
    x: float | None = limited(None, low=0.0)
    xs: tuple[float, ...] = ()
    is_on: bool = True


def test_a_record_says_the_types_and_limits_of_its_keys():
    table = ConfigTable({"n": 7, "xs": [1, 2]}, "f")
    assert Example(**table.values(Example, 2)) == Example(7, None, (1.0, 2.0))
    table.refuse_unknown()
    for raw in ({}, {"n": 9}, {"n": 7, "x": -1}, {"n": 7, "xs": [1]}):
        with pytest.raises(InputError):
            ConfigTable(raw, "f").values(Example, 2)
    assert ConfigTable({"n": 9}, "f").values(Example, n=0)["n"] == 0


def test_a_table_in_a_list_is_called_by_its_number():
    (bus,) = ConfigTable({"bus": [{"device": 1}]}, "f").tables("bus", "bus")
    bus.has("clock")
    with pytest.raises(
        InputError, match="f: bus 0: unknown key device; allowed: clock"
    ):
        bus.refuse_unknown()


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        ("{", "Expecting property name"),
        ("[NaN]", "the number NaN is not finite"),
        ("[1e400]", "the number 1e400 is not finite"),
        (f"[{'9' * 5000}]", "a whole number of 5000 digits"),
        ("[" * 100_000, "nested too deeply"),
        (b'"\xff"', "not UTF-8"),
    ],
)
def test_what_is_not_json_is_one_sentence(text, reason):
    with pytest.raises(InputError) as caught:
        parse_json(text, "the file")
    assert str(caught.value).startswith("the file: not JSON: ")
    assert reason in str(caught.value)


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        (f"n = {'9' * 5000}", "digits"),
        ("a = " + "[" * 50_000, "nested too deeply"),
        ("a = 1\na = 2", "Cannot overwrite"),
    ],
)
def test_what_is_not_toml_is_one_sentence(text, reason, tmp_path):
    with pytest.raises(InputError, match=f"x.toml: not TOML: .*{reason}"):
        parse_toml(text, "x.toml")
    (tmp_path / "x.toml").write_text(text)
    with pytest.raises(InputError, match="x.toml: not TOML"):
        read_toml(tmp_path / "x.toml")


def test_a_value_is_shown_short():
    assert len(short_text("x" * 100_000)) < 80
    assert len(short_text([[1] * 100] * 100)) < 200
