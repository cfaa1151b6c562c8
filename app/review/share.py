"""One HTML file of a trial that plays from disk, in any browser, without us.

viser's own serializer writes the scene and its changes into viser's client. The page's tags cannot
travel along, so probabilities are drawn as viser's labels; the value slice, a picture a moment, is
left out for size.
"""

import contextlib
import io
from html import escape
from pathlib import Path

from app.review.jobs import Progress, Result
from app.review.opening import open_trial
from app.review.posing import ArmPoser
from app.review.replay import Replay
from app.session.drawing import Viewer
from app.session.view_server import view_server

MAX_FRAMES = 20_000
VISIBLE = "<style>canvas { opacity: 1 !important }</style>"
"""viser fades its canvas in from 5 %, which stalls where few pictures are drawn."""
LAYERS = {"slice": False, "path": True}


def share_html(
    replay: Replay, theme: str = "dark", rate_hz: float = 30.0, progress: Progress = lambda s: None
) -> str:
    """The trial as one HTML document with a timeline.

    Args:
        replay: The trial.
        theme: "dark" or "light".
        rate_hz: Frames a second; fewer for trials that would have more than `MAX_FRAMES`.
        progress: Told how far it is.

    Raises:
        ThemeError: If there is no such theme.
    """
    header = replay.header
    dt = header.control_dt_s
    stride = max(1, round(1.0 / (rate_hz * dt)), -(-replay.n_steps // MAX_FRAMES))
    with view_server() as server, contextlib.redirect_stdout(io.StringIO()):
        viewer = Viewer(server, replay.scene, theme, labels=True)
        try:
            viewer.set_layers(LAYERS)
            viewer.set_target(header.instructed_goal)
            poser = ArmPoser()
            viewer.update(poser.record(replay, 0), replay.goals(0))
            serializer = server.get_scene_serializer()
            for step in range(0, replay.n_steps, stride):
                viewer.update(poser.record(replay, step), replay.goals(step), None)
                serializer.insert_sleep(stride * dt)
                progress(0.9 * step / replay.n_steps)
            html = serializer.as_html(dark_mode=theme == "dark")
            about = f"{header.instructed_goal}, {header.method}"
            title = f"{header.participant}, trial {header.trial}: {about}"
            html = html.replace("<title>Viser</title>", f"<title>{escape(title)}</title>", 1)
            return html.replace("</head>", f"{VISIBLE}</head>", 1)
        finally:
            viewer.close()


def share_job(path: str, theme: str, rate_hz: float, progress: Progress) -> Result:
    """The HTML file of a trial; runs as a job."""
    replay = Replay(open_trial(Path(path), lambda share: progress(0.3 * share)))
    html = share_html(replay, theme, rate_hz, lambda share: progress(0.3 + 0.7 * share))
    header = replay.header
    name = f"{header.study}-{header.participant}-{header.session}-trial-{header.trial:03d}.html"
    return Result(html.encode(), "text/html", name)
