"""The exact map of capsule-sym, which follows the modes by itself."""

from capsule_sym import Parameters, simulate


def switches(case):
    """Times of the switches up to the end of a case, and the fields entered."""
    p, start = Parameters(**case["parameters"]), case["start"]
    run = simulate(p, start["state"], start["t"], periods=2 + int(case["end"] / p.period))
    found = []
    for before, after in zip(run.segments, run.segments[1:], strict=False):
        time = before.end.period * p.period + before.end.phase
        if time > case["end"]:
            break
        found.append((time, after.name))
    return found
