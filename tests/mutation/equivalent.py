"""Changes of `make mutants` that no test can notice, because they change nothing, and why."""

EQUIVALENT: dict[tuple[str, str], str] = {}
"""{(file, "old  ->  new"): the reason}."""
