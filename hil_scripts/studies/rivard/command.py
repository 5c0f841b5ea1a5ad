"""Fly N rendezvous of a named setting from the shell.

python -m hil_scripts.studies.rivard.command k3_a b7re -n 20000
python -m hil_scripts.studies.rivard.command --list
python -m hil_scripts.studies.rivard.command --bench -n 100000
"""

from __future__ import annotations

import argparse
import sys

from hil_scripts.launch import kernel_cache

NM = 1852.0


def main(argv: list[str] | None = None) -> int:
    """Entry point; returns the exit code."""
    ap = argparse.ArgumentParser(prog="rivard_command", description="Monte Carlo of the range-only rendezvous")
    ap.add_argument("case", nargs="*", help="names of settings; see --list")
    ap.add_argument("-n", type=int, default=20000, help="rendezvous of each")
    ap.add_argument("--seed", type=int, default=20821)
    ap.add_argument("--workers", type=int, default=2)
    ap.add_argument("--list", action="store_true", help="names of the settings")
    ap.add_argument("--bench", action="store_true", help="speed of the source's setting against plain numpy")
    a = ap.parse_args(argv)
    kernel_cache.use()  # before numba is imported
    from hil_scripts.studies.rivard import cases as rivard_cases
    from hil_scripts.studies.rivard import figures as rivard_figures
    from hil_scripts.studies.rivard import mc as rivard_mc
    from hil_scripts.studies.rivard import plain_numpy as rivard_numpy

    if a.list:
        print("\n".join(rivard_cases.CASES))
        return 0
    if a.bench:
        for key, value in rivard_numpy.bench(a.n, a.seed).items():
            print(f"{key:28s} {value:.6g}")
        return 0
    for name in a.case:
        try:
            r = rivard_mc.run_case(rivard_cases.case(name), a.n, a.seed, a.workers)
        except ValueError as e:
            print(e, file=sys.stderr)
            return 2
        f = rivard_figures.figures(r)
        line = f"{name:24s} n {a.n} unfinished {100 * f['unfinished']:.2f} %"
        for axis, sign in (("x", 1.0), ("y", -1.0)):
            v = [f.get(f"{axis}.{k}_m", float("nan")) / NM for k in ("mean", "sigma", "rms", "rms_lo", "rms_hi", "p95")]
            line += f" | {axis} {sign * v[0]:.3f}/{v[1]:.3f}/{v[2]:.3f} [{v[3]:.3f} {v[4]:.3f}] p95 {v[5]:.2f} NM"
        print(f"{line} | alarm {f['alarm']:.3f} | {r.wall_s:.2f} s", flush=True)
        nees = [f"{k[:-6]} {v:.2f}" for k, v in rivard_figures.consistency(r).items() if k.endswith(".nees3")]
        if nees:
            print(f"{'':24s} NEES/3: {', '.join(nees)}")
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
