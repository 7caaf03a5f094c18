"""The measurements of a contact: quantities, and the vector that they make."""
