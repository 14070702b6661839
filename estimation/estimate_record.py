"""The estimate: what moved, what pushed, what the joints bore, and how well each is known."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal

from estimation.errors import UnknownLinkError
from estimation.spatial import Array, IntArray
from estimation.tree import EstimationTree

Method = Literal["one_step", "two_step", "deterministic"]
Bands = Literal["uncertainty", "widened", "tuning", "none"]


@dataclass(frozen=True, slots=True)
class Estimate:
    """Posterior means of the whole vector d by name, with standard deviations.

    Wrenches and accelerations are in each link's own axes at its own origin, linear first. The
    standard deviations are None where the method gives none or none were asked for.

    Attributes:
        tree: the links, joints and degrees of freedom that name the columns.
        method: how it was made.
        frames: ``(n,)`` which of the frames given were estimated.
        left_out: frames that were not, by the measurement that is not finite there.
        link_acceleration: ``(n, n_links, 6)`` proper acceleration, m/s^2 and rad/s^2.
        external_wrench: ``(n, n_links, 6)`` N, N m, acting on the link.
        joint_wrench: ``(n, n_links - 1, 6)`` N, N m, parent on child, at the joint's centre in the
            child's axes.
        joint_acceleration: ``(n, n_dof)`` rad/s^2.
        torque: ``(n, n_dof)`` N m.
        link_acceleration_sd: as ``link_acceleration``.
        external_wrench_sd: as ``external_wrench``.
        joint_wrench_sd: as ``joint_wrench``.
        joint_acceleration_sd: as ``joint_acceleration``.
        torque_sd: as ``torque``.
        joint_moment_covariance: ``(n, n_links - 1, 3, 3)`` (N m)^2, child axes.
        sites: the links on which something unmeasured may push.
        site_covariance: ``(n, 6 m, 6 m)`` joint covariance of the external wrenches on the sites.
        site_prior: ``(n, 6 m, 6 m)`` the same before the equations of motion.
        link_rotation: ``(n, n_links, 3, 3)`` link axes in the world.
        residual: ``(n, 6)`` N, N m, base axes and origin: what motion and measured wrenches leave
            over before the equations of motion are imposed. A wrong body mass shows here.
        residual_chi2: ``(n,)`` the same in units of its covariance: mean 6 if all covariances are
            true. None where there is no covariance.
        bands: ``uncertainty`` where the covariances were the sensors' noise, ``widened`` where
            errors of the model are in them, too, ``tuning`` for the papers' presets, whose bands
            cover little of the truth, ``none``.
        assumed: what was derived or changed instead of measured, in words.
        engine: what did the arithmetic, the compiled ``kernel`` or ``numpy``; their numbers agree.
    """

    tree: EstimationTree
    method: Method
    frames: IntArray
    left_out: Mapping[str, tuple[int, ...]]
    link_acceleration: Array
    external_wrench: Array
    joint_wrench: Array
    joint_acceleration: Array
    torque: Array
    link_acceleration_sd: Array | None
    external_wrench_sd: Array | None
    joint_wrench_sd: Array | None
    joint_acceleration_sd: Array | None
    torque_sd: Array | None
    joint_moment_covariance: Array | None
    sites: tuple[str, ...]
    site_covariance: Array | None
    site_prior: Array | None
    link_rotation: Array
    residual: Array
    residual_chi2: Array | None
    bands: Bands
    assumed: tuple[str, ...]
    engine: Literal["kernel", "numpy"] = "numpy"

    def link(self, name: str) -> int:
        """Returns the column of a link.

        Raises:
            UnknownLinkError: there is none of that name.
        """
        if name not in self.tree.link_names:
            raise UnknownLinkError(name, self.tree.link_names)
        return self.tree.link_names.index(name)

    def joint(self, name: str) -> int:
        """Returns the column of a joint.

        Raises:
            UnknownLinkError: there is none of that name.
        """
        if name not in self.tree.joint_names:
            raise UnknownLinkError(name, self.tree.joint_names)
        return self.tree.joint_names.index(name)


def from_results(
    results: Mapping[str, Array],
    *,
    tree: EstimationTree,
    method: Method,
    frames: IntArray,
    left_out: Mapping[str, tuple[int, ...]],
    sites: tuple[str, ...],
    bands: Literal["uncertainty", "tuning", "none"],
    assumed: tuple[str, ...],
    engine: Literal["kernel", "numpy"],
) -> Estimate:
    """Makes the record from arrays by name; those that a method does not give are None.

    Args:
        results: arrays by their names in `Estimate`.
        tree: see `Estimate`, as all that follow.
        method: how it was made.
        frames: which were estimated.
        left_out: which were not.
        sites: where something unmeasured may push.
        bands: what the standard deviations are.
        assumed: in words.
        engine: what did the arithmetic.
    """
    return Estimate(
        tree=tree,
        method=method,
        frames=frames,
        left_out=left_out,
        link_acceleration=results["link_acceleration"],
        external_wrench=results["external_wrench"],
        joint_wrench=results["joint_wrench"],
        joint_acceleration=results["joint_acceleration"],
        torque=results["torque"],
        link_acceleration_sd=results.get("link_acceleration_sd"),
        external_wrench_sd=results.get("external_wrench_sd"),
        joint_wrench_sd=results.get("joint_wrench_sd"),
        joint_acceleration_sd=results.get("joint_acceleration_sd"),
        torque_sd=results.get("torque_sd"),
        joint_moment_covariance=results.get("joint_moment_covariance"),
        sites=sites,
        site_covariance=results.get("site_covariance"),
        site_prior=results.get("site_prior"),
        link_rotation=results["link_rotation"],
        residual=results["residual"],
        residual_chi2=results.get("residual_chi2"),
        bands=bands,
        assumed=assumed,
        engine=engine,
    )
