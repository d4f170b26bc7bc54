"""Small drawings of loads and drives, by the names of their presets, as SVG in the colour of the text."""

from __future__ import annotations

_OPEN = (
    '<svg viewBox="0 0 120 80" width="120" height="80" aria-hidden="true" fill="none" stroke="currentColor" '
    'stroke-width="2" stroke-linecap="round" stroke-linejoin="round">'
)
_CEILING = '<path d="M30 10h60M34 10l-6-6M46 10l-6-6M58 10l-6-6M70 10l-6-6M82 10l-6-6"/>'
_WALL = '<path d="M12 16v48M12 22l-6 6M12 34l-6 6M12 46l-6 6M12 58l-6 6"/>'
_WIRE = 'stroke="var(--wire)" stroke-width="3"'
_LETTER = 'fill="currentColor" stroke="none" font-size="13" font-family="inherit" text-anchor="middle"'

LOADS: dict[str, tuple[str, str]] = {
    "dead_weight": (
        "a weight that hangs on the wire",
        f'{_CEILING}<path d="M60 10v36" {_WIRE}/><rect x="46" y="46" width="28" height="22" rx="3"/>'
        f'<text x="60" y="62" {_LETTER}>m</text><path d="M92 66V46m-4 5 4-6 4 6"/>',
    ),
    "bias_spring": (
        "a slider between the wire and a spring",
        f'{_WALL}<path d="M12 40h32" {_WIRE}/><rect x="44" y="30" width="20" height="20" rx="3"/>'
        '<path d="M64 40h4l3-7 5 14 5-14 5 14 5-14 5 14 3-7h5"/><path d="M108 16v48"/>',
    ),
    "blocked_wire": (
        "a wire between a frame and a load cell: nothing moves, a force is measured",
        f'{_WALL}<path d="M12 40h52" {_WIRE}/><rect x="64" y="28" width="32" height="24" rx="3"/>'
        f'<text x="80" y="45" {_LETTER}>F</text><path d="M96 40h12M108 16v48"/>',
    ),
    "arm": (
        "an arm on a pulley that the wire turns",
        f'<circle cx="42" cy="48" r="12"/><circle cx="42" cy="48" r="2"/><path d="M42 48 92 22" stroke-width="4"/>'
        f'<circle cx="92" cy="22" r="7"/><path d="M30 48v24M54 48v24" {_WIRE}/><path d="M74 54a36 36 0 0 0 3-14m-4 4 4-6 4 5"/>',
    ),
    "coupon": (
        "a wire in an oven at a given stress: its strain is measured",
        f'<rect x="26" y="12" width="68" height="56" rx="4" stroke-dasharray="4 4"/><path d="M44 40h32" {_WIRE}/>'
        '<path d="M44 40H14m6-4-6 4 6 4M76 40h30m-6-4 6 4-6 4"/><path d="M36 60c4-4-4-6 0-10M84 60c4-4-4-6 0-10"/>',
    ),
    "strain_coupon": (
        "a wire held at a given strain: its stress is measured",
        f'<rect x="26" y="12" width="68" height="56" rx="4" stroke-dasharray="4 4"/><path d="M36 40h48" {_WIRE}/>'
        '<path d="M36 24v32M84 24v32M40 62h40m-36-4-4 4 4 4m32-8 4 4-4 4"/>',
    ),
}
_CIRCUIT = f'<path d="M24 40V16h72v8M24 40v24h72v-8"/><path d="M96 24v32" {_WIRE}/>'
DRIVES: dict[str, str] = {
    "voltage": f'{_CIRCUIT}<circle cx="24" cy="40" r="12" fill="var(--card)"/><text x="24" y="45" {_LETTER}>U</text>',
    "current": f'{_CIRCUIT}<circle cx="24" cy="40" r="12" fill="var(--card)"/><text x="24" y="45" {_LETTER}>I</text>',
    "power": f'{_CIRCUIT}<circle cx="24" cy="40" r="12" fill="var(--card)"/><text x="24" y="45" {_LETTER}>P</text>',
    "duty": f'{_CIRCUIT}<path d="M36 46h8V32h10v14h8V32h10v14h8"/><circle cx="24" cy="40" r="7" fill="var(--card)"/>',
    "none": f'<path d="M30 62h60" {_WIRE}/><path d="M60 14a5 5 0 0 0-5 5v17a9 9 0 1 0 10 0V19a5 5 0 0 0-5-5z"/><path d="M60 28v14"/>',
}
_AMPLIFIED = (
    f'{_CIRCUIT}<circle cx="24" cy="40" r="10" fill="var(--card)"/><text x="24" y="45" {_LETTER}>U</text>'
    '<path d="M48 6v20l18-10z" fill="var(--card)"/>'
)
_OTHER = '<rect x="30" y="20" width="60" height="40" rx="4"/>'


def load(name: str) -> tuple[str, str]:
    """(what it is, drawing) of a load; one of another package is a box."""
    words, drawing = LOADS.get(name, ("a load of another package", _OTHER))
    return words, f"{_OPEN}{drawing}</svg>"


def drive(name: str) -> str:
    """Drawing of a drive."""
    return f"{_OPEN}{DRIVES.get(name, _AMPLIFIED)}</svg>"


def wire(diameter: float, length: float) -> str:
    """A wire to scale with the others: diameter 0.15 mm is 3 px, length 0.5 m is 55 px."""
    thick = min(max(diameter / 0.15e-3 * 3.0, 1.5), 14.0)
    half = 0.5 * min(max(length / 0.5 * 55.0, 16.0), 108.0)
    return (
        f'{_OPEN}<path d="M{60 - half:.0f} 40h{2 * half:.0f}" stroke="var(--wire)" stroke-width="{thick:.1f}"/>'
        f'<path d="M{60 - half:.0f} 28v24M{60 + half:.0f} 28v24"/></svg>'
    )
