"""`hindsight study …`: its options, and what each action calls; imports nothing slow."""

import argparse
import sys
from pathlib import Path

from app.study.errors import StudyError

ACTIONS = ("check", "export", "rebuild", "sheet", "password")
_USAGE = (
    "hindsight study STUDY.yaml | check STUDY.yaml | sheet STUDY.yaml | export FOLDER | "
    "rebuild FOLDER | password"
)


def add_options(parser: argparse.ArgumentParser) -> None:
    """Options of all actions."""
    parser.usage = _USAGE + " [options]"
    parser.add_argument(
        "words",
        nargs="+",
        metavar="STUDY.yaml | ACTION TARGET",
        help="host a study (a shipped one by its name: paper), or do one of: " + ", ".join(ACTIONS),
    )
    parser.add_argument("--host", default="127.0.0.1", help="address to listen on")
    parser.add_argument("--port", type=int, default=8080, help="port to listen on; 0: any free")
    parser.add_argument("--sessions", type=Path, default=Path("sessions"), metavar="DIR")
    parser.add_argument("--capacity", type=int, default=0, metavar="N", help="participants at once")
    parser.add_argument(
        "--behind-tls-proxy", metavar="ORIGIN", help="public origin of a TLS reverse proxy"
    )
    parser.add_argument("--open", action="store_true", help="open the page in a browser")
    parser.add_argument(
        "--test-run", action="store_true", help="mark the data as test data; allows /?fast=1"
    )
    parser.add_argument(
        "--dry-run",
        action="store_true",
        help="send simulated participants through the pages' protocol, then end",
    )
    parser.add_argument(
        "--participants", type=int, default=0, metavar="N", help="of a dry run; 0: two a cell"
    )
    parser.add_argument(
        "--with-comments", action="store_true", help="export what participants wrote, too"
    )
    parser.add_argument(
        "--out", type=Path, metavar="DIR", help="where an export goes, or a dry run's study is kept"
    )


def run(args: argparse.Namespace) -> int:
    """Do what was asked for.

    Raises:
        AppError: If it is not possible.
    """
    action = args.words[0] if args.words[0] in ACTIONS else "host"
    targets = args.words[1:] if action != "host" else args.words
    if action == "password":
        from app.study.server.password import set_password

        return set_password(args.sessions)
    if len(targets) != 1:
        raise StudyError(f"study {' '.join(args.words)}: valid is {_USAGE}")
    target = targets[0]
    if action == "check" and not args.dry_run:
        from app.study.check import check
        from app.study.load import load_study

        print(check(load_study(target)))
        return 0
    if action == "sheet":
        from app.study.load import load_study
        from app.study.sheet import run_sheet

        print(run_sheet(load_study(target)))
        return 0
    if action == "export":
        from app.study.export import export_study

        done = export_study(Path(target), args.out, with_comments=args.with_comments)
        print(f"{done.participants} participants, {done.trials} logs in {done.folder}")
        for note in done.notes:
            print(note, file=sys.stderr)
        return 0
    if action == "rebuild":
        from app.study.rebuild import rebuild

        print(rebuild(Path(target)))
        return 0
    if args.dry_run:
        from app.study.dry_run import dry_run

        return dry_run(target, args.participants, args.out)
    return _host(args, target)


def _host(args: argparse.Namespace, target: str) -> int:
    from app.study.server.run import HostOptions, host_study
    from app.web.config import ServerConfig

    config = ServerConfig(
        host=args.host,
        port=args.port,
        sessions=args.sessions,
        capacity=args.capacity,
        public_origin=(args.behind_tls_proxy or "").rstrip("/"),
        open_browser=args.open,
    )
    host_study(HostOptions(target, config, args.test_run))
    return 0
