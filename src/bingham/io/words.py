"""What columns of sensors are called, in the languages in which loggers are sold."""

from __future__ import annotations

import re
import unicodedata

__all__ = ["TIME_WORDS", "WORDS", "joined", "letter_of"]

# Sensor's letter → what its columns are called; written as `joined` writes names.
WORDS = {
    "g": (
        "g|gyro|gyr|gyros|gyroscope|w|omega|angular_velocity|angular_rate|ang_vel|rotation_rate"
        "|gyroskop|drehrate|winkelgeschwindigkeit|vitesse_angulaire|giroscopio|velocidad_angular|velocita_angolare"
        "|velocidade_angular"
    ),
    "a": (
        "a|acc|accel|accelerometer|acceleration|specific_force"
        "|beschleunigung|beschleunigungssensor|beschleunigungsmesser|accelerometre|acelerometro|aceleracion"
        "|accelerometro|accelerazione|aceleracao"
    ),
    "m": (
        "m|mag|magn|magnet|magnetometer|magnetic_field"
        "|magnetfeld|magnetometre|champ_magnetique|magnetometro|campo_magnetico"
    ),
}
TIME_WORDS = "zeit|zeitstempel|temps|horodatage|tiempo|marca_de_tiempo|tempo"


def joined(text: str) -> str:
    """Return a name in lower case, its words joined by underscores, without accents: "GyrX", "Gyr X" as "gyr_x"."""
    if not text.isascii():
        text = "".join(c for c in unicodedata.normalize("NFKD", text) if not unicodedata.combining(c))
    text = re.sub(r"(?<=[a-z0-9])(?=[A-Z])", "_", text)
    text = re.sub(r"\[(\d+)\]", r"_\1", text)
    return re.sub(r"[\s./:\-_]+", "_", text).strip("_").lower()


def letter_of(word: str) -> str:
    """Return the letter of the sensor that a word of ``WORDS`` means, or else the word's first."""
    return next((letter for letter, words in WORDS.items() if word in words.split("|")), word[:1])
