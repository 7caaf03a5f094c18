"""Changes of `make mutants` that no test can notice, because they change nothing, and why."""

EQUIVALENT: dict[tuple[str, str], str] = {
    (
        "edge/touch/contact.py",
        "256  ->  257",
    ): "the rows that a contact first has room for; more room is made where they are full",
}
"""{(file, "old  ->  new"): the reason}."""
