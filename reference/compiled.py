"""Compilation of the kernels, with their types kept for the checker and the result kept on disk for later processes.

Numba renews a stored kernel when its own file changes, but not when a kernel it calls does, in another file. So the
store's folder is named after the text of all kernels.
"""

from __future__ import annotations

import hashlib
from collections.abc import Callable
from pathlib import Path
from typing import TypeVar, cast

from numba import config, njit

Kernel = TypeVar("Kernel", bound=Callable[..., object])

HERE = Path(__file__).parent
TEXT = b"".join(path.read_bytes() for path in sorted(HERE.glob("*.py")))
STORE = Path(config.CACHE_DIR or HERE / "__pycache__") / f"kernels-{hashlib.sha256(TEXT).hexdigest()[:16]}"


def compiled(kernel: Kernel) -> Kernel:
    """Compile for numbers and flat arrays at the first call, or load what an earlier process compiled."""
    usual = config.CACHE_DIR
    config.CACHE_DIR = str(STORE)  # read once, by the next line; other users of numba keep their own
    try:
        return cast(Kernel, njit(cache=True)(kernel))
    finally:
        config.CACHE_DIR = usual
