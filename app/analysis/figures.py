"""Which figures a study gives, with their captions; each as PDF, PNG and themed SVG."""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from matplotlib.figure import Figure

from app.analysis.figure_beyond import (
    draw_calibration,
    draw_explored,
    draw_learning,
    draw_link,
)
from app.analysis.figure_outcomes import draw_survey, draw_time_and_input
from app.analysis.figure_traces import choose_traces, draw_traces, read_trace
from app.analysis.results import Results
from app.analysis.style import MANY, figure_style, save


@dataclass(frozen=True)
class Drawn:
    """A figure of the report.

    Attributes:
        name: Stem of its files.
        title: What it shows.
        caption: How to read it.
        svg: The drawing, coloured by the page's tokens.
    """

    name: str
    title: str
    caption: str
    svg: str


def draw_figures(
    results: Results, folder: Path, progress: Callable[[str], None]
) -> dict[str, Drawn]:
    """Draw everything that the results allow into a folder."""
    drawn: dict[str, Drawn] = {}

    def add(name: str, figure: Figure | None, title: str, caption: str) -> None:
        if figure is not None:
            progress(f"figure {name}")
            drawn[name] = Drawn(name, title, caption, save(figure, folder, name))

    with figure_style():
        trials, people, contrast = results.trials, results.participants, results.contrast
        if results.methods:
            who = (
                "Each point is one participant and object; colour and marker tell participants "
                "apart, the same in every figure."
                if len(people) <= MANY
                else "Each point is one participant and object."
            )
            add(
                "time-and-input",
                draw_time_and_input(trials, people, contrast),
                "Time and input (the paper's figure 6)",
                "Left, means and standard errors over participants. Right, the difference against "
                f"the value of {contrast[0] if contrast else 'the reference'}. {who}",
            )
        if results.survey_means is not None:
            add(
                "survey",
                draw_survey(results.survey, people, contrast),
                "Survey (the paper's figure 7)",
                "Left, means and standard errors; dotted, the neutral 4. Right, the difference in "
                "“like” against “prefer”; "
                + (
                    "answers on one coordinate stand around it."
                    if len(people) <= MANY
                    else "the area tells how many answered so."
                ),
            )
        _add_traces(results, add)
        if results.explored:
            add(
                "explored",
                draw_explored(results.explored),
                "Measures beyond the paper",
                "Mean ± SD over participants' means.",
            )
        if results.calibration is not None and len(results.calibration):
            add(
                "calibration",
                draw_calibration(results.calibration),
                "Calibration of the belief",
                "Every goal in every tick of the running phase is a forecast. Ticks of a trial "
                "are not independent: read the shape, not the noise.",
            )
        if results.trends:
            add(
                "learning",
                draw_learning(trials),
                "Learning",
                "Counted trials in the order they were done.",
            )
            add("link", draw_link(trials), "Link", "Each point is one counted trial.")
    return drawn


def _add_traces(results: Results, add: Callable[[str, Figure | None, str, str], None]) -> None:
    if results.contrast is None:
        return
    for i, chosen in enumerate(choose_traces(results.trials, results.survey, results.contrast)):
        traces = [read_trace(results.data.folder / file) for file in chosen.files]
        whole = [trace for trace in traces if trace is not None]
        if len(whole) == len(traces):
            add(
                f"traces-{i + 1}",
                draw_traces(whole),
                f"User input and assistance of {chosen.participant_id}, who {chosen.reason}; "
                f"{chosen.object} (the paper's figure {8 + i})",
                "Top three, each dimension of the velocity: user input, and the assistance minus "
                "the user input under the belief and had the goal been known. Bottom, the dot "
                "product of user input and assistance: below 0 the user works against it.",
            )
