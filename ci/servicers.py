#!/usr/bin/env python3
"""Servicers drawn at random: the built-in one with lengths, masses and limits times 0.7 to 1.4.

A mission file each, for datasets and tests of a network that is to serve many servicers
(docs/guides/train.md). Log-uniform factors: one for the bus's mass, with its inertia; one for each kind of
limit; one for the length and one for the mass of each link, a uniform cylinder. The same for a seed on
every machine.

    ci/servicers.py DIR 1000:1100      # seeds 1000 to 1099, DIR/1000.mission.toml and so on
"""

import pathlib
import random
import sys

LENGTHS_M = [0.75, 0.75, 0.3]
LINK_KG = 10.0
RADIUS_M = 0.05


def servicer(seed: int) -> str:
    draw = random.Random(seed)

    def factor() -> float:
        return 0.7 * 2 ** draw.random()

    bus = factor()
    inertia = ", ".join([f"{83.3 * bus:.4f}"] * 3)
    lines = ['format = "remora-mission/1"', "", "[servicer]"]
    lines += [f"bus_mass_kg = {500 * bus:.4f}", f"bus_inertia_kg_m2 = [{inertia}]"]
    lines += [f"joint_rate_limit_rad_s = {5e-3 * factor():.6e}", f"force_limit_n = {2.5 * factor():.4f}"]
    lines += [f"bus_torque_limit_n_m = {5e-3 * factor():.6e}", f"joint_torque_limit_n_m = {5e-3 * factor():.6e}"]
    for base in LENGTHS_M:
        length, mass = base * factor(), LINK_KG * factor()
        across = mass * (3 * RADIUS_M**2 + length**2) / 12
        lines += ["", "[[servicer.links]]", f"tip_m = [0.0, 0.0, {length:.6f}]"]
        lines += [f"center_of_mass_m = [0.0, 0.0, {length / 2:.6f}]", f"mass_kg = {mass:.4f}"]
        lines += [f"inertia_kg_m2 = [{across:.6f}, {across:.6f}, {mass * RADIUS_M**2 / 2:.6f}]"]
        lines += ["axis = [0.0, 1.0, 0.0]", f"radius_m = {RADIUS_M}"]
    return "\n".join(lines) + "\n"


def main() -> None:
    directory, seeds = pathlib.Path(sys.argv[1]), sys.argv[2].split(":")
    directory.mkdir(parents=True, exist_ok=True)
    for seed in range(*map(int, seeds)):
        (directory / f"{seed:03}.mission.toml").write_text(servicer(seed))


if __name__ == "__main__":
    if len(sys.argv) != 3 or ":" not in sys.argv[2]:
        sys.exit(__doc__)
    main()
