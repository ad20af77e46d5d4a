"""What goes into the explorer and comes out of it, in a headless browser: records, files, pages within pages, reports."""

import json
import re
import shutil
from base64 import b64encode
from pathlib import Path

import numpy as np
import pytest
import xarray as xr
from explorer_page import FRAME, drawn, facts
from matplotlib.figure import Figure
from PIL import Image
from real_records import RIGS

import stickslip as ss
from stickslip.explorer import content_of, content_of_system, page
from stickslip.laws import StaticKinetic
from stickslip.model.system_file import load_system_document
from stickslip.report.report import Report


@pytest.mark.parametrize(
    "preset", ["stick-slip", "chain", *(pytest.param(name, marks=pytest.mark.long) for name in ("forced", "brake"))]
)
def test_the_exported_system_is_simulated_to_the_same_bits(opened, tmp_path, preset):
    opened.run(f"explorer.open('#{preset}')")
    opened.run("explorer.change([['system.drive_velocity', 0.1 + 0.2]])")
    opened.run(FRAME)
    (tmp_path / "system.toml").write_text(opened.run("explorer.toml()"), encoding="utf-8")
    system, settings = load_system_document(tmp_path / "system.toml")
    orbit = ss.simulate(system, **settings)
    here = json.loads(opened.run("JSON.stringify(explorer.orbit.events.map(({ t, x, v, force }) => [t, x, v, force]))"))
    assert here == orbit.events[["t", "x", "v", "force"]].to_numpy().tolist()


@pytest.mark.slow
def test_a_saved_page_opens_as_it_was_saved(opened, tmp_path):
    opened.run("explorer.change([['system.law.D', [0.36, 2.2]], ['system.drive_velocity', 0.22]])")
    said = facts(opened)
    (tmp_path / "saved.html").write_text(opened.run("explorer.savedPage()"), encoding="utf-8")
    opened.open((tmp_path / "saved.html").as_uri())
    assert facts(opened) == said
    assert opened.run("explorer.state.system.law.D") == [0.36, 2.2]


def test_a_report_comes_alive_where_scripts_run_and_keeps_its_pictures_elsewhere(browser, tmp_path):
    report = Report("Two motions")
    system = ss.paper.oscillator(0.3)
    for _ in range(2):
        report.figure(Figure(figsize=(3, 2)), "A loop.", content_of_system(system, 60.0))
    path = report.write(tmp_path / "report.html")
    text = path.read_text(encoding="utf-8")
    assert text.count('id="core"') == 1
    assert len(re.findall(r"<stick-slip [^>]*><script[^>]*>[^<]*</script><img ", text)) == 2
    browser.problems.clear()
    browser.send("Page.navigate", url=path.as_uri())
    browser.wait("document.querySelector('stick-slip')?.dataset.ready === 'yes'")
    browser.run(FRAME)
    one = "document.querySelector('stick-slip')"
    assert browser.run(f"{one}.querySelector('.facts').textContent").startswith("Almost-harmonic, period 10.975949")
    browser.run(
        f"""(() => {{ const range = {one}.querySelector('input'); range.value = 0.2;
        range.dispatchEvent(new Event('input')); }})()"""
    )
    browser.run(FRAME)
    assert browser.run(f"{one}.querySelector('.facts').textContent").startswith("Stick-slip, period 10.594341")
    assert browser.problems == []


def test_a_live_figure_names_the_units_of_its_axes_and_of_its_drive(browser, tmp_path):
    report = Report("A rig")
    system = ss.Oscillator(0.1, 0.02, StaticKinetic(break_away=1.2, kinetic=0.8), mass=2.0, stiffness=50.0)
    report.figure(Figure(figsize=(3, 2)), "A loop.", content_of_system(system, 20.0), "law,phase,displacement")
    browser.send("Page.navigate", url=report.write(tmp_path / "report.html").as_uri())
    browser.wait("document.querySelector('stick-slip')?.dataset.ready === 'yes'")
    browser.run(
        """(() => { const said = [], fill = CanvasRenderingContext2D.prototype.fillText;
        CanvasRenderingContext2D.prototype.fillText = function (words, ...more) {
          said.push(words); fill.call(this, words, ...more); };
        window.said = said;
        const range = document.querySelector('stick-slip input'); range.dispatchEvent(new Event('input')); })()"""
    )
    browser.run(FRAME)
    drawn = browser.run("said")
    assert {"slip velocity w = s − ẋ (m/s)", "friction f (N)", "velocity ẋ (m/s)", "time t (s)"} <= set(drawn)
    assert "drive velocity s" in browser.run("document.querySelector('stick-slip').textContent")
    assert browser.run("document.querySelector('stick-slip output').textContent") == "0.02 m/s"
    assert re.search(
        r"period [\d.]+ s, amplitude [\d.]+ m,", browser.run("document.querySelector('.facts').textContent")
    )


def fitted(browser):
    browser.run("document.querySelector('#record-box > button').click()")
    browser.wait("!explorer.fitting")
    browser.run(FRAME)
    return browser.run("explorer.state.system.law")


@pytest.mark.long
@pytest.mark.parametrize(
    ("preset", "free", "slack"),
    # Where a forced slip turns between two samples the force rate of the turn is a little off.
    [
        ("stick-slip", ["B.1", "phi", "psi", "static_friction.limit"], 1e-6),
        pytest.param("forced", ["B.1", "phi"], 1e-2, marks=pytest.mark.slow),
    ],
)
def test_a_record_dropped_on_the_page_gives_its_law_back(opened, preset, free, slack):
    opened.run(f"explorer.open('#{preset}')")
    opened.run(FRAME)
    opened.run("explorer.read('orbit.csv', explorer.csv())")
    for path, factor in zip(free, [1.05, 0.7, 0.8, 0.7], strict=False):
        opened.run(f"explorer.change([['system.law.{path}', {factor} * ({value_of('explorer.state', path)})]])")
    opened.run(FRAME)
    for path in opened.run("explorer.fittable()"):
        if path not in free:
            opened.run(f"explorer.hold('{path}')")
    fitted(opened)
    for path in free:
        found, true = (
            opened.run(value_of(state, path))
            for state in ("explorer.state", f"explorer.data.presets['{preset}'].state")
        )
        assert found == pytest.approx(true, rel=slack), path
    assert opened.run("explorer.records[0].breaks.length > 5") == (preset == "stick-slip")
    if preset == "forced":
        assert "something about every number" in said_of_the_record(opened)
        return
    # Of what the motion never does it says nothing: here no climb begins at a turn of the slip.
    opened.run("document.querySelectorAll('#record-box input:not(:checked)').forEach((box) => box.click())")
    fitted(opened)
    said = said_of_the_record(opened)
    silent = re.search(r"says nothing about ([^:]*): hold them", said)[1].split(", ")
    assert {"D₁", "D₂"} <= set(silent)
    assert not {"B₂", "φ", "ψ"} & set(silent)
    assert "stickslip measure orbit.csv --rig RIG.toml" in said


@pytest.mark.slow
def test_a_measured_force_has_its_error_bars(opened):
    rows = [f"{0.1 * i},{0.02 * i},1.2,0.3" for i in range(40)]
    drop(opened, "bars.csv", "\n".join(["t,w,f,force_error", *rows]))
    opened.wait("explorer.records.length === 1")
    opened.run(FRAME)
    assert opened.run("explorer.records[0].error") == [0.3] * 40
    with_bars = drawn(opened, "law")
    opened.run("explorer.measure([{ ...explorer.records[0], error: null }])")
    opened.run(FRAME)
    assert with_bars > drawn(opened, "law") + 1000


def said_of_the_record(browser):
    browser.run(FRAME)
    return browser.run("document.querySelector('#record-box p').textContent")


def value_of(state, path):
    return f"'{path}'.split('.').reduce((at, key) => at[key], {state}.system.law)"


STATE = '<script type="application/json" id="state">'


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        ("a,b\n1,2", "expected a column named t or time, got a, b"),
        ("t,w,force\n0,1,2\n1,x,2", "row 3, column w: expected a number, got “x”"),
        ("t,w,force\n0,1,2", "expected at least 10 rows, got 1"),
        ('{"t": [1', "expected a record as JSON"),
        ("\ufffdHDF\r\n", "run stickslip explore run.csv, which reads more of them"),
        ("t,w,force\n" + "0,1,2\n1,1,2\n0.5,1,2\n" * 5, "row 4: expected times that increase, got 0.5 after 1"),
        ("<!doctype html><p>", "expected a page that Save page or stickslip explore wrote"),
        (f"<!doctype html>{STATE}{{&quot;</script>", "got one whose state is broken"),
        (f'<!doctype html>{STATE}{{"system": {{}}}}</script>', "got one whose system has no mass, stiffness, damping"),
    ],
)
def test_a_file_that_is_no_record_is_refused_with_a_sentence(opened, text, sentence):
    opened.run(f"explorer.read('run.csv', {json.dumps(text)})")
    said = opened.run("document.getElementById('facts').textContent")
    assert said.startswith("run.csv")
    assert sentence in said
    # The page is as it was.
    opened.run("explorer.change([])")
    opened.run(FRAME)
    assert opened.run("document.getElementById('facts').textContent").startswith("Stick-slip")


def test_the_csv_file_of_a_row_of_masses_is_read_as_that_of_the_first(opened):
    opened.run("explorer.open('#chain')")
    opened.run(FRAME)
    drop(opened, "row.csv", opened.run("explorer.csv()"))
    opened.wait("explorer.records.length === 1")
    assert opened.run("explorer.records[0].breaks.length") > 5
    assert opened.run("explorer.records[0].x") == pytest.approx(opened.run("Array.from(explorer.orbit.x[0])"))


def drop(browser, name, content):
    """Let a file fall on the page."""
    data = b64encode(content if isinstance(content, bytes) else content.encode()).decode()
    browser.run(
        f"""(() => {{ const files = new DataTransfer();
        const bytes = Uint8Array.from(atob('{data}'), (letter) => letter.charCodeAt(0));
        files.items.add(new File([bytes], {json.dumps(name)}));
        dispatchEvent(new DragEvent('drop', {{ dataTransfer: files, cancelable: true }})); }})()"""
    )


@pytest.mark.slow
def test_a_saved_page_that_is_dropped_brings_its_motion_and_its_records(opened, address):
    opened.run("explorer.read('orbit.csv', explorer.csv())")
    opened.run("explorer.change([['system.drive_velocity', 0.22]])")
    said, saved = facts(opened), opened.run("explorer.savedPage()")
    opened.open(address)
    drop(opened, "saved.html", saved)
    opened.wait("explorer.records.length === 1")
    assert facts(opened) == said


@pytest.mark.slow
@pytest.mark.parametrize("drift", [0.0, 0.5])
def test_a_friction_file_that_is_dropped_is_the_record_that_the_command_puts_in(opened, tmp_path, drift):
    examples = Path(ss.__file__).parent / "examples"
    friction = tmp_path / "friction.nc"
    ss.measure(examples / "block.csv", examples / "block.toml").to_netcdf(friction)
    if drift:
        with xr.open_datatree(friction) as tree:
            tree = tree.load()
        tree["force"] = tree["force"] + drift * (tree["time"] - 2.0)
        tree["break_away/force"] = tree["break_away/force"] + drift * (tree["break_away/t"] - 2.0)
        friction = tmp_path / "drifting.nc"
        tree.to_netcdf(friction, engine="h5netcdf")
    (put,) = content_of(friction)["records"]
    opened.run("explorer.change([['system.stiffness', 600], ['system.drive_velocity', 0.07]])")
    opened.run(FRAME)
    drop(opened, friction.name, friction.read_bytes())
    opened.wait("explorer.records.length === 1")
    (found,) = opened.run("explorer.records")
    assert found["drive"] == pytest.approx(put["drive"])
    assert found["file"] == friction.name
    np.testing.assert_allclose(found["breaks"], put["breaks"], rtol=1e-3)
    assert np.ptp([force for _, _, force in found["breaks"]]) < 0.1  # what drifts is taken off
    # Both keep every sample of a slip; the command smooths w where it turns.
    here, there = (dict(zip(np.round(one["t"], 6), one["force"], strict=True)) for one in (found, put))
    both = here.keys() & there.keys()
    assert len(both) > 0.9 * len(there)
    np.testing.assert_allclose([here[t] for t in both], [there[t] for t in both], rtol=1e-4)
    np.testing.assert_allclose(np.ptp(found["x"]), np.ptp(put["x"]), rtol=1e-3)


@pytest.mark.slow
def test_an_orbit_that_is_dropped_lies_on_the_motion_of_its_system(opened, tmp_path):
    (tmp_path / "system.toml").write_text(opened.run("explorer.toml()"))
    orbit = tmp_path / "orbit.nc"
    system, settings = load_system_document(tmp_path / "system.toml")
    ss.simulate(system, **settings).save(orbit)
    drop(opened, "orbit.nc", orbit.read_bytes())
    opened.wait("explorer.records.length === 1")
    assert opened.run("explorer.records[0].breaks.length > 5")
    assert float(re.search(r"rms\): (\S+) while", said_of_the_record(opened))[1].replace("−", "-")) < 1e-3


def test_a_packed_netcdf_file_is_refused_with_the_command_that_reads_it(opened, tmp_path):
    xr.Dataset({"time": ("t", np.arange(50.0))}).to_netcdf(
        tmp_path / "a.nc", engine="h5netcdf", encoding={"time": {"zlib": True}}
    )
    drop(opened, "a.nc", (tmp_path / "a.nc").read_bytes())
    opened.wait("document.getElementById('facts').textContent.startsWith('a.nc')")
    assert "run stickslip explore a.nc" in opened.run("document.getElementById('facts').textContent")


@pytest.mark.slow
def test_several_records_are_fitted_together(opened):
    for preset, name in (("stick-slip", "slow.csv"), ("almost-harmonic", "fast.csv")):
        opened.run(f"explorer.open('#{preset}')")
        opened.run(FRAME)
        drop(opened, name, opened.run("explorer.csv()"))
        opened.wait(f"explorer.records.some((one) => one.name === '{name}')")
    # The slow record says nothing about D, the fast one nothing about static friction: together they say both.
    changes = {"D.1": 2.3, "static_friction.limit": 0.3}
    for path, value in changes.items():
        opened.run(f"explorer.change([['system.law.{path}', {value}]])")
    for path in opened.run("explorer.fittable()"):
        if path not in changes:
            opened.run(f"explorer.hold('{path}')")
    fitted(opened)
    for path in changes:
        true = opened.run(value_of("explorer.data.presets['stick-slip'].state", path))
        assert opened.run(value_of("explorer.state", path)) == pytest.approx(true, rel=1e-4), path
    assert "These records say something about every number" in said_of_the_record(opened)
    assert "stickslip identify slow.nc fast.nc --law BogaczRyczek" in said_of_the_record(opened)
    opened.run("document.querySelector('#record-box button[aria-label=\"Remove slow.csv\"]').click()")
    opened.run(FRAME)
    assert opened.run("explorer.records.map(({ name }) => name)") == ["fast.csv"]


def fitted_by_hand(browser, keys):
    """Rings moved by the arrow keys, one after another, as long as the misfit that the page shows falls."""

    def misfit():
        browser.run(FRAME)
        said = browser.run("document.querySelector('#record-box p').textContent")
        return sum(float(number.replace("−", "-")) for number in re.findall(r"([0-9.e−]+) (?:while|at)", said))

    for key in [*keys, *keys]:
        browser.run(f"document.querySelector('.handle[data-key=\"{key}\"]').focus()")
        for there, back in (("ArrowUp", "ArrowDown"), ("ArrowDown", "ArrowUp")):
            least = misfit()
            for _ in range(200):
                browser.key(there)
                if (now := misfit()) >= least:
                    browser.key(back)
                    break
                least = now


@pytest.mark.slow
@pytest.mark.parametrize("law", ["StaticKinetic", "DwellTime", "LogarithmicDwell"])
def test_the_fit_of_a_real_record_lies_within_the_intervals_of_identify(opened, shared_data, tmp_path, law):
    rig = RIGS / "paper_slider_k168_v42.toml"
    friction = tmp_path / "friction.nc"
    ss.measure(shared_data / "paper_stickslip" / "k168Nm_v42.mat", rig).to_netcdf(friction)
    drop(opened, "page.html", page(**content_of(friction)))
    opened.wait("explorer.records.length === 1")
    known = ss.identify(friction, law=law).parameters
    if law == "StaticKinetic":
        # By hand, from numbers a tenth off.
        opened.run("explorer.change([['system.law', { type: 'StaticKinetic', break_away: 0.11, kinetic: 0.08 }]])")
        opened.run(FRAME)
        fitted_by_hand(opened, ["kinetic", "break_away"])
        found = opened.run("explorer.state.system.law")
        for name, row in known.iterrows():
            assert row["low"] < found[name] < row["high"], name
    opened.run(f"explorer.change([['system.law', explorer.data.laws['{law}'].example]])")
    opened.run(FRAME)
    found = fitted(opened)
    for name, row in known.iterrows():
        assert row["low"] < found[name] < row["high"], name


@pytest.mark.slow
def test_the_page_lives_within_another_and_asks_the_network_for_nothing(opened, tmp_path):
    text = page().replace("&", "&amp;").replace('"', "&quot;")
    (tmp_path / "outer.html").write_text(
        f'<body data-ready="yes"><iframe width=900 height=700 srcdoc="{text}"></iframe>'
    )
    opened.open((tmp_path / "outer.html").as_uri())
    opened.wait("frames[0]?.document.body?.dataset.ready === 'yes'")
    assert (
        opened.run(
            "frames[0].performance.getEntriesByType('resource').filter(({ name }) => !name.startsWith('blob:')).length"
        )
        == 0
    )


def test_a_page_that_may_not_start_its_core_says_so(browser, tmp_path):
    (tmp_path / "strict.html").write_text(page().replace("'wasm-unsafe-eval'", ""), encoding="utf-8")
    browser.send("Page.navigate", url=(tmp_path / "strict.html").as_uri())
    browser.wait("document.getElementById('facts')?.textContent")
    assert facts(browser).startswith("This browser does not start the page, which needs WebAssembly: ")


@pytest.mark.slow
def test_a_panel_is_taken_away_alone_as_a_picture_and_as_a_film(opened, tmp_path):
    opened.run(FRAME)
    opened.send("Browser.setDownloadBehavior", behavior="allow", downloadPath=str(tmp_path))
    sizes = []
    for way, file in (("PNG ×1", "phase-plane.png"), ("PNG ×3", "phase-plane.png"), ("GIF of a period", "the-rig.gif")):
        panel = "phase" if way.startswith("PNG") else "rig"
        opened.run(
            f"""(() => {{ const take = document.getElementById('{panel}').closest('figure').querySelector('.take');
            take.value = '{way}'; take.dispatchEvent(new Event('change')); }})()"""
        )
        for _ in range(600):
            opened.run("new Promise((done) => setTimeout(done, 50))")
            if (tmp_path / file).exists():
                break
        with Image.open(tmp_path / file) as image:
            sizes.append(image.size)
            if file.endswith("gif"):
                assert image.n_frames == 40
                first = np.asarray(image.convert("RGB"))
                image.seek(20)
                assert (np.asarray(image.convert("RGB")) != first).any()
        (tmp_path / file).unlink()
    assert sizes[1] == pytest.approx([3 * size for size in sizes[0]], abs=3)


@pytest.mark.slow
def test_files_are_taken_away(opened, tmp_path):
    shutil.rmtree(tmp_path / "down", ignore_errors=True)
    opened.run(FRAME)
    opened.send("Browser.setDownloadBehavior", behavior="allow", downloadPath=str(tmp_path / "down"))
    for name, file in (
        ("toml", "system.toml"),
        ("csv", "orbit.csv"),
        ("png", "stickslip.png"),
        ("save", "explorer.html"),
    ):
        opened.run(f"document.getElementById('{name}').click()")
        for _ in range(600):
            opened.run("new Promise((done) => setTimeout(done, 50))")
            if (tmp_path / "down" / file).exists():
                break
        assert (tmp_path / "down" / file).stat().st_size > 100, file
    header, first = (tmp_path / "down" / "orbit.csv").read_text().splitlines()[:2]
    assert header == "t,x,v,slip_velocity,force,branch"
    assert len(re.split(",", first)) == 6


@pytest.mark.slow
def test_a_picture_of_the_documentation_comes_alive_on_the_site_and_is_still_elsewhere(browser, tmp_path):
    from sphinx.application import Sphinx

    text = '# One\n\n![A loop](loop.svg "live: #almost-harmonic&system.drive_velocity=0.31 law,phase")\n'
    (tmp_path / "index.md").write_text(text, encoding="utf-8")
    (tmp_path / "loop.svg").write_text('<svg xmlns="http://www.w3.org/2000/svg" width="9" height="9"/>')
    docs = Path(__file__).parents[1] / "docs" / "extensions"
    (tmp_path / "conf.py").write_text(
        f"import sys\nsys.path.insert(0, {str(docs)!r})\nextensions = ['myst_parser', 'live']\n"
    )
    Sphinx(tmp_path, tmp_path, tmp_path / "out", tmp_path / "trees", "html", status=None).build()
    written = (tmp_path / "out" / "index.html").read_text(encoding="utf-8")
    assert re.search(r'<stick-slip address="[^"]*" panels="law,phase"><img [^>]*></stick-slip>', written)
    browser.problems.clear()
    browser.send("Page.navigate", url=(tmp_path / "out" / "index.html").as_uri())
    browser.wait("document.querySelector('stick-slip')?.dataset.ready === 'yes'")
    browser.run(FRAME)
    assert browser.run("document.querySelector('stick-slip .facts').textContent").startswith("Almost-harmonic")
    assert browser.run("document.querySelector('stick-slip').state.system.drive_velocity") == 0.31
    assert browser.problems == []
