"""Plates onto the motion's frames, smoothed as the motion's accelerations are."""

import re

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import convolve1d

from estimation.spatial import Array
from human import Motion

#: Steps longer than this many usual ones are gaps: nothing is known inside.
_GAP_FACTOR = 3.5
#: How `human.motion_from_configurations` states the window in a motion's provenance.
_STATED = r"local cubics, window ([\d.]+) s"


def resampled(time_s: Array, values: Array, at_s: Array, window_s: float) -> Array:
    """Returns signals at other times, averaged with the weights that differentiation implies.

    Derived here: the second derivative of a polynomial of order two or three fitted to
    ``x(t + u)``, ``|u| <= h``, at its middle is ``45/(4 h^5) int (u^2 - h^2/3) x du``. By parts
    twice it is the mean of ``x''`` with the weights ``15/(16 h) (1 - (u/h)^2)^2``. Forces averaged
    with these weights belong to accelerations that were derived so: neither lags nor leads.

    Args:
        time_s: ``(samples,)`` s, strictly increasing.
        values: ``(samples, k)``.
        at_s: ``(frames,)`` s; outside of ``time_s`` the nearest value stands.
        window_s: full width ``2 h`` of the window, s; zero interpolates and no more.

    Returns:
        ``(frames, k)``.
    """
    if len(time_s) < 2:
        return np.repeat(values[:1], len(at_s), axis=0)
    step = float(np.median(np.diff(time_s)))
    half = int(np.floor(0.5 * window_s / step + 1e-9))
    if half < 1:
        return _interpolated(time_s, values, at_s)
    even = time_s[0] + step * np.arange(int(np.ceil((time_s[-1] - time_s[0]) / step)) + 1)
    u = np.arange(-half, half + 1) * step / (0.5 * window_s)
    weights = np.maximum(1.0 - u**2, 0.0) ** 2
    signal = _interpolated(time_s, values, even)
    inside = np.ones(len(even))
    total = convolve1d(inside, weights, mode="constant")
    mean = convolve1d(signal, weights, axis=0, mode="constant") / total[:, None]
    return _interpolated(even, mean, at_s)


def smoothing_width_s(motion: Motion, window_s: float | None) -> float:
    """Returns how wide forces must be smoothed to match a motion's accelerations, s.

    Args:
        motion: the motion; its provenance names the window that it was differentiated with.
        window_s: that window where the caller knows it; None reads the provenance.

    Returns:
        Zero where the accelerations were not derived. A window of n samples weighs as one that is n
        steps wide.
    """
    if window_s is None:
        stated = [re.search(_STATED, step) for step in motion.provenance.steps]
        window_s = max((float(found[1]) for found in stated if found), default=0.0)
    if not window_s or len(motion) < 2:
        return 0.0
    step = float(np.median(np.diff(motion.time_s)))
    return float((np.floor(window_s / step + 1e-9) + 1.0) * step)


def uncovered(time_s: Array, at_s: Array) -> NDArray[np.bool_]:
    """Returns the times ``(frames,)`` at which there are no samples: before, after, or in a gap."""
    if len(time_s) < 2:
        return np.ones(len(at_s), dtype=np.bool_)
    step = np.diff(time_s)
    usual = float(np.median(step))
    after = np.clip(np.searchsorted(time_s, at_s, side="right"), 1, len(time_s) - 1)
    gap = step[after - 1] > _GAP_FACTOR * usual
    outside = (at_s < time_s[0] - usual) | (at_s > time_s[-1] + usual)
    return np.asarray(outside | (gap & (at_s > time_s[after - 1]) & (at_s < time_s[after])))


def _interpolated(time_s: Array, values: Array, at_s: Array) -> Array:
    """Returns signals between their samples, along straight lines."""
    after = np.clip(np.searchsorted(time_s, at_s, side="right"), 1, len(time_s) - 1)
    before = after - 1
    share = (at_s - time_s[before]) / (time_s[after] - time_s[before])
    share = np.clip(share, 0.0, 1.0)[:, None]
    return np.asarray((1.0 - share) * values[before] + share * values[after])
