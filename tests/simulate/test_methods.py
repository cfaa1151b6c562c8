"""Methods by text: what can be said, and what is answered to what cannot."""

import math

import pytest

from app.core import METHODS, preset
from app.simulate.errors import SimulateError
from app.simulate.methods import VARIANTS, parse_methods


def test_plain_names_mean_the_preset():
    """Without variant and settings a method is exactly what the preset says."""
    for spec in parse_methods(",".join(METHODS)):
        assert spec.settings == preset("default", method=spec.name)


def test_blend_means_distance_arbitration():
    """And a variant names another."""
    plain, gate = parse_methods("blend, blend:probability-gate")
    assert plain.settings.arbitration == "distance"
    assert gate.settings.arbitration == "probability-gate"
    assert gate.name == "blend:probability-gate"


def test_settings_follow_the_at_sign():
    """Any number of them, each of its own type."""
    (spec,) = parse_methods("yielding:exact@gain=1.5@w_l=inf@predictor=paper@enabled=false")
    settings = spec.settings
    assert (settings.gain, settings.w_l, settings.predictor) == (1.5, math.inf, "paper")
    assert (settings.step, settings.enabled) == ("exact", False)


def test_common_settings_give_way_to_named_ones():
    """What is said with a method is more particular than what is said of all."""
    first, second = parse_methods("policy,policy@gain=2", common={"gain": 0.5})
    assert (first.settings.gain, second.settings.gain) == (0.5, 2.0)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("assistant", list(METHODS)),
        ("policy,bland", list(METHODS)),
        ("", list(METHODS)),
        ("blend:gate", list(VARIANTS["blend"])),
        ("direct:exact", ["none"]),
        ("policy@gian=1", ["gian", "gain", "beta"]),
        ("policy@gain", ["gain", "beta"]),
        ("policy@method=blend", ["gain"]),
        ("policy@gain=7", ["gain", "7", "2"]),
        ("policy@predictor=oracle", ["calibrated", "paper", "oracle"]),
        ("policy,policy", ["twice"]),
    ],
)
def test_what_is_unknown_lists_what_is_valid(text: str, said: list[str]):
    """One line that helps."""
    with pytest.raises(SimulateError) as error:
        parse_methods(text)
    for word in said:
        assert word in str(error.value)


def test_an_unknown_preset_lists_the_valid():
    """By name."""
    with pytest.raises(SimulateError, match="valid: paper, ada, default"):
        parse_methods("policy", "authors")
