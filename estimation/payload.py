"""The payload nobody measured: its mass, its band, and which hand bears it where that shows."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from scipy.special import ndtri

from estimation.errors import MissingMeasurementError
from estimation.estimate_record import Bands, Estimate
from estimation.norm_quantiles import norm_quantiles
from estimation.spatial import GRAVITY_MS2, Array, BoolArray, times

Definition = Literal["inertial", "vertical", "norm"]
#: A hand's force is told apart if its spread fell below this share of the widest one beforehand.
TOLD_APART = 0.3
#: Correlation of the errors of a load's force and of its acceleration, between none and whole; held
#: to coverage by ``benchmarks.estimation.uncertainty``.
TOGETHER = 0.5
#: Below this proper acceleration a held mass weighs too little to be found, m/s^2.
LEAST_PULL = 1.0


@dataclass(frozen=True, slots=True)
class Payload:
    """What the free sites bear together.

    Attributes:
        definition: which kilograms. ``inertial``: the mass that, moved as the sites move, would
            pull like this; right in motion. ``vertical``: the downward force over 9.81.  ``norm``:
            the papers', the force's length over 9.81; never negative, too large near zero.
        sites: the links it may act on.
        mass_kg: ``(n,)``; for ``norm`` of the mean force.
        sd_kg: ``(n,)`` to first order, or None without standard deviations.
        quantiles_kg: ``(n, p)`` of its distribution, or None.
        probabilities: ``p`` of them.
        force_world: ``(n, 3)`` N, all sites together, on the person.
        force_covariance: ``(n, 3, 3)`` N^2, or None.
        split_observable: ``(n,)`` whether the share of each site can be told; the sum always can.
        weightless: ``(n,)`` the sites all but fall freely, so that no mass could be felt.
        bands: as the estimate's.
    """

    definition: Definition
    sites: tuple[str, ...]
    mass_kg: Array
    sd_kg: Array | None
    quantiles_kg: Array | None
    probabilities: tuple[float, ...]
    force_world: Array
    force_covariance: Array | None
    split_observable: BoolArray
    weightless: BoolArray
    bands: Bands


def payload(
    estimate: Estimate,
    definition: Definition = "inertial",
    probabilities: Sequence[float] = (0.05, 0.5, 0.95),
) -> Payload:
    """Reads the payload off the external wrenches at the free sites.

    Only the sum over the sites follows from the balance of the body; how two hands share it does
    not, unless something else tells.

    Args:
        estimate: with at least one `FreeWrench` among its measurements.
        definition: which kilograms.
        probabilities: of the quantiles wanted.

    Raises:
        MissingMeasurementError: the estimate has no free site.

    Source: Tirupachuri et al. 2021, section IV-C2 (``norm``). Derived here: a held mass ``m`` whose
    proper acceleration is ``a`` pulls with ``F = -m a``, so least squares give
    ``m = -F'a / a'a``, linear in ``F`` and so Gaussian with it. An error ``d`` of ``a`` changes it
    by ``-m a'd / a'a``. What moves the hand wrongly moves the body wrongly, too, so the two errors
    are related; their correlation is not worked out but taken to be `TOGETHER`.
    """
    if not estimate.sites:
        raise MissingMeasurementError(
            "payload: expected a FreeWrench where a load may act, such as "
            "FreeWrench('RightHandCOM'); got none"
        )
    links = [estimate.link(name) for name in estimate.sites]
    rotation = estimate.link_rotation[:, links]
    force = np.sum(times(rotation, estimate.external_wrench[:, links, :3]), axis=1)
    covariance = _sum_covariance(estimate, rotation)
    pull = np.mean(times(rotation, estimate.link_acceleration[:, links, :3]), axis=1)
    size = np.linalg.norm(pull, axis=1)
    weightless = size < LEAST_PULL
    if definition == "norm":
        mass = np.linalg.norm(force, axis=1) / GRAVITY_MS2
        direction = force / np.maximum(np.linalg.norm(force, axis=1), 1e-9)[:, None] / GRAVITY_MS2
    elif definition == "vertical":
        direction = np.broadcast_to(np.array([0.0, 0.0, -1.0 / GRAVITY_MS2]), force.shape)
        mass = np.sum(force * direction, axis=1)
    else:
        direction = -pull / np.maximum(size, LEAST_PULL)[:, None] ** 2
        mass = np.sum(force * direction, axis=1)
    sd, quantiles = None, None
    if covariance is not None:
        sd = np.sqrt(np.einsum("ni,nij,nj->n", direction, covariance, direction))
        if definition == "inertial":
            other = np.abs(mass) * np.sqrt(_pull_variance(estimate, links))
            sd = np.sqrt(sd**2 + 2.0 * TOGETHER * sd * other + other**2)
        if definition == "norm":
            quantiles = norm_quantiles(force, covariance, probabilities) / GRAVITY_MS2
        else:
            quantiles = mass[:, None] + sd[:, None] * ndtri(np.asarray(probabilities))
    return Payload(
        definition=definition,
        sites=estimate.sites,
        mass_kg=mass,
        sd_kg=sd,
        quantiles_kg=quantiles,
        probabilities=tuple(probabilities),
        force_world=force,
        force_covariance=covariance,
        split_observable=_split_observable(estimate),
        weightless=weightless,
        bands=estimate.bands,
    )


def _pull_variance(estimate: Estimate, links: Sequence[int]) -> Array:
    """Variance ``(n,)`` of the sites' proper acceleration along itself, as a share of its square.

    As if the sites' errors were the same, and each site's axes' errors not related.
    """
    if estimate.link_acceleration_sd is None:
        return np.zeros(len(estimate.frames))
    pull = estimate.link_acceleration[:, links, :3]
    size = np.maximum(np.sum(pull**2, axis=-1), LEAST_PULL**2)
    along = pull / size[..., None]
    spread = along**2 * estimate.link_acceleration_sd[:, links, :3] ** 2
    return np.asarray(np.mean(np.sum(spread, axis=-1), axis=1))


def _sum_covariance(estimate: Estimate, rotation: Array) -> Array | None:
    """Covariance ``(n, 3, 3)`` of the sites' forces together, world axes."""
    if estimate.site_covariance is None:
        return None
    count = len(estimate.sites)
    gather = np.zeros((len(rotation), 3, 6 * count))
    for site in range(count):
        gather[:, :, 6 * site : 6 * site + 3] = rotation[:, site]
    return np.asarray(gather @ estimate.site_covariance @ gather.swapaxes(-1, -2))


def _split_observable(estimate: Estimate) -> BoolArray:
    count = len(estimate.sites)
    told = np.full(len(estimate.frames), count == 1)
    if count == 1 or estimate.site_covariance is None or estimate.site_prior is None:
        return told
    forces = np.concatenate([np.arange(6 * site, 6 * site + 3) for site in range(count)])
    before = np.diagonal(estimate.site_prior, axis1=-2, axis2=-1)[:, forces]
    after = np.diagonal(estimate.site_covariance, axis1=-2, axis2=-1)[:, forces]
    return np.asarray(np.max(after, axis=1) < TOLD_APART**2 * np.max(before, axis=1))
