"""The command line: one table of subcommands, each with its options and what it calls.

Rooms are imported by the command that needs them, so that `hindsight --help` answers at once.
"""

import argparse
import json
import signal
import sys
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

from app import __version__
from app.errors import AppError

Arguments = argparse.ArgumentParser
DEFAULT_SESSIONS = Path("sessions")
DEFAULT_COMMAND = "run"


@dataclass(frozen=True)
class Command:
    """A subcommand: its one line of help, its options, and the function that does it."""

    help: str
    add_options: Callable[[Arguments], None]
    run: Callable[[argparse.Namespace], int | None]


def _port(text: str) -> int:
    if not text.isdigit() or not 0 <= int(text) <= 65535:
        raise argparse.ArgumentTypeError(
            f"{text!r} is no port; valid are 0 (any free one) to 65535"
        )
    return int(text)


def _positive(text: str) -> float:
    try:
        value = float(text)
    except ValueError:
        value = -1.0
    if not 0 < value < float("inf"):
        raise argparse.ArgumentTypeError(f"{text!r} is not a number above 0")
    return value


def _run_options(parser: Arguments) -> None:
    parser.add_argument("--host", default="127.0.0.1", help="address to listen on")
    parser.add_argument("--port", type=_port, default=8080, help="port to listen on; 0: any free")
    parser.add_argument(
        "--sessions", type=Path, default=DEFAULT_SESSIONS, metavar="DIR", help="where logs go"
    )
    parser.add_argument("--scene", default="default", help="a shipped scene's name, or a YAML file")
    parser.add_argument(
        "--preset", default="default", help="constants of the method: default, paper or ada"
    )
    parser.add_argument("--method", default="policy", help="assistance to begin with")
    parser.add_argument("--open", action="store_true", help="open the page in a browser")
    parser.add_argument("--no-record", action="store_true", help="write no logs")
    parser.add_argument(
        "--retention-days",
        type=_positive,
        metavar="DAYS",
        help="delete demo sessions older than this at start-up (default: keep)",
    )
    parser.add_argument(
        "--hold-on-loss", action="store_true", help="stop the arm while the person's input is lost"
    )
    parser.add_argument(
        "--attract",
        action="store_true",
        help="let simulated users drive until a visitor touches a stick, and again a minute after",
    )
    parser.add_argument(
        "--capacity",
        type=int,
        metavar="N",
        help="sessions at once (default: what this machine bears)",
    )
    parser.add_argument(
        "--behind-tls-proxy",
        metavar="ORIGIN",
        help="public origin of a TLS reverse proxy, e.g. https://lab.example.org; "
        "needed to listen beyond this machine",
    )


def _run(args: argparse.Namespace) -> None:
    from app.core import preset
    from app.robot import load_scene
    from app.web.config import ServerConfig
    from app.web.run import serve

    config = ServerConfig.from_arguments(args)
    # What every session would refuse is refused once, before the page is there.
    preset(args.preset, method=args.method)
    load_scene(args.scene)
    serve(config)


def _sessions_options(parser: Arguments) -> None:
    parser.add_argument("folder", nargs="?", type=Path, default=DEFAULT_SESSIONS)
    parser.add_argument("--json", action="store_true", help="print JSON instead of a table")


def _sessions(args: argparse.Namespace) -> None:
    from app.recording.store import format_trials, list_trials, trials_to_json

    entries = list_trials(args.folder)
    print(trials_to_json(entries) if args.json else format_trials(entries))


def _bench_options(parser: Arguments) -> None:
    parser.add_argument(
        "what",
        nargs="?",
        choices=("all", "assist", "simulate", "review", "capacity", "soak"),
        default="all",
        help="all: loop, recording, view, latency; review: opening and scrubbing a long trial; "
        "capacity: sessions this machine bears; soak: sessions that run for long",
    )
    parser.add_argument("--json", action="store_true", help="print JSON instead of a table")
    parser.add_argument(
        "--sessions",
        type=int,
        nargs="+",
        metavar="N",
        help="sessions at once (capacity: several numbers are tried in turn; soak: 4)",
    )
    parser.add_argument(
        "--seconds", type=_positive, default=15.0, help="capacity: how long each number is tried"
    )
    parser.add_argument(
        "--minutes", type=_positive, help="soak: how long (60); review: length of the trial (10)"
    )
    parser.add_argument(
        "--keep", action="store_true", help="capacity: let servers here offer what was measured"
    )


def _bench(args: argparse.Namespace) -> None:
    from app.bench.command import bench, format_table

    figures = bench(
        args.what,
        sessions=args.sessions or (),
        seconds=args.seconds,
        minutes=args.minutes,
        keep=args.keep,
    )
    print(json.dumps(figures, indent=2) if args.json else format_table(figures))


def _doctor_options(parser: Arguments) -> None:
    parser.add_argument(
        "--sessions", type=Path, default=DEFAULT_SESSIONS, metavar="DIR", help="where logs go"
    )
    parser.add_argument("--port", type=_port, default=8080, help="port the page will be served on")
    parser.add_argument("--no-browser", action="store_true", help="start no browser to look at it")
    parser.add_argument("--json", action="store_true", help="print JSON instead of lines")


def _doctor(args: argparse.Namespace) -> int:
    from app.doctor.command import doctor

    return doctor(args.sessions, args.port, browser=not args.no_browser, as_json=args.json)


def _figures_options(parser: Arguments) -> None:
    parser.add_argument("which", choices=("paper",), help="the paper's conceptual figures")
    parser.add_argument("--out", type=Path, default=Path("figures"), metavar="DIR")


def _figures(args: argparse.Namespace) -> None:
    from app.analysis.paper_figures import draw_paper_figures

    for path in draw_paper_figures(args.out):
        print(path)


def _analyze_options(parser: Arguments) -> None:
    parser.add_argument(
        "folder", type=Path, help="a study's, a simulated run's or a sessions folder"
    )
    parser.add_argument(
        "--out", type=Path, metavar="DIR", help="where the report goes (default: FOLDER/analysis)"
    )


def _analyze(args: argparse.Namespace) -> None:
    from app.analysis.command import analyze

    print(analyze(args.folder, args.out, progress=lambda text: print(text, file=sys.stderr)))


def _simulate_options(parser: Arguments) -> None:
    from app.simulate.options import add_options

    add_options(parser)


def _simulate(args: argparse.Namespace) -> int:
    from app.simulate.options import run

    return run(args)


def _review_options(parser: Arguments) -> None:
    parser.add_argument("folder", nargs="?", type=Path, default=DEFAULT_SESSIONS)
    parser.add_argument("--host", default="127.0.0.1", help="address to listen on")
    parser.add_argument("--port", type=_port, default=8081, help="port to listen on; 0: any free")
    parser.add_argument("--open", action="store_true", help="open the page in a browser")
    parser.add_argument(
        "--behind-tls-proxy",
        metavar="ORIGIN",
        help="public origin of a TLS reverse proxy; needed to serve beyond this machine",
    )
    parser.add_argument(
        "--password-file", type=Path, metavar="FILE", help="ask for the password whose hash it has"
    )
    parser.add_argument(
        "--set-password", type=Path, metavar="FILE", help="write a password file, and end"
    )


def _review(args: argparse.Namespace) -> None:
    from app.review.command import ask_password, review

    if args.set_password is not None:
        ask_password(args.set_password)
        return
    review(
        args.folder,
        host=args.host,
        port=args.port,
        public_origin=(args.behind_tls_proxy or "").rstrip("/"),
        password_file=args.password_file,
        open_browser=args.open,
    )


def _export_options(parser: Arguments) -> None:
    parser.add_argument("folder", nargs="?", type=Path, default=DEFAULT_SESSIONS)
    parser.add_argument("--out", type=Path, default=Path("export"), metavar="DIR")
    parser.add_argument("--format", choices=("parquet", "csv"), default="parquet")
    parser.add_argument("--study", metavar="NAME", help="only this study")


def _export(args: argparse.Namespace) -> None:
    from app.recording.export import export_trials

    done = export_trials(args.folder, args.out, args.format, args.study)
    for problem in done.skipped:
        print(f"left out: {problem}", file=sys.stderr)
    print(f"{done.trials} trials in {len(done.files)} files in {args.out}")


def _verify_options(parser: Arguments) -> None:
    parser.add_argument("target", type=Path, metavar="FOLDER|FILE", help="logs to re-simulate")


def _verify(args: argparse.Namespace) -> int:
    from app.review.verify import run

    return run(args.target)


def _study_options(parser: Arguments) -> None:
    from app.study.command import add_options

    add_options(parser)


def _study(args: argparse.Namespace) -> int:
    from app.study.command import run

    return run(args)


COMMANDS: dict[str, Command] = {
    "run": Command("serve the live page (the default)", _run_options, _run),
    "review": Command("see recorded trials again in the browser", _review_options, _review),
    "export": Command("write trials as tables for other programs", _export_options, _export),
    "verify": Command("re-simulate logs, bit for bit", _verify_options, _verify),
    "study": Command("host, check or export a study", _study_options, _study),
    "sessions": Command("list recorded trials and their outcomes", _sessions_options, _sessions),
    "doctor": Command("look for what would spoil a session here", _doctor_options, _doctor),
    "bench": Command("measure this machine", _bench_options, _bench),
    "figures": Command("draw the method from the running code", _figures_options, _figures),
    "simulate": Command("run studies with simulated users", _simulate_options, _simulate),
    "analyze": Command("report on a folder of trials", _analyze_options, _analyze),
}


def build_parser() -> argparse.ArgumentParser:
    """The whole command line."""
    parser = argparse.ArgumentParser(
        prog="hindsight",
        description="Shared-autonomy teleoperation in the browser. Without a command: run.",
    )
    parser.add_argument("--version", action="version", version=f"hindsight {__version__}")
    commands = parser.add_subparsers(dest="command", required=True, metavar="COMMAND")
    for name, command in COMMANDS.items():
        sub = commands.add_parser(
            name,
            help=command.help,
            description=command.help.capitalize() + ".",
            formatter_class=argparse.ArgumentDefaultsHelpFormatter,
            allow_abbrev=False,
        )
        command.add_options(sub)
        sub.set_defaults(run=command.run)
    return parser


def main(argv: Sequence[str] | None = None) -> int:
    """Run one command; 0 on success, 2 for bad input, 130 when interrupted."""
    arguments = list(sys.argv[1:] if argv is None else argv)
    if not arguments or (arguments[0].startswith("-") and arguments[0] not in _OWN_OPTIONS):
        arguments.insert(0, DEFAULT_COMMAND)
    args = build_parser().parse_args(arguments)
    # Told to end, a command ends what it started, as after Ctrl+C; servers have an order of theirs.
    signal.signal(signal.SIGTERM, signal.default_int_handler)
    try:
        return args.run(args) or 0
    except AppError as error:
        print(f"hindsight: {error}", file=sys.stderr)
        return 2
    except KeyboardInterrupt:
        return 130
    except BrokenPipeError:
        sys.stderr.close()
        return 0


_OWN_OPTIONS = ("-h", "--help", "--version")
