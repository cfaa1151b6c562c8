"""The options of `hindsight simulate` and its actions `sweep` and `power`; imports nothing slow."""

import argparse
import json
import sys
from pathlib import Path

Arguments = argparse.ArgumentParser


def add_options(parser: Arguments) -> None:
    """Options of the study itself, and the two actions."""
    parser.add_argument(
        "--methods",
        metavar="M,…",
        help="method[:variant][@setting=value]…, e.g. blend:probability-gate@gain=2,policy",
    )
    parser.add_argument("--users", default="paper-like", help="a population's name, or a YAML file")
    parser.add_argument("--trials", type=int, default=300, metavar="N", help="trials per method")
    parser.add_argument("--seed", type=int, default=0, help="of everything random")
    parser.add_argument("--world", default="kinematic", help="kinematic or physics")
    parser.add_argument("--scene", default="default", help="a shipped scene's name, or a YAML file")
    parser.add_argument("--preset", default="default", help="where settings come from")
    parser.add_argument("--workers", type=int, default=0, metavar="N", help="0: every core")
    parser.add_argument("--json", metavar="FILE", help="summary as JSON; - for standard output")
    parser.add_argument("--out", type=Path, metavar="DIR", help="folder for the rows (Parquet)")
    actions = parser.add_subparsers(dest="action", metavar="ACTION")
    sweep = actions.add_parser("sweep", help="vary parameters, draw the measures against them")
    sweep.add_argument("file", type=Path, metavar="SWEEP.yaml")
    sweep.add_argument("--out", type=Path, default=Path("sweep"), metavar="DIR")
    sweep.add_argument("--workers", type=int, default=0, metavar="N", help="0: every core")
    power = actions.add_parser("power", help="how many participants a study needs")
    power.add_argument("folder", type=Path, nargs="?", help="trials, simulated or of people")
    power.add_argument("--effect", type=float, metavar="DZ", help="plan for this dz instead")
    power.add_argument(
        "--contrast", nargs=2, metavar=("A", "B"), help="methods to compare (default: the folder's)"
    )
    power.add_argument("--alpha", type=float, default=0.05)
    power.add_argument("--power", type=float, nargs="+", default=[0.8, 0.9], metavar="P")


def run(args: argparse.Namespace) -> int:
    """Do what was asked for.

    Raises:
        SimulateError: If it is not possible.
    """
    if args.action == "sweep":
        return _sweep(args)
    if args.action == "power":
        return _power(args)
    from app.simulate.command import simulate
    from app.simulate.errors import SimulateError
    from app.simulate.methods import describe_methods

    if not args.methods:
        raise SimulateError(f"--methods is missing; valid:\n{describe_methods()}")
    names = ("methods", "users", "trials", "seed", "world", "scene", "preset")
    options = {name: getattr(args, name) for name in names}
    return simulate(options, workers=args.workers, out=args.out, to=args.json)


def _sweep(args: argparse.Namespace) -> int:
    from app.analysis.sweep import load_sweep, run_sweep
    from app.analysis.sweep_figure import draw_sweep
    from app.simulate.sweep import run_point

    sweep = load_sweep(args.file)
    rows = run_sweep(
        sweep,
        lambda config: run_point(config, args.workers),
        lambda text: print(text, file=sys.stderr, flush=True),
    )
    args.out.mkdir(parents=True, exist_ok=True)
    rows.to_parquet(args.out / "rows.parquet", index=False)
    (args.out / "config.json").write_text(
        json.dumps({"sweep": sweep.model_dump(by_alias=True)}, indent=2) + "\n", encoding="utf-8"
    )
    for path in draw_sweep(rows, sweep, args.out):
        print(path)
    return 0


def _power(args: argparse.Namespace) -> int:
    from app.analysis.power import format_plan, plan_for_effect
    from app.analysis.power_command import plan_from_folder
    from app.simulate.errors import SimulateError

    powers = tuple(args.power)
    if (args.folder is None) == (args.effect is None):
        raise SimulateError("power needs either a folder of trials, or --effect DZ")
    if args.folder is None:
        plans = [plan_for_effect(args.effect, powers=powers, alpha=args.alpha)]
    else:
        plans = plan_from_folder(
            args.folder,
            lambda text: print(text, file=sys.stderr),
            contrast=tuple(args.contrast) if args.contrast else None,
            powers=powers,
            alpha=args.alpha,
        )
    for plan in plans:
        print(format_plan(plan))
    return 0
