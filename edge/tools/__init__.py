"""What stands beside the core: commands that decide nothing, with the page and the
terminal."""
