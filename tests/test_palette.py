"""Agents' colours are told apart, also by who sees two of three colours, and on their grounds."""

import numpy as np
import pytest

from gne_mj.palette import PALETTE
from gne_mj.plots.style import line_style

HUES = 8
GROUNDS = {"light": "#ffffff", "dark": "#1a2028"}
LUMINANCE = np.array([0.2126729, 0.7151522, 0.0721750])
TO_XYZ = np.array([[0.4124564, 0.3575761, 0.1804375], LUMINANCE, [0.0193339, 0.1191920, 0.9503041]])
# Machado, Oliveira and Fernandes 2009, severity 1, for linear sRGB
VISIONS = {
    "three colours": np.eye(3),
    "protanopia": [[0.152286, 1.052583, -0.204868], [0.114503, 0.786281, 0.099216],
                   [-0.003882, -0.048116, 1.051998]],
    "deuteranopia": [[0.367322, 0.860646, -0.227968], [0.280085, 0.672501, 0.047413],
                     [-0.011820, 0.042940, 0.968881]],
    "tritanopia": [[1.255528, -0.076749, -0.178779], [-0.078411, 0.930809, 0.147602],
                   [0.004733, 0.691367, 0.303900]],
}  # fmt: skip


def linear(colour):
    """sRGB's colour as three linear parts from 0 to 1."""
    part = np.array([int(colour[k : k + 2], 16) for k in (1, 3, 5)]) / 255
    return np.where(part <= 0.04045, part / 12.92, ((part + 0.055) / 1.055) ** 2.4)


def lab(colour, vision):
    """CIE L*a*b* under D65."""
    seen = TO_XYZ @ np.clip(np.asarray(VISIONS[vision]) @ linear(colour), 0, 1)
    x, y, z = (
        np.cbrt(t) if t > (6 / 29) ** 3 else t / (3 * (6 / 29) ** 2) + 4 / 29
        for t in seen / [0.95047, 1.0, 1.08883]
    )
    return np.array([116 * y - 16, 500 * (x - y), 200 * (y - z)])


@pytest.mark.parametrize("vision", VISIONS)
@pytest.mark.parametrize("ground", GROUNDS)
def test_neighbours_and_colours_of_one_hue_differ(ground, vision):
    """By 20 of L*a*b* among the first eight; the others, which have another dash too, by 10."""
    points = np.array([lab(colour, vision) for colour in PALETTE[ground]])
    first = points[:HUES]
    assert np.min(np.linalg.norm(first - np.roll(first, -1, axis=0), axis=1)) > 20
    assert np.min(np.linalg.norm(points[1:] - points[:-1], axis=1)) > 10
    assert np.min(np.linalg.norm(points[HUES:] - first, axis=1)) > 15


@pytest.mark.parametrize("ground", GROUNDS)
def test_every_colour_is_read_on_its_ground(ground):
    """With the contrast of 3 that WCAG 2 asks of graphics."""
    luminances = [
        LUMINANCE @ linear(colour) + 0.05 for colour in (GROUNDS[ground], *PALETTE[ground])
    ]
    ratio = np.array(luminances[1:]) / luminances[0]
    assert np.min(np.maximum(ratio, 1 / ratio)) > 3
    assert len(set(PALETTE[ground])) == 2 * HUES


def test_figures_have_the_pages_colours():
    assert [line_style(k)["color"] for k in range(2 * HUES)] == PALETTE["light"]
