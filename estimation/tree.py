"""The tree of links that the estimator works on.

By default its links are the person's segments, joined by joints of one to three axes, and the named
points where a load may act, fixed to their segments. For comparison with the papers every axis can
have a joint of its own, with massless links between.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from estimation.errors import TreeError
from estimation.spatial import Array, IntArray, spatial_inertia
from human import HumanModel

#: Where a held load acts; links of their own, so that its wrench is an unknown of its own.
HAND_FRAMES = ("RightHandCOM", "LeftHandCOM")
#: Configurations start with the base's position and quaternion, velocities with its twist.
BASE_NQ, BASE_NV = 7, 6


@dataclass(frozen=True, eq=False)
class EstimationTree:
    """Rigid links on joints of none to three axes, a floating base first.

    Attributes:
        link_names: ``n_links`` names, parents before children; the first is the base.
        joint_names: the joint above each link but the base: joint ``j`` moves link ``j + 1``.
        parents: index of each link's parent; -1 for the base.
        offsets: ``(n_links, 3)`` m, the link's origin in its parent's axes; zero for the base.
        axes: for each link, the axes (0, 1, 2) its joint turns about, one after another; none for
            the base and for fixed joints.
        dofs: for each link, the indices of those axes among the degrees of freedom.
        inertias: ``(n_links, 6, 6)`` about the links' origins, linear first.
        dof_names: ``n_dof`` names.

    Source: Latella et al. 2019, section 2.2, with joints of several axes.
    """

    link_names: tuple[str, ...]
    joint_names: tuple[str, ...]
    parents: tuple[int, ...]
    offsets: Array
    axes: tuple[tuple[int, ...], ...]
    dofs: tuple[IntArray, ...]
    inertias: Array
    dof_names: tuple[str, ...]

    def __post_init__(self) -> None:
        """Makes arrays read-only and refuses what is no tree."""
        count = len(self.link_names)
        # Compiled code trusts these numbers as addresses: nobody changes them afterwards.
        object.__setattr__(self, "dofs", tuple(_indices(dofs) for dofs in self.dofs))
        if not count == len(self.parents) == len(self.axes) == len(self.dofs):
            raise TreeError(f"tree: expected {count} parents, axes and dofs, one for each link")
        if len(self.joint_names) != count - 1 or len(set(self.link_names)) != count:
            raise TreeError("tree: expected distinct links and one joint above each but the base")
        if self.parents[0] != -1 or self.axes[0]:
            raise TreeError("tree: expected the base first, without parent and joint")
        for index, parent in enumerate(self.parents[1:], 1):
            if not 0 <= parent < index:
                raise TreeError(f"link {self.link_names[index]!r}: expected its parent before it")
            if len(self.axes[index]) != len(self.dofs[index]) or len(self.axes[index]) > 3:
                raise TreeError(
                    f"link {self.link_names[index]!r}: expected a degree of freedom for each axis"
                )
            if not set(self.axes[index]) <= {0, 1, 2}:
                raise TreeError(
                    f"link {self.link_names[index]!r}: expected axes of 0, 1 and 2, got "
                    f"{self.axes[index]}"
                )
        if sorted(np.concatenate(self.dofs).tolist()) != list(range(len(self.dof_names))):
            raise TreeError("tree: expected every degree of freedom once")
        for name, shape in (("offsets", (count, 3)), ("inertias", (count, 6, 6))):
            array = np.array(getattr(self, name), dtype=np.float64)
            if array.shape != shape or not np.all(np.isfinite(array)):
                raise TreeError(f"{name}: expected finite numbers of shape {shape}")
            array.flags.writeable = False
            object.__setattr__(self, name, array)

    @property
    def n_links(self) -> int:
        """Number of links, massless and fixed ones included."""
        return len(self.link_names)

    @property
    def n_dof(self) -> int:
        """Number of joint degrees of freedom, without the base."""
        return len(self.dof_names)

    @property
    def mass_kg(self) -> float:
        """The person's mass, kg."""
        return float(np.sum(self.inertias[:, 0, 0]))

    def path(self, link: int) -> list[int]:
        """Returns the links from this one up to the base, both included."""
        out = [link]
        while self.parents[out[-1]] >= 0:
            out.append(self.parents[out[-1]])
        return out


def _indices(dofs: IntArray) -> IntArray:
    out = np.array(dofs)
    if out.ndim != 1 or (len(out) and out.dtype.kind not in "iu"):
        raise TreeError(f"tree: expected whole numbers as degrees of freedom, got {dofs!r}")
    out = out.astype(np.intp)
    out.flags.writeable = False
    return out


def real_tree(model: HumanModel, frames: Sequence[str] = HAND_FRAMES) -> EstimationTree:
    """Makes the tree of real links: the segments, and the named frames as massless links.

    Args:
        model: the person.
        frames: named points where a wrench may act that is to be an unknown of its own.

    Raises:
        UnknownNameError: the model has no such frame.
    """
    links = [_Link(model.segment_names[0], "", -1, np.zeros(3), (), ())]
    for index, parent in enumerate(model.parents[1:], 1):
        dofs = model.joint_dofs(index - 1)
        links.append(
            _Link(
                model.segment_names[index],
                model.joint_names[index - 1],
                parent,
                model.offsets[index - 1],
                tuple(int(axis) for axis in model.dof_axes[dofs]),
                tuple(int(dof) for dof in dofs),
            )
        )
    return _grown(model, links, list(range(len(links))), frames)


def hinge_tree(model: HumanModel, frames: Sequence[str] = HAND_FRAMES) -> EstimationTree:
    """Makes the papers' tree: one axis a joint, massless links between the axes of one joint.

    For comparison only: a massless link is no thing that anything could push, and the noise the
    papers give it is absorbed from real loads.

    Args:
        model: the person.
        frames: as for `real_tree`.

    Source: Latella et al. 2019, section 2.3 (67 links, 66 joints).
    """
    links = [_Link(model.segment_names[0], "", -1, np.zeros(3), (), ())]
    place = [0]
    for index, parent in enumerate(model.parents[1:], 1):
        dofs = model.joint_dofs(index - 1)
        above, offset = place[parent], model.offsets[index - 1]
        for dof in dofs[:-1]:
            name = model.dof_names[dof]
            links.append(
                _Link(f"{name}_link", name, above, offset, (int(model.dof_axes[dof]),), (int(dof),))
            )
            above, offset = len(links) - 1, np.zeros(3)
        last = tuple(int(dof) for dof in dofs[-1:])
        joint = model.dof_names[last[0]] if last else model.joint_names[index - 1]
        axes = tuple(int(model.dof_axes[dof]) for dof in last)
        links.append(_Link(model.segment_names[index], joint, above, offset, axes, last))
        place.append(len(links) - 1)
    return _grown(model, links, place, frames)


@dataclass(frozen=True, slots=True)
class _Link:
    name: str
    joint: str
    parent: int
    offset: Array
    axes: tuple[int, ...]
    dofs: tuple[int, ...]


def _grown(
    model: HumanModel, links: list[_Link], place: list[int], frames: Sequence[str]
) -> EstimationTree:
    """Adds named frames and masses; ``place`` says which link each segment is."""
    for name in frames:
        segment, position = model.point(name)
        if name not in model.segment_names:
            links.append(_Link(name, f"{name}_fixed", place[segment], position, (), ()))
    inertias = np.zeros((len(links), 6, 6))
    for segment, link in enumerate(place):
        inertias[link] = spatial_inertia(
            float(model.masses[segment]), model.centers_of_mass[segment], model.inertias[segment]
        )
    return EstimationTree(
        link_names=tuple(link.name for link in links),
        joint_names=tuple(link.joint for link in links[1:]),
        parents=tuple(link.parent for link in links),
        offsets=np.array([link.offset for link in links]),
        axes=tuple(link.axes for link in links),
        dofs=tuple(np.array(link.dofs, dtype=np.intp) for link in links),
        inertias=inertias,
        dof_names=model.dof_names,
    )
