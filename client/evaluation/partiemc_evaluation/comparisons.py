"""Methods against a baseline: geometric means of the sequences' ratios, with bootstrap intervals."""

import math
from typing import Callable, NamedTuple, Sequence as Seq

import numpy as np

from .geometry import Floats
from .metrics import ABSENT
from .study import Row, mean_of

TIE_SHARE = 0.01     # A sequence is a tie if its numbers differ by at most this share of the baseline's.
LOSS_RATIO = 1.25    # Sequences with a larger ratio are listed by name.
RATIO_LIMIT = 10.0   # Limits ratios to [1 / this, this], so that one number near 0 does not decide a mean.
STILL_JITTER = 0.01  # Known jitter of the baseline, in spacings, up to which a body rests and is not compared.
_RESAMPLES, _SEED = 2000, 20_240_117


class Ratio(NamedTuple):
    """Geometric mean of ratios with its 95 % bootstrap interval."""
    value: float = ABSENT
    low: float = ABSENT
    high: float = ABSENT


class Comparison(NamedTuple):
    """One metric of one method against the baseline."""
    ratio: Ratio
    ratio_of_means: float
    wins: int
    ties: int
    losses: int


def ratios(pairs: Floats) -> Floats:
    """(N,) ratios of pairs (N, 2) of method and baseline, not negative; 1 if both are 0. Limited by RATIO_LIMIT."""
    with np.errstate(divide="ignore", invalid="ignore"):
        ratio = np.where((pairs == 0).all(axis=1), 1.0, pairs[:, 0] / pairs[:, 1])
    return np.clip(ratio, 1 / RATIO_LIMIT, RATIO_LIMIT)


def geometric_mean(pairs: Floats) -> float:
    return float(np.exp(np.log(ratios(pairs)).mean())) if len(pairs) else ABSENT


def bootstrap(pairs: Floats, seed: int = _SEED) -> Ratio:
    """The geometric mean, and percentiles 2.5 and 97.5 of 2,000 samples drawn with replacement."""
    if not len(pairs):
        return Ratio()
    drawn = np.random.default_rng(seed).integers(len(pairs), size=(_RESAMPLES, len(pairs)))
    means = np.sort(np.log(ratios(pairs))[drawn].mean(axis=1))
    low, high = means[_RESAMPLES // 40], means[-1 - _RESAMPLES // 40]
    return Ratio(geometric_mean(pairs), float(np.exp(low)), float(np.exp(high)))


def ratio_of_means(pairs: Floats) -> float:
    """Ratio of the means, as in the paper: sequences with large numbers decide. Infinite if only the baseline is 0."""
    if not len(pairs):
        return ABSENT
    method, baseline = pairs.sum(axis=0)
    return float(method / baseline) if baseline > 0 else math.inf if method > 0 else 1.0


def match(method: Seq[Row], baseline: Seq[Row], metric: str) -> Floats:
    """(N, 2) numbers of method and baseline, for judged sequences that have both, in the order of
    `method`. Pairs of a known jitter are left out if the baseline's is at most STILL_JITTER."""
    numbers = {row.sequence: row[metric] for row in baseline}
    pairs = np.array([(row[metric], numbers[row.sequence]) for row in method
                      if row.judged and row.sequence in numbers], float).reshape(-1, 2)
    pairs = pairs[~np.isnan(pairs).any(axis=1)]
    return pairs[pairs[:, 1] > STILL_JITTER] if metric.startswith("known_") else pairs


def compare_rows(method: Seq[Row], baseline: Seq[Row], metric: str) -> Comparison:
    pairs = match(method, baseline, metric)
    margin = TIE_SHARE * pairs[:, 1]
    wins, losses = (int((sign * (pairs[:, 0] - pairs[:, 1]) > margin).sum()) for sign in (-1, 1))
    return Comparison(bootstrap(pairs), ratio_of_means(pairs), wins, len(pairs) - wins - losses, losses)


class Part(NamedTuple):
    """Sequences of one group, sampler or name, with one ratio for each metric."""
    name: str
    sequences: int
    ratios: dict[str, Ratio]


def compare_parts(method: Seq[Row], baseline: Seq[Row], metrics: Seq[str], worst_by: str,
                  key: Callable[[Row], str]) -> list[Part]:
    """The judged rows in parts of equal `key`, worst first by the metric `worst_by`."""
    groups: dict[str, list[Row]] = {}
    for row in method:
        if row.judged:
            groups.setdefault(key(row), []).append(row)
    parts = [Part(name, len(rows), {m: compare_rows(rows, baseline, m).ratio for m in metrics})
             for name, rows in groups.items()]
    return sorted(parts, key=lambda part: -np.nan_to_num(part.ratios[worst_by].value, nan=-1.0))


def mean_over(rows: Seq[Row], metric: str) -> float:
    """Mean over the judged rows that have the metric."""
    return mean_of([row[metric] for row in rows if row.judged])
