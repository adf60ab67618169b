"""Browsers that several test files share; started by the first test that asks for one."""

from __future__ import annotations

import signal
from collections.abc import Iterator

import pytest
from browsers import Chrome, Firefox, open_chrome, open_firefox


@pytest.fixture(scope="session")
def chrome() -> Iterator[Chrome]:
    """Headless chromium without WebGL."""
    with open_chrome("--disable-3d-apis") as browser:
        yield browser


@pytest.fixture(scope="session")
def firefox(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Firefox]:
    """Headless firefox-esr."""
    with open_firefox(tmp_path_factory.mktemp("firefox")) as browser:
        yield browser


# A shell that runs this in the background has Ctrl-C ignored, and programs started from here would inherit that.
if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
    signal.signal(signal.SIGINT, signal.default_int_handler)
