"""The explorer: time from a moved slider to new plots, questions to the core, and time of an orbit diagram.

The diagram has 300 columns of 60 periods, in one worker. Needs a browser: python benchmarks/explorer.py
"""

import sys
import tempfile
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1] / "tests"))

from browser import Browser

from stickslip.explorer import page

MOVE = """(() => { const slider = document.querySelector('input[aria-label="belt speed s"]'); const times = [];
  const calls = explorer.core.calls;
  for (let i = 0; i < 40; i++) { slider.value = 160 + i; const begun = performance.now();
    slider.dispatchEvent(new Event('input')); explorer.redraw(); times.push(performance.now() - begun); }
  times.sort((a, b) => a - b);
  return [times[20], times[39], (explorer.core.calls - calls) / 40]; })()"""
SWEEP = """new Promise((done) => { const begun = performance.now();
  explorer.change([['system.damping', 0.351]]); const look = () => (explorer.swept[which] === 300 && !explorer.stale ?
  done(performance.now() - begun) : setTimeout(look, 1)); requestAnimationFrame(() => requestAnimationFrame(look)); })"""


def main() -> None:
    """Print the three numbers for each preset whose law has a closed form."""
    with tempfile.TemporaryDirectory() as folder, Browser() as browser:
        path = Path(folder) / "page.html"
        path.write_text(page(), encoding="utf-8")
        for preset in ("stick-slip", "almost-harmonic", "forced"):
            browser.open(f"{path.as_uri()}#{preset}")
            browser.run("explorer.play(false)")
            browser.wait("explorer.swept[0] === 300 && explorer.swept[1] === 300")
            median, most, calls = browser.run(MOVE)
            browser.wait("explorer.swept[0] === 300 && explorer.swept[1] === 300")
            # Both sweeps run at once, each in a worker of its own: the one that is asked for first.
            sweep = browser.run(SWEEP.replace("which", "0"))
            sys.stdout.write(
                f"{preset}: slider to plots {median:.1f} ms (most {most:.1f}), {calls:g} questions; diagram {sweep:.0f} ms\n"
            )


if __name__ == "__main__":
    main()
