"""`impactbench routes`: the two routes of rule R14 side by side."""

from __future__ import annotations

import click

STEPS = (60, 240, 960)


@click.command()
@click.option("--json", "as_json", is_flag=True, help="Print everything as JSON.")
def routes(as_json: bool) -> None:
    """An off-centre hit by both routes of rule R14: an explicit rigid body, and particles joined by distances.

    The documents call the second approximate: the table shows by how much, and gates nothing.
    """
    from dataclasses import asdict

    from impactbench.reference.joined_particles import SHAPES, particle_route, rigid_route

    rows = [
        (
            shape,
            b,
            {
                "rigid body": asdict(rigid_route(shape, b)),
                **{f"particles, 1/{n} s": asdict(particle_route(shape, b, 1 / n)) for n in STEPS},
            },
        )
        for shape in SHAPES
        for b in (1.0, 0.5)
    ]
    if as_json:
        import json

        found = [{"shape": shape, "bounciness": b, "routes": by_route} for shape, b, by_route in rows]
        click.echo(json.dumps(found, indent=1, allow_nan=False))
        return
    head = ("ball [m/s]", "body [m/s]", "spin [rad/s]")
    click.echo(f"{'1 kg at 1 m/s hits':<30}{'route':<20}" + "".join(f"{text:>14}" for text in head))
    for shape, b, by_route in rows:
        for route, outcome in by_route.items():
            numbers = "".join(f"{value:>14.5f}" for value in outcome.values())
            click.echo(f"{f'{shape}, b = {b:g}':<30}{route:<20}{numbers}")
