"""The kind of law that is asked for, by its name, its class, or a law as first guess."""

from __future__ import annotations

from stickslip.errors import InputError, did_you_mean
from stickslip.identification.guesses.first_guess import GUESSES
from stickslip.laws import Combined, Law


def kind_of(law: str | type[Law] | Law) -> type[Law]:
    """The class of the law; an InputError that names the known ones where there is none."""
    if isinstance(law, Law):
        return type(law)
    if isinstance(law, type) and issubclass(law, Law):
        return law
    if isinstance(law, str) and law in Law.ALL:
        return Law.ALL[law]
    if parts_of(law):
        return Combined
    hint = did_you_mean(str(law), Law.ALL)
    known = ", ".join(item.__name__ for item in GUESSES)
    raise InputError(f"identify: unknown law {law!r}{hint}; known are {known}")


def parts_of(law: str | type[Law] | Law) -> tuple[type[Law], ...]:
    """Kinds of the parts in ``"Combined:LogarithmicDwell"`` or ``"Combined:DwellTime:Lorentzian"``, else none."""
    if not isinstance(law, str) or not law.startswith(f"{Combined.__name__}:"):
        return ()
    names = law.split(":")[1:]
    for name in names:
        if name not in Law.ALL:
            raise InputError(f"identify: {law}: unknown law {name!r}{did_you_mean(name, Law.ALL)}")
    if len(names) > 2:
        raise InputError(
            f"identify: {law}: expected a static and a kinetic part after Combined, got {len(names)} parts"
        )
    return tuple(Law.ALL[name] for name in names)
