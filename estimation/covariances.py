"""How far the model itself is believed: covariances of its equations and priors, and the presets.

The defaults are physical: the equations hold to a thousandth of a newton or metre per second
squared, nothing is known beforehand of accelerations and joint wrenches, and a link that nothing
touches bears at most some hundredths of a newton.
"""

from dataclasses import dataclass

from estimation.errors import CovarianceError

#: Beyond this, a force that is free beside a moment that is not costs its variance too many digits.
LARGEST_FREE_VARIANCE = 1e6
#: The same where force and moment are both free.
LARGEST_WHOLLY_FREE_VARIANCE = 1e8
INFINITE = float("inf")


@dataclass(frozen=True, slots=True)
class ModelCovariances:
    """Variances (SI units squared) of the model's equations and of what is known beforehand.

    Attributes:
        dynamics: of each row of Newton's and Euler's equations, N^2 and (N m)^2.
        kinematics: of each row of the acceleration's propagation, (m/s^2)^2 and (rad/s^2)^2.
        acceleration_prior: of link accelerations about zero.
        wrench_prior: of external wrenches about zero; infinite: none.
        joint_wrench_prior: of joint wrenches about zero; infinite: none. A finite one pulls loads
            towards zero and is there for comparison with the papers.
        joint_acceleration_prior: of joint accelerations about zero; infinite: none.
        prior_mean: what those priors are centred on, instead of zero.
        untouched_force_sd: N, of the external force on a link without sensor and load.
        untouched_moment_sd: N m, the same of its moment.
        derived_acceleration_sd: m/s^2, of a base acceleration that was derived from the motion.
        derived_angular_sd: rad/s^2, the same of its angular acceleration.
        derived_joint_sd: rad/s^2, the same of joint accelerations.
        carried_from_hinges: give each real link the noise that the papers' massless links would
            have put between it and its parent; for comparison with their tree.
    """

    dynamics: float = 1e-6
    kinematics: float = 1e-6
    acceleration_prior: float = 1e8
    wrench_prior: float = INFINITE
    joint_wrench_prior: float = INFINITE
    joint_acceleration_prior: float = INFINITE
    prior_mean: float = 0.0
    untouched_force_sd: float = 1e-2
    untouched_moment_sd: float = 1e-2
    derived_acceleration_sd: float = 0.1
    derived_angular_sd: float = 0.5
    derived_joint_sd: float = 0.5
    carried_from_hinges: bool = False

    def __post_init__(self) -> None:
        """Refuses variances that are not positive."""
        if not abs(self.prior_mean) < INFINITE:
            raise CovarianceError("prior_mean", "expected a finite number", self.prior_mean)
        for name in self.__dataclass_fields__:
            value = getattr(self, name)
            if name in ("carried_from_hinges", "prior_mean"):
                continue
            if not value > 0.0:
                raise CovarianceError(name, "expected more than zero", value)
            if value == INFINITE and name not in (
                "wrench_prior",
                "joint_wrench_prior",
                "joint_acceleration_prior",
            ):
                raise CovarianceError(name, "expected a finite number", value)


@dataclass(frozen=True, slots=True)
class TwoStepCovariances:
    """The covariances of Tirupachuri et al. 2021, Table 1: tuning, not uncertainty.

    Torque bands that follow from them cover a small part of the truth; they are there to compare
    with the paper. The accelerometers' and joint accelerations' are not in the paper; those here
    are what its published software shipped with.

    Attributes:
        name: the table's column.
        first_step: whether there is a first step at all.
        feet: first step, of the feet's wrenches.
        hand_force: first step, N^2, of the hands' forces about zero.
        hand_moment: first step, (N m)^2, of their moments.
        momentum: first step, of the rate of change of momentum (the paper's text).
        untouched: both steps, of the wrenches on all other links.
        second_feet: second step, of the feet.
        second_hands: second step, of the hands.
        prior: of every unknown, second step.
        model: of every model equation, second step.
        accelerometer: (m/s^2)^2.
        joint_acceleration: (rad/s^2)^2.

    Source: Tirupachuri et al. 2021, Table 1 and section IV-C. Its text gives 1e4 for the hand's
    moments where the table has 1e-4; the table's works.
    """

    name: str
    first_step: bool = True
    feet: float = 1e-6
    hand_force: float = 1.0
    hand_moment: float = 1e-4
    momentum: float = 1e-3
    untouched: float = 1e-6
    second_feet: float = 1e-6
    second_hands: float = 1e-6
    prior: float = 1e6
    model: float = 1e-6
    accelerometer: float = 1.1e-3
    joint_acceleration: float = 6.66e-6

    @property
    def covariances(self) -> ModelCovariances:
        """The same for the second step's model and priors."""
        return ModelCovariances(
            dynamics=self.model,
            kinematics=self.model,
            acceleration_prior=self.prior,
            wrench_prior=self.prior,
            joint_wrench_prior=self.prior,
            joint_acceleration_prior=self.prior,
            untouched_force_sd=self.untouched**0.5,
            untouched_moment_sd=self.untouched**0.5,
        )


#: The columns of Table 1; the first has no first step there, and hands that bear nothing.
TPOSE_NO_LOAD = TwoStepCovariances("T-pose without load", first_step=False)
TPOSE_LOAD = TwoStepCovariances("T-pose with load")
APPLICATION = TwoStepCovariances("application", hand_moment=1.0)
