"""Numbers small enough for a page: 16-bit words, delta-coded, as two byte planes, deflated, in base64.

For display only: no figure of the report is computed from what comes out of here. `templates/replay.js` holds the
inverse; `unpack` is the same in Python.
"""

from __future__ import annotations

import base64
import zlib

import numpy as np
from impactbench.scenarios.trajectory import Floats
from numpy.typing import NDArray

Words = NDArray[np.int16]
UNKNOWN = -32768
"""The word that stands for "no value"."""
TINY = 1e-16
"""Smallest size a series tells from 0: a round-off of the scene's own scale."""
PER_DECADE = 1000
"""Words to a factor of ten: a series keeps its values to 10^(1/2000), 0.12 %, over 32 decades."""


def quantised(values: Floats, low: Floats, span: Floats) -> Words:
    """Positions [..., 3] as words: 0 ... 65534 across the box from `low` over `span` [m], less 32767."""
    scaled = np.rint((values - low) / span * 65534)
    return np.asarray(np.clip(scaled, 0, 65534) - 32767, dtype=np.int16)


def restored(words: Words, low: Floats, span: Floats) -> Floats:
    """Positions [m] of words; off by at most span/131068 on each axis."""
    return np.asarray((words.astype(np.float64) + 32767) / 65534 * span + low)


def logarithmic(values: Floats) -> Words:
    """Signed values of any size as words: sign and 1000 log10(|x|/1e-16); not-a-number is UNKNOWN."""
    size = np.where(np.isfinite(values), np.abs(values), TINY)
    word = np.minimum(np.rint(PER_DECADE * np.log10(np.maximum(size, TINY) / TINY)), 32767)
    return np.where(np.isnan(values), UNKNOWN, np.sign(values) * word).astype(np.int16)


def exponential(words: Words) -> Floats:
    """Values of `logarithmic` words."""
    size = np.where(words == 0, 0.0, TINY * 10 ** (np.abs(words.astype(np.float64)) / PER_DECADE))
    return np.where(words == UNKNOWN, np.nan, np.sign(words.astype(np.float64)) * size)


def pack(*groups: tuple[Words, int]) -> str:
    """Rows of words over time, each group [rows, T] with how often differences are taken of it, as one text.

    Differences wrap around at 16 bits, so that nothing is lost to them; twice suits what flies, once what creeps.
    """
    stored = []
    for rows, times in groups:
        words = np.ascontiguousarray(rows).astype(np.uint16)
        for _ in range(times):
            words[:, 1:] = words[:, 1:] - words[:, :-1]
        signed = words.view(np.int16).astype(np.int32)
        stored.append(((signed << 1) ^ (signed >> 31)).astype(np.uint16).ravel())  # small of either sign: high byte 0
    words = np.concatenate(stored) if stored else np.zeros(0, np.uint16)
    planes = (words & 0xFF).astype(np.uint8).tobytes() + (words >> 8).astype(np.uint8).tobytes()
    return base64.b64encode(zlib.compress(planes, 9)).decode("ascii")


def unpack(text: str, *groups: tuple[int, int, int]) -> list[Words]:
    """Groups of `pack` again, given (rows, T, differences) of each."""
    planes = np.frombuffer(zlib.decompress(base64.b64decode(text)), np.uint8)
    low, high = np.split(planes.astype(np.uint16), 2)
    words, found, start = low | (high << 8), [], 0
    for rows, count, times in groups:
        part = words[start : start + rows * count].reshape(rows, count)
        start += rows * count
        part = (part >> 1) ^ (np.uint16(0) - (part & 1))
        for _ in range(times):
            part = np.cumsum(part, axis=1, dtype=np.uint16)
        found.append(part.view(np.int16))
    return found
