"""Statistics against hand-made data, a second implementation, and the paper's printed numbers."""

import math
import warnings

import numpy as np
import pandas as pd
import pingouin
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy import stats

from app.analysis.anova import one_way, two_way, write_out
from app.analysis.design import Cells
from app.analysis.hypotheses import adjust, format_p
from app.analysis.paired import compare, dz_interval, ratio_of_means, signed_rank

PAPER_PREFER = np.array([6, 6, 4, 3, 2, 2, 2, 2, 1, 1])
"""The ten answers to `prefer`: the only ones that give M 2.90, SD 1.76, W 9.0 and p .09846."""


def make_cells(values: np.ndarray) -> Cells:
    """Cells of values (participants × methods × objects)."""
    n, a, b = values.shape
    return Cells(
        "time_s",
        tuple(f"p{i:03d}" for i in range(n)),
        tuple("abcdef"[:a]),
        tuple("uvwxyz"[:b]),
        values,
        np.isfinite(values).astype(float),
    )


def test_anova_of_data_worked_out_by_hand() -> None:
    """Method differences 1, 2, 3 of three participants: t = 2 / (1/√3) = 3.46, F = t² = 12."""
    values = np.array([[[11.0], [10.0]], [[12.0], [10.0]], [[13.0], [10.0]]])
    effect = one_way(make_cells(values)).effect("method")
    assert effect.f == pytest.approx(12.0)
    assert (effect.df1, effect.df2, effect.epsilon) == (1, 2, 1.0)
    assert effect.partial_eta2 == pytest.approx(12 / 14)
    # SS method = 6, SS error = 1, SS participants = 1: 6 / 8.
    assert effect.generalised_eta2 == pytest.approx(6 / 8)


@settings(max_examples=15, deadline=None)
@given(st.integers(0, 10**6), st.integers(4, 14), st.integers(2, 4), st.integers(2, 4))
def test_three_implementations_agree(seed: int, n: int, a: int, b: int) -> None:
    """pingouin, statsmodels and sums of squares written out give one F for every effect."""
    values = np.random.default_rng(seed).normal(size=(n, a, b)) + np.arange(a)[:, None]
    found = two_way(make_cells(values))
    assert set(found.checked_with) == {"sums of squares written out", "pingouin", "statsmodels"}
    assert found.agreement < 1e-8


def test_corrections_and_effect_sizes_agree_with_pingouin() -> None:
    """Epsilon, Mauchly's p, corrected p, and partial and generalised eta² of every effect."""
    rng = np.random.default_rng(3)
    values = rng.normal(size=(12, 2, 4)) * np.array([1.0, 2.0, 3.0, 4.0]) + rng.normal(
        size=(12, 1, 1)
    )
    rows = [(i, m, o, values[i, m, o]) for i in range(12) for m in range(2) for o in range(4)]
    long = pd.DataFrame(rows, columns=pd.Index(["who", "method", "object", "value"]))
    for effsize, field in (("np2", "partial_eta2"), ("ng2", "generalised_eta2")):
        with warnings.catch_warnings():
            warnings.filterwarnings("ignore", category=pd.errors.Pandas4Warning)
            table = pingouin.rm_anova(
                long, "value", ["method", "object"], "who", detailed=True, effsize=effsize
            )
        for effect, row in zip(
            write_out(values, ("method", "object")), table.to_dict("records"), strict=True
        ):
            assert getattr(effect, field) == pytest.approx(row[effsize])
            assert effect.epsilon == pytest.approx(row["eps"])
            assert effect.p_corrected == pytest.approx(row["p_GG_corr"])
            if effect.df1 > 1:
                # pingouin follows R, whose second-order term has the number of conditions where
                # Anderson (2003) has the degrees of freedom: the third digit differs.
                assert effect.mauchly_p == pytest.approx(row["p_spher"], abs=1e-3)


def test_a_missing_cell_drops_its_participant_and_says_who() -> None:
    """Two-way uses complete participants; the paired means keep the shared objects of others."""
    values = np.random.default_rng(0).normal(10.0, 1.0, size=(8, 2, 3))
    values[2, 1, 0] = values[5, :, :] = np.nan
    cells = make_cells(values)
    assert two_way(cells).dropped == ("p002", "p005")
    participants, means = cells.balanced_means()
    assert "p005" not in participants
    row = participants.index("p002")
    assert means[row] == pytest.approx(values[2, :, 1:].mean(axis=1))


@pytest.mark.parametrize("n", [2, 3, 4])
def test_few_participants_still_have_an_f(n: int) -> None:
    """As few as two: F without a test of sphericity, nothing raised or warned of."""
    values = np.random.default_rng(n).normal(10.0, 1.0, size=(n, 3, 3))
    found = two_way(make_cells(values))
    assert found.n == n and all(math.isfinite(e.f) for e in found.effects)
    assert found.agreement < 1e-8


def test_equal_differences_have_no_f() -> None:
    """Everyone exactly 1 s faster: no error variance, F undefined, nothing raised."""
    values = np.random.default_rng(0).normal(size=(5, 1, 3)) + np.array([[[0.0]], [[1.0]]]).reshape(
        1, 2, 1
    )
    effect = two_way(make_cells(values)).effect("method")
    assert math.isnan(effect.f) and math.isnan(effect.p)


@pytest.mark.parametrize(("f", "p"), [(12.98, 0.006), (7.76, 0.021)])
def test_the_papers_f_give_its_p(f: float, p: float) -> None:
    """F(1, 9) of time and input; dz = √(F / n) is then 1.14 and 0.88."""
    assert round(float(stats.f.sf(f, 1, 9)), 3) == p


def test_an_anova_with_the_papers_f_prints_the_papers_p() -> None:
    """Differences scaled to F(1, 9) = 12.98 go through our table to .006 and dz 1.14."""
    z = stats.norm.ppf((np.arange(10) + 0.5) / 10)
    z = (z - z.mean()) / z.std(ddof=1)
    differences = z + (12.98 / 10) ** 0.5
    values = np.stack([differences + 8.6, np.full(10, 8.6)], axis=1)[:, :, None]
    effect = one_way(make_cells(values)).effect("method")
    assert effect.f == pytest.approx(12.98)
    assert format_p(effect.p) == "=\N{NO-BREAK SPACE}.006"
    assert compare(differences).dz == pytest.approx(1.14, abs=0.005)


def test_benjamini_hochberg_of_the_papers_p() -> None:
    """.006 .021 .471 .098 become .024 .042 .471 .131; a test that does not exist takes no share."""
    names = ("time", "input", "like", "prefer")
    adjusted = adjust(dict(zip(names, (0.006, 0.021, 0.471, 0.098), strict=True)))
    assert [round(adjusted[n], 3) for n in names] == [0.024, 0.042, 0.471, 0.131]
    without = adjust({"time": 0.006, "input": 0.021, "like": float("nan"), "prefer": float("nan")})
    assert without["time"] == pytest.approx(0.012) and math.isnan(without["like"])


def test_the_papers_preference_was_a_signed_rank_test() -> None:
    """Its M, SD, W = 9.0 and p = .098458502 (in its source) fix the ten answers, by signed ranks.

    W and p leave tie groups of 6, 2 and 1; M and SD then leave one assignment of 1 to 7.
    """
    assert PAPER_PREFER.mean() == pytest.approx(2.90)
    assert round(float(PAPER_PREFER.std()), 2) == 1.76
    ranks = signed_rank(PAPER_PREFER - 4.0)
    assert (ranks.w, ranks.zeros, ranks.n, ranks.ties) == (9.0, 1, 10, 8)
    assert ranks.p_asymptotic == pytest.approx(0.098458502377584176, abs=1e-12)
    assert ranks.method == "exact over sign patterns (ties)"
    assert ranks.lean == -1


def test_the_papers_like_follows_from_its_w_and_ties() -> None:
    """W = 16.5 with one zero and tie groups of 3, 4 and 2 gives the p = .4713 of its source."""
    ranks = signed_rank(np.array([2, 2, 2, -2, -1, -1, -1, -3, -3, 0], dtype=float))
    assert ranks.w == 16.5
    assert ranks.p_asymptotic == pytest.approx(0.47130320504429746, abs=1e-12)


def test_exact_ranks_count_sign_patterns() -> None:
    """Five differences of one sign: 2 of 2⁵ patterns are as extreme, ties or not."""
    assert signed_rank(np.array([1.0, 2, 3, 4, 5])).p == pytest.approx(2 / 32)
    tied = signed_rank(np.array([1.0, 1, 1, 4, 5]))
    assert tied.p == pytest.approx(2 / 32) and tied.ties == 3


@pytest.mark.parametrize("seed", range(4))
def test_exact_ranks_agree_with_scipys_permutations(seed: int) -> None:
    """With ties and zeros, p is what scipy finds by visiting the sign patterns one by one."""
    d = np.random.default_rng(seed).integers(-3, 4, size=9).astype(float)
    nonzero = d[d != 0]
    expected = stats.wilcoxon(nonzero, method=stats.PermutationMethod())  # type: ignore[arg-type]
    assert signed_rank(d).p == pytest.approx(float(expected[1]))  # type: ignore[arg-type]


def test_ranks_without_differences_say_why() -> None:
    """All zero, or nobody there: no p and a reason."""
    assert signed_rank(np.zeros(4)).note == "every difference is zero"
    assert signed_rank(np.array([])).note == "nobody answered"


def test_interval_of_dz_inverts_the_noncentral_t() -> None:
    """At its ends the observed t has the tail probabilities 2.5 %."""
    low, high = dz_interval(1.14, 10, 0.95)
    t = 1.14 * 10**0.5
    assert stats.nct.sf(t, 9, low * 10**0.5) == pytest.approx(0.025)
    assert stats.nct.cdf(t, 9, high * 10**0.5) == pytest.approx(0.025)


def test_ratio_of_means_is_of_means() -> None:
    """(10 + 20) / (5 + 15), not the mean of 2 and 1.33; constant data have no width."""
    found = ratio_of_means(np.array([10.0, 20.0]), np.array([5.0, 15.0]))
    assert found.estimate == pytest.approx(1.5)
    assert found.low <= found.estimate <= found.high
    same = ratio_of_means(np.full(6, 3.0), np.full(6, 2.0))
    assert (same.low, same.high) == pytest.approx((1.5, 1.5))
