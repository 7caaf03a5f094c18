"""The time that accuracy costs: waiting, the wire, arithmetic and the arm."""
