"""The skin: its file, its calibration, and frames read over its buses."""
