"""One module a subcommand of edge-classify."""
