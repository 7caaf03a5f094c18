"""The subcommands of edge-classify, one module each.

What several of them share: `options` (command-line options and their checks), `source` (opening
the skin and the joint angles that the options name), `terminal` and `summary` (text for people).
"""
