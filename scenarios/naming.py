"""Case names: `family[parameter=value,...]`, the parameters in the order given."""

from __future__ import annotations

Parameters = dict[str, float | int | str]


def case_name(family: str, parameters: Parameters) -> str:
    """`equal_masses[bounciness=0.5]`; a float is written in its shortest form, 1.0 as 1."""
    if not parameters:
        return family
    return f"{family}[{','.join(f'{key}={_text(value)}' for key, value in parameters.items())}]"


def _text(value: float | int | str) -> str:
    return f"{value:g}" if isinstance(value, float) else str(value)
