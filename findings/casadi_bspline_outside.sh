#!/usr/bin/env bash
# Package: casadi 3.8.2, with the IPOPT that it brings.
# Expected: `interpolant` with "bspline" is the smooth form of the one with "linear", which carries on beyond the
#   grid; and a solver whose variable is bounded to the grid never asks for more.
# Seen: beyond the last point of the grid, by however little, "bspline" is 0.0, and so is its slope. (The help of the
#   function `bspline` says so, that of `interpolant` does not.) And IPOPT relaxes bounds, by 1e-8 of their size: an
#   optimum at the end of the grid lies 3e-6 beyond it, where the table is worth nothing. Below, the speed that takes
#   the least energy for 1000 rad, from a table of a motor's power: 700 J at the grid's upper end; the solver finds
#   "Solve_Succeeded", that speed, and 0 J.
# Why it matters: tables of torque, loss and efficiency end where the drive does, and optima lie there. The solution
#   shows a speed that is right to eight digits and an energy of none; in a sum of many terms a missing one is not seen.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/pip" install --quiet --disable-pip-version-check casadi==3.8.2 numpy
"$folder/venv/bin/python" - <<'PYTHON'
import casadi as ca
import numpy as np

speeds = np.linspace(0.0, 300.0, 7)
watts = 120.0 + 1e-3 * speeds**2
energy = {}
for kind in "linear", "bspline":
    power = ca.interpolant("power", kind, [speeds], watts)
    at = [float(power(speed)) for speed in (299.9, 300.0, 300.0 + 1e-9, 301.0)]
    print(f"{kind}: power at 299.9, 300, 300 + 1e-9 and 301 rad/s: {np.round(at, 3)} W")
    assert abs(at[1] - 210.0) < 1e-6
    assert at[2:] == [0.0, 0.0] if kind == "bspline" else at[3] > at[2] > 209.9
    speed = ca.MX.sym("speed")
    problem = {"x": speed, "f": 1000.0 * power(speed) / speed}
    for relax in 1e-8, 0.0:  # IPOPT's default, and none.
        options = {"ipopt.print_level": 0, "ipopt.sb": "yes", "print_time": False, "ipopt.bound_relax_factor": relax}
        solver = ca.nlpsol("solver", "ipopt", problem, options)
        found = solver(x0=150.0, lbx=10.0, ubx=300.0)
        status, energy[kind, relax] = solver.stats()["return_status"], float(found["f"])
        print(f"  bounds relaxed by {relax}: {status}, {float(found['x']):.7f} rad/s, {energy[kind, relax]:.3f} J")
        assert status == "Solve_Succeeded" and abs(float(found["x"]) - 300.0) < 1e-5
assert energy.pop(("bspline", 1e-8)) == 0.0
assert all(abs(joules - 700.0) < 1e-3 for joules in energy.values())
PYTHON
