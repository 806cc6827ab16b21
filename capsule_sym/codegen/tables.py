"""The switching table as source text, from its derivation and from nowhere else."""

from __future__ import annotations

from capsule_sym.codegen.printers import Language
from capsule_sym.symbolic.switching import line_transitions, local_maps, surface_transitions


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
    """The table in a target language: targets by source and place, and the local maps."""
    if language.comment == "#":
        rows = "".join(
            f'    ({source}, "{place}"): {targets},\n'
            for (source, place), targets in transitions().items()
        )
        maps = "".join(f'    ("{m.target}", {m.field}, "{m.source}"),\n' for m in local_maps())
        return f"TRANSITIONS = {{\n{rows}}}\n\nLOCAL_MAPS = frozenset((\n{maps}))\n"
    rows = "".join(
        f"    {{{source}, '{place[0]}', {place[1:]}, {sum(1 << t for t in targets)}}},\n"
        for (source, place), targets in transitions().items()
    )
    maps = "".join(f"    {{{m.target[1:]}, {m.field}, {m.source[1:]}}},\n" for m in local_maps())
    return (
        f"const capsule_transition capsule_transitions[] = {{\n{rows}}};\n"
        f"const int capsule_transition_count = {len(transitions())};\n\n"
        f"const signed char capsule_local_maps[][3] = {{\n{maps}}};\n"
        f"const int capsule_local_map_count = {len(local_maps())};\n"
    )
