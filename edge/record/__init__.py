"""What is kept of touches: recordings, and the table of their labels."""
