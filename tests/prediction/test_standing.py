"""Who stands on both feet, and what is learned of somebody who also steps."""

from dataclasses import replace

import numpy as np
import pytest
from whole_body import RATE_HZ, led, motion_of, object_way

from human import Motion, Subject, generate_model
from prediction import (
    DemonstrationError,
    demonstrations_from_motion,
    find_reduction,
    led_chain,
    motion_findings,
    standing_frames,
)


@pytest.fixture(scope="module")
def chain():
    return led_chain(generate_model(Subject(1.75, 72.0)), "right", "feet")


@pytest.fixture(scope="module")
def postures(chain):
    rng = np.random.default_rng(0)
    return led(chain, *object_way(rng, 4), rng)


def stepping(chain, postures) -> tuple[Motion, np.ndarray]:
    """The same, but for the left foot, which is lifted from 2.5 to 3.5 s."""
    q, lifted = postures.copy(), np.zeros(len(postures), dtype=bool)
    lifted[round(2.5 * RATE_HZ) : round(3.5 * RATE_HZ)] = True
    bump = np.sin(np.linspace(0.0, np.pi, lifted.sum())) ** 2
    q[lifted, chain.dof_names.index("jLeftKnee_roty")] += 0.8 * bump
    return motion_of(chain, q), lifted


def test_feet_that_stand_are_told_from_a_foot_that_is_lifted(chain, postures):
    motion, lifted = stepping(chain, postures)
    still = standing_frames(chain, motion)
    assert not still[lifted][2:-2].any() or still[lifted][2:-2].mean() < 0.1
    beside = np.convolve(lifted, np.ones(21), "same") > 0
    assert still[~beside].all()
    assert standing_frames(chain, motion_of(chain, postures)).all()
    assert standing_frames(led_chain(chain.model, "right"), motion).all()


def test_feet_that_slide_together_do_not_stand(chain, postures):
    """Seen from one foot the other is still; in the world neither is."""
    motion = motion_of(chain, postures)
    v = motion.v.copy()
    v[:, :3] += np.array([0.0, 0.5, 0.0])
    with pytest.raises(DemonstrationError, match="never both stand"):
        demonstrations_from_motion(chain, replace(motion, v=v))


def test_steps_teach_nothing_and_pelves_without_a_place_are_refused(chain, postures):
    motion, lifted = stepping(chain, postures)
    seen = demonstrations_from_motion(chain, motion)
    assert not np.isin(seen.time_s, motion.time_s[lifted][2:-2]).any()
    assert np.abs(seen.xdot[:, :3]).max() < 0.1
    assert len(seen) > 0.6 * len(motion.time_s)
    (finding,) = motion_findings(chain, motion)
    assert f"stand in {len(seen) / len(motion.time_s):.0%}" in finding
    assert motion_findings(chain, motion_of(chain, postures)) == ()
    assert motion_findings(led_chain(chain.model, "both", "pelvis"), motion) == ()
    with pytest.raises(DemonstrationError, match="where the pelvis is"):
        demonstrations_from_motion(chain, replace(motion, base="fixed"))


def test_joints_that_the_feet_tie_together_are_learned_all_the_same(chain, postures):
    """What keeps the foot was never shown moving it; without it the foot could not be kept."""
    seen = demonstrations_from_motion(chain, motion_of(chain, postures))
    reduction = find_reduction(seen)
    jacobian = seen.jacobian[::20] @ reduction.expansion
    size = np.linalg.svd(jacobian, compute_uv=False)
    assert (size[:, -1] / size[:, 0]).min() > 1e-3
    locked = seen.qdot.copy()
    locked[:, ["Knee" in name for name in seen.joint_names]] = 0.0
    assert not any("Knee" in name for name in find_reduction(replace(seen, qdot=locked)).kept_names)
    legs = ["Hip" in n or "Knee" in n or "Ankle" in n for n in seen.joint_names]
    locked[:, legs] = 0.0
    with pytest.raises(DemonstrationError, match="cannot move the hand"):
        find_reduction(replace(seen, qdot=locked))
