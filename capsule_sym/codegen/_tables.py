"""The switching table as source text, from its derivation and from nowhere else."""

from __future__ import annotations

from capsule_sym._symbolic.model.formulas import impact_planes, places
from capsule_sym._symbolic.model.model import SEGMENTS
from capsule_sym._symbolic.model.switching import line_transitions, local_maps, surface_transitions
from capsule_sym.codegen._printers import Language


def transitions() -> dict[tuple[int, str], tuple[int, ...]]:
    """Target fields of each source field at each surface, line and corner point."""
    targets: dict[tuple[int, str], set[int]] = {}
    for surface in surface_transitions():
        targets.setdefault((surface.source, surface.surface), set()).add(surface.target)
    for line in line_transitions():
        targets.setdefault((line.source, line.line), set()).add(line.target)
    return {key: tuple(sorted(targets[key])) for key in sorted(targets, key=_place_order)}


def _place_order(key: tuple[int, str]) -> tuple[str, int, int]:
    source, place = key
    return {"S": "0", "L": "1", "O": "2"}[place[0]], int(place[1:]), source


def table_text(language: Language) -> str:
    """The tables in Python: targets by source and place, the local maps, places and fields."""
    if language.comment != "#":
        return ""
    rows = "".join(
        f'    ({source}, "{place}"): {targets},\n'
        for (source, place), targets in transitions().items()
    )
    maps = "".join(f'    ("{m.target}", {m.field}, "{m.source}"),\n' for m in local_maps())
    fields = "".join(f"    ({int(g.contact)}, {g.drift}): {g.index},\n" for g in SEGMENTS)
    pieces = "".join(f'    {signs}: "{name}",\n' for signs, name in places().items())
    return (
        f"TRANSITIONS = {{\n{rows}}}\n\nLOCAL_MAPS = frozenset((\n{maps}))\n\n"
        f"FIELDS = {{\n{fields}}}\n\nPLACES = {{\n{pieces}}}\n\n"
        f"IMPACT_PLANES = {impact_planes()}\n"
    )


_FLOWS = ((False, 0), (False, 1), (True, 0), (True, 1))  # contact, and whether the capsule drifts


def c_classification() -> str:
    """The same for C, as far as it is followed there: fields by mode, and planes of impact."""
    by_mode = {(int(g.contact), g.drift): g.index for g in SEGMENTS}
    rows = ", ".join(
        "{" + ", ".join(str(by_mode[contact, drift]) for drift in (-1, 0, 1)) + "}"
        for contact in (0, 1)
    )
    contacts = ", ".join(str(int(g.contact)) for g in SEGMENTS)
    drifts = ", ".join(str(g.drift) for g in SEGMENTS)
    flows = ", ".join(str(2 * int(g.contact) + abs(g.drift)) for g in SEGMENTS)
    ones = [next(g for g in SEGMENTS if (g.contact, abs(g.drift)) == mode) for mode in _FLOWS]
    planes = impact_planes()
    impacts = ", ".join(
        "{" + ", ".join(str(planes[v_c, v_r]) for v_r in (-1, 1)) + "}" for v_c in (-1, 1)
    )
    return (
        "/* Fields by contact and drift + 1; contact, drift and linear flow by field - 1; a field\n"
        "   of each flow; and the plane of an impact by whether v_c and v_r are positive. */\n"
        f"static const signed char FIELD_OF[2][3] = {{{rows}}};\n"
        f"static const signed char CONTACT_OF[CAPSULE_FIELD_COUNT] = {{{contacts}}};\n"
        f"static const signed char DRIFT_OF[CAPSULE_FIELD_COUNT] = {{{drifts}}};\n"
        f"static const signed char FLOW_OF[CAPSULE_FIELD_COUNT] = {{{flows}}};\n"
        f"static const signed char ONE_OF_FLOW[4] = {{{', '.join(str(g.index) for g in ones)}}};\n"
        f"static const signed char IMPACT_PLANE[2][2] = {{{impacts}}};\n"
    )
