"""From the bus to frames: buses, chips, the skin that reads them, and their fakes."""
