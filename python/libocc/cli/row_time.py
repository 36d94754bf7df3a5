# SPDX-License-Identifier: Apache-2.0
"""Period of the stripes that a rolling shutter makes of blinking light, in rows.

Two kinds of pictures are used. An evenly lit surface under a lamp with mains ripple (100 or 120 Hz) has stripes across
the whole picture: the logarithm of the row means is fitted by a polynomial and the harmonics of one frequency. A
small lamp that blinks fast has stripes on its own image, which `detect` measures.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .._core import Readout, Sensor, detect

Signal = NDArray[np.float64]

MIN_ROW_S, MAX_ROW_S = 0.5e-6, 2e-4  # row times of cameras, from 8 million pixels at 120 Hz to slow webcams
MIN_PERIODS = 2.0  # fewer resemble a gradient of the light
MIN_TRIED = 0.75  # fewer periods in the picture cannot be distinguished from a trend
MIN_PERIOD_PX = 4.0
BLOCKS = 8  # parts of the picture, side by side; stripes are equal in all of them
MIN_EXPLAINED = 0.97  # part of the variance of the row means, without their trend and noise; an edge has up to 0.75
MIN_RIPPLE = 1e-5  # r.m.s., relative
MIN_SIGNAL = 1.3  # variance of the row means, without their trend, over that of their noise
MIN_COHERENCE = 0.8  # of the amplitudes of the blocks: 1 for stripes, 1/BLOCKS for random texture
MAX_RELATIVE_SIGMA = 0.05
TREND_SIGMA = 5e-4  # relative, of 3 periods: light that no trend of DEGREE fits; from 73 rendered pictures
SATURATED, BLACK = 0.98, 0.01  # parts of the full scale
MIN_COLUMNS = 16  # usable columns
DEGREE, HARMONICS = 5, 3  # of the trend; the light falls off in even powers
LOW_DEGREE, MIN_EXPLAINED_LOW = 2, 0.8  # a period that needs a higher trend may be part of a longer one
GRID = 8  # frequencies per 1 / rows
FEW_PERIODS, MAX_PEAKS = 8, 30  # of the frequencies whose fit is computed
ASSUMED_ROW_S = 1.25e-5  # detect() then searches periods from 4 rows: up to 20 kHz
MAX_CHI = 5.0  # normalised difference from the mean, beyond which images contradict each other
NO_LAMP = "no lamp has visible stripes"


class NoStripes(Exception):
    """The picture has no stripes that can be measured; the text has the reason."""


@dataclass(frozen=True)
class Stripes:
    """Stripes of a picture."""

    period_px: float
    sigma_px: float
    periods: float  # in the picture or on the lamp
    contrast: float  # amplitude over mean; NaN for a lamp
    readout: str  # rows or columns
    place: str  # "picture" or "lamp"

    def row_time_s(self, frequency_hz: float) -> tuple[float, float]:
        """Row time and its standard deviation."""
        value = 1 / (frequency_hz * self.period_px)
        return value, value * self.sigma_px / self.period_px


def grey_of(pixels: NDArray[Any]) -> tuple[Signal, float]:
    """Mean of the colours, and the full scale."""
    full = float(np.iinfo(pixels.dtype).max)
    grey = pixels[..., :3].mean(axis=2) if pixels.ndim == 3 else pixels.astype(float)
    return np.asarray(grey, float), full


def block_signals(pixels: NDArray[Any]) -> Signal:
    """Logarithm of the row means of each block (BLOCKS, rows). Columns with saturated or black pixels are omitted."""
    grey, full = grey_of(pixels)
    good = ((grey < SATURATED * full) & (grey > BLACK * full)).all(axis=0)
    columns = np.flatnonzero(good)
    if len(columns) < max(MIN_COLUMNS, BLOCKS):
        bright = float((grey >= SATURATED * full).any(axis=0).mean())
        what = "saturated" if bright > 0.5 else "too dark"
        raise NoStripes(f"nearly every column has pixels that are {what}; change the exposure")
    means = [grey[:, part].mean(axis=1) for part in np.array_split(columns, BLOCKS)]
    return np.asarray(np.log(np.stack(means)), float)


class Fit:
    """Least-squares fit of a trend and harmonics to signals of one length."""

    def __init__(self, rows: int, degree: int):
        self.at = np.arange(rows) - (rows - 1) / 2
        trend = np.polynomial.legendre.legvander(2 * self.at / rows, degree)
        self._trend = np.linalg.qr(trend)[0]

    def without_trend(self, signal: Signal) -> Signal:
        return np.asarray(signal - self._trend @ (self._trend.T @ signal))

    def harmonics(self, frequency: float) -> Signal:
        phase = 2 * np.pi * frequency * self.at
        return np.stack([f(k * phase) for k in range(1, HARMONICS + 1) for f in (np.cos, np.sin)], axis=1)

    def residuals(self, signal: Signal, frequency: float) -> tuple[Signal, Signal]:
        """Residuals of a signal without trend, and the coefficients of the harmonics."""
        basis = self.without_trend(self.harmonics(frequency))
        found = np.linalg.solve(basis.T @ basis, basis.T @ signal)  # well conditioned from MIN_PERIODS on
        return np.asarray(signal - basis @ found, float), np.asarray(found, float)

    def cost(self, signal: Signal, frequency: float) -> float:
        residuals, _ = self.residuals(signal, frequency)
        return float(residuals @ residuals)

    def refined(self, signal: Signal, frequency: float, step: float) -> float:
        """Minimum of the cost near a frequency, by repeated parabolas."""
        for _ in range(12):
            low, middle, high = (self.cost(signal, frequency + side * step) for side in (-1, 0, 1))
            curvature = low - 2 * middle + high
            move = 0.5 * step * (low - high) / curvature if curvature > 0 else 0.0
            frequency += float(np.clip(move, -step, step))
            step /= 2
        return frequency

    def sigma(self, signal: Signal, frequency: float) -> float:
        """Standard deviation of the frequency from the residuals, which may be correlated.

        Newey, West, "A simple, positive semi-definite, heteroskedasticity and autocorrelation consistent covariance
        matrix", Econometrica 1987, with lags up to a period: imperfections of the trend are about as long.
        """
        residuals, found = self.residuals(signal, frequency)
        phase = 2 * np.pi * frequency * self.at
        slope = np.zeros_like(signal)
        for k in range(1, HARMONICS + 1):
            a, b = found[2 * k - 2 : 2 * k]
            slope += 2 * np.pi * k * self.at * (b * np.cos(k * phase) - a * np.sin(k * phase))
        basis = np.hstack([self._trend, self.harmonics(frequency)])
        slope -= basis @ np.linalg.solve(basis.T @ basis, basis.T @ slope)
        parts = slope * residuals
        lags = min(len(parts) - 1, round(1 / frequency))
        size = 1 << (2 * len(parts) - 1).bit_length()
        covariances = np.fft.irfft(np.abs(np.fft.rfft(parts, size)) ** 2, size)[: lags + 1]
        weights = 1 - np.arange(lags + 1) / (lags + 1)
        variance = float(covariances[0] + 2 * weights[1:] @ covariances[1:])
        free = len(signal) / (len(signal) - basis.shape[1] - 1)
        return float(np.sqrt(max(variance, float(covariances[0])) * free) / (slope @ slope))


def frequency_range(rows: int, frequency_hz: float) -> tuple[float, float]:
    """Frequencies [1/px] of possible stripes. Raises: NoStripes."""
    low = max(MIN_PERIODS / rows, frequency_hz * MIN_ROW_S)
    high = min(1 / MIN_PERIOD_PX, frequency_hz * MAX_ROW_S)
    if low >= high:
        raise NoStripes(f"{rows} rows are too few for {MIN_PERIODS:g} periods of {frequency_hz:g} Hz")
    return low, high


def candidates(signal: Signal, grid: Signal, step: float) -> NDArray[np.bool_]:
    """Frequencies whose fit is computed: all with few periods, and the neighbourhoods of the highest harmonic sums."""
    power = np.abs(np.fft.rfft(signal, GRID * len(signal))) ** 2
    at = np.rint(grid / step).astype(int)
    sums = sum(power[np.minimum(k * at, len(power) - 1)] for k in range(1, HARMONICS + 1))
    chosen = grid * len(signal) < FEW_PERIODS
    inner = np.r_[False, (sums[1:-1] >= sums[:-2]) & (sums[1:-1] >= sums[2:]), False]
    for peak in np.flatnonzero(inner)[np.argsort(sums[inner])[-MAX_PEAKS:]]:
        chosen[max(0, peak - 2) : peak + 3] = True
    return np.asarray(chosen)


def fundamental(fit: Fit, signal: Signal, low: float, high: float) -> float:
    """Frequency with the best fit. Of frequencies that fit equally well, the highest: half of it fits as well."""
    step = 1 / (GRID * len(signal))
    grid = step * np.arange(np.ceil(low / step), np.floor(high / step) + 1)
    chosen = candidates(signal, grid, step)
    explained = np.full(len(grid), -1.0)
    explained[chosen] = [1 - fit.cost(signal, frequency) / float(signal @ signal) for frequency in grid[chosen]]
    inner = explained[1:-1]
    peaks = np.flatnonzero((inner > 0) & (inner >= explained[:-2]) & (inner >= explained[2:])) + 1
    if len(peaks) == 0:
        raise NoStripes("the brightness of the rows has no period")
    good = peaks[explained[peaks] >= 0.98 * explained[peaks].max()]
    return fit.refined(signal, float(grid[good[-1]]), step)


def depends_on_trend(signal: Signal, frequency: float, noise: float) -> bool:
    """True if the fit is poor with a simple trend: the complex one then contains a longer period."""
    fit = Fit(len(signal), LOW_DEGREE)
    flat = fit.without_trend(signal)
    total = float(flat @ flat)
    return total - fit.cost(flat, frequency) < MIN_EXPLAINED_LOW * (total - noise)


def better_with_few_periods(fit: Fit, signal: Signal, frequency: float) -> bool:
    """True if a period that is too long to be measured fits better; multiples of the period fit as well."""
    rows = len(signal)
    grid = np.arange(MIN_TRIED, MIN_PERIODS, 1 / GRID) / rows
    multiple = np.min([np.abs(k * grid / frequency - 1) for k in range(2, HARMONICS + 1)], axis=0) < 1 / GRID
    best = fit.cost(signal, frequency)
    return any(fit.cost(signal, each) < best for each in grid[~multiple])


def stripes_of_surface(pixels: NDArray[Any], frequency_hz: float, readout: str) -> Stripes:
    """Stripes across the picture of an evenly lit surface. Raises: NoStripes."""
    blocks = block_signals(pixels if readout == "rows" else np.swapaxes(pixels, 0, 1))
    rows = blocks.shape[1]
    fit = Fit(rows, DEGREE)
    flat = np.stack([fit.without_trend(block) for block in blocks])
    signal = flat.mean(axis=0)
    noise = 0.5 * float((np.diff(signal) ** 2).sum())
    total = float(signal @ signal)
    limits = frequency_range(rows, frequency_hz)
    if total < MIN_SIGNAL * noise or total < rows * MIN_RIPPLE**2:
        raise NoStripes(
            f"no stripes are visible across the {readout}: their brightness has no more than noise and a trend"
        )
    frequency = fundamental(fit, signal, *limits)
    explained = min(1.0, (total - fit.cost(signal, frequency)) / (total - noise))
    amplitudes = np.array([complex(*fit.residuals(block, frequency)[1][:2]) for block in flat])
    coherence = abs(amplitudes.mean()) ** 2 / float((np.abs(amplitudes) ** 2).mean())
    if explained < MIN_EXPLAINED or coherence < MIN_COHERENCE:
        raise NoStripes(
            f"no stripes are visible across the {readout}: a period explains {100 * explained:.0f} % of their "
            f"brightness ({100 * MIN_EXPLAINED:.0f} % are needed), and {100 * coherence:.0f} % are equal from side to "
            f"side ({100 * MIN_COHERENCE:.0f} % are needed); the surface must be even, exposed for less than half a "
            f"period, with at least {MIN_PERIODS:g} periods in the picture"
        )
    if depends_on_trend(blocks.mean(axis=0), frequency, noise) or better_with_few_periods(fit, signal, frequency):
        raise NoStripes(f"fewer than {MIN_PERIODS:g} periods are in the picture: they resemble a gradient of the light")
    # Jackknife over the blocks, which includes the texture of the surface.
    step = 1 / (GRID * rows)
    parts = np.array([fit.refined(np.delete(flat, i, axis=0).mean(axis=0), frequency, step) for i in range(BLOCKS)])
    scatter = float(np.sqrt((BLOCKS - 1) / BLOCKS * ((parts - parts.mean()) ** 2).sum()))
    trend = TREND_SIGMA * (3 / (frequency * rows)) ** 2 * frequency
    sigma = float(np.hypot(max(scatter, fit.sigma(signal, frequency)), trend))
    if sigma > MAX_RELATIVE_SIGMA * frequency:
        raise NoStripes(f"the stripes are too weak: their period has a sigma of {100 * sigma / frequency:.0f} %")
    contrast = float(abs(amplitudes.mean()))
    return Stripes(1 / frequency, sigma / frequency**2, frequency * rows, contrast, readout, "picture")


def stripes_of_lamp(pixels: NDArray[Any], readout: str) -> Stripes:
    """Stripes on the image of a lamp. Raises: NoStripes."""
    sensor = Sensor(
        row_time_s=ASSUMED_ROW_S,
        exposure_s=1e-6,
        readout=Readout.__members__[readout],
        bit_depth=8 * pixels.dtype.itemsize,
    )
    found = [blob for blob in detect(pixels, sensor=sensor) if blob.frequency_hz is not None]
    if not found:
        raise NoStripes(NO_LAMP)
    periods = np.array([1 / (blob.frequency_hz * ASSUMED_ROW_S) for blob in found if blob.frequency_hz])
    sigmas = np.array([blob.frequency_sigma_hz / blob.frequency_hz for blob in found if blob.frequency_hz]) * periods
    weights = sigmas**-2.0
    mean = float(weights @ periods / weights.sum())
    if (np.abs(periods - mean) > 5 * sigmas + 0.02 * mean).any():
        text = ", ".join(f"{period:.1f}" for period in sorted(periods))
        raise NoStripes(f"the lamps have different stripes, with periods of {text} px; cover all lamps but one")
    chi2 = float((weights * (periods - mean) ** 2).sum()) / max(1, len(periods) - 1)
    sigma = float(weights.sum() ** -0.5) * max(1.0, chi2**0.5)
    high = max(blob.area_px for blob in found) ** 0.5  # the side of a square of equal area
    return Stripes(mean, sigma, high / mean, float("nan"), readout, "lamp")


def stripes_of(pixels: NDArray[Any], frequency_hz: float, readout: str) -> Stripes:
    """Stripes across the picture or on a lamp; readout: rows, columns or unknown. Raises: NoStripes."""
    found: list[Stripes] = []
    reasons: list[str] = []
    directions = ("rows", "columns") if readout == "unknown" else (readout,)
    for each in directions:
        try:
            found.append(stripes_of_surface(pixels, frequency_hz, each))
        except NoStripes as error:
            reasons.append(f"{error}")
    if found:
        return min(found, key=lambda stripes: stripes.sigma_px / stripes.period_px)
    surface, of_lamps = reasons[0], NO_LAMP
    if readout == "unknown":
        surface = surface.replace("across the rows", "across the rows or columns")
    for each in directions:
        try:
            found.append(stripes_of_lamp(pixels, each))
        except NoStripes as error:
            of_lamps = f"{error}" if of_lamps == NO_LAMP else of_lamps
    if not found:
        raise NoStripes(f"across the picture: {surface}; on lamps: {of_lamps}")
    best = min(found, key=lambda stripes: stripes.sigma_px / stripes.period_px)
    row_s, _ = best.row_time_s(frequency_hz)
    if not MIN_ROW_S <= row_s <= MAX_ROW_S:
        raise NoStripes(
            f"stripes of {best.period_px:.1f} px on a lamp would be a row time of {row_s:.3g} s, which no camera has: "
            "another frequency made them"
        )
    return best


def combined(found: Sequence[Stripes], frequency_hz: float, frequency_sigma_hz: float) -> dict[str, Any]:
    """Weighted mean of the row times with its standard deviation, and whether the images agree."""
    times, sigmas = np.array([stripes.row_time_s(frequency_hz) for stripes in found]).T
    weights = sigmas**-2.0
    mean = float(weights @ times / weights.sum())
    chi2 = float((weights * (times - mean) ** 2).sum()) / max(1, len(times) - 1)
    sigma = float(weights.sum() ** -0.5) * max(1.0, chi2**0.5)
    far = np.abs(times - mean) > np.maximum(MAX_CHI * sigmas, 0.02 * mean)
    readouts = {stripes.readout for stripes in found}
    return {
        "row_time_s": mean,
        "sigma_s": float(np.hypot(sigma, mean * frequency_sigma_hz / frequency_hz)),
        "readout": found[0].readout,
        "consistent": bool(not far.any() and len(readouts) == 1),
    }
