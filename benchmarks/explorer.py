"""The explorer: time from a moved slider to new plots, questions to the core, time of a diagram, and what blocks the page.

Time of the processor is that of the page's own thread, so that other work on the machine does not count; by the clock it
does. The diagram has 300 columns of 60 periods and those that are looked at, in one worker; its processor time is that of the
same columns in the module of the page, the shorter of two sweeps up. Needs a browser: python benchmarks/explorer.py
"""

import sys
import tempfile
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1] / "tests"))

from browser import Browser

from stickslip.explorer import page

#: Laws with lines, forced, smooth, and a row of masses.
PRESETS = ("stick-slip", "almost-harmonic", "forced", "brake", "bow", "chain")
MOVE = """(() => { const slider = document.querySelector('input[aria-label="drive velocity s"]'); const times = [];
  const calls = explorer.core.calls; const now = slider.valueAsNumber;
  for (let i = 0; i < MOVES; i++) { slider.value = now + i % 2; const begun = performance.now();
    slider.dispatchEvent(new Event('input')); explorer.redraw(); times.push(performance.now() - begun); }
  return [Math.min(...times), (explorer.core.calls - calls) / MOVES]; })()""".replace("MOVES", "40")
SWEEP = """new Promise((done) => { const begun = performance.now();
  explorer.change([['system.damping', 1.001 * explorer.state.system.damping]]);
  const look = () => (explorer.swept[0] === 300 && !explorer.stale ? done(performance.now() - begun) : setTimeout(look, 1));
  requestAnimationFrame(() => requestAnimationFrame(look)); })"""
# The drive velocity moves every contact alike.
COLUMNS = """(() => { const [ask] = JSON.parse(explorer.sweeps.asked); explorer.diagram.values.forEach((value, i) =>
  explorer.core.ask(2, { ...ask, values: ask.names.map(() => value), go_on: i > 0, patience: 1000 })); })()"""
# A slider is moved once in each of sixty frames while the diagrams are swept: the tasks of the page.
BLOCKED = """new Promise((done) => { const tasks = [];
  const slider = document.querySelector('input[aria-label="drive velocity s"]');
  const frame = explorer.frame.bind(explorer); let count = 0; const now = slider.valueAsNumber;
  explorer.frame = (time) => { const begun = performance.now(); frame(time); tasks.push(performance.now() - begun); };
  const step = () => { slider.value = now + count % 5; slider.dispatchEvent(new Event('input'));
    if (count++ < 60) requestAnimationFrame(step);
    else { explorer.frame = frame; tasks.sort((a, b) => a - b); done([tasks[0], tasks[tasks.length >> 1], tasks.at(-1)]); } };
  step(); })"""


def busy(browser: Browser) -> float:
    """Milliseconds of processor that the page has used."""
    metrics = browser.send("Performance.getMetrics")["metrics"]
    return 1000 * next(one["value"] for one in metrics if one["name"] == "TaskDuration")


def main() -> None:
    """Print the numbers of each preset."""
    with tempfile.TemporaryDirectory() as folder, Browser() as browser:
        path = Path(folder) / "page.html"
        path.write_text(page(), encoding="utf-8")
        browser.send("Performance.enable", timeDomain="threadTicks")
        for preset in PRESETS:
            browser.open(f"{path.as_uri()}#{preset}")
            browser.run("explorer.play(false)")
            browser.wait("explorer.swept[0] === 300 && explorer.swept[1] === 300")
            begun = busy(browser)
            least, calls = browser.run(MOVE)
            each = (busy(browser) - begun) / 40
            browser.wait("explorer.swept[0] === 300 && explorer.swept[1] === 300")
            # Both sweeps run at once, each in a worker of its own: the one that is asked for first.
            sweep = browser.run(SWEEP)
            browser.wait("explorer.swept[0] === 300 && explorer.swept[1] === 300")
            columns = []
            for _ in range(2):
                begun = busy(browser)
                browser.run(COLUMNS)
                columns.append(busy(browser) - begun)
            begun = busy(browser)
            shortest, usual, longest = browser.run(BLOCKED)
            frame = (busy(browser) - begun) / 60
            sys.stdout.write(
                f"{preset}: slider to plots {each:.1f} ms of processor ({least:.1f} by the clock), {calls:g} questions; "
                f"diagram {min(columns):.0f} ms of processor ({sweep:.0f} by the clock); "
                f"with the diagrams on their way a frame takes {frame:.1f} ms of processor "
                f"({shortest:.1f} to {longest:.1f} by the clock, half below {usual:.1f})\n"
            )


if __name__ == "__main__":
    main()
