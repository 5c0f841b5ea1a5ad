"""After a run: figures, picture file, verdict."""

from __future__ import annotations

import json
import math
import signal
import sys
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

from rich.console import Console

from flightsw.files import write_whole
from flightsw.plugins import VIEWS
from flightsw.strict import ConfigError
from hil_scripts.launch import verdict
from hil_scripts.launch.mission import Outcome, deleted
from hil_scripts.launch.procs import StopFlag, Supervisor, describe_exit
from hil_scripts.launch.runfolder import RunPlan

FAILED = "run.failed_views"  # of the figures (ground.metrics): views that failed
EXIT_FAILED = 1
EXIT_SILENT = 3  # an aircraft that another computer flies was not heard
EXIT_EXPECT = 4  # completed, but a bound of the scenario is violated


def finish(
    plan: RunPlan, run: Path, outcome: Outcome, rrd: bool, console: Console, stop: StopFlag, in_process: bool = False
) -> int:
    """Write summary.json and run.rrd, print what came out, return the exit code of `sil run`. `in_process`: the figures too."""
    summary: dict[str, Any] = {}
    _write(run, {"run.outcome": outcome.outcome, "run.sim_s": round(outcome.sim_s, 3)})  # what the logs must reach
    by_user = outcome.outcome == "aborted" and outcome.signum == signal.SIGINT and not deleted(run)

    def halted() -> bool:  # who ended a run by Ctrl-C may end this by another
        return stop.hurry if by_user else bool(stop)

    if (outcome.outcome in ("completed", "lost") or by_user) and not halted():
        if in_process:
            summary = _figures(run, console)
        elif _step("metrics", ["ground", "metrics", "--write", str(run)], run, console, halted) or _has_failed_view(
            run
        ):
            summary = read_summary(run, console)
        if rrd and not halted():
            _step("convert", ["ground", "convert", str(run)], run, console, halted)
    if summary.get("run.outcome") == "truncated":
        outcome = replace(outcome, outcome="truncated", reason=str(summary["run.reason"]))
    flown = {
        "run.outcome": outcome.outcome,
        "run.scenario": plan.scenario_name,
        "run.seed": plan.seed,
        "run.sim_s": round(outcome.sim_s, 3),
        "run.sim_s_per_wall_s": round(outcome.speed, 3),
    }
    if outcome.reason:
        flown["run.reason"] = outcome.reason
    if plan.warnings:
        flown["run.warnings"] = "; ".join(plan.warnings)
    got_metrics = bool(summary)
    flown |= dict(sorted(outcome.accounts.items()))
    summary = flown | {k: v for k, v in summary.items() if k not in flown}
    if outcome.outcome == "failed" and deleted(run):  # said already; there is nowhere to write to
        return EXIT_FAILED
    unwritten = _write(run, summary)
    nothing_lost = {k for k, v in outcome.accounts.items() if not v}
    verdict.show_summary(console, {k: v for k, v in summary.items() if k not in nothing_lost})
    code = 0
    if outcome.outcome == "aborted":
        console.print(outcome.reason, style="yellow")
        code = 128 + outcome.signum
    elif outcome.outcome in ("lost", "truncated"):
        console.print(outcome.reason, style="red")
        code = EXIT_FAILED
    elif outcome.outcome != "completed" or not got_metrics:
        code = EXIT_SILENT if outcome.silent else EXIT_FAILED
    else:
        code = _judge(plan, summary, console) or (EXIT_FAILED if FAILED in summary else 0)
    if unwritten:
        console.print(unwritten, style="red", soft_wrap=True)
        return code or EXIT_FAILED
    _where(run, outcome, console)
    return 128 + stop.signum if stop and code == 0 else code


def _write(run: Path, summary: dict[str, Any]) -> str:
    """summary.json, whole or not at all; what the disk says against it."""
    finite = {
        k: None if isinstance(v, float) and not math.isfinite(v) else v for k, v in summary.items()
    }  # JSON has no NaN
    try:
        write_whole(run / "summary.json", json.dumps(finite, indent=2) + "\n")
    except OSError as e:
        return str(e)
    return ""


def _judge(plan: RunPlan, summary: dict[str, Any], console: Console) -> int:
    if plan.shortened:
        text = f"bounds of the scenario hold for its full {plan.full_s:.0f} s and were not judged"
        console.print(text)
    if not plan.expect:
        return 0
    try:
        checks = verdict.evaluate(plan.expect, summary)
    except ConfigError as e:
        console.print(f"scenario.toml: {e}", style="red")
        return EXIT_EXPECT
    verdict.show_checks(console, checks)
    bad = [c.key for c in checks if not c.ok]
    if bad:
        console.print(f"bounds violated: {', '.join(bad)}", style="red")
    return EXIT_EXPECT if bad else 0


def _where(run: Path, outcome: Outcome, console: Console) -> None:
    console.print(f"run folder: {run}", style="bold", soft_wrap=True)
    rerun = Path(sys.executable).with_name("rerun")
    if (run / "run.rrd").exists():
        console.print(f"look at it: {_short(rerun)} {run / 'run.rrd'}", soft_wrap=True)
    elif outcome.outcome not in ("completed", "lost"):
        ground = _short(Path(sys.executable).with_name("ground"))
        console.print(
            f"the logs up to the end are readable; to draw them: {ground} convert {run}",
            soft_wrap=True,
        )


def _short(path: Path) -> Path:
    try:
        return path.relative_to(Path.cwd())
    except ValueError:
        return path


def _figures(run: Path, console: Console) -> dict[str, Any]:
    """What `ground metrics` writes."""
    from ground.columns import LogError
    from ground.metrics import compute

    try:
        failed: list[str] = []
        figures = compute(run, failed)
        if failed:
            console.print(f"ground metrics: {figures[FAILED]}", style="red", soft_wrap=True)
        return figures
    except (LogError, ValueError, OSError) as e:
        console.print(f"ground metrics: {e}", style="red", soft_wrap=True)
        return {}


def _has_failed_view(run: Path) -> bool:
    """Whether the figures were written, all but those of a view."""
    try:
        return FAILED in json.loads((run / "summary.json").read_text())
    except (OSError, ValueError):
        return False


def read_summary(run: Path, console: Console) -> dict[str, Any]:
    """summary.json of a run folder, {} and a word about it where there is none that can be read."""
    try:
        data = json.loads((run / "summary.json").read_text())
    except (OSError, ValueError) as e:
        console.print(f"{run / 'summary.json'}: not readable: {e}", style="red")
        return {}
    return data if isinstance(data, dict) else {}


def _step(name: str, module_args: list[str], run: Path, console: Console, halted: Callable[[], bool]) -> bool:
    """Run one post-processing program to its end; False with a message when it fails or is stopped."""
    with Supervisor(run) as sup:
        child = sup.start(name, [sys.executable, "-m", *module_args])
        with console.status(f"ground {name} ...") if console.is_terminal else _Quiet():
            while child.popen.poll() is None and not halted():
                sup.pump(0.1)
        sup.newly_ended()
        if child.popen.returncode == 0:
            return True
        sup.stop()
        why = "stopped" if halted() else describe_exit(child.popen.returncode)
        views = [line for line in child.tail if line.startswith(f"ground: {VIEWS}")]  # failed, and the rest was done
        lines = views if views and not halted() else [f"ground {name}: {why}", *child.tail]
        console.print("\n".join(lines), style="red", soft_wrap=True)
        return False


class _Quiet:
    """Context manager that shows nothing."""

    def __enter__(self) -> None:
        return None

    def __exit__(self, *_exc: object) -> None:
        return None
