"""How fast a report is in a real browser, by the clock on the wall: `make measure`, or

    python -m tests.measure_page out/report.html

Says when the page is loaded, when its first chart and its replay are drawn, how long it keeps a reader waiting in one
piece, how soon the slider answers, and how many frames a second the replay of 300 boxes in four panels shows. Headless
chromium without a GPU. No test: on a busy machine the figures say more about the machine.
"""

from __future__ import annotations

import statistics
import sys
import tempfile
from pathlib import Path
from typing import Any

sys.path.insert(0, str(Path(__file__).parent))

from browsers import Chrome, open_chrome
from replay_pages import boxes

ROUNDS = 5
PLAYED = 5.0  # seconds the replay is watched
WATCH = """
  window.seen = {}, window.tasks = [];
  const note = (all) => tasks.push(...all.getEntries().map((one) => one.duration));
  new PerformanceObserver(note).observe({type: 'longtask'});
  const marks = {
    'first chart by script': '.first [data-drawn]',
    'replay drawn': '#replay-panels canvas',
    'conservation drawn': '#replay-plots svg',
  };
  (function look() {
    for (const [name, place] of Object.entries(marks))
      if (!seen[name] && document.querySelector(place)) seen[name] = performance.now();
    requestAnimationFrame(look);
  })();
"""
ANSWER = """const done = arguments[0], slider = document.querySelector('input.target'), start = performance.now();
  slider.value = Number(slider.value) + 1;
  slider.dispatchEvent(new Event('input', {bubbles: true}));
  requestAnimationFrame(() => setTimeout(() => done(performance.now() - start)));"""
PLAY = """const done = arguments[0], gaps = []; let before = 0, start = 0, drawn = 0;
  const clock = document.getElementById('replay-clock');
  new MutationObserver(() => drawn++).observe(clock, {childList: true});
  document.getElementById('replay-speed').value = '0.25';
  document.getElementById('replay-speed').dispatchEvent(new Event('change'));
  document.getElementById('replay-play').click();
  requestAnimationFrame(function tick(now) {
    if (before) gaps.push(now - before);
    start ||= now, before = now;
    if (now - start < 1000 * SECONDS) requestAnimationFrame(tick);
    else done([drawn / ((now - start) / 1000), Math.max(...gaps)]);
  });"""


def loaded(chrome: Chrome, path: Path) -> dict[str, float]:
    """Milliseconds from the start of the load; the slider's answer and the longest task by themselves."""
    chrome.open(path)
    chrome.until("seen['first chart by script'] && (seen['conservation drawn'] || !document.getElementById('replay'))")
    entry = "performance.getEntriesByType('navigation')[0]"
    found: dict[str, float] = {
        "HTML read": chrome.js(f"return {entry}.domInteractive"),
        "scripts run": chrome.js(f"return {entry}.domContentLoadedEventEnd"),
        "loaded": chrome.js(f"return {entry}.loadEventEnd"),
        **chrome.js("return seen"),
    }
    found["longest task"] = chrome.js("return Math.max(0, ...tasks)")
    found["slider answers in"] = chrome.driver.execute_async_script(ANSWER)
    return found


def frames(chrome: Chrome, path: Path) -> tuple[float, float]:
    """Frames a second of a playing replay, and its longest gap between two [ms]."""
    chrome.open(path)
    chrome.until("seen['conservation drawn']")
    rate, gap = chrome.driver.execute_async_script(PLAY.replace("SECONDS", str(PLAYED)))
    return rate, gap


def main(names: list[str]) -> None:
    """Measure the reports that are named, and the replay of a crowd."""
    with open_chrome("--disable-3d-apis") as chrome, tempfile.TemporaryDirectory() as folder:
        chrome.driver.execute_cdp_cmd("Page.addScriptToEvaluateOnNewDocument", {"source": WATCH})
        for name in names:
            path = Path(name).resolve()
            rounds = [loaded(chrome, path) for _ in range(ROUNDS)]
            print(f"{name}: {path.stat().st_size / 1e6:.2f} MB; median and most of {ROUNDS} rounds [ms]")
            for key in rounds[0]:
                values: list[Any] = [found[key] for found in rounds if key in found]
                print(f"  {key:24} {statistics.median(values):6.0f} {max(values):6.0f}")
        crowd = Path(folder) / "crowd.html"
        boxes(crowd)
        rates = [frames(chrome, crowd) for _ in range(3)]
        told = ", ".join(f"{rate:.0f} (longest gap {gap:.0f} ms)" for rate, gap in rates)
        print(f"replay of 300 boxes in four panels and the overlay, frames a second over {PLAYED:.0f} s: {told}")


if __name__ == "__main__":
    main(sys.argv[1:])
