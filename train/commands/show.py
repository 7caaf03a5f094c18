"""`python -m train show`."""
