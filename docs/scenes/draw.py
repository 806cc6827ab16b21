"""Drawings of the scenes, as SVG beside this script: `python docs/scenes/draw.py`."""

from pathlib import Path

HEAD = """<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 640 {height}" \
font-family="serif" font-size="17" role="img" aria-labelledby="t">
<title id="t">{title}</title>
<defs><marker id="a" viewBox="0 0 10 10" refX="9" refY="5" markerWidth="8" markerHeight="8" \
orient="auto-start-reverse"><path d="M0 0L10 5L0 10z"/></marker></defs>
<rect width="640" height="{height}" fill="#fff"/>
"""
ARROW = 'marker-end="url(#a)"'
BOTH = 'marker-start="url(#a)" marker-end="url(#a)"'
SHELL = '<rect x="90" y="60" width="460" height="140" rx="60" stroke-width="4"/>'
MASS = '<rect x="230" y="80" width="110" height="100" fill="#dce8f5"/>'
TRACK = '<path d="M20 202h600" stroke-width="3"/>'
PULSES = '<path d="M248 168v-26h38v26h18v-26h20" stroke-width="1.5"/>'


def spring(x: int, y: int, length: int) -> str:
    """A spring from a point to the right, with straight ends."""
    end = (length - 72) // 2
    zigzag = "l6 -9l12 18l12 -18l12 18l12 -18l12 18l6 -9"
    return f'<path d="M{x} {y}h{end}{zigzag}h{length - 72 - end}"/>'


def damper(y: int, wall: int = 93) -> str:
    """The damper between the left wall and the mass."""
    return f'<path d="M{wall} {y}H153m0 -10h40m-40 20h40m-40 -20v20m22 -15v10m0 -5h55"/>'


def arrow(path: str, both: bool = False) -> str:
    """A thin line with an arrow at its end, or at both."""
    return f'<path d="{path}" stroke-width="1" {BOTH if both else ARROW}/>'


def label(x: int, y: int, letter: str, index: str = "", size: int = 17) -> str:
    """An italic letter with an index below it."""
    small = f'<tspan dy="4" font-size="{size - 4}">{index}</tspan>' if index else ""
    italic = f'<tspan font-style="italic">{letter}</tspan>'
    return f'<text x="{x}" y="{y}" font-size="{size}" text-anchor="middle">{italic}{small}</text>'


def stop(x: int, y: int, length: int, plate: int) -> str:
    """The spring of a stop, with the plate that the mass meets."""
    return spring(x, y, length) + f'<path d="M{plate} {y - 20}v40" stroke-width="3"/>'


def front(y: int, stiffness: str, gap: str) -> str:
    """The stop in front, and its gap."""
    return (
        stop(430, y, 117, 430)
        + f'<path d="M340 192v-11M430 192v{y + 20 - 192}" stroke-width="1"/>'
        + arrow("M342 187h86", both=True)
        + f'<g stroke="none" fill="#000">{label(488, y - 18, "k", stiffness)}'
        + f"{label(385, 180, 'G', gap)}</g>"
    )


def words(*texts: str) -> str:
    """Letters, which are filled and not outlined."""
    return f'<g stroke="none" fill="#000">{"".join(texts)}</g>'


def actuator() -> str:
    """An actuator between the mass and the front wall, which pushes both."""
    return (
        '<path d="M340 98h44m76 0h86"/><rect x="384" y="84" width="76" height="28" '
        'fill="#f5e8dc"/>' + words('<text x="422" y="103" text-anchor="middle">drive</text>')
    )


def tilted(body: str) -> str:
    """A device on a slope: the track rises to the right, and weight pulls straight down."""
    level = '<path d="M20 300h170" stroke-width="1" stroke-dasharray="5 5"/>'
    angle = '<path d="M150 300A130 130 0 0 0 148 281" stroke-width="1"/>'
    weight = arrow("M590 60v60")
    letters = words(label(172, 295, "θ"), label(604, 98, "g"))
    return f'<g transform="rotate(-8 20 300) translate(0 98)">{body}</g>' + (
        level + angle + weight + letters
    )


def slope() -> str:
    """The capsule on a slope."""
    inside = SHELL + spring(93, 105, 137) + damper(155) + MASS + front(140, "2", "")
    letters = words(
        label(285, 120, "M", "m", 20),
        '<text x="285" y="158" font-size="15" text-anchor="middle"><tspan font-style="italic">P'
        '</tspan><tspan dy="3" font-size="12">d</tspan><tspan dy="-3"> cos Ω</tspan>'
        '<tspan font-style="italic">t</tspan></text>',
        label(160, 86, "k", "1"),
        label(205, 185, "c"),
        label(565, 70, "M", "c"),
    )
    return tilted(inside + TRACK + letters)


def prototype() -> str:
    """A mass between two stops, driven by pulses, on a slope."""
    inside = SHELL + spring(97, 92, 133) + damper(170, 98) + MASS + PULSES
    inside += stop(93, 130, 92, 185) + front(130, "front", "front")
    inside += arrow("M187 118h41", both=True)
    letters = words(
        label(285, 122, "M", "m", 20),
        label(163, 80, "k", "1"),
        label(205, 193, "c"),
        label(122, 158, "k", "back"),
        label(207, 137, "G", "back"),
        label(565, 70, "M", "c"),
    )
    return tilted(inside + TRACK + letters)


def reaction() -> str:
    """A capsule whose actuator sits between both bodies."""
    inside = SHELL + spring(93, 105, 137) + damper(155) + MASS + actuator() + front(150, "2", "")
    forces = arrow("M285 80v-34h60") + arrow("M530 66v-20h-60")
    letters = words(
        label(285, 136, "M", "m", 20),
        label(356, 50, "u"),
        label(455, 50, "−u"),
        label(160, 86, "k", "1"),
        label(205, 185, "c"),
        label(565, 224, "M", "c"),
    )
    return inside + TRACK + forces + letters


def shuttle() -> str:
    """Two stops, and pulses that push both bodies: the scene that a page declares."""
    inside = SHELL + spring(97, 92, 133) + damper(170, 98) + MASS + PULSES
    inside += front(130, "front", "front")
    inside += stop(93, 130, 92, 185) + arrow("M187 118h41", both=True)
    forces = arrow("M285 80v-34h60") + arrow("M530 66v-20h-60")
    letters = words(
        label(285, 122, "M", "m", 20),
        label(356, 50, "u"),
        label(455, 50, "−u"),
        label(163, 80, "k", "1"),
        label(205, 193, "c"),
        label(122, 158, "k", "back"),
        label(207, 137, "G", "back"),
        label(565, 224, "M", "c"),
    )
    return inside + TRACK + forces + letters


DRAWINGS = {
    "slope": (slope, "The capsule on a track that rises by an angle theta in front"),
    "prototype": (
        prototype,
        "A capsule on a slope; its mass is driven by pulses, with a gap before a stop on each side",
    ),
    "reaction": (
        reaction,
        "A capsule with a drive between mass and front wall, which pushes both with equal forces",
    ),
    "shuttle": (shuttle, "A capsule with a stop on each side of its mass and pulses between both"),
}

if __name__ == "__main__":
    for name, (drawing, title) in DRAWINGS.items():
        height = 240 if name in ("reaction", "shuttle") else 320
        lines = '<g fill="none" stroke="#000" stroke-width="2">\n'
        text = HEAD.format(title=title, height=height) + f"{lines}{drawing()}\n</g>\n</svg>\n"
        (Path(__file__).parent / f"{name}.svg").write_text(text, encoding="utf-8")
