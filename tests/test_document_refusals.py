"""Documents of laws and systems with values of a wrong kind or shape: one sentence with the law, the key and what came."""

import copy
import re

import pytest

import stickslip as ss
from stickslip.cli.main import main
from stickslip.laws import Law
from stickslip.model.system import system_from_dict

WRONG = [
    *(3, -1, "x", None, True, float("nan"), float("inf"), 10**400, 1 + 2j, b"x"),
    *([], [[]], [None], [1, 2], [1, 2, 3], [[0, 1, 2]], [[0, 1], [1]], [[0, 1], [0.1, "a"]], {}, {"a": 1}),
]
#: Words of the reader of JSON, which knows neither laws nor what to do.
OF_SERDE = re.compile(
    r"invalid (type|length|value)|expected (f64|value)|at line|missing field|unknown (field|variant)|did not"
)
COULOMB = ss.laws.Coulomb(1.0)
DRIVE = ss.Drive(0.1, ss.Harmonic(1, 1), [(0, 1), (1, 2)])
SYSTEMS = [
    ss.Oscillator(0.1, DRIVE, COULOMB, forcing=[ss.Harmonic(1, 1), ss.Harmonic(1, 2)]),
    ss.System(
        [1, 1],
        [[2, -1], [-1, 2]],
        0.1,
        [ss.Contact(0, COULOMB, DRIVE), ss.Contact(1, COULOMB, other=0)],
        ss.Force(1, 1),
    ),
]


def places(document, path=()):
    """The path of everything in a document."""
    items = (
        document.items() if isinstance(document, dict) else enumerate(document) if isinstance(document, list) else ()
    )
    for key, value in items:
        yield (*path, key)
        yield from places(value, (*path, key))


def spoilt(document, path, value):
    """A copy with `value` at `path`."""
    place = whole = copy.deepcopy(document)
    for key in path[:-1]:
        place = place[key]
    place[path[-1]] = value
    return whole


def refusals(document, read):
    """The sentences with which wrong values everywhere in a document are refused; a few of them happen to fit and are not."""
    for path in places(document):
        for value in WRONG:
            try:
                read(spoilt(document, path, value))
            except ss.InputError as error:
                yield str(error)


@pytest.mark.parametrize("kind", Law.ALL.values(), ids=lambda kind: kind.__name__)
def test_a_law_says_in_its_own_words_what_is_wrong(kind):
    sentences = [*refusals(kind.example().to_dict(), Law.from_dict)]
    assert len(sentences) > 20
    assert not [sentence for sentence in sentences if OF_SERDE.search(sentence) or "\n" in sentence]


@pytest.mark.parametrize("system", SYSTEMS, ids=lambda system: type(system).__name__)
def test_a_system_says_in_its_own_words_what_is_wrong(system):
    sentences = [*refusals(system.to_dict(), system_from_dict)]
    assert len(sentences) > 200
    assert not [sentence for sentence in sentences if OF_SERDE.search(sentence) or "\n" in sentence]


@pytest.mark.parametrize(
    ("law", "sentence"),
    [
        ('type = "PiecewiseLinear"\nnodes = 3\nbreak_away = 1', "PiecewiseLinear: nodes must be a list of pairs .*, got 3"),
        (
            'type = "PiecewiseLinear"\nnodes = [[0, 1], [0.1, 0.6, 2]]\nbreak_away = 1',
            r"PiecewiseLinear: nodes\[1\] must be a pair of numbers .*, got \[0.1, 0.6, 2\]",
        ),
        ('type = "Coulomb"\nkinetic = [1, 2]', r"Coulomb: kinetic must be a number or a text such as .*, got \[1, 2\]"),
        (
            'type = "Tabulated"\nkinetic = "a"\nbreak_away = 1',
            "Tabulated: kinetic must be a number or a text such as .*, got 'a'",
        ),
        ('type = "TwoBranch"\nrising = [[0, "a"]]\nfalling = 1\nbreak_away = 1', r"rising\[0\]\[1\] must be a number"),
        ('type = "BogaczRyczek"\nB = [[1], 2]', r"BogaczRyczek: B\[0\] must be a number or a text such as .*, got \[1\]"),
        ('type = "BogaczRyczek"\nstatic_friction = 2', "static_friction must be a table with the keys of .*, got 2"),
        ('type = "RateState"\nnormal_force = 1\na = 1\nb = 1\nlength = 1\nreference_velocity = 1\nlaw = 2', "law must be"),
        ('type = "Regularised"\nlaw = 2\nwidth = 1', "Regularised: law must be a memoryless friction law .*, got 2"),
        ('type = "Coulomb"\nkinetic = nan', "Coulomb: kinetic must be a finite number, got nan"),
    ],
)  # fmt: skip
def test_a_file_is_refused_with_its_name_the_law_and_the_key(law, sentence, tmp_path, capsys):
    path = tmp_path / "system.toml"
    path.write_text(f"mass = 1.0\nstiffness = 1.0\ndamping = 0.1\ndrive_velocity = 0.2\n[law]\n{law}\n")
    assert main(["simulate", str(path), "-o", str(tmp_path / "orbit.nc")]) == 2
    printed = capsys.readouterr().err.strip()
    assert re.search(rf"{re.escape(str(path))}: law: .*{sentence}", printed)
    assert "\n" not in printed
    assert not (tmp_path / "orbit.nc").exists()
