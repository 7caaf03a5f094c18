"""The colours of the live page."""

import re
from importlib import resources

import numpy as np

THEME = re.compile(r"--([\w-]+): (#[0-9a-f]{6});")


def luminance(colour):
    """The relative luminance of WCAG 2, of #rrggbb."""
    channels = np.array(list(bytes.fromhex(colour[1:]))) / 255
    linear = np.where(
        channels <= 0.04045,
        channels / 12.92,
        ((channels + 0.055) / 1.055) ** 2.4,
    )
    return float(linear @ (0.2126, 0.7152, 0.0722))


def test_the_weakest_contact_stands_out_from_every_rest_in_both_themes():
    css = resources.files("edge.app.sinks").joinpath("pages/page.css").read_text()
    light_part, dark_part = css.split("@media (prefers-color-scheme: dark)")
    light = dict(THEME.findall(light_part))
    for theme in (light, {**light, **dict(THEME.findall(dark_part))}):
        weak = luminance(theme["weak"])
        for ground in ("rest-low", "rest-high", "panel"):
            darker, brighter = sorted((weak, luminance(theme[ground])))
            assert (brighter + 0.05) / (darker + 0.05) >= 3.0
