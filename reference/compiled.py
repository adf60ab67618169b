"""Compilation of the kernels, with their types kept for the checker."""

from __future__ import annotations

from collections.abc import Callable
from typing import TypeVar, cast

from numba import njit

Kernel = TypeVar("Kernel", bound=Callable[..., object])


def compiled(kernel: Kernel) -> Kernel:
    """Compile for numbers and flat arrays at the first call; the result is kept on disk for later processes."""
    return cast(Kernel, njit(cache=True)(kernel))
