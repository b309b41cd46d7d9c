"""Random cases and quasi-random cases of a batch, with the numbers of sweep files (docs/batches.md).

A random number depends on the seed, the name and the number of its case alone. It is computed by additions,
multiplications, divisions and square roots of IEEE numbers alone, so that it equals that of `refdyn batch` to the bit.

Philox: J. K. Salmon, M. A. Moraes, R. O. Dror, D. E. Shaw, "Parallel random numbers: as easy as 1, 2, 3", SC11. Normal
quantile: M. J. Wichura, "Algorithm AS 241: The percentage points of the normal distribution", Applied Statistics 37 (1988).
"""
from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np

from .names import nearest, not_one_of, one_real, suggests

LEAST = 2.0 ** -54  # the normal distribution has no quantile at 0
LARGEST = 1e300
COUNT_MOST = 10**7  # some 100 bytes a case and name
LN2_HIGH, LN2_LOW = float.fromhex("0x1.62e42fefa3800p-1"), float.fromhex("0x1.ef35793c76730p-45")
MASK = np.uint64(0xFFFFFFFF)
SHIFT = np.uint64(32)
SEQUENCES = ("random", "sobol", "halton")
ARGUMENTS = {"normal": ("mean", "deviation"), "uniform": ("from_", "to"), "log_uniform": ("from_", "to")}

# AS 241: coefficients of numerator and denominator in the middle, near the tails and far in the tails.
MIDDLE = ((3.3871328727963666080e0, 1.3314166789178437745e+2, 1.9715909503065514427e+3, 1.3731693765509461125e+4, 4.5921953931549871457e+4,
           6.7265770927008700853e+4, 3.3430575583588128105e+4, 2.5090809287301226727e+3),
          (1.0, 4.2313330701600911252e+1, 6.8718700749205790830e+2, 5.3941960214247511077e+3, 2.1213794301586595867e+4, 3.9307895800092710610e+4,
           2.8729085735721942674e+4, 5.2264952788528545610e+3))
NEAR = ((1.42343711074968357734e0, 4.63033784615654529590e0, 5.76949722146069140550e0, 3.64784832476320460504e0, 1.27045825245236838258e0,
         2.41780725177450611770e-1, 2.27238449892691845833e-2, 7.74545014278341407640e-4),
        (1.0, 2.05319162663775882187e0, 1.67638483018380384940e0, 6.89767334985100004550e-1, 1.48103976427480074590e-1, 1.51986665636164571966e-2,
         5.47593808499534494600e-4, 1.05075007164441684324e-9))
FAR = ((6.65790464350110377720e0, 5.46378491116411436990e0, 1.78482653991729133580e0, 2.96560571828504891230e-1, 2.65321895265761230930e-2,
        1.24266094738807843860e-3, 2.71155556874348757815e-5, 2.01033439929228813265e-7),
       (1.0, 5.99832206555887937690e-1, 1.36929880922735805310e-1, 1.48753612908506148525e-2, 7.86869131145613259100e-4, 1.84631831751005468180e-5,
        1.42151175831644588870e-7, 2.04426310338993978564e-15))


class Distribution(NamedTuple):
    """Made by refdyn.normal, refdyn.uniform or refdyn.log_uniform; a value of refdyn.sample."""

    name: str
    a: float
    b: float

    def __repr__(self) -> str:
        return f"refdyn.{self.name}({self.a!r}, {self.b!r})"

    def quantile(self, u: np.ndarray) -> np.ndarray:
        """The values below which the fractions u of the distribution lie."""
        if self.name == "normal":
            return self.a + self.b * normal_quantile(u)
        if self.name == "uniform":
            return self.a + (self.b - self.a) * u
        begin, end = logarithm(self.a), logarithm(self.b)
        return exponential(begin + (end - begin) * u)


def bound(name: str, value: Any) -> float:
    number = one_real(name, value)
    if not math.isfinite(number):
        raise ValueError(f"{name}: {number:g}; must be finite")
    if abs(number) > LARGEST:
        raise ValueError(f"{name}: {number:g}; must not be beyond {LARGEST:g}")
    return number


def distribution(name: str, a: Any, b: Any) -> Distribution:
    low, high = (bound(f"{name}: {argument}", value) for argument, value in zip(ARGUMENTS[name], (a, b)))
    if name == "normal" and high < 0:
        raise ValueError(f"normal: standard deviation {high:g}; must not be negative")
    if name != "normal" and not low < high:
        raise ValueError(f"{name}: from {low:g} to {high:g}; the range must ascend")
    if name == "log_uniform" and low <= 0:
        raise ValueError(f"log_uniform: from {low:g}; bounds must be positive")
    return Distribution(name, low, high)


@suggests
def normal(mean: float, deviation: float) -> Distribution:
    """Normally distributed; `deviation` is the standard deviation."""
    return distribution("normal", mean, deviation)


@suggests
def uniform(from_: float, to: float) -> Distribution:
    """Uniformly distributed."""
    return distribution("uniform", from_, to)


@suggests
def log_uniform(from_: float, to: float) -> Distribution:
    """With a uniformly distributed logarithm."""
    return distribution("log_uniform", from_, to)


def sample(count: int, names: Mapping[str, Distribution] | None = None, /, *, seed: int = 0, sequence: str = "random", **more: Distribution) -> dict[str, np.ndarray]:
    """Returns `count` random cases for `arm.batch`: `refdyn.sample(100, seed=7, E=refdyn.normal(2.1e11, 2e9))`.

    With sequence="random" and "halton" the numbers are those of a sweep file with this seed, to the bit. "halton" and "sobol"
    fill the range more evenly: the points of Halton's sequence and of Sobol's sequence (SciPy's direction numbers, by S. Joe
    and F. Y. Kuo), shifted modulo 1 by the seed.
    """
    if names is not None and not isinstance(names, Mapping):
        raise TypeError(f"sample: {type(names).__name__}; must be distributions by name, E=refdyn.normal(2.1e11, 2e9)")
    given = joined("sample", names or {}, more)
    check_sample(count, seed, sequence, given)
    values = {}
    points = POINTS[sequence](int(count), len(given)) if sequence in POINTS else None
    for column, name in enumerate(sorted(given)):
        if points is None:
            u = uniform_numbers(seed, name, np.arange(count, dtype=np.uint64))
        else:
            u = points[:, column] + uniform_numbers(seed, name, np.zeros(1, dtype=np.uint64))
            u = np.maximum(u - np.floor(u), LEAST)
        values[name] = given[name].quantile(u)
    return {name: values[name] for name in given}


def joined(call: str, names: Mapping[str, Any], more: Mapping[str, Any]) -> dict[str, Any]:
    """What a call gets by name, in a mapping and as keywords."""
    for name in more:
        if name in names:
            raise TypeError(f"{call}: {name} is given twice; give it once")
    return {**names, **more}


def check_sample(count: int, seed: int, sequence: str, given: Mapping[str, Distribution]) -> None:
    for what, number, least in (("count", count, 1), ("seed", seed, 0)):
        if isinstance(number, bool) or not isinstance(number, (int, np.integer)):
            raise TypeError(f"sample: {what}: {type(number).__name__}; must be a whole number")
        if not least <= number <= 2**53:
            raise ValueError(f"sample: {what}: value {number}; must be {'a positive whole number' if least else 'a whole number and not negative'}")
    if count > COUNT_MOST:
        raise ValueError(f"sample: count: value {count}; must be at most {COUNT_MOST}")
    if sequence not in SEQUENCES:
        raise ValueError(f"sequence: {not_one_of(sequence, SEQUENCES)}")
    if not given:
        raise ValueError("sample: no name; add at least one, E=refdyn.normal(2.1e11, 2e9)")
    for name, value in given.items():
        if not isinstance(name, str):
            raise TypeError(f"sample: name {name!r}; must be a text")
        if not isinstance(value, Distribution):
            near = nearest(name, ("seed", "sequence"))
            raise TypeError(f"{name}: {type(value).__name__}; must be refdyn.normal, refdyn.uniform or refdyn.log_uniform" + (f"; did you mean the keyword {near!r}?" if near else ""))


# ---- Points of sequences ----

def primes(count: int) -> list[int]:
    found: list[int] = []
    number = 2
    while len(found) < count:
        if all(number % prime for prime in found):
            found.append(number)
        number += 1
    return found


def halton_points(count: int, width: int) -> np.ndarray:
    """Points 1 ... count. Each coordinate writes the number in a prime base, and its digits in reverse order after the point."""
    points = np.zeros((count, width))
    for column, base in enumerate(primes(width)):
        numbers, part = np.arange(1, count + 1), 1.0
        while numbers.any():
            part *= 1.0 / base
            points[:, column] += part * (numbers % base)
            numbers //= base
    return points


def sobol_points(count: int, width: int) -> np.ndarray:
    try:
        from scipy.stats import qmc
    except ImportError as error:
        raise ImportError('sample: sequence="sobol" needs SciPy; install it with pip install scipy') from error
    points: np.ndarray = qmc.Sobol(width, scramble=False).random_base2(math.ceil(math.log2(count)))
    return points[:count]


POINTS = {"sobol": sobol_points, "halton": halton_points}  # by sequence: (count, width)


# ---- Uniform numbers ----

def stream_of(name: str) -> int:
    """FNV-1a hash."""
    found = 14695981039346656037
    for byte in name.encode():
        found = (found ^ byte) * 1099511628211 % 2**64
    return found


def uniform_numbers(seed: int, name: str, numbers: np.ndarray) -> np.ndarray:
    """Philox 4x32-10 of the seed, the name and the numbers of the cases. A result is the middle of one of 2^52 equal intervals."""
    stream = stream_of(name)
    c = [numbers & MASK, numbers >> SHIFT, np.full_like(numbers, stream & 0xFFFFFFFF), np.full_like(numbers, stream >> 32)]
    keys = [int(seed) & 0xFFFFFFFF, int(seed) >> 32]
    for _ in range(10):
        first, second = np.uint64(0xD2511F53) * c[0], np.uint64(0xCD9E8D57) * c[2]
        c = [(second >> SHIFT) ^ c[1] ^ np.uint64(keys[0]), second & MASK, (first >> SHIFT) ^ c[3] ^ np.uint64(keys[1]), first & MASK]
        keys = [(keys[0] + 0x9E3779B9) & 0xFFFFFFFF, (keys[1] + 0xBB67AE85) & 0xFFFFFFFF]
    part: np.ndarray = ((c[0] << SHIFT) | c[1]) >> np.uint64(12)
    return np.divide(part.astype(float) + 0.5, 4503599627370496.0)


# ---- Logarithm, exponential, normal numbers ----

def logarithm(x: Any) -> Any:
    """x = 2^e m, m near 1, and ln m = 2 artanh s with s = (m - 1) / (m + 1)."""
    m, e = np.frexp(x)
    is_small = m < 0.70710678118654752
    m, e = np.where(is_small, 2 * m, m), np.where(is_small, e - 1, e).astype(float)
    s = (m - 1) / (m + 1)
    s2, total = s * s, 0.0
    for k in range(23, 2, -2):
        total = s2 * (total + 1.0 / k)
    return e * LN2_HIGH + (2 * s + (2 * s * total + e * LN2_LOW))


def exponential(x: np.ndarray) -> np.ndarray:
    """x = k ln 2 + r, and the series of exp r."""
    k = np.floor(x / LN2_HIGH + 0.5)
    r, total = (x - k * LN2_HIGH) - k * LN2_LOW, np.ones_like(k)
    for i in range(15, 0, -1):
        total = 1 + r / i * total
    return np.asarray(np.ldexp(total, k.astype(int)))


def ratio(coefficients: tuple[tuple[float, ...], tuple[float, ...]], x: np.ndarray) -> np.ndarray:
    above, below = (np.full_like(x, polynomial[7]) for polynomial in coefficients)
    for i in range(6, -1, -1):
        above, below = above * x + coefficients[0][i], below * x + coefficients[1][i]
    result: np.ndarray = above / below
    return result


def normal_quantile(u: np.ndarray) -> np.ndarray:
    """The value below which a standard normal variable lies with probability u."""
    q = u - 0.5
    is_middle = np.abs(q) <= 0.425
    r = np.sqrt(-logarithm(np.where(is_middle, 0.5, np.where(q < 0, u, 1 - u))))
    size = np.where(r <= 5, ratio(NEAR, r - 1.6), ratio(FAR, r - 5))
    return np.asarray(np.where(is_middle, q * ratio(MIDDLE, 0.180625 - q * q), np.where(q < 0, -size, size)))
