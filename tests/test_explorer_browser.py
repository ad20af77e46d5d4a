"""The page in a headless browser, from a file, under its own strict policy: what is moved by hand and seen."""

import json
import re

import numpy as np
import pytest
from explorer_page import FRAME, drawn, facts, settled, swept

import stickslip as ss
from stickslip.explorer import content_of
from stickslip.model.system_file import load_system_document


def button(words):
    """The expression of a button of the lesson."""
    return f"[...document.querySelectorAll('#lesson button')].find((one) => one.textContent === '{words}')"


def place(browser, key):
    return browser.run(
        f"""(() => {{ const box = document.querySelector('.handle[data-key="{key}"]').getBoundingClientRect();
        return [box.x + box.width / 2, box.y + box.height / 2]; }})()"""
    )


def key(browser, panel):
    """The colours that are named below a panel."""
    row = f"document.getElementById('{panel}').closest('figure').querySelector('div.key')"
    return browser.run(f"[...({row}?.children ?? [])].map((one) => one.textContent)")


def test_the_page_says_the_steady_motion_draws_every_panel_and_names_its_colours(fresh):
    assert facts(fresh).startswith("Stick-slip, period 10.594341, amplitude 0.65503, sticks for 5.9246")
    swept(fresh)
    fresh.run(FRAME)
    for panel in ("law", "phase", "displacement", "diagram", "spectrum", "surface"):
        assert drawn(fresh, panel) > 2000, panel
    assert key(fresh, "diagram") == ["stick-slip", "almost-harmonic", "stable slip"]


@pytest.mark.slow
def test_panels_below_are_computed_when_they_are_seen_and_name_their_colours(fresh):
    fresh.run(FRAME)
    assert not any(fresh.run(f"explorer.cells('{panel}')") for panel in ("regimes", "basin"))
    fresh.run("document.getElementById('regimes').scrollIntoView({ block: 'center' })")
    fresh.wait("explorer.idle && explorer.cells('regimes') && explorer.cells('basin')")
    fresh.run(FRAME)
    for panel in ("regimes", "basin"):
        assert fresh.run(f"explorer.cells('{panel}')") == 40**2
        assert drawn(fresh, panel) > 20_000, panel
    assert key(fresh, "basin") == ["stick-slip", "stable slip", "paler: others of its kind"]
    assert "almost-harmonic" in key(fresh, "regimes")
    box = fresh.run("document.getElementById('regimes').getBoundingClientRect().toJSON()")
    x, y = box["x"] + 0.5 * box["width"], box["y"] + 0.5 * box["height"]
    fresh.drag((x, y), (x, y))
    fresh.run(FRAME)
    assert fresh.run("explorer.state.system.damping") == pytest.approx(0.5, abs=0.1)
    assert fresh.run("explorer.state.system.drive_velocity") == pytest.approx(0.3, abs=0.1)
    # Nothing but the place in it changed: the map stands.
    assert fresh.run("explorer.cells('regimes')") == 40**2


def test_a_slider_moves_every_panel_and_costs_few_questions(opened):
    opened.run(FRAME)
    opened.run("window.before = explorer.core.calls")
    opened.run(
        """(() => { const slider = document.querySelector('input[aria-label="drive velocity s"]');
        slider.value = 250; slider.dispatchEvent(new Event('input')); })()"""
    )
    assert facts(opened).startswith("Almost-harmonic")
    assert opened.run("explorer.state.system.drive_velocity") == 0.3
    # Orbit, steady motion, law, break-away, spectrum, surface.
    assert opened.run("explorer.core.calls - before") <= 6


def test_what_stands_still_is_not_drawn_and_what_is_swept_not_swept_again(opened):
    swept(opened)
    opened.wait("explorer.idle")
    opened.run(FRAME)
    opened.run(
        """(() => { window.moments = 0; for (const panel of explorer.panels) panel.time = (...all) => {
        window.moments++; Object.getPrototypeOf(panel).time.apply(panel, all); }; })()"""
    )
    opened.run(FRAME)
    assert opened.run("window.moments") == 0
    opened.run("explorer.seek(3)")
    opened.run(FRAME)
    drawn_once = opened.run("window.moments")
    assert 0 < drawn_once <= opened.run("explorer.panels.length")
    opened.run(FRAME)
    assert opened.run("window.moments") == drawn_once
    opened.run("explorer.panels.forEach((panel) => delete panel.time)")
    for link, kept in (("#stick-slip", True), ("#almost-harmonic", False)):
        opened.run(f"window.columns = explorer.diagram.up, explorer.open('{link}')")
        opened.run(FRAME)
        assert opened.run("explorer.diagram.up === window.columns") is kept, link


def test_a_handle_follows_the_hand_and_the_arrow_keys(opened):
    opened.run(FRAME)
    x, y = place(opened, "D")
    before = opened.run("explorer.state.system.law.D")
    opened.drag((x, y), (x + 20, y + 30))
    opened.run(FRAME)
    after = opened.run("explorer.state.system.law.D")
    assert after[0] > before[0]
    assert after[1] < before[1]
    opened.run("document.querySelector('.handle[data-key=\"D\"]').focus()")
    opened.key("ArrowLeft")
    opened.run(FRAME)
    assert opened.run("explorer.state.system.law.D")[0] == pytest.approx(after[0] - 0.01)
    # Two keys before the next picture: neither is lost.
    opened.run(
        """(() => { const ring = document.querySelector('.handle[data-key="D"]');
        for (const key of ['ArrowUp', 'ArrowRight']) ring.dispatchEvent(new KeyboardEvent('keydown', { key })); })()"""
    )
    assert opened.run("explorer.state.system.law.D") == pytest.approx([after[0], after[1] + 0.01])


@pytest.mark.slow
@pytest.mark.parametrize("laws", [("TwoBranch", "ExponentialStribeck", "LuGre"), pytest.param((), id="all")])
def test_every_law_has_rings_and_each_moves_what_it_is_of(opened, laws):
    for law in laws or opened.run("Object.keys(explorer.data.laws)"):
        opened.run(f"explorer.change([['system.law', explorer.data.laws['{law}'].example]])")
        opened.run(FRAME)
        keys = opened.run("[...document.querySelectorAll('.handle:not([hidden])')].map((one) => one.dataset.key)")
        assert keys, law
        for key in keys:
            before = opened.run("JSON.stringify(explorer.state.system.law)")
            opened.run(f"document.querySelector('.handle[data-key=\"{key}\"]').focus()")
            for arrow in ("ArrowUp", "ArrowRight"):
                opened.key(arrow)
            opened.run(FRAME)
            assert opened.run("JSON.stringify(explorer.state.system.law)") != before, (law, key)
            # The next one is moved from the law as it was.
            opened.run(f"explorer.change([['system.law', {before}]])")


@pytest.mark.slow
def test_friction_of_rock_takes_a_second_state_and_another_evolution(opened):
    def field(words):
        label = f"find((one) => one.textContent.startsWith('{words}'))"
        return f"[...document.querySelectorAll('label.line')].{label}.querySelector('input, select')"

    def law():
        opened.run(FRAME)
        found = opened.run("explorer.state.system.law")
        return tuple(found[name] for name in ("law", "second_b", "second_length", "cutoff_velocity"))

    def sliders():
        return opened.run("[...document.querySelectorAll('.number i')].map((one) => one.textContent)")

    opened.run("explorer.change([['system.law', explorer.data.laws.RateState.example], ['system.law.b', 0.012]])")
    opened.run(FRAME)
    opened.run(f"{field('second state')}.click()")
    assert law() == ("aging", 0.006, 0.1, None)
    assert {"b₂", "L₂"} <= set(sliders())
    for word, cutoff in (("composite", 1), ("slip", None)):
        opened.run(f"{field('evolution')}.value = '{word}', {field('evolution')}.dispatchEvent(new Event('change'))")
        assert law() == (word, 0.006, 0.1, cutoff)
        assert ("V_c" in sliders()) == (cutoff is not None)
        # The package takes what the page made of it.
        assert ss.laws.RateState.from_dict(
            {key: value for key, value in opened.run("explorer.state.system.law").items() if value is not None}
        )
    opened.run(f"{field('second state')}.click()")
    assert law() == ("slip", None, None, None)


@pytest.mark.slow
def test_pencils_go_to_infinity_and_come_back(opened):
    for name, angle in (("A", "phi"), ("C", "psi"), ("D", "eta")):
        for there in (True, False):
            label = f"find((one) => one.textContent === 'pencil {name} at infinity')"
            box = f"[...document.querySelectorAll('label.line')].{label}.firstChild"
            opened.run(FRAME)
            if opened.run(f"{box}.checked") != there:
                opened.run(f"{box}.click()")
            opened.run(FRAME)
            keys = opened.run("[...document.querySelectorAll('.handle')].map((one) => one.dataset.key)")
            assert (name in keys, angle in keys) == (not there, there)
            assert "events" in facts(opened)


@pytest.mark.slow
def test_a_link_gives_the_same_page_and_names_what_it_does_not_know(opened, address):
    opened.run("explorer.change([['system.law.B', [-0.5, 1.3]], ['system.damping', 0.31], ['t_end', 120]])")
    said, link = facts(opened), opened.run("explorer.link()")
    assert link.startswith("#stick-slip&")
    opened.open(address + link)
    assert facts(opened) == said
    opened.open(address + "#stick-slip&system.dumping=0.3")
    assert "names nothing here" in facts(opened)


@pytest.mark.slow
def test_a_refused_number_is_said_in_the_words_of_the_core(opened):
    opened.run("explorer.change([['system.mass', -1]])")
    assert facts(opened) == "mass must be greater than 0, got -1"
    opened.run("explorer.change([['system.mass', 1]])")
    assert facts(opened).startswith("Stick-slip")


@pytest.mark.slow
def test_a_motion_that_carries_on_keeps_to_its_kind(opened):
    opened.run("explorer.open('#stick-slip&start.x0=[1.2]&start.v0=[0]')")
    assert facts(opened).startswith("Stable slip")
    opened.run("document.getElementById('carry').click()")
    opened.run("explorer.change([['system.drive_velocity', 0.19]])")
    assert facts(opened).startswith("Stable slip")
    opened.run("document.getElementById('anew').click()")
    assert facts(opened).startswith("Stick-slip")


@pytest.mark.slow
def test_what_friction_remembers_is_carried_on_and_kept_by_the_link(opened, address):
    # Nothing sticks: what is remembered is a branch and a corner.
    opened.run("explorer.open('#almost-harmonic&t_end=100')")
    facts(opened)
    opened.run("document.getElementById('carry').click()")
    last = opened.run("[explorer.orbit.w[0].at(-1), explorer.orbit.force[0].at(-1)]")
    assert last[0] != 0
    opened.run("explorer.change([['system.drive_velocity', 0.31]])")
    said = facts(opened)
    assert "carried on, with the memory of friction" in said
    assert opened.run("[explorer.orbit.w[0][0], explorer.orbit.force[0][0]]") == pytest.approx(last, rel=1e-9)
    assert opened.run("explorer.toml()").startswith("# Carried on from another motion")
    opened.run("document.getElementById('carry').click()")
    opened.open(address + opened.run("explorer.link()"))
    opened.run("explorer.play(false)")
    assert facts(opened) == said
    # Under another law there is nothing to remember.
    opened.run("document.getElementById('carry').click()")
    opened.run("explorer.change([['system.law.B', [-0.42, 1.33]]])")
    assert "memory" not in facts(opened)


@pytest.mark.slow
def test_a_law_with_an_internal_state_moves_and_says_how(opened):
    opened.run("explorer.change([['system.law', explorer.data.laws.LuGre.example]])")
    assert "Integrated to 10⁻⁶ a step, without events: the law has an internal state" in facts(opened)
    opened.wait("document.getElementById('facts').textContent.includes('period')")
    assert re.match(r"Stick-slip, period 7[.]\d+, amplitude 0[.]\d+", facts(opened))
    for panel in ("law", "phase", "displacement", "spectrum"):
        assert drawn(opened, panel) > 2000, panel
    opened.wait("explorer.swept[1] > 20")
    opened.run("explorer.change([['system.law.stiffness', 1e8]])")
    assert re.search(
        r"stopped at t = 0[.]\d+ after 12000 steps .* too stiff for this page; run the system by", facts(opened)
    )
    # Friction of rock creeps from rest into steady slip.
    opened.run("explorer.change([['system.law', explorer.data.laws.RateState.example]])")
    assert facts(opened).startswith("Stable slip")


@pytest.mark.slow
def test_the_starts_of_the_basins_remember_nothing(opened):
    """A motion that was carried on has a memory; the starts around it are others."""
    facts(opened)
    opened.run("document.getElementById('carry').click()")
    opened.run("explorer.change([['system.drive_velocity', 0.201]])")
    assert "memory" in facts(opened)
    opened.run("document.getElementById('basin').scrollIntoView({ block: 'center' })")
    opened.wait("explorer.idle && explorer.cells('basin') === 1600")
    kinds = opened.run(
        "[...new Set(explorer.panels.find((one) => one.plot.host.id === 'basin').cells.map((one) => one.regime))]"
    )
    assert sorted(kinds) == [0, 2]


@pytest.mark.slow
def test_every_step_of_every_lesson_sets_a_state_and_names_what_is_there(opened):
    lessons = opened.run("explorer.lessons.all")
    assert len(lessons) == 7
    opened.run("new Promise((done) => setTimeout(done, 50))")
    for i, lesson in enumerate(lessons):
        assert lesson["title"]
        for j, step in enumerate(lesson["steps"]):
            opened.run(f"explorer.lessons.show({i}, {j})")
            said = facts(opened)
            where = f"{lesson['title']}: {step['heading']}: {said}"
            assert "event" in said, where
            assert "names" not in said, where
            assert step["paragraphs"][0], where
            for panel in step["look"]:
                assert opened.run(f"document.getElementById('{panel}') !== null"), f"{where}: {panel}"
            marked = opened.run("[...document.querySelectorAll('.look > .plot')].map(({ id }) => id).sort()")
            assert marked == sorted(panel for panel in step["look"] if panel != "record-box"), where
            # What is to be looked at is in sight, from its title on.
            tops = opened.run(
                "[...document.querySelectorAll('figure.look')].map((one) => one.getBoundingClientRect().top)"
            )
            floor = opened.run("document.getElementById('panels').getBoundingClientRect().top")
            assert all(floor - 1 <= top <= 800 for top in tops), where
            values = opened.run("[...document.querySelectorAll('#lesson input[type=number]')].map((one) => one.value)")
            assert len(values) == len(step["moves"]), where
            assert all(np.isfinite(float(value)) for value in values), where
            assert opened.run(f"{button('Back')}.disabled") == (j == 0), where


@pytest.mark.slow
def test_what_the_lessons_say_is_so(opened):
    def said(link):
        opened.run(f"explorer.open('{link}')")
        return facts(opened)

    amplitude = re.compile(r"amplitude ([0-9]+[.][0-9]+)")
    wide, usual = (
        float(amplitude.search(said(link))[1])
        for link in ("#almost-harmonic&system.law.D=[0.33,3]", "#almost-harmonic")
    )
    assert wide > usual
    assert said("#almost-harmonic&system.law.D=[0.33,1.9]").startswith("Stable slip")
    assert said("#stick-slip&system.law.D=[0.33,3]") == said("#stick-slip")
    assert "repeats after 2 forcing periods" in said("#forced&system.forcing.0.amplitude=0.005")
    assert "repeats after 4 forcing periods" in said("#forced&system.forcing.0.amplitude=0.015")
    said("#forced")
    assert ": chaotic" in settled(opened)
    assert said("#stick-slip&start.x0=[1.2]&start.v0=[0]").startswith("Stable slip")
    assert said("#stable-slip").startswith("Stable slip")


@pytest.mark.slow
def test_the_questions_of_the_lessons_are_answered_on_the_page(opened):
    # A slider of the lesson moves the state.
    opened.run("explorer.lessons.show(5, 2)")
    assert facts(opened).startswith("Stable slip at x = 1.4")
    for push, says in ((0.3, "Stick-slip"), (-0.12, "Stable slip"), (-0.36, "Stick-slip")):
        opened.run(
            f"""(() => {{ const range = document.querySelector('#lesson input[type=range]');
            range.value = {round((push + 0.6) / 1.2 * 500)}; range.dispatchEvent(new Event('input')); }})()"""
        )
        said = facts(opened)
        assert said.startswith(says), push
        assert f"ẋ₀ = {push}".replace("-", "−") in said
    # A click into the phase plane that is highlighted, and a motion said without digits of rounding.
    opened.run("explorer.lessons.show(3, 2)")
    opened.run(FRAME)
    x, y = opened.run(
        """(() => { const { plot } = explorer.panels.find(({ plot }) => plot.host.id === 'phase');
        const box = plot.host.getBoundingClientRect();
        return [box.x + plot.px(1.2), box.y + plot.py(0)]; })()"""
    )
    opened.drag((x, y), (x, y))
    said = facts(opened)
    assert re.match(r"Stable slip at x = 1[.]\d{4}; started at x₀ = 1[.]", said)
    assert "amplitude" not in said


@pytest.mark.slow
def test_the_orbit_diagram_says_where_the_sweeps_found_another_motion(opened):
    for link, another in (
        ("#forced&start.x0=[1.12]&start.v0=[0]", True),
        ("#forced", False),
        ("#stick-slip", False),
        ("#almost-harmonic", False),
    ):
        opened.run(f"explorer.open('{link}')")
        opened.run(FRAME)
        swept(opened)
        opened.run(FRAME)
        assert opened.run("explorer.diagram.another") is another, link


def test_a_long_table_is_folded_and_its_rings_take_their_neighbours_with_them(opened):
    nodes = [[w, 0.5 - 0.1 * w] for w in np.linspace(0, 2, 97)]
    law = {"type": "Tabulated", "kinetic": nodes, "break_away": 0.6}
    opened.run(f"explorer.change([['system.law', {json.dumps(law)}], ['t_end', 157.0796326794]])")
    opened.run(FRAME)
    assert opened.run("document.getElementById('time').value") == "157.08"
    assert opened.run("document.querySelectorAll('.handle').length") <= 10
    assert opened.run("document.querySelector('#numbers details').open") is False
    opened.run("document.querySelector('.handle[data-key=\"kinetic.48\"]').focus()")
    opened.key("ArrowUp")
    opened.run(FRAME)
    moved = np.array(opened.run("explorer.state.system.law.kinetic")) - nodes
    assert moved[48, 1] > 0
    assert moved[42, 1] == pytest.approx(moved[48, 1] / 2, rel=0.1)
    assert not moved[:37].any()
    assert not moved[60:].any()
    assert not moved[:, 0].any()


def test_a_name_is_not_given_twice(opened):
    opened.run(FRAME)
    labels = opened.run("[...document.querySelectorAll('.handle')].map((one) => one.getAttribute('aria-label'))")
    assert {label.partition(":")[0] for label in labels} >= {"pencil D", "line l, lower end", "line l, upper end"}
    # A pencil stands upright, the damping in italics.
    assert opened.run("[...document.querySelectorAll('#numbers b')].map((one) => one.textContent)") == ["B", "D"]
    names = opened.run("[...document.querySelectorAll('#numbers input')].map((one) => one.getAttribute('aria-label'))")
    assert len([name for name in names if name]) == len({name for name in names if name})


def test_a_lesson_on_a_phone_holds_what_is_moved_beside_the_words_that_answer(opened):
    opened.resize(360, 740, touch=True)
    opened.run("explorer.lessons.show(0, 3)")
    opened.run(FRAME)
    box = "(id) => document.querySelector(id).getBoundingClientRect().toJSON()"
    assert opened.run(f"({box})('header')")["height"] <= 64
    slider, said = (opened.run(f"({box})('{one}')") for one in ("#lesson input[type=range]", "#facts"))
    assert slider["height"] >= 44
    assert 0 <= slider["top"] < slider["bottom"] <= said["top"] < said["bottom"] <= 740
    assert opened.run("document.querySelector('figure.look').getBoundingClientRect().top") < 740
    # The words stay while one reads the panels, and nothing else lies over them.
    opened.run("scrollBy(0, 900)")
    assert opened.run(f"({box})('#facts')")["top"] == 0
    assert opened.run("getComputedStyle(document.querySelector('figure.rig')).position") == "static"
    small = opened.run(
        """[...document.querySelectorAll('button, select, input[type=range]')].filter((one) => {
        const { width, height } = one.getBoundingClientRect(); return width && Math.min(width, height) < 43.9;
        }).map((one) => one.outerHTML.slice(0, 80))"""
    )
    assert small == []


@pytest.mark.slow
def test_a_motion_that_does_not_repeat_has_its_exponent(opened):
    # From rest and from another start: both signs of chaos. The exponent of long runs is 0.447 a forcing period.
    for start in ("", "&start.x0=[0.5]&start.v0=[0]"):
        opened.run(f"explorer.open('#forced{start}')")
        assert "does not repeat" in facts(opened)
        test, value, error = re.search(
            r"does not repeat: chaotic [(]0–1 test K = ([\d.]+), Lyapunov exponent (0[.]\d+) ± (0[.]\d+) over 600 periods[)]",
            settled(opened),
        ).groups()
        assert float(test) > 0.9
        assert float(value) == pytest.approx(0.447 / (2 * np.pi / 1.4), abs=3 * float(error))
    # A motion that repeats has none, and none is computed.
    opened.run("explorer.open('#stick-slip')")
    assert "exponent" not in facts(opened)
    assert opened.run("explorer.idle")


@pytest.mark.slow
def test_a_motion_that_dies_out_slowly_is_said_to_end_in_stable_slip_however_long_it_runs(opened):
    for link in (
        "#passage",
        "#passage&t_end=150",
        "#passage&t_end=700",
        "#passage&t_end=3000",
        "#brake&system.damping=0.2375&system.drive_velocity=0.27",
        "#rock&system.drive_velocity=0.3&system.damping=0.01",
    ):
        opened.run(f"explorer.open('{link}')")
        said = settled(opened)
        assert re.match(r"Stable slip( after a long transient)? at x = [\d.]+[.;] ", said), (link, said)
        assert ("long" in said) == (link not in ("#passage", "#passage&t_end=3000")), said


@pytest.mark.slow
def test_cells_of_a_map_that_still_settle_are_not_said_not_to_repeat(opened):
    opened.run("explorer.open('#brake&map.across=[0.26,0.28]&map.up=[0.235,0.24]')")
    opened.run("document.getElementById('regimes').scrollIntoView({ block: 'center' })")
    opened.wait("explorer.idle && explorer.cells('regimes') === 1600")
    opened.run(FRAME)
    assert "greyer: still settling" in key(opened, "regimes")
    assert "darker: does not repeat" not in key(opened, "regimes")


@pytest.mark.slow
def test_a_normal_force_and_a_stop_are_moved_linked_and_exported(opened, address, tmp_path):
    opened.run("explorer.open('#wiper')")
    before = facts(opened)
    for box in ("pressed", "stopped"):
        opened.run(f"document.getElementById('{box}').click()")
        opened.run(FRAME)
    for name, value in (("with x nₓ", 0.25), ("cubic part κ₃", 0.5)):
        opened.run(
            f"""(() => {{ const field = document.querySelector('input[aria-label="{name}, as a number"]');
            field.value = {value}; field.dispatchEvent(new Event('change')); }})()"""
        )
    said, link = settled(opened), opened.run("explorer.link()")
    assert said != before
    (tmp_path / "system.toml").write_text(opened.run("explorer.toml()"), encoding="utf-8")
    system, settings = load_system_document(tmp_path / "system.toml")
    assert (system.normal_force.position, system.springs[0].cubic) == (0.25, 0.5)
    here = opened.run("explorer.orbit.events.map(({ t, x, v, force }) => [t, x, v, force])")
    assert here == ss.simulate(system, **settings).events[["t", "x", "v", "force"]].to_numpy().tolist()
    opened.open(address + link)
    assert settled(opened) == said
    (tmp_path / "again.toml").write_text(system.to_toml(), encoding="utf-8")
    state = content_of(tmp_path / "again.toml")["state"]["system"]
    assert (state["normal_force"]["position"], state["springs"][0]["cubic"]) == (0.25, 0.5)


@pytest.mark.slow
@pytest.mark.parametrize("width", [360, 768, 1440, 3840])
def test_nothing_is_wider_than_the_window(opened, width):
    opened.resize(width, 2160 if width > 2000 else 800, touch=width < 500)
    opened.run(FRAME)
    assert opened.run("document.documentElement.scrollWidth") <= width
    if width < 500:
        sizes = opened.run("[...document.querySelectorAll('.handle:not([hidden])')].map((one) => one.offsetWidth)")
        assert min(sizes) >= 44


@pytest.mark.slow
@pytest.mark.parametrize("theme", ["light", "dark"])
def test_words_stand_out_in_both_themes(opened, theme, address):
    opened.prefer(prefers_color_scheme=theme)
    opened.open(address)
    assert opened.run("document.documentElement.dataset.theme") == theme
    colours = opened.run(
        """(() => { const style = getComputedStyle(document.body);
        const names = ['paper', 'card', 'ink', 'soft', 'accent', 'bad'];
        return Object.fromEntries(names.map((name) => [name, style.getPropertyValue('--' + name).trim()])); })()"""
    )
    opened.prefer()

    def light(colour):
        parts = [int(colour[i : i + 2], 16) / 255 for i in (1, 3, 5)]
        red, green, blue = (part / 12.92 if part <= 0.04045 else ((part + 0.055) / 1.055) ** 2.4 for part in parts)
        return 0.2126 * red + 0.7152 * green + 0.0722 * blue

    for text in ("ink", "soft", "accent", "bad"):
        for ground in ("paper", "card"):
            low, high = sorted([light(colours[text]), light(colours[ground])])
            assert (high + 0.05) / (low + 0.05) >= 4.5, (text, ground)


@pytest.mark.slow
def test_who_wants_less_motion_gets_a_still_page(opened, address):
    opened.prefer(prefers_reduced_motion="reduce")
    opened.open(address)
    assert opened.run("explorer.playing") is False
    opened.prefer()


@pytest.mark.slow
def test_everything_has_a_name_for_who_cannot_see_it(opened):
    opened.run(FRAME)
    nameless = opened.run(
        """[...document.querySelectorAll('button, input, select, canvas.over')].filter((one) =>
        !(one.getAttribute('aria-label') || one.textContent.trim() || one.labels?.length)).map((one) => one.outerHTML)"""
    )
    assert nameless == []


@pytest.mark.slow
def test_the_motion_is_heard_when_asked_and_follows_a_change(opened):
    opened.run(FRAME)
    assert opened.run("explorer.sound.on") is False
    for on in (True, False):
        opened.run("document.getElementById('listen').click()")
        opened.run("explorer.change([['system.drive_velocity', 0.21]])")
        opened.run(FRAME)
        assert opened.run("explorer.sound.on") is on


@pytest.mark.slow
def test_a_worker_that_falls_silent_is_replaced_and_its_column_named(opened):
    swept(opened)
    # Nothing is heard of this worker after its first three messages.
    opened.run(
        """(() => { const { worker } = explorer.sweeps.sweepers[0]; const hear = worker.onmessage; let count = 0;
        worker.onmessage = (message) => count++ < 3 && hear(message); })()"""
    )
    opened.run("explorer.change([['system.damping', 0.3]])")
    opened.run(FRAME)
    swept(opened)
    lost = opened.run("explorer.diagram.lost")
    assert len(lost) == 1
    assert 0 < lost[0] < 299
    missing = opened.run("Array.from(explorer.diagram.up, (row, i) => row ? -1 : i).filter((i) => i >= 0)")
    assert missing == lost
    assert "refused" not in opened.run("document.body.className")


@pytest.mark.slow
def test_panels_can_be_put_away_and_a_link_keeps_them_and_the_moment(opened, address):
    opened.run("document.querySelector('#panel-boxes input[value=spectrum]').click()")
    opened.run("explorer.seek(33)")
    opened.run(FRAME)
    opened.open(address + opened.run("explorer.link()"))
    opened.run(FRAME)
    shown = opened.run("[...document.querySelectorAll('figure')].map((one) => !one.hidden)")
    assert shown.count(False) == 1
    assert opened.run("document.getElementById('spectrum').closest('figure').hidden")
    assert opened.run("[explorer.clock, explorer.playing]") == [33, False]


@pytest.mark.slow
@pytest.mark.parametrize("preset", ["drill", "rock", "bow", "stick-slip"])
def test_the_regime_map_holds_the_motion_and_its_axes_their_units(opened, preset):
    opened.run(f"explorer.open('#{preset}')")
    opened.run(FRAME)
    across, up = (opened.run(f"explorer.state.map.{side}") for side in ("across", "up"))
    speed, damping = (opened.run(f"explorer.state.system.{name}") for name in ("drive_velocity", "damping"))
    assert across[0] <= speed <= across[1]
    assert up[0] <= damping <= up[1]
    assert opened.run("explorer.link()") == f"#{preset}"
    if preset == "drill":
        assert re.search(r"period [\d.]+ s, amplitude [\d.]+ rad, .* breaks away at 6223 N m", facts(opened))


@pytest.mark.slow
@pytest.mark.parametrize("width", [720, 1440])
def test_rings_stand_on_their_points(opened, width):
    opened.resize(width, 900)
    opened.run(FRAME)
    opened.run(FRAME)
    x, y = place(opened, "B")
    there = opened.run(
        """(() => { const { plot } = explorer.panels.find(({ plot }) => plot.host.id === 'law');
        const box = plot.host.getBoundingClientRect(); const [w, f] = explorer.state.system.law.B;
        return [box.x + plot.px(w), box.y + plot.py(f)]; })()"""
    )
    assert [x, y] == pytest.approx(there, abs=1)


@pytest.mark.slow
@pytest.mark.parametrize("width", [1024, 1440])
def test_no_control_of_a_panel_is_cut_off(opened, width):
    opened.resize(width, 768)
    opened.run(FRAME)
    cut = opened.run(
        """[...document.querySelectorAll('figure .tools > *')].filter((one) => {
        const [box, frame] = [one, one.closest('figure')].map((element) => element.getBoundingClientRect());
        return box.left < frame.left || box.right > frame.right; }).map(({ id, className }) => id || className)"""
    )
    assert cut == []


@pytest.mark.slow
@pytest.mark.parametrize("preset", ["stick-slip", "wiper"])
def test_where_the_drive_goes_backwards_the_law_and_its_rings_are_turned(opened, preset):
    opened.run(f"explorer.open('#{preset}')")
    facts(opened)
    find = "explorer.panels.find(({ plot }) => plot.host.id === 'law')"
    rings = f"[...{find}.handles.values()].map(({{ key, w, f }}) => [key, w, f])"
    before = {key: (w, f) for key, w, f in opened.run(rings)}
    opened.run("explorer.change([['system.drive_velocity', -explorer.state.system.drive_velocity]])")
    assert facts(opened).startswith("Stick-slip")
    after = {key: (w, f) for key, w, f in opened.run(rings)}
    assert before.keys() == after.keys()
    for key, ring in before.items():
        assert after[key] == pytest.approx([-one for one in ring], rel=0.2, abs=0.05), key
    ring = {"stick-slip": "D", "wiper": "kinetic"}[preset]
    law = opened.run("JSON.stringify(explorer.state.system.law)")
    opened.run(f"document.querySelector('.handle[data-key=\"{ring}\"]').focus()")
    opened.key("ArrowUp")
    opened.key("ArrowUp")
    opened.run(FRAME)
    old, new = (one[ring] for one in (json.loads(law), opened.run("explorer.state.system.law")))
    assert (new[1] < old[1]) if ring == "D" else (new < old)


@pytest.mark.slow
def test_a_change_and_the_theme_are_there_after_a_reload(fresh):
    facts(fresh)
    assert fresh.run("location.hash") == ""
    fresh.run("explorer.open('#wiper'), explorer.change([['system.damping', 0.07]])")
    said = facts(fresh)
    dark = fresh.run("document.documentElement.dataset.theme === 'dark'")
    fresh.run("document.getElementById('theme').click()")
    fresh.wait("location.hash.includes('damping')")
    try:
        fresh.send("Page.reload")
        fresh.wait("performance.getEntriesByType('navigation')[0].type === 'reload' && document.body?.dataset.ready")
        assert facts(fresh) == said
        assert fresh.run("document.documentElement.dataset.theme === 'dark'") is not dark
    finally:
        fresh.run("delete localStorage['stickslip-theme']")


@pytest.mark.slow
def test_a_field_shows_the_number_that_holds(opened):
    for field, wrong in (("time", "-3"), ("low", "7"), ("high", "")):
        before = opened.run(f"document.getElementById('{field}').value")
        opened.run(
            f"""(() => {{ const field = document.getElementById('{field}'); field.focus(); field.value = '{wrong}';
            field.dispatchEvent(new Event('change')); }})()"""
        )
        opened.run(FRAME)
        assert opened.run(f"document.getElementById('{field}').value") == before, field


@pytest.mark.slow
def test_keys_play_and_step_from_where_the_focus_is(opened):
    opened.run("document.getElementById('csv').focus()")
    opened.key("n")
    assert opened.run("explorer.clock") > 0
    opened.run("document.querySelector('#phase canvas.over').focus()")
    opened.key(" ")
    assert opened.run("explorer.playing")
    opened.run("explorer.play(false)")
