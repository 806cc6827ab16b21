"""The exact orbit that a run has come to."""

from __future__ import annotations

from capsule_sym._errors import CapsuleError
from capsule_sym._orbits.shooting.orbit import NoOrbit, Orbit
from capsule_sym._orbits.shooting.search import find_orbit
from capsule_sym._parameters import Parameters
from capsule_sym._sweeps import words


class NotClosed(CapsuleError):
    """Newton's method closes no orbit of this word at the end of a run."""


def closed(
    parameters: Parameters, state: tuple[float, float, float], multiple: int, word: int
) -> Orbit:
    """The orbit of a word (its code) and period multiple at a state of phase 0.

    Raises NotClosed where Newton's method leads to none, or to one of another word.
    """
    orbit = find_orbit(parameters, state, 0.0, 2 * multiple + 1)
    if isinstance(orbit, NoOrbit):
        raise NotClosed(f"{orbit.reason}: {orbit.detail}")
    found = words.text(orbit.word.fields)
    if (orbit.word.multiple, words.code(found)) != (multiple, word):
        raise NotClosed(f"the orbit's word is {found}, its period multiple {orbit.word.multiple}")
    return orbit
