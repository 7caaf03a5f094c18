"""What is measured of a contact: quantities, and the vector that they make."""
