"""The report in real browsers, from disk: the script draws the charts, nothing complains, nothing is fetched."""

from __future__ import annotations

import re
import shutil
import subprocess
from pathlib import Path

import pytest
from impactbench.reports import page
from test_page import HOSTILE, Maker, case, document, small

pytestmark = pytest.mark.slow
# Messages of a page's own scripts and policies; a headless browser logs much else about the machine it is on.
CONSOLE = re.compile(r"CONSOLE[(:].*")


def browser(*names: str) -> str:
    """First of these browsers on PATH; skips the test where there is none."""
    found = next((path for name in names if (path := shutil.which(name))), None)
    if found is None:
        pytest.skip(f"no {' or '.join(names)} on PATH")
    return found


def chromium(path: Path, profile: Path, *options: str) -> tuple[str, list[str]]:
    """Page after its scripts have run, and what they wrote to the console. Every host name resolves to nothing."""
    command = [
        browser("chromium", "chromium-browser", "google-chrome"), "--headless", "--no-sandbox", "--disable-gpu",
        f"--user-data-dir={profile}", "--host-resolver-rules=MAP * ~NOTFOUND", "--enable-logging=stderr", "--v=0",
        "--virtual-time-budget=8000", *options, "--dump-dom", path.as_uri(),
    ]  # fmt: skip
    run = subprocess.run(command, capture_output=True, text=True, timeout=120, check=True)
    return run.stdout, CONSOLE.findall(run.stderr)


def test_chromium_draws_the_charts_by_script_and_stays_quiet(tmp_path: Path) -> None:
    path = tmp_path / "report.html"
    page.write_page(small(), path)
    dom, console = chromium(path, tmp_path / "profile", "--window-size=1366,4000")
    assert console == []
    assert dom.count('data-drawn="script"') == 2
    assert 'class="static"' not in dom
    assert dom.count('class="marks"') >= 2
    assert "mark-symbol" in dom
    assert '<p class="control">' in dom  # shown by the script, hidden without it


def test_chromium_sees_the_console_messages_this_file_relies_on(tmp_path: Path) -> None:
    path = tmp_path / "broken.html"
    path.write_text("<script>console.error('a known complaint')</script>")
    _, console = chromium(path, tmp_path / "profile")
    assert "a known complaint" in "".join(console)


def test_hostile_names_stay_text_after_the_script_has_drawn_them(tmp_path: Path) -> None:
    maker = Maker()
    maker.ladder("a", f"{HOSTILE}/default", 0.1, 1e-4)
    maker.cell("a", HOSTILE, 60, {}, state="crashed", reason=HOSTILE)
    path = tmp_path / "report.html"
    page.write_page(document(maker, [case("a", HOSTILE, question=HOSTILE)]), path)
    dom, console = chromium(path, tmp_path / "profile", "--window-size=1366,4000")
    assert console == []
    assert 'data-drawn="script"' in dom
    assert "<img" not in re.sub(r"<(script|style).*?</\1>|\"[^\"]*\"", "", dom, flags=re.S)


def test_firefox_paints_the_page_from_disk(tmp_path: Path) -> None:
    firefox = browser("firefox-esr", "firefox")
    command = [firefox, "--headless", "--no-remote", "--profile", str(tmp_path / "profile"), "--window-size=1366,768"]
    (tmp_path / "profile").mkdir()

    def painted(name: str) -> int:
        """Bytes of the picture, which hold as much as there is to see."""
        picture, uri = tmp_path / f"{name}.png", (tmp_path / f"{name}.html").as_uri()
        subprocess.run([*command, f"--screenshot={picture}", uri], capture_output=True, timeout=120, check=True)
        return picture.stat().st_size

    (tmp_path / "empty.html").write_text("<!doctype html><title>empty</title>", encoding="utf-8")
    page.write_page(small(), tmp_path / "report.html")
    assert painted("report") > 4 * painted("empty")
