"""The subcommands of edge-classify, one module each."""
