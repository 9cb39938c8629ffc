"""Angles in the notations of field books: the same planes and lines written in many ways are the same axes."""

import numpy as np
import pytest

from bingham.errors import RecordingError
from bingham.geology import from_strike_dip, from_trend_plunge
from bingham.io import read_axes

# Planes and lines worked out by hand: right-hand strike, dip; trend, plunge.
PLANES = [(45, 30), (225, 30), (330, 60), (150, 60), (90, 10), (270, 80)]
LINES = [(45, 30), (135, 10), (200, 75), (310, 5)]
QUADRANT_PLANES = "N45E 30SE\nS45W 30NW\nN30W 60NE\nN30W 60SW\nN90E 10S\nN90W 80N\n"


def written(tmp_path, text, **options):
    path = tmp_path / "book.csv"
    path.write_text(text, encoding="utf-8")
    return read_axes(path, **options)


def same(axes, expected):
    np.testing.assert_allclose(np.abs(np.sum(axes.values * expected, axis=1)), 1.0, atol=1e-12)


@pytest.mark.parametrize(
    "text",
    [
        QUADRANT_PLANES,
        "Strike,Dip\n" + QUADRANT_PLANES.replace(" ", ","),
        "Strike,Dip,Dip quadrant\n045,30,SE\n45,30,NW\n150,60,NE\n330,60,SW\n90,10,S\n270,80,N\n",
        "stop;rock;strike_RHR;dip;remark\nA1;gneiss;45;30;fresh, wet\nA1;;225;30;\nB;schist;330;60;a\nB;s;150;60;b\n"
        "B;s;90;10;c\nB;s;270;80;d\n",
        "# site 4\nstrike\tdip\nN 45° E\t30° SE\nS45°W\t30°NW\nN30W\t60NE\nS30E\t60SW\nN90E\t10S\n270°\t80°\n",
        "Strike/Dip\n045/30\n225/30\n330/60\n150/60\n90/10\n270/80\n",
    ],
)
def test_planes(tmp_path, text):
    strike, dip = np.array(PLANES, dtype=float).T
    same(written(tmp_path, text), from_strike_dip(strike, dip))


@pytest.mark.parametrize(
    ("text", "angles"),
    [
        ("trend,plunge\nN45E,30\nS45E,10\nS20W,75\nN50W,5\n", None),
        ("Azimuth (°);Inclination (°)\n45,0°;30,0°\n135,0°;10,0°\n200,0°;75,0°\n310,0°;5,0°\n", None),
        ("lineation\n30->045\n10->135\n75 → 200\n5° → 310°\n", None),
        ("045/30\n135/10\n200/75\n310/05\n", "trend-plunge"),
        ("N45E 30\nS45E 10\nS20W 75\nN50W 5\n", "trend-plunge"),
    ],
)
def test_lines(tmp_path, text, angles):
    trend, plunge = np.array(LINES, dtype=float).T
    same(written(tmp_path, text, angles=angles), from_trend_plunge(trend, plunge))


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("045/30\n135/10\n200/75\n", "line 1: a pair of angles without a name; say what it is"),
        ("site\na 12/30\nb 14/31\nc 15/32\n", "line 2: a pair of angles without a name; say what it is"),
        ("strike,dip\nN45E,30\nN30W,60\n", "line 2: strike N45E without the side to which the plane dips"),
        ("strike,dip\nN45E,30SE\nN30W,60NW\n", "line 3: a plane that dips along its strike"),
        ("strike,dip\nN45E,30SE\nN30W,190NE\n", "line 3: dip is to be"),
        ("strike,dip\nN45E,30SE\nN95W,20NE\n", "line 3, column 1: no angle"),
        ("45,30\n135,10\n200,75\n310,5\n", "line 1: two columns without names that look like angles in degrees"),
    ],
)
def test_what_is_left_open_is_not_guessed(tmp_path, text, message):
    with pytest.raises(RecordingError, match=message):
        written(tmp_path, text)
