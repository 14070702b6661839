"""Where the kernel keeps what: its tables of inputs and outputs, and its working memory."""

from collections.abc import Iterable

#: Frames solved at once.
LANES = 8
#: The one function that is called from outside: the table of tables, and the number of frames.
NAME = "solve"


def _places(sizes: Iterable[tuple[str, int]]) -> tuple[dict[str, int], int]:
    """Puts things one after another; returns where each starts, and where all end."""
    out, end = {}, 0
    for name, size in sizes:
        out[name] = end
        end += size
    return out, end


#: What comes out, under the names of `Estimate`, and the state of the arithmetic.
MEANS = (
    "link_acceleration",
    "external_wrench",
    "joint_wrench",
    "joint_acceleration",
    "torque",
    "link_rotation",
    "residual",
    "residual_chi2",
    "status",
)
SPREADS = (
    "link_acceleration_sd",
    "external_wrench_sd",
    "joint_wrench_sd",
    "joint_acceleration_sd",
    "torque_sd",
    "joint_moment_covariance",
    "site_covariance",
    "site_prior",
)
#: Addresses that a call hands over.
TABLES = (
    "work",
    "rows",
    "frames",
    "constants",
    "links",
    "plates",
    "motion_sensors",
    "sites",
    "paths",
    "settings",
    *MEANS,
    *SPREADS,
)
TABLE = {name: place for place, name in enumerate(TABLES)}

#: Whole numbers of a run. References to numbers are explained at `REFERENCE`.
SETTINGS = (
    "n_links",
    "n_dof",
    "width",
    "spreads",
    "prior_on_joint_wrenches",
    "prior_on_wrenches",
    "n_sites",
    "n_pairs",
    "joint_variance",
    "joint_mean",
    # Where the working memory holds the inputs and the results of the eight frames at hand.
    "row_start",
    *(f"start of {name}" for name in (*MEANS, *SPREADS)),
    *(f"size of {name}" for name in (*MEANS, *SPREADS)),
)
SETTING = {name: place for place, name in enumerate(SETTINGS)}

#: A reference to numbers: ``k >= 0`` is where they start among the constants, ``-1 - k`` is their
#: column in the row of each frame. So anything may change from frame to frame.
REFERENCE = "see above"

#: Whole numbers of a link: its parent, its axes, which of its tables' rows are its own.
LINK_ROW, LINK_ROW_SIZE = _places(
    [
        ("parent", 1),
        ("axes", 1),
        ("axis", 3),
        ("dof", 3),
        ("information", 1),
        ("wrench_covariance", 1),
        ("wrench", 1),
        ("first_plate", 1),
        ("last_plate", 1),
        ("first_sensor", 1),
        ("last_sensor", 1),
    ]
)
#: References of a force plate, fixed to the world.
PLATE_ROW, PLATE_ROW_SIZE = _places(
    [("rotation", 1), ("position", 1), ("covariance", 1), ("wrench", 1)]
)
#: References of an accelerometer: what its reading and its centripetal part tell the link.
SENSOR_ROW, SENSOR_ROW_SIZE = _places(
    [("weight", 1), ("centripetal", 1), ("position", 1), ("value", 1)]
)
#: Two sites, where their paths to the base meet, and those paths.
PAIR_ROW, PAIR_ROW_SIZE = _places(
    [
        ("row", 1),
        ("column", 1),
        ("first", 1),
        ("second", 1),
        ("meeting", 1),
        ("first_path", 2),
        ("second_path", 2),
    ]
)

#: Constants of a run, then those of each link.
GLOBAL, GLOBAL_SIZE = _places(
    [
        ("information_mean", 1),
        ("wrench_information", 1),
        ("wrench_pull", 1),
        ("prior_mean", 1),
        ("joint_wrench_prior", 36),
        ("zeros", 6),
    ]
)
LINK_CONSTANTS, LINK_CONSTANTS_SIZE = _places(
    [("offset", 3), ("inertia", 36), ("dynamics", 36), ("kinematic_inverse", 36)]
)


def output_sizes(n_links: int, n_dof: int, n_sites: int) -> dict[str, int]:
    """Returns how many numbers of each result a frame has."""
    links, joints, square = 6 * n_links, 6 * (n_links - 1), 36 * n_sites**2
    sizes = {
        "link_acceleration": links,
        "external_wrench": links,
        "joint_wrench": joints,
        "joint_acceleration": n_dof,
        "torque": n_dof,
        "link_rotation": 9 * n_links,
        "residual": 6,
        "residual_chi2": 1,
        "status": 3,
        "joint_moment_covariance": 9 * (n_links - 1),
        "site_covariance": square,
        "site_prior": square,
    }
    return {
        name: sizes.get(name, sizes.get(name.removesuffix("_sd"), 0)) for name in (*MEANS, *SPREADS)
    }


def columns(n_dof: int) -> tuple[dict[str, int], int]:
    """Returns where the state stands in the row of a frame, and where sensors start."""
    return _places(
        [
            ("sine", n_dof),
            ("cosine", n_dof),
            ("rate", n_dof),
            ("quaternion", 4),
            ("position", 3),
            ("omega", 3),
        ]
    )


#: Working memory of a link, in slots of `LANES` numbers. The information and mass of
#: the way up lie where the covariances of the way down will.
SLOT, LINK_SLOTS = _places(
    [
        ("turn", 9),
        ("offset", 3),
        ("omega", 3),
        ("rotation", 9),
        ("position", 3),
        ("h", 9),
        ("b", 6),
        ("s_hat", 3),
        ("variance", 3),
        ("j", 6),
        ("k", 6),
        ("e", 6),
        ("fbar", 6),
        ("a", 6),
        ("z", 6),
        ("r", 18),
        ("r1", 18),
        ("r2", 18),
        ("left", 3),
        ("J", 36),
        ("M", 36),
        ("Px", 36),
        ("S0", 36),
        ("A", 36),
        ("P", 36),
        ("G", 36),
        ("MA", 36),
        ("B", 36),
        ("F", 36),
        # The rest is for a prior on joint wrenches alone.
        ("K", 36),
        ("Pf", 36),
        ("U", 36),
        ("through", 36),
        ("Lam_inv", 36),
        ("u0", 6),
    ]
)
SLOT["Ca"], SLOT["Caz"] = SLOT["J"], SLOT["M"]

#: Working memory for all, before that of the links.
COMMON, COMMON_SLOTS = _places(
    [(f"block{place}", 36) for place in range(10)]
    + [(f"vector{place}", 18) for place in range(6)]
    + [("least", 1)]
)
