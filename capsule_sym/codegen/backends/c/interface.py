"""Interface of the C library, in C."""

from __future__ import annotations

from capsule_sym._symbolic.model.symbols import MODEL, PARAMETERS, PULSED, PULSES, stop
from capsule_sym.codegen._blocks import OWN, flow_parameters
from capsule_sym.codegen._interface import Entry, Interface, flags, members


def texts(interface: Interface) -> dict[str, str]:
    """Counts, positions, lists and roles of parameters, enumerations and structs."""
    counts = {
        name: value if value.isdigit() else f"({interface.spelt(value)})"
        for name, value in interface.counts.items()
    }
    flow = flow_parameters()
    lists = {
        "PARAMETERS": PARAMETERS,
        "FLOW_PARAMETERS": [p for p in PARAMETERS if p in flow],
        "RUN_PARAMETERS": [p for p in PARAMETERS if p not in flow],
        "SEGMENT_CONSTANTS": (*PARAMETERS, *(["high"] if PULSED else []), "contact", "drift", *OWN),
        "POSITIVE_PARAMETERS": [p for p in PARAMETERS if p.is_positive],
        "NOT_NEGATIVE_PARAMETERS": [p for p in PARAMETERS if p.is_nonnegative],
        "SHARE_PARAMETERS": [PULSES.share] if PULSES else [],
    }
    roles = {"OWN_STOP": stop, "FRONT_GAP": MODEL.stops[0]}
    if len(MODEL.stops) == 2:
        roles["BACK_GAP"] = -MODEL.stops[1]
    if PULSES:
        roles["HIGH_SHARE"] = PULSES.share
    return {
        "roles": "\n".join(f"#define CAPSULE_{role} {name}" for role, name in roles.items()),
        "counts": "\n".join(
            [f"#define CAPSULE_{name.upper()}_COUNT {value}" for name, value in counts.items()]
            + [f"#define CAPSULE_{name} {value}" for name, value in flags().items()]
        ),
        "positions": "\n".join(f"    CAPSULE_{str(p).upper()}_AT," for p in PARAMETERS),
        "lists": "\n".join(
            " ".join((f"#define CAPSULE_{name}(of)", *(f"of({p})" for p in several)))
            for name, several in lists.items()
        ),
        "enums": "\n".join(map(_enum, interface.enums)),
        "structs": "\n".join(_struct(struct, interface) for struct in interface.structs),
    }


def _enum(enum: Entry) -> str:
    rows = "".join(
        f"    CAPSULE_{name.upper().replace('-', '_')}, /* {doc} */\n"
        for name, doc in enum["values"].items()
    )
    return f"/* {enum['doc']} */\ntypedef enum {{\n{rows}}} capsule_{enum['name']};\n"


def _struct(struct: Entry, interface: Interface) -> str:
    """Struct, and the offsets of its members."""
    name = f"capsule_{struct['name']}"
    rows = "".join(
        f"    {kind} {interface.spelt_all(names)};{f' /* {doc} */' if doc else ''}\n"
        for kind, names, doc in struct["fields"]
    )
    offsets = "".join(f"    offsetof({name}, {member}), \\\n" for member, _, _ in members(struct))
    return (
        f"/* {struct['doc']} */\ntypedef struct {{\n{rows}}} {name};\n"
        f"#define {name.upper()}_LAYOUT {{ \\\n{offsets}    sizeof({name})}}\n"
    )
