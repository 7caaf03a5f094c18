"""What accuracy costs in time: waiting, the wire, arithmetic and the arm."""
