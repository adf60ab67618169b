"""Compilation of the kernels, with their types kept for the checker and the result kept on disk for later processes.

Numba renews a stored kernel when its own file changes, but not when a kernel it calls does, in another file. So the
store's folder is named after the text of all kernels.
"""

from __future__ import annotations

import hashlib
import os
from collections.abc import Callable
from pathlib import Path
from typing import TypeVar, cast

from numba import config, njit

Kernel = TypeVar("Kernel", bound=Callable[..., object])

HERE = Path(__file__).parent
TEXT = b"".join(path.read_bytes() for path in sorted(HERE.glob("*.py")))


def _store() -> Path:
    """The folder of compiled kernels: beside the package, or the user's cache where that cannot be written."""
    beside = HERE / "__pycache__" if os.access(HERE, os.W_OK) else Path.home() / ".cache" / "impactbench"
    return Path(config.CACHE_DIR or beside) / f"kernels-{hashlib.sha256(TEXT).hexdigest()[:16]}"


STORE = _store()


def compiled(kernel: Kernel) -> Kernel:
    """Compile for numbers and flat arrays at the first call, or load what an earlier process compiled."""
    return _compile(kernel)


def inlined(kernel: Kernel) -> Kernel:
    """Like `compiled`, set into its callers and without counting references: handing on dozens of arrays and counting
    each costs several times the arithmetic of a small kernel. It cannot make arrays; those it gets are its callers'.
    """
    return _compile(kernel, forceinline=True, _nrt=False)


def merged(kernel: Kernel) -> Kernel:
    """Like `compiled`, set into its only caller: handing on dozens of arrays costs as much as a small step itself."""
    return _compile(kernel, forceinline=True)


def _compile(kernel: Kernel, **options: bool) -> Kernel:
    """Without the second entry that numba makes for callbacks of C: nobody calls it, and it takes time to compile."""
    usual = config.CACHE_DIR
    config.CACHE_DIR = str(STORE)  # read once, by the next line; other users of numba keep their own
    try:
        return cast(Kernel, njit(cache=True, error_model="numpy", no_cfunc_wrapper=True, **options)(kernel))
    finally:
        config.CACHE_DIR = usual
