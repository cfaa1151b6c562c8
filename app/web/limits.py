"""Bounds on how often something may happen: token buckets, and log lines that do not flood."""

import logging
import time
from collections import OrderedDict
from collections.abc import Callable, Hashable

Clock = Callable[[], float]


class TokenBucket:
    """At most `burst` at once and `rate_per_s` in the long run."""

    def __init__(self, rate_per_s: float, burst: float, clock: Clock = time.monotonic) -> None:
        self._rate_per_s = rate_per_s
        self._burst = burst
        self._clock = clock
        self._tokens = burst
        self._at_s = clock()

    def take(self, amount: float = 1.0) -> bool:
        """Take `amount` tokens; False, and nothing is taken, where there are not enough."""
        now_s = self._clock()
        gained = (now_s - self._at_s) * self._rate_per_s
        self._tokens = min(self._burst, self._tokens + gained)
        self._at_s = now_s
        if self._tokens < amount:
            return False
        self._tokens -= amount
        return True


class KeyedBuckets:
    """One bucket a key (an address, a session), for the `most` keys seen last."""

    def __init__(self, rate_per_s: float, burst: float, most: int = 4096) -> None:
        self._rate_per_s = rate_per_s
        self._burst = burst
        self._most = most
        self._buckets: OrderedDict[Hashable, TokenBucket] = OrderedDict()

    def take(self, key: Hashable) -> bool:
        """Take one token of this key's bucket."""
        bucket = self._buckets.pop(key, None) or TokenBucket(self._rate_per_s, self._burst)
        self._buckets[key] = bucket
        if len(self._buckets) > self._most:
            self._buckets.popitem(last=False)
        return bucket.take()


class QuietLog:
    """Log lines of one kind, at most `per_minute`; the next one says how many were left out."""

    def __init__(self, logger: logging.Logger, per_minute: float = 6.0, burst: int = 5) -> None:
        self._logger = logger
        self._bucket = TokenBucket(per_minute / 60, burst)
        self._left_out = 0

    def warning(self, text: str) -> None:
        """Log, or count."""
        if not self._bucket.take():
            self._left_out += 1
            return
        suffix = f" ({self._left_out} like it left out)" if self._left_out else ""
        self._left_out = 0
        self._logger.warning("%s%s", text, suffix)
